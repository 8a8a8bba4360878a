"""Sandbox of workers, in case a model exploits a vulnerability to run its own program.

`confinement` limits the resources of a task; the sandbox limits what its process can access. The kernel enforces each
part permanently, for any user. A kernel may lack a part, or a container may forbid it: the other parts still apply, and
the missing ones are reported.
"""

import contextlib
import json
import os
import sys
from collections.abc import Callable, Set

from robosc_server.workers import kernel
from robosc_server.workers.file_access import FileRules, program_places
from robosc_server.workers.system_calls import prepare_filter, restrict_system_calls

_STANDARD_ERROR = 2
_HIGHEST_DESCRIPTOR = 2**31 - 1
_ANSWER_BYTES = 1000
_KILLED = "the attempt was killed"


class SandboxError(Exception):
    """A part of the sandbox that worked in the test cannot be entered; one sentence."""


class Sandbox:
    """Sandbox, which a process with one thread prepares and its forks enter."""

    def __init__(self) -> None:
        self._rules: FileRules | None = None
        self._fault = ""
        try:
            self._rules = FileRules(program_places())
        except OSError as error:
            self._fault = error.strerror or str(error)
        # Prepared here once for all forks.
        with contextlib.suppress(OSError):
            kernel.capabilities()
        prepare_filter()
        # The last part forbids the calls that enter the others.
        self._parts: dict[str, Callable[[], None]] = {
            "capabilities cannot be dropped": kernel.drop_capabilities,
            "file access is not restricted (no Landlock)": self._restrict_files,
            "system calls are not filtered (no seccomp)": restrict_system_calls,
        }
        self._faults = {words: fault for words, restrict in self._parts.items() if (fault := _failure_of(restrict))}

    @property
    def missing(self) -> tuple[str, ...]:
        """Parts of the sandbox that this machine lacks, one sentence with the reason for each."""
        return tuple(f"{words}: {fault}" for words, fault in self._faults.items())

    @property
    def descriptors(self) -> frozenset[int]:
        """Descriptors that a fork has to have open to enter; closed by that."""
        return frozenset() if self._rules is None else frozenset({self._rules.descriptor})

    def enter(self) -> None:
        """Confine this process permanently by all parts that are not missing.

        Raises:
            SandboxError: A further part is missing.
        """
        for words, restrict in self._parts.items():
            if words not in self._faults:
                try:
                    restrict()
                except OSError as error:
                    raise SandboxError(f"{words}: {error.strerror or error}") from error

    def _restrict_files(self) -> None:
        if self._rules is None:
            raise OSError(0, self._fault)
        self._rules.restrict()


def _failure_of(restrict: Callable[[], None]) -> str:
    """Return the reason why a process cannot be confined by something; empty if it can.

    It is found out by a fork that ends at once.
    """
    read_end, write_end = os.pipe2(os.O_CLOEXEC)
    pid = os.fork()
    if pid == 0:
        try:
            restrict()
            answer = "done"
        except BaseException as error:  # The fork must never continue with the code of its parent.
            answer = getattr(error, "strerror", None) or str(error)
        with contextlib.suppress(BaseException):
            os.write(write_end, answer.encode()[:_ANSWER_BYTES])
        os._exit(0)
    os.close(write_end)
    os.waitpid(pid, 0)
    answer = os.read(read_end, _ANSWER_BYTES).decode("utf-8", "replace")
    os.close(read_end)
    return "" if answer == "done" else answer or _KILLED


def close_other_descriptors(kept: Set[int]) -> None:
    """Close every descriptor except the given ones and standard input, output and error."""
    first = _STANDARD_ERROR + 1
    for number in sorted(number for number in kept if number >= first):
        os.closerange(first, number)
        first = number + 1
    os.closerange(first, _HIGHEST_DESCRIPTOR)


def main() -> None:
    """Print the missing parts of the sandbox of this machine as a JSON list."""
    sys.stdout.write(json.dumps(Sandbox().missing))


if __name__ == "__main__":
    main()
