"""Failure reasons of worker processes that ended without an answer, from what the kernel reports."""

import math
import re
import signal
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from robosc_server.clock import monotonic
from robosc_server.tasks.exceeded import MACHINE_OUT_OF_MEMORY, cpu_time_exceeded, memory_exceeded
from robosc_server.tasks.task import Failure, Reason, TaskLimits

_REMEMBERED_S = 1.0
_NEAR_THE_LIMIT = 0.9
_OUT_OF_MEMORY = re.compile(r"^MemoryError\b", re.MULTILINE)
_NEVER_RESIDENT_BYTES = 96 * 2**20  # Part of the address space: mostly unused parts of libraries.


@dataclass(frozen=True, slots=True)
class ProcessExit:
    """End of a worker's process.

    Attributes:
        exit_code: Status of the process; negative: the signal that ended it.
        cpu_s: CPU time of the process, in seconds.
        peak_bytes: Peak of its resident memory.
    """

    exit_code: int
    cpu_s: float
    peak_bytes: int


EXIT_DESCRIPTION = re.compile(
    r"(ended with status \d{1,3} and no answer|was ended by (SIG[A-Z0-9]{2,8}|signal \d{1,3})) "
    r"after \d{1,9}\.\d\d s of CPU time, with at most \d{1,15} bytes resident"
)
"""Pattern of the text that `exit_description` returns: it cannot contain parts of a model."""


def exit_description(end: ProcessExit) -> str:
    """Return a description of a process's end, in one line."""
    return (
        f"{_status_text(end.exit_code)} after {end.cpu_s:.2f} s of CPU time, "
        f"with at most {end.peak_bytes} bytes resident"
    )


def failure_of(end: ProcessExit, limits: TaskLimits, crash_output: str, was_memory_short: bool) -> Failure:
    """Return the failure of a task whose worker ended without an answer, and was not killed by the server.

    Args:
        end: End of the worker's process.
        limits: Limits of the task.
        crash_output: Text that the interpreter wrote when it crashed.
        was_memory_short: True if the kernel killed some process for want of memory meanwhile.
    """
    details = f"{exit_description(end)}\n{crash_output}".rstrip()
    out_of_processor = end.cpu_s >= limits.cpu_seconds
    if end.exit_code == -signal.SIGXCPU or (end.exit_code == -signal.SIGKILL and out_of_processor):
        return cpu_time_exceeded(limits, details)
    if end.exit_code == -signal.SIGKILL and was_memory_short:
        return Failure(Reason.MEMORY_LIMIT, MACHINE_OUT_OF_MEMORY, details)
    # C libraries end the process if an allocation fails: CUDD by exit(1), others by abort(). A worker that exits by
    # itself without an answer has a fault, and writes that down, unless memory is lacking for that as well.
    has_exited = end.exit_code == 1 and (not crash_output or _OUT_OF_MEMORY.search(crash_output) is not None)
    is_near = end.peak_bytes + _NEVER_RESIDENT_BYTES >= _NEAR_THE_LIMIT * limits.memory_bytes
    if has_exited or (end.exit_code and is_near):
        return memory_exceeded(limits, details)
    return Failure(Reason.WORKER_DIED, f"the worker process {_status_text(end.exit_code)}", details)


def oom_kills() -> int:
    """Return the number of processes that this machine's kernel has killed for want of memory; 0 if unknown."""
    with suppress(OSError, ValueError):
        for line in Path("/proc/vmstat").read_text().splitlines():
            if line.startswith("oom_kill "):
                return int(line.split()[1])
    return 0


class RecentOomKills:
    """Number of processes killed for lack of memory so far, read from the kernel at most once a second.

    Reading takes a tenth of a millisecond, and is useful only if a worker is killed. A worker that is killed within a
    second after another process ran out of memory is assumed to have run out of memory as well.

    Args:
        count: Function that reads the number from the kernel.
        clock: Seconds that never go back.
    """

    def __init__(self, count: Callable[[], int] = oom_kills, clock: Callable[[], float] = monotonic) -> None:
        self._count, self._clock = count, clock
        self._known = 0
        self._until_s = -math.inf

    def __call__(self) -> int:
        """Return the number."""
        if self._clock() >= self._until_s:
            self._known, self._until_s = self._count(), self._clock() + _REMEMBERED_S
        return self._known


def _status_text(exit_code: int) -> str:
    if exit_code >= 0:
        return f"ended with status {exit_code} and no answer"
    with suppress(ValueError):
        return f"was ended by {signal.Signals(-exit_code).name}"
    return f"was ended by signal {-exit_code}"
