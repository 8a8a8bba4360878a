"""Limits of steps, one within another."""

import pytest

from robosc.synthesis.monitor import BoundedMonitor, EffortSpentError, ProgressMonitor


@pytest.fixture
def waiting() -> ProgressMonitor:
    return ProgressMonitor(lambda: False, lambda progress: None)


def steps_of(monitor: BoundedMonitor) -> int:
    def work() -> int:
        for _ in range(100):
            monitor.check_stop()
        return 100

    found = monitor.result_of(work)
    assert found == (100 if monitor.limit is None else None)
    return monitor.steps


def test_a_limit_ends_the_work_quietly(waiting: ProgressMonitor) -> None:
    assert steps_of(BoundedMonitor(waiting, 7)) == 8
    assert steps_of(BoundedMonitor(waiting)) == 100


def test_the_limit_around_it_is_no_limit_of_its_own(waiting: ProgressMonitor) -> None:
    outer = BoundedMonitor(waiting, 5)
    with pytest.raises(EffortSpentError, match="more than 5 steps"):
        steps_of(BoundedMonitor(outer, 7))
