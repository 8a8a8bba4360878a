"""Kernel-enforced limits of a worker process, which does not outlive its parent."""

import math
import os
import resource
import signal
from contextlib import suppress
from pathlib import Path

from robosc_server.tasks.task import TaskLimits
from robosc_server.workers import kernel

_FILES_LIMIT = 64
_MINIMUM_FREE_BYTES = 64 * 2**20
_FAILURE_REPORT_BYTES = 64 * 2**20
_FAILURE_REPORT_S = 2


def exit_with_parent(parent: int) -> None:
    """Have the kernel kill this process when its parent dies; exit at once if it is dead already."""
    with suppress(OSError):
        kernel.prctl(kernel.SET_PARENT_DEATH_SIGNAL, int(signal.SIGKILL))
    if os.getppid() != parent:
        os._exit(1)


def prefer_oom_kill() -> None:
    """Make this process the first one that the kernel kills when memory runs out."""
    with suppress(OSError):
        # The file belongs to the superuser while the process is not dumpable.
        kernel.prctl(kernel.SET_DUMPABLE, 1)
        try:
            score = os.open("/proc/self/oom_score_adj", os.O_WRONLY | os.O_CLOEXEC)
            try:
                os.write(score, b"900")
            finally:
                os.close(score)
        finally:
            kernel.prctl(kernel.SET_DUMPABLE, 0)


def confine(limits: TaskLimits, used_bytes: int) -> None:
    """Set the limits of the task that this process is about to do.

    Args:
        limits: Limits of the task.
        used_bytes: Bytes of address space that the process has already.

    The limit of the address space includes what the process has already, plus at least 64 MiB, the minimum for any
    task. CPU time counts from here on, in whole seconds. Writing to files is impossible.
    """
    memory_bytes = max(limits.memory_bytes, used_bytes + _MINIMUM_FREE_BYTES)
    _set(resource.RLIMIT_AS, memory_bytes, memory_bytes + _FAILURE_REPORT_BYTES)
    used = resource.getrusage(resource.RUSAGE_SELF)
    cpu_s = max(1, math.ceil(limits.cpu_seconds)) + round(used.ru_utime + used.ru_stime)
    _set(resource.RLIMIT_CPU, cpu_s, cpu_s + _FAILURE_REPORT_S)
    _set(resource.RLIMIT_FSIZE, 0, 0)
    _set(resource.RLIMIT_NOFILE, _FILES_LIMIT, _FILES_LIMIT)


def raise_memory_limit() -> None:
    """Raise the memory limit, so that there is enough memory to report a failure."""
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    with suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_AS, (hard, hard))


def disable_core_dumps() -> None:
    """Disable core dumps, which would contain models."""
    _set(resource.RLIMIT_CORE, 0, 0)


def _set(kind: int, soft: int, hard: int) -> None:
    """Set a limit, within the existing hard limit."""
    _, allowed = resource.getrlimit(kind)
    if allowed != resource.RLIM_INFINITY:
        soft, hard = min(soft, allowed), min(hard, allowed)
    resource.setrlimit(kind, (soft, hard))


def address_space_bytes() -> int:
    """Return the size of this process's address space, in bytes."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    return pages * resource.getpagesize()
