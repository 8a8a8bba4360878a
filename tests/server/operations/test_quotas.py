"""Quotas against an obvious twin, and their messages."""

import asyncio
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_api.security import Quota, Scope, TokenFile, make_token
from robosc_server.jobs.scheduler import QueueLimits, Scheduler
from robosc_server.operations.quotas import Bucket, Quotas
from robosc_server.tasks.task import Reason, RefusedError, Report, TaskLimits
from support.job_workers import ScriptedWorkers, task_of


class Clock:
    now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


def quotas_for(folder: Path, clock: Clock, **quotas: Quota) -> Quotas:
    file = folder / "tokens"
    file.write_text("".join(f"{make_token(name, (Scope.SYNTHESIZE,), quota)[1]}\n" for name, quota in quotas.items()))
    file.chmod(0o600)
    return Quotas(TokenFile(file, clock), clock)


async def drop(report: Report) -> None:
    pass


def refused(quotas: Quotas, caller: str) -> RefusedError:
    with pytest.raises(RefusedError) as caught:
        quotas.admit(caller)
    assert caught.value.reason is Reason.QUOTA_EXCEEDED
    return caught.value


@given(
    st.integers(1, 20),
    st.lists(st.tuples(st.sampled_from(["take", "wait"]), st.integers(1, 30)), max_size=40),
)
def test_a_bucket_against_one_that_is_filled_drop_by_drop(size: int, steps: list[tuple[str, int]]) -> None:
    """The twin is filled each second with so many drops that a minute has as many as it holds whole ones."""
    bucket, now_s = Bucket(size, 60.0, 0.0), 0.0
    drops, full = size * 60, size * 60
    for what, amount in steps:
        if what == "take":
            bucket.take(amount, now_s)
            drops -= amount * 60
        else:
            for _ in range(amount):
                now_s += 1.0
                drops = min(full, drops + size)
        for wanted in (0, 1):
            seconds = max(0.0, (wanted * 60 - drops) / size)
            assert bucket.seconds_until(wanted, now_s) == pytest.approx(seconds, abs=1e-6)


def test_so_many_tasks_in_a_minute_and_then_at_their_pace(tmp_path: Path) -> None:
    clock = Clock()
    quotas = quotas_for(tmp_path, clock, a=Quota(per_minute=6), b=Quota())
    for _ in range(6):
        quotas.admit("a")
    error = refused(quotas, "a")
    assert error.message == "the token has used up its quota of 6 tasks per minute"
    assert error.retry_after_s == pytest.approx(10.0)
    for _ in range(100):
        quotas.admit("b")
        quotas.admit("somebody without a token")
    clock.now_s += 9.9
    refused(quotas, "a")
    clock.now_s += 0.2
    quotas.admit("a")
    refused(quotas, "a")


def test_who_comes_at_the_time_of_the_refusal_is_let_in(tmp_path: Path) -> None:
    clock = Clock()
    quotas = quotas_for(tmp_path, clock, a=Quota(per_minute=7))
    for _ in range(50):
        try:
            quotas.admit("a")
        except RefusedError as error:
            assert error.retry_after_s is not None
            clock.now_s += error.retry_after_s + 1e-6
            quotas.admit("a")


def test_time_of_a_processor_is_counted_afterwards(tmp_path: Path) -> None:
    clock = Clock()
    quotas = quotas_for(tmp_path, clock, a=Quota(cpu_seconds_per_hour=100))
    quotas.charge("a", 90.0)
    quotas.admit("a")
    quotas.charge("a", 40.0)
    error = refused(quotas, "a")
    assert error.message == "the token has used up its quota of 100 CPU seconds per hour"
    assert error.retry_after_s == pytest.approx(30 * 36)
    clock.now_s += 30 * 36 + 1
    quotas.admit("a")


def test_a_quota_that_is_changed_in_the_file_holds_from_then_on(tmp_path: Path) -> None:
    clock = Clock()
    quotas = quotas_for(tmp_path, clock, a=Quota(per_minute=1, waiting=3))
    quotas.admit("a")
    refused(quotas, "a")
    assert quotas.waiting("a") == 3
    quotas_for(tmp_path, clock, a=Quota(per_minute=2))
    clock.now_s += 2.0
    quotas.admit("a")
    quotas.admit("a")
    refused(quotas, "a")
    assert quotas.waiting("a") is None
    quotas_for(tmp_path, clock, other=Quota())
    clock.now_s += 2.0
    quotas.admit("a")


def test_without_tokens_there_are_no_quotas() -> None:
    quotas = Quotas(None)
    quotas.admit("127.0.0.1")
    quotas.charge("127.0.0.1", 1e9)
    assert quotas.waiting("127.0.0.1") is None


async def test_the_line_before_the_workers_keeps_to_a_tokens_own_bound_and_notes_what_it_takes(tmp_path: Path) -> None:
    clock = Clock()
    quotas = quotas_for(tmp_path, clock, little=Quota(waiting=1), timed=Quota(cpu_seconds_per_hour=60))
    workers = ScriptedWorkers(1)
    scheduler = Scheduler(workers, QueueLimits(waiting_per_caller=3), clock, quotas)
    at_work = scheduler.enter("timed")
    overtaken = asyncio.create_task(scheduler.run(task_of("a"), "timed", TaskLimits(), drop))
    little = scheduler.enter("little")
    with pytest.raises(RefusedError, match="too many tasks of this caller"):
        scheduler.enter("little")
    for _ in range(3):
        scheduler.leave(scheduler.enter("anybody"))
    quotas.admit("timed")
    # By the clock, nothing passes.
    await scheduler.work(at_work, task_of("spend 90"), TaskLimits(), drop)
    assert refused(quotas, "timed").retry_after_s == pytest.approx(30 * 60)
    for place in (little, at_work):
        scheduler.leave(place)
    # A call that was admitted before, and has its turn now, comes too late.
    with pytest.raises(RefusedError) as caught:
        await overtaken
    assert caught.value.reason is Reason.QUOTA_EXCEEDED
    assert caught.value.retry_after_s == pytest.approx(30 * 60)
    assert (scheduler.running, scheduler.waiting, workers.begun) == (0, 0, ["spend 90"])
    clock.now_s += 30 * 60
    await scheduler.run(task_of("fail CPU_LIMIT\nspend 3"), "timed", TaskLimits(), drop)
    assert refused(quotas, "timed").retry_after_s == pytest.approx(3 * 60)
