"""Several servers on one PostgreSQL: who carries which job, and what others see of it."""

import asyncio
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any

import pytest

from robosc_server.jobs import Caller, JobLimits
from robosc_server.store import JobFilter, JobState, job_rows, store
from robosc_server.store.job_rows import take_orphans
from robosc_server.tasks.task import Reason, RefusedError, TaskKind
from support.job_parts import ME, Choices, Parts, Times, ended, has_begun, is_in, messages_of_job, parts
from support.job_workers import messages_for, task_of
from support.postgresql import Postgresql
from support.waiting import until

pytestmark = pytest.mark.smoke

_NEVER = "until /nowhere/never"
_LIMITS = JobLimits(poll_s=0.02, lease_s=15.0, sweep_s=3600.0)


async def replicas(stack: AsyncExitStack, url: str, times: Times, number: int = 2) -> list[Parts]:
    choices = Choices(url=url, limits=_LIMITS, capacity=1, times=times)
    return [await stack.enter_async_context(parts(Path("/nowhere"), choices)) for _ in range(number)]


def fall_silent(made: Parts) -> None:
    """Have a server do nothing any more, as if it had been stopped."""
    for task in (*made.manager._background, *made.manager._runner._tasks):
        task.cancel()
    made.manager._background = []
    made.manager._has_left = True


async def test_a_job_is_seen_watched_and_read_at_each_server(database_url: str, tmp_path: Path) -> None:
    async with AsyncExitStack() as stack:
        ours, theirs = await replicas(stack, database_url, Times())
        gates = [tmp_path / str(number) for number in range(2)]
        text = f"until {gates[0]}\nreport 3\nuntil {gates[1]}\nbig 3000000"
        job, _ = await ours.manager.submit(task_of(text, TaskKind.GENERATE), ME, idempotency_key="k")
        again, existed = await theirs.manager.submit(task_of(text, TaskKind.GENERATE), ME, idempotency_key="k")
        assert existed and again.id == job.id
        watch = theirs.manager.watch(job.id, ME, 0)
        seen = []
        async for record in watch:
            seen.append(record)
            if record.state is JobState.RUNNING:
                gates[0].touch()
            if record.progress is not None:
                gates[1].touch()
        assert seen[-1].state is JobState.SUCCEEDED
        assert any(record.progress is not None for record in seen)
        revisions = [record.revision for record in seen]
        assert revisions == sorted(set(revisions))
        expected = messages_for(TaskKind.GENERATE, text, 3_000_000)
        assert await messages_of_job(theirs.manager, job.id) == expected
        from_store, _ = await theirs.manager.submit(task_of(text, TaskKind.GENERATE), ME)
        assert from_store.is_from_store
        listed = await theirs.manager.list_jobs(JobFilter("me", frozenset(), None), None, 10)
        assert {record.id for record in listed} == {job.id, from_store.id}


async def test_a_job_is_cancelled_at_another_server_and_its_worker_stopped(database_url: str) -> None:
    async with AsyncExitStack() as stack:
        ours, theirs = await replicas(stack, database_url, Times())
        running, _ = await ours.manager.submit(task_of(_NEVER), ME)
        waiting, _ = await ours.manager.submit(task_of(f"{_NEVER}\n2"), ME)
        await until(lambda: has_begun(ours, running.id))
        watching = asyncio.create_task(ended(ours.manager, waiting.id))
        for job in (waiting, running):
            assert (await theirs.manager.cancel(job.id, ME)).state is JobState.CANCELLED

        async def is_free() -> bool:
            return ours.workers.killed == 1 and ours.scheduler.running == ours.scheduler.waiting == 0

        await until(is_free)
        assert (await watching).state is JobState.CANCELLED
        assert (await ended(ours.manager, running.id)).state is JobState.CANCELLED
        assert ours.workers.begun == [_NEVER]


