"""Programs under test, as processes of their own."""

import contextlib
import os
import signal
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

EXIT_LIMIT_S = 15.0
_ABORT_LIMIT_S = 5.0


class Process:
    """A program; it and its children are ended at the latest when the `with` block ends.

    Args:
        command: Command to run.
        variables: Its environment.
        folder: Folder for its output, in which it runs.
        stdin: Its standard input: a file descriptor, or one of the constants of `subprocess`.
    """

    def __init__(
        self, command: Sequence[str], variables: Mapping[str, str], folder: Path, stdin: int = subprocess.DEVNULL
    ) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._error_file = folder / "stderr.txt"
        self._output_file = folder / "stdout.txt"
        with self._error_file.open("wb") as error, self._output_file.open("wb") as output:
            self.popen = subprocess.Popen(
                command,
                env={"PYTHONFAULTHANDLER": "1", **variables},
                stdin=stdin,
                stdout=output,
                stderr=error,
                cwd=folder,
                # No session of its own: the kernel shares out time among sessions, and a priority counts within one.
                process_group=0,
            )

    @property
    def stderr(self) -> str:
        """Text that it has written to standard error so far."""
        return self._error_file.read_text(errors="replace")

    @property
    def stdout(self) -> str:
        """Text that it has written to standard output so far."""
        return self._output_file.read_text(errors="replace")

    @property
    def is_running(self) -> bool:
        """True if it has not ended."""
        return self.popen.poll() is None

    def resident_kb(self) -> int:
        """Memory that it takes now."""
        status = Path(f"/proc/{self.popen.pid}/status").read_text()
        return int(next(line.split()[1] for line in status.splitlines() if line.startswith("VmRSS:")))

    def processor_s(self) -> float:
        """Time of a processor that it has taken."""
        fields = Path(f"/proc/{self.popen.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def signal(self, number: signal.Signals) -> None:
        """Send a signal."""
        self.popen.send_signal(number)

    def wait(self, limit_s: float = EXIT_LIMIT_S) -> int:
        """Its exit status, waiting for its end.

        Raises:
            AssertionError: It did not end; a Python's says where its threads are.
        """
        try:
            return self.popen.wait(limit_s)
        except subprocess.TimeoutExpired:
            self.signal(signal.SIGABRT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.popen.wait(_ABORT_LIMIT_S)
            raise AssertionError(f"the process did not end within {limit_s} s\n{self.stderr}") from None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        # It leads a group of its own.
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.popen.pid, signal.SIGKILL)
        self.popen.wait()
