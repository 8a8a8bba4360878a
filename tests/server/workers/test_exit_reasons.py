"""Tests of the report on a worker that ended without an answer."""

import signal

import pytest

from robosc_server.tasks.task import Reason, TaskLimits
from robosc_server.workers.exit_reasons import ProcessExit, RecentOomKills, failure_of, oom_kills

MIB = 2**20
LIMITS = TaskLimits(cpu_seconds=10, memory_bytes=1000 * MIB)
OUT_OF_MEMORY = (
    f"the task needs more memory than the server allows, {1000 * MIB} bytes; make the model smaller, or have the "
    "operator of the server raise task_memory_bytes"
)
OUT_OF_PROCESSOR = (
    "the task needs more CPU time than the server allows, 10 s; make the model smaller, or have the operator of the "
    "server raise task_cpu_seconds"
)
MACHINE = (
    "the machine ran out of memory and killed the task; make the model smaller, try again when the machine has less to "
    "do, or have the operator of the server lower worker_processes"
)


@pytest.mark.parametrize(
    ("exit_code", "cpu_s", "peak_mib", "was_memory_short", "reason", "message"),
    [
        (0, 1, 10, False, Reason.WORKER_DIED, "the worker process ended with status 0 and no answer"),
        (3, 11, 700, True, Reason.WORKER_DIED, "the worker process ended with status 3 and no answer"),
        (1, 1, 803, False, Reason.WORKER_DIED, "the worker process ended with status 1 and no answer"),
        (1, 1, 804, False, Reason.MEMORY_LIMIT, OUT_OF_MEMORY),
        (0, 1, 950, False, Reason.WORKER_DIED, "the worker process ended with status 0 and no answer"),
        (-signal.SIGSEGV, 1, 803, False, Reason.WORKER_DIED, "the worker process was ended by SIGSEGV"),
        (-signal.SIGSEGV, 1, 804, False, Reason.MEMORY_LIMIT, OUT_OF_MEMORY),
        (-signal.SIGABRT, 1, 900, False, Reason.MEMORY_LIMIT, OUT_OF_MEMORY),
        (-signal.SIGKILL, 9.9, 10, False, Reason.WORKER_DIED, "the worker process was ended by SIGKILL"),
        (-signal.SIGKILL, 9.9, 10, True, Reason.MEMORY_LIMIT, MACHINE),
        (
            -signal.SIGKILL,
            10,
            10,
            False,
            Reason.CPU_LIMIT,
            OUT_OF_PROCESSOR,
        ),
        (
            -signal.SIGXCPU,
            9,
            10,
            True,
            Reason.CPU_LIMIT,
            OUT_OF_PROCESSOR,
        ),
        (-63, 1, 10, False, Reason.WORKER_DIED, "the worker process was ended by signal 63"),
    ],
)
def test_each_ending_is_reported_by_its_cause(
    exit_code: int, cpu_s: float, peak_mib: int, was_memory_short: bool, reason: Reason, message: str
) -> None:
    failure = failure_of(ProcessExit(exit_code, cpu_s, peak_mib * MIB), LIMITS, "Fatal error\n", was_memory_short)
    assert (failure.reason, failure.message) == (reason, message)
    assert failure.details.endswith(f"at most {peak_mib * MIB} bytes resident\nFatal error")


@pytest.mark.parametrize(
    ("status", "crash_output", "reason"),
    [
        (1, "", Reason.MEMORY_LIMIT),
        (1, 'Traceback (most recent call last):\n  File "x.py", line 1, in f\nMemoryError\n', Reason.MEMORY_LIMIT),
        (1, "Traceback (most recent call last):\nMemoryError: no room\n", Reason.MEMORY_LIMIT),
        (1, "Traceback (most recent call last):\nKeyError: 'MemoryError'\n", Reason.WORKER_DIED),
        (2, "", Reason.WORKER_DIED),
    ],
)
def test_a_library_that_exits_for_want_of_memory_need_not_have_touched_it(
    status: int, crash_output: str, reason: Reason
) -> None:
    """The decision diagrams' library ends the process when a large table is refused, however little is resident."""
    failure = failure_of(ProcessExit(status, 1, 10 * MIB), LIMITS, crash_output, was_memory_short=False)
    assert failure.reason is reason


def test_kills_for_want_of_memory_are_counted_by_the_kernel() -> None:
    assert oom_kills() >= 0


def test_kills_before_now_are_asked_for_once_a_second() -> None:
    now_s = [100.0]
    counts = iter([3, 5])
    before = RecentOomKills(lambda: next(counts), lambda: now_s[0])
    results = []
    for at_s in (100.0, 100.5, 100.999, 101.0, 101.5):
        now_s[0] = at_s
        results.append(before())
    assert results == [3, 3, 3, 5, 5]