async def test_who_watches_a_job_that_is_forgotten_elsewhere_learns_it(database_url: str) -> None:
    times = Times()
    by_hand = JobLimits(poll_s=3600.0, sweep_s=3600.0)
    async with (
        parts(Path("unused"), Choices(database_url, by_hand, times=times)) as ours,
        parts(Path("unused"), Choices(database_url, by_hand, times=times)) as theirs,
    ):
        job, _ = await ours.manager.submit(task_of(_NEVER), ME, retention_s=0.0)
        watch = theirs.manager.watch(job.id, ME, 0)
        await anext(watch)

        async def follow() -> None:
            async for _ in watch:
                pass

        following = asyncio.create_task(follow())
        await asyncio.sleep(0)
        await ours.manager.cancel(job.id, ME)
        times.wall_s += 1.0
        await ours.manager.sweep()
        await theirs.manager.poll()
        with pytest.raises(RefusedError, match="no job with this id"):
            await following


async def test_jobs_of_a_server_that_falls_silent_are_adopted_after_its_lease_and_run_once_more(
    database_url: str, tmp_path: Path
) -> None:
    async with AsyncExitStack() as stack:
        times = Times()
        dying, living = await replicas(stack, database_url, times)
        gate = tmp_path / "gate"
        jobs = [(await dying.manager.submit(task_of(f"until {gate}\n{n}"), ME))[0] for n in range(4)]
        await until(lambda: is_in(living.manager, jobs[0].id, JobState.RUNNING))
        watching = asyncio.create_task(ended(living.manager, jobs[0].id))
        seen = await living.manager.get(jobs[0].id, ME)
        fall_silent(dying)
        gate.touch()

        async def has_looked() -> bool:
            return bool(living.manager._lease_monitor.seen)

        await until(has_looked)
        # Not before its lease has passed.
        times.monotonic_s += 14.0
        for _ in range(3):
            await living.manager.poll()
        assert (await living.manager.get(jobs[1].id, ME)).replica == seen.replica
        times.monotonic_s += 2.0
        done = [await ended(living.manager, job.id) for job in jobs]
        assert [record.state for record in done] == [JobState.SUCCEEDED] * 4
        assert [record.attempts for record in done] == [2, 1, 1, 1]
        assert (await watching).revision > seen.revision


async def test_servers_that_go_on_are_not_taken_for_dead_however_long_it_takes(database_url: str) -> None:
    times = Times()
    by_hand = JobLimits(poll_s=3600.0, lease_s=15.0, sweep_s=3600.0)
    choices = Choices(database_url, by_hand, times=times)
    async with parts(Path("unused"), choices) as ours, parts(Path("unused"), choices) as theirs:
        jobs = [(await made.manager.submit(task_of(f"{_NEVER}\n{made}"), ME))[0] for made in (ours, theirs)]
        await until(lambda: has_begun(ours, jobs[0].id))
        await until(lambda: has_begun(theirs, jobs[1].id))
        for _ in range(10):
            for made in (ours, theirs):
                await made.manager.poll()
            times.monotonic_s += 7.0
        for job, made in zip(jobs, (ours, theirs), strict=True):
            record = await made.manager.get(job.id, ME)
            assert (record.state, record.attempts, record.replica) == (JobState.RUNNING, 1, job.replica)
            assert (len(made.workers.begun), made.workers.killed) == (1, 0)


async def test_a_job_that_servers_die_on_fails_at_last(database_url: str) -> None:
    async with AsyncExitStack() as stack:
        times = Times()
        *dying, living = await replicas(stack, database_url, times, 3)
        living.workers.capacity = 0
        job, _ = await dying[0].manager.submit(task_of(_NEVER), ME)
        await until(lambda: is_in(living.manager, job.id, JobState.RUNNING))
        dying[1].workers.capacity = 1
        fall_silent(dying[0])
        for keeper in living.manager._background:
            keeper.cancel()  # The other one adopts it.
        await dying[1].manager.poll()
        times.monotonic_s += 16.0
        await until(lambda: _is_second_attempt(dying[1], job.id))
        fall_silent(dying[1])
        # The first look finds that it was taken for dead itself, the second one sees who is there.
        for _ in range(2):
            await living.manager.poll()
        times.monotonic_s += 16.0
        await living.manager.poll()
        done = await living.manager.get(job.id, ME)
        assert done.failure is not None
        assert (done.state, done.failure.reason, done.attempts) == (JobState.FAILED, Reason.SERVER_DIED, 2)


