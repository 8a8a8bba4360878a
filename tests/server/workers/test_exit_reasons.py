"""Tests of the report on a worker that ended without an answer."""

import signal

import pytest

from robosc_server.tasks.task import Reason, TaskLimits
from robosc_server.workers.exit_reasons import ProcessExit, RecentOomKills, failure_of, oom_kills

MIB = 2**20
LIMITS = TaskLimits(cpu_seconds=10, memory_bytes=1000 * MIB)


@pytest.mark.parametrize(
    ("exit_code", "cpu_s", "peak_mib", "was_memory_short", "reason", "message"),
    [
        (0, 1, 10, False, Reason.WORKER_DIED, "the worker process ended with status 0 and no answer"),
        (3, 11, 700, True, Reason.WORKER_DIED, "the worker process ended with status 3 and no answer"),
        (1, 1, 803, False, Reason.WORKER_DIED, "the worker process ended with status 1 and no answer"),
        (1, 1, 804, False, Reason.MEMORY_LIMIT, "the task exceeded its memory limit"),
        (0, 1, 950, False, Reason.WORKER_DIED, "the worker process ended with status 0 and no answer"),
        (-signal.SIGSEGV, 1, 803, False, Reason.WORKER_DIED, "the worker process was ended by SIGSEGV"),
        (-signal.SIGSEGV, 1, 804, False, Reason.MEMORY_LIMIT, "the task exceeded its memory limit"),
        (-signal.SIGABRT, 1, 900, False, Reason.MEMORY_LIMIT, "the task exceeded its memory limit"),
        (-signal.SIGKILL, 9.9, 10, False, Reason.WORKER_DIED, "the worker process was ended by SIGKILL"),
        (-signal.SIGKILL, 9.9, 10, True, Reason.MEMORY_LIMIT, "the machine ran out of memory and killed the task"),
        (
            -signal.SIGKILL,
            10,
            10,
            False,
            Reason.CPU_LIMIT,
            "the task exceeded its CPU time limit",
        ),
        (
            -signal.SIGXCPU,
            9,
            10,
            True,
            Reason.CPU_LIMIT,
            "the task exceeded its CPU time limit",
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
