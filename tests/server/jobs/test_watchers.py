"""Watchers of jobs receive each state at once, and progress no more often than all of them together can read it."""

from contextlib import ExitStack
from dataclasses import replace
from typing import Any

from robosc_server.jobs.watchers import PROGRESS_PER_SECOND, JobWatch, Watchers
from robosc_server.store import JobRecord, JobState
from robosc_server.tasks.task import TaskKind
from support.held_time import HeldLoop

JOB = "a" * 32
MANY = 1000
QUEUED = JobRecord(JOB, "me", TaskKind.CHECK, JobState.QUEUED, 1, "key", "file", "", None, 0, 0)


def state(revision: int, state: JobState = JobState.RUNNING) -> JobRecord:
    return replace(QUEUED, state=state, revision=revision)


async def received(watch: JobWatch) -> int:
    record = await watch.next_record()
    assert record is not None
    return record.revision


def timers(loop: Any) -> list[Any]:
    return [timer for timer in loop._scheduled if not timer.cancelled()]


def has_news(watch: JobWatch) -> bool:
    return watch._has_news.is_set()


async def test_many_get_a_new_state_at_once_and_the_newest_progress_later(loop: HeldLoop) -> None:
    watchers = Watchers()
    with ExitStack() as stack:
        watches = [stack.enter_context(watchers.watch(JOB)) for _ in range(MANY)]
        watchers.notify(state(2))
        assert {await received(watch) for watch in watches} == {2}
        for revision in range(3, 20):
            watchers.notify(state(revision))
            await loop.passed(0.1)
        assert not any(map(has_news, watches))
        await loop.passed(MANY / PROGRESS_PER_SECOND - 1.7)
        assert {await received(watch) for watch in watches} == {19}
        # The end replaces progress that is held.
        watchers.notify(state(20))
        watchers.notify(state(21, JobState.SUCCEEDED))
        assert {await received(watch) for watch in watches} == {21}
        await loop.passed(60.0)
        assert not any(map(has_news, watches))


async def test_a_record_that_is_late_replaces_none_that_is_newer(loop: HeldLoop) -> None:
    watchers = Watchers()
    with ExitStack() as stack:
        watches = [stack.enter_context(watchers.watch(JOB)) for _ in range(MANY)]
        watchers.notify(state(2))
        assert {await received(watch) for watch in watches} == {2}
        watchers.notify(state(9))
        watchers.notify(state(8))
        await loop.passed(60.0)
        assert {await received(watch) for watch in watches} == {9}


async def test_few_get_all_progress(loop: HeldLoop) -> None:
    watchers = Watchers()
    with watchers.watch(JOB) as one, watchers.watch(JOB) as other:
        for revision in range(2, 50):
            watchers.notify(state(revision))
            assert (await received(one), await received(other)) == (revision, revision)


async def test_no_timer_outlives_the_last_watcher(loop: HeldLoop) -> None:
    watchers = Watchers()
    with ExitStack() as stack:
        for _ in range(MANY):
            stack.enter_context(watchers.watch(JOB))
        watchers.notify(state(2))
        watchers.notify(state(3))
        assert len(timers(loop)) == 1
    assert not timers(loop)
    assert watchers.revisions() == {}


def test_jobs_of_this_server_are_asked_for_no_revisions() -> None:
    watchers = Watchers()
    with watchers.watch(JOB) as one, watchers.watch(JOB), watchers.watch("b" * 32) as other:
        one.revision, other.revision = 5, 7
        assert watchers.revisions() == {JOB: 0, "b" * 32: 7}
        assert watchers.revisions({JOB}) == {"b" * 32: 7}