async def _is_second_attempt(made: Parts, job_id: str) -> bool:
    record = await made.manager.get(job_id, ME)
    return record.attempts == 2 and record.state is JobState.RUNNING


async def test_a_server_that_was_taken_for_dead_stops_its_work_and_takes_part_again(
    database_url: str, tmp_path: Path
) -> None:
    async with AsyncExitStack() as stack:
        times = Times()
        stalled, living = await replicas(stack, database_url, times)
        gate = tmp_path / "gate"
        job, _ = await stalled.manager.submit(task_of(f"until {gate}"), ME)
        await until(lambda: has_begun(stalled, job.id))
        (looking, sweeping) = stalled.manager._background
        looking.cancel()
        await living.manager.poll()
        times.monotonic_s += 16.0
        await until(lambda: _is_second_attempt(living, job.id))
        # It wakes up, with a worker at a job that is another's now.
        stalled.manager._background = [asyncio.create_task(stalled.manager._lease_monitor.poll_forever()), sweeping]

        async def has_stopped() -> bool:
            return stalled.workers.killed == 1 and stalled.manager.active_jobs == 0

        await until(has_stopped)
        gate.touch()
        done = await ended(stalled.manager, job.id)
        assert (done.state, done.attempts) == (JobState.SUCCEEDED, 2)
        after, _ = await stalled.manager.submit(task_of("after"), ME)
        assert (await ended(stalled.manager, after.id)).state is JobState.SUCCEEDED
        assert stalled.workers.begun[-1] == "after"


async def test_jobs_that_a_server_leaves_at_its_end_are_taken_at_once(database_url: str) -> None:
    async with AsyncExitStack() as stack:
        ending, living = await replicas(stack, database_url, Times())
        # All jobs are equally old: the one that never ends may be the first there, and keeps its worker.
        living.workers.capacity = 2
        jobs = [(await ending.manager.submit(task_of(f"report {n}"), ME))[0] for n in range(3)]
        running, _ = await ending.manager.submit(task_of(_NEVER), ME)
        await ending.manager.drain(0.0)
        done = [await ended(living.manager, job.id) for job in jobs]
        assert {record.state for record in done} == {JobState.SUCCEEDED}
        # One that had begun there runs again.
        assert {record.attempts for record in done} <= {1, 2}
        await until(lambda: is_in(living.manager, running.id, JobState.RUNNING))


async def test_what_waits_at_a_server_that_ends_is_done_by_others_while_its_own_work_goes_on(
    database_url: str, tmp_path: Path
) -> None:
    async with AsyncExitStack() as stack:
        ending, living = await replicas(stack, database_url, Times())
        gate = tmp_path / "gate"
        running, _ = await ending.manager.submit(task_of(f"until {gate}"), ME)
        await until(lambda: is_in(ending.manager, running.id, JobState.RUNNING))
        waiting = [(await ending.manager.submit(task_of(f"report {n}"), ME))[0] for n in range(3)]
        watching = asyncio.create_task(ended(ending.manager, waiting[0].id))
        draining = asyncio.create_task(ending.manager.drain(60.0))
        for job in waiting:
            assert (await ended(living.manager, job.id)).state is JobState.SUCCEEDED
        assert (await watching).state is JobState.SUCCEEDED
        assert not draining.done()
        assert ending.manager.active_jobs == 1
        gate.touch()
        await draining
        done = await ended(living.manager, running.id)
        assert (done.state, done.attempts) == (JobState.SUCCEEDED, 1)
        assert (len(ending.workers.begun), ending.workers.killed) == (1, 0)


async def test_many_jobs_are_adopted_a_few_at_a_time(database_url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "_TAKEN_AT_ONCE", 2)
    taken: list[int] = []

    def counted(*args: Any, **kwargs: Any) -> Any:
        found = take_orphans(*args, **kwargs)
        taken.append(len(found))
        return found

    monkeypatch.setattr(job_rows, "take_orphans", counted)
    async with AsyncExitStack() as stack:
        dying, living = await replicas(stack, database_url, Times())
        living.workers.capacity = 0
        jobs = [(await dying.manager.submit(task_of(f"{_NEVER}\n{n}"), ME))[0] for n in range(5)]
        await dying.manager.drain(0.0)

        async def has_all() -> bool:
            return living.manager.active_jobs == len(jobs)

        await until(has_all)
        living.workers.capacity = 1
        for job in jobs:
            await living.manager.cancel(job.id, ME)
    assert max(taken) == 2 and sum(taken) == 5


async def test_the_same_key_at_two_servers_at_once_is_one_job(database_url: str) -> None:
    async with AsyncExitStack() as stack:
        both = await replicas(stack, database_url, Times())
        for number in range(10):
            calls = [
                made.manager.submit(task_of(f"report {number}"), ME, idempotency_key=str(number)) for made in both * 3
            ]
            answers = await asyncio.gather(*calls)
            assert len({record.id for record, _ in answers}) == 1
            assert [existed for _, existed in answers].count(False) == 1
        assert sum(len(made.workers.begun) for made in both) <= 10


@pytest.mark.parametrize("way", ["stop", "freeze"])
async def test_a_database_that_goes_and_comes_back(database_server: Postgresql, tmp_path: Path, way: str) -> None:
    url = database_server.new_database()
    choices = Choices(url=url, limits=_LIMITS, capacity=2, times=Times())
    async with parts(Path("/nowhere"), choices) as made:
        made.store._database._answer_s = 2.0
        gate = tmp_path / "gate"
        running, _ = await made.manager.submit(task_of(f"until {gate}"), ME)
        waiting = [(await made.manager.submit(task_of(f"until {gate}\n{n}"), ME))[0] for n in range(5)]
        await until(lambda: is_in(made.manager, running.id, JobState.RUNNING))
        watching = asyncio.create_task(ended(made.manager, running.id))
        loop = asyncio.get_running_loop()
        await asyncio.to_thread(database_server.stop if way == "stop" else database_server.freeze)
        try:
            for call in (
                made.manager.submit(task_of("a"), ME),
                made.manager.get(running.id, ME),
                made.manager.cancel(running.id, ME),
                made.manager.list_jobs(JobFilter("me", frozenset(), None), None, 10),
                made.manager.submit(task_of("a"), Caller("you"), idempotency_key="k"),
            ):
                begun_s = loop.time()
                with pytest.raises(RefusedError) as refused:
                    await call
                assert refused.value.reason is Reason.STORE_UNAVAILABLE
                assert loop.time() - begun_s < 4.0
            assert not made.store.is_available
            # A running job goes on, and ends.
            gate.touch()

            async def is_through() -> bool:
                return made.workers.running == 0

            await until(is_through)
            assert not watching.done()
        finally:
            await asyncio.to_thread(database_server.start if way == "stop" else database_server.thaw)
        done = await watching
        assert (done.state, done.attempts) == (JobState.SUCCEEDED, 1)
        for job in waiting:
            done = await ended(made.manager, job.id)
            assert (done.state, done.attempts) == (JobState.SUCCEEDED, 1)

        async def is_available() -> bool:
            return made.store.is_available

        await until(is_available)
        after, _ = await made.manager.submit(task_of("after"), ME)
        assert (await ended(made.manager, after.id)).state is JobState.SUCCEEDED
        assert (made.scheduler.running, made.scheduler.waiting) == (0, 0)


async def test_servers_that_start_at_the_same_time_make_the_tables_once(database_url: str) -> None:
    async with AsyncExitStack() as stack:
        choices = Choices(url=database_url)
        several = [stack.enter_async_context(parts(Path("/nowhere"), choices)) for _ in range(4)]
        assert len(await asyncio.gather(*several)) == 4
