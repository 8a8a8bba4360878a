"""Jobs from their acceptance to their end, on SQLite."""

import asyncio
import math
from dataclasses import replace
from pathlib import Path

import pytest

from robosc_server.jobs import Caller, JobLimits, QueueLimits, runner
from robosc_server.store import JobFilter, JobRecord, JobState, StoreUnavailableError
from robosc_server.store.records import STEP
from robosc_server.tasks.task import Failure, Reason, RefusedError, Report, Result, TaskKind
from support.held_time import HeldLoop
from support.job_parts import ME, Choices, Parts, ended, has_begun, is_in, messages_of_job, parts, sweep_by_hand
from support.job_workers import messages_for, task_of
from support.waiting import until

_NEVER = "until /nowhere/never"


async def refusal_of(call: object) -> Reason:
    with pytest.raises(RefusedError) as refused:
        await call  # type: ignore[misc]
    return refused.value.reason


async def test_a_job_is_done_and_its_result_is_kept(tmp_path: Path) -> None:
    async with parts(tmp_path) as made:
        record, existed = await made.manager.submit(task_of("hello"), ME, label="mine")
        assert not existed
        assert record.state in {JobState.QUEUED, JobState.RUNNING}
        done = await ended(made.manager, record.id)
        assert (done.state, done.attempts, done.label, done.owner) == (JobState.SUCCEEDED, 1, "mine", "me")
        assert done.expires_us == done.ended_us + done.retention_us  # type: ignore[operator]
        assert await messages_of_job(made.manager, record.id) == messages_for(TaskKind.CHECK, "hello", 0)


async def test_what_was_worked_out_before_is_answered_from_the_store(tmp_path: Path) -> None:
    async with parts(tmp_path) as made:
        first, _ = await made.manager.submit(task_of("hello"), ME)
        await ended(made.manager, first.id)
        second, existed = await made.manager.submit(task_of("hello"), ME)
        assert not existed and second.id != first.id
        assert (second.state, second.is_from_store, second.attempts) == (JobState.SUCCEEDED, True, 0)
        assert await messages_of_job(made.manager, second.id) == messages_for(TaskKind.CHECK, "hello", 0)
        assert made.workers.begun == ["hello"]
        assert (made.scheduler.running, made.scheduler.waiting, made.manager.active_jobs) == (0, 0, 0)
    # And by a server that has nothing in memory.
    async with parts(tmp_path) as made:
        third, _ = await made.manager.submit(task_of("hello"), ME)
        assert third.is_from_store
        assert made.workers.begun == []


async def test_of_many_jobs_with_one_task_the_later_ones_find_the_result_when_their_turn_comes(tmp_path: Path) -> None:
    async with parts(tmp_path, Choices(capacity=1)) as made:
        gate = tmp_path / "gate"
        jobs = [(await made.manager.submit(task_of(f"until {gate}"), ME))[0] for _ in range(5)]
        gate.touch()
        done = [await ended(made.manager, job.id) for job in jobs]
        assert [record.is_from_store for record in done] == [False, True, True, True, True]
        assert len(made.workers.begun) == 1


async def test_an_idempotency_key_answers_with_the_same_job_and_not_for_another_task(tmp_path: Path) -> None:
    async with parts(tmp_path, Choices(capacity=1, queue=QueueLimits(2, 1))) as made:
        asked = [made.manager.submit(task_of(_NEVER), ME, idempotency_key="k") for _ in range(2)]
        (first, existed), (second, existed_too) = await asyncio.gather(*asked)
        assert first.id == second.id
        assert sorted((existed, existed_too)) == [False, True]
        # Also where there is no place any more.
        await made.manager.submit(task_of("other"), ME)
        assert await refusal_of(made.manager.submit(task_of("third"), ME)) is Reason.SERVER_BUSY
        again, existed = await made.manager.submit(task_of(_NEVER), ME, idempotency_key="k")
        assert existed and again.id == first.id
        another = made.manager.submit(task_of("another"), ME, idempotency_key="k")
        assert await refusal_of(another) is Reason.IDEMPOTENCY_KEY_REUSED
        # Another caller's keys are others.
        theirs, existed = await made.manager.submit(task_of(_NEVER), Caller("you"), idempotency_key="k")
        assert not existed and theirs.id != first.id


async def test_a_key_is_free_again_when_its_job_has_expired(tmp_path: Path) -> None:
    choices = Choices()
    async with parts(tmp_path, choices) as made:
        first, _ = await made.manager.submit(task_of("a"), ME, idempotency_key="k", retention_s=10.0)
        await ended(made.manager, first.id)
        choices.times.wall_s += 10.0
        assert await refusal_of(made.manager.get(first.id, ME)) is Reason.NO_SUCH_JOB
        second, existed = await made.manager.submit(task_of("b"), ME, idempotency_key="k")
        assert not existed and second.id != first.id


async def test_others_do_not_see_a_job_and_admins_do(tmp_path: Path) -> None:
    async with parts(tmp_path) as made:
        job, _ = await made.manager.submit(task_of(_NEVER), ME)
        other, admin = Caller("you"), Caller("boss", is_admin=True)
        assert await refusal_of(made.manager.get(job.id, other)) is Reason.NO_SUCH_JOB
        assert await refusal_of(made.manager.cancel(job.id, other)) is Reason.NO_SUCH_JOB
        assert await refusal_of(made.manager.result(job.id, other)) is Reason.NO_SUCH_JOB
        assert await refusal_of(anext(made.manager.watch(job.id, other, 0))) is Reason.NO_SUCH_JOB
        assert (await made.manager.get(job.id, admin)).owner == "me"
        assert (await made.manager.cancel(job.id, admin)).state is JobState.CANCELLED


async def test_cancelling_ends_what_waits_and_what_runs(tmp_path: Path) -> None:
    async with parts(tmp_path, Choices(capacity=1)) as made:
        jobs = [(await made.manager.submit(task_of(f"{_NEVER}\n{number}"), ME))[0] for number in range(3)]
        await until(lambda: has_begun(made, jobs[0].id))
        for job in (jobs[1], jobs[0]):
            record = await made.manager.cancel(job.id, ME)
            assert record.state is JobState.CANCELLED
            assert await refusal_of(made.manager.result(job.id, ME)) is Reason.JOB_CANCELLED
        await until(lambda: has_begun(made, jobs[2].id, tasks=2))
        assert made.workers.killed == 1
        assert [text[-1] for text in made.workers.begun] == ["0", "2"]
        # An ended job stays as it is.
        again = await made.manager.cancel(jobs[0].id, ME)
        assert again == await made.manager.get(jobs[0].id, ME)
        assert await refusal_of(made.manager.cancel("no such", ME)) is Reason.NO_SUCH_JOB


async def test_failures_are_reported_and_nothing_of_them_is_kept_as_a_result(tmp_path: Path) -> None:
    async with parts(tmp_path) as made:
        job, _ = await made.manager.submit(task_of("fail CPU_LIMIT"), ME)
        done = await ended(made.manager, job.id)
        assert done.failure is not None
        assert (done.state, done.failure.reason) == (JobState.FAILED, Reason.CPU_LIMIT)
        assert await refusal_of(made.manager.result(job.id, ME)) is Reason.JOB_HAS_FAILED
        again, _ = await made.manager.submit(task_of("fail CPU_LIMIT"), ME)
        assert not (await ended(made.manager, again.id)).is_from_store
        assert len(made.workers.begun) == 2
        # A fault of ours ends one job, and no other.
        fault, _ = await made.manager.submit(task_of("fault"), ME)
        done = await ended(made.manager, fault.id)
        assert done.failure is not None and done.failure.reason is Reason.INTERNAL_FAULT
        assert made.scheduler.running == 0


async def test_watchers_see_each_state_and_what_workers_report(tmp_path: Path) -> None:
    async with parts(tmp_path, Choices(capacity=1)) as made:
        gates = [tmp_path / str(number) for number in range(3)]
        text = f"until {gates[0]}\nreport 2\nuntil {gates[1]}\nreport 3\nuntil {gates[2]}"
        blocker, _ = await made.manager.submit(task_of(_NEVER), ME)
        job, _ = await made.manager.submit(task_of(text), ME)
        watch = made.manager.watch(job.id, ME, 0)
        first = await anext(watch)
        assert (first.state, made.manager.waiting_before(first)) == (JobState.QUEUED, 0)
        await made.manager.cancel(blocker.id, ME)
        running = await anext(watch)
        assert (running.state, running.attempts) == (JobState.RUNNING, 1)
        assert await refusal_of(made.manager.result(job.id, ME)) is Reason.JOB_NOT_ENDED
        revisions = [first.revision, running.revision]
        for gate, last in ((gates[0], "round 1"), (gates[1], "round 2")):
            gate.touch()
            record = running
            while record.progress is None or record.progress.message != last:
                record = await anext(watch)
                revisions.append(record.revision)
        assert (await made.manager.get(job.id, ME)).revision == revisions[-1]
        gates[2].touch()
        rest = [record async for record in watch]
        assert [record.state for record in rest] == [JobState.SUCCEEDED]
        revisions.append(rest[0].revision)
        assert revisions == sorted(set(revisions))
        # A watcher that comes back with what it has seen receives what is new, or the end.
        assert [r.state async for r in made.manager.watch(job.id, ME, revisions[0])] == [JobState.SUCCEEDED]
        assert [r.state async for r in made.manager.watch(job.id, ME, 2**64 - 1)] == [JobState.SUCCEEDED]


async def test_after_a_revision_nothing_is_sent_before_there_is_a_greater_one(tmp_path: Path) -> None:
    async with parts(tmp_path) as made:
        gate = tmp_path / "gate"
        job, _ = await made.manager.submit(task_of(f"until {gate}\nreport 1\n{_NEVER}"), ME)
        await until(lambda: is_in(made.manager, job.id, JobState.RUNNING))
        now = await made.manager.get(job.id, ME)
        watching = asyncio.ensure_future(anext(made.manager.watch(job.id, ME, now.revision)))
        await made.manager.get(job.id, ME)
        assert not watching.done()
        gate.touch()
        assert (await watching).revision > now.revision


async def test_lists_come_in_pages_the_youngest_first(tmp_path: Path) -> None:
    choices = Choices()
    async with parts(tmp_path, choices) as made:
        ids = []
        for number in range(7):
            choices.times.wall_s += number % 2  # Some at the same time.
            kind = TaskKind.CHECK if number < 5 else TaskKind.GENERATE
            ids.append((await made.manager.submit(task_of(str(number), kind), ME))[0].id)
            await ended(made.manager, ids[-1])
        await made.manager.submit(task_of("theirs"), Caller("you"))
        mine = JobFilter("me", frozenset(), None)
        found: list[JobRecord] = []
        after = None
        while page := await made.manager.list_jobs(mine, after, 3):
            found += page
            after = page[-1].created_us, page[-1].id
        assert sorted(record.id for record in found) == sorted(ids)
        order = [(record.created_us, record.id) for record in found]
        assert order == sorted(order, reverse=True)
        generated = await made.manager.list_jobs(replace(mine, kind=TaskKind.GENERATE), None, 10)
        assert {record.id for record in generated} == set(ids[5:])
        assert len(await made.manager.list_jobs(replace(mine, owner=None), None, 10)) == 8
        assert await made.manager.list_jobs(replace(mine, states=frozenset({JobState.FAILED})), None, 10) == []


async def test_jobs_are_forgotten_when_their_time_has_passed_and_no_sooner(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep_by_hand(monkeypatch)
    choices = Choices(limits=JobLimits(retention_s=100.0, sweep_s=3600.0))
    async with parts(tmp_path, choices) as made:
        short, _ = await made.manager.submit(task_of("a"), ME, retention_s=10.0)
        long, _ = await made.manager.submit(task_of("b"), ME, retention_s=1e12)
        running, _ = await made.manager.submit(task_of(_NEVER), ME, retention_s=0.0)
        for job in (short, long):
            await ended(made.manager, job.id)
        choices.times.wall_s += 9.9
        await made.manager.sweep()
        assert await made.manager.get(short.id, ME)
        choices.times.wall_s += 0.2
        assert await refusal_of(made.manager.get(short.id, ME)) is Reason.NO_SUCH_JOB
        await made.manager.sweep()
        assert made.manager.counts[JobState.SUCCEEDED] == 1
        choices.times.wall_s += 100.0
        await made.manager.sweep()
        assert made.manager.counts[JobState.SUCCEEDED] == 0
        # One that has not ended is never forgotten.
        assert await made.manager.get(running.id, ME)


async def test_results_that_no_job_needs_go_first_those_that_were_not_asked_for_longest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep_by_hand(monkeypatch)
    choices = Choices(limits=JobLimits(results_bytes=250_000, sweep_s=3600.0), memory_bytes=0)
    async with parts(tmp_path, choices) as made:
        tasks = [task_of(f"big 100000\n{number}", TaskKind.SYNTHESIZE) for number in range(4)]
        job, _ = await made.manager.submit(tasks[0], ME)
        await ended(made.manager, job.id)
        for task in tasks[1:]:
            choices.times.wall_s += 1.0
            outcome = await made.workers.run(task, None, None)  # type: ignore[arg-type]
            await made.store.keep_results([(task.key, task.kind, outcome, "me")])  # type: ignore[list-item]
        choices.times.wall_s += 1.0
        await made.store.touch([tasks[1].key])
        await made.manager.sweep()
        kept = [await made.store.find_result(task.key) is not None for task in tasks]
        assert kept == [True, True, False, False]


async def test_a_large_result_comes_in_pieces_as_it_was_made(tmp_path: Path, loop: HeldLoop) -> None:
    # A slow disk may take longer for it than a transaction may take.
    async with parts(tmp_path) as made:
        size = 64 * 2**20
        job, _ = await made.manager.submit(task_of(f"big {size}", TaskKind.GENERATE), ME)
        await ended(made.manager, job.id)
        assert await messages_of_job(made.manager, job.id) == messages_for(TaskKind.GENERATE, f"big {size}", size)


async def test_after_a_clean_end_jobs_go_on_without_a_lost_attempt(tmp_path: Path) -> None:
    gate = tmp_path / "gate"
    async with parts(tmp_path, Choices(capacity=1)) as made:
        jobs = [(await made.manager.submit(task_of(f"until {gate}\n{number}"), ME))[0] for number in range(3)]
        await until(lambda: is_in(made.manager, jobs[0].id, JobState.RUNNING))
        watching = asyncio.ensure_future(_all(made, jobs[1].id))
        await asyncio.sleep(0)
        await made.manager.drain(0.0)
        assert await refusal_of(made.manager.submit(task_of("late"), ME)) is Reason.SHUTTING_DOWN
        assert await refusal_of(watching) is Reason.SHUTTING_DOWN
    gate.touch()
    async with parts(tmp_path, Choices(capacity=1)) as made:
        for job in jobs:
            done = await ended(made.manager, job.id)
            assert (done.state, done.attempts) == (JobState.SUCCEEDED, 1)


async def _all(made: Parts, job_id: str) -> list[JobRecord]:
    return [record async for record in made.manager.watch(job_id, ME, 0)]


async def test_draining_lets_jobs_end_that_run(tmp_path: Path) -> None:
    gate = tmp_path / "gate"
    async with parts(tmp_path, Choices(capacity=1)) as made:
        jobs = [(await made.manager.submit(task_of(f"until {gate}\n{number}"), ME))[0] for number in range(2)]
        await until(lambda: has_begun(made, jobs[0].id))
        draining = asyncio.create_task(made.manager.drain(60.0))
        watching = asyncio.create_task(ended(made.manager, jobs[0].id))
        await asyncio.sleep(0)
        gate.touch()
        assert (await watching).state is JobState.SUCCEEDED
        await draining
        assert len(made.workers.begun) == 1
        assert await is_in(made.manager, jobs[1].id, JobState.QUEUED)


async def test_workers_that_are_away_cost_a_job_no_attempt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robosc_server.jobs.runner._RETRY_S", 0.01)
    gate = tmp_path / "gate"
    async with parts(tmp_path) as made:
        job, _ = await made.manager.submit(task_of(f"until {gate}"), ME)
        await until(lambda: is_in(made.manager, job.id, JobState.RUNNING))
        made.workers.is_away = True
        await until(lambda: is_in(made.manager, job.id, JobState.QUEUED))
        gate.touch()
        made.workers.is_away = False
        done = await ended(made.manager, job.id)
        assert (done.state, done.attempts) == (JobState.SUCCEEDED, 1)
        assert done.revision > 3 * STEP
        assert made.scheduler.running == 0


class Allowance:
    """Lets callers begin who have not spent more than they may."""

    def __init__(self) -> None:
        self.may_spend_s: dict[str, float] = {}
        self.spent_s: dict[str, float] = {}

    def waiting(self, caller: str) -> int | None:
        return None

    def check(self, caller: str) -> None:
        if self.spent_s.get(caller, 0.0) > self.may_spend_s.get(caller, math.inf):
            raise RefusedError(Reason.QUOTA_EXCEEDED, "nothing is left", retry_after_s=3600.0)

    def charge(self, caller: str, cpu_s: float) -> None:
        self.spent_s[caller] = self.spent_s.get(caller, 0.0) + cpu_s


async def test_jobs_wait_beside_the_line_while_their_owner_has_spent_too_much(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("robosc_server.jobs.runner._QUOTA_S", 0.01)
    accounts = Allowance()
    accounts.may_spend_s["me"] = 5.0
    choices = Choices(capacity=1, queue=QueueLimits(2, 2), accounts=accounts)
    async with parts(tmp_path, choices) as made:
        gate = tmp_path / "gate"
        texts = [f"until {gate}\nspend 3\nfail CPU_LIMIT", "spend 3\nfault", "spend 3"]
        jobs = [(await made.manager.submit(task_of(text), ME))[0] for text in texts]
        gate.touch()
        ends = [(await ended(made.manager, job.id)).state for job in jobs[:2]]
        assert ends == [JobState.FAILED] * 2
        # Failed or not, they have taken six seconds.
        watch = made.manager.watch(jobs[2].id, ME, 0)
        record = await anext(watch)
        while record.progress is None:
            record = await anext(watch)
        assert record.state is JobState.QUEUED
        assert record.progress == Report("waiting", "nothing is left")
        assert record.attempts == 0
        # Another caller finds the line empty.
        you = Caller("you")
        others = [(await made.manager.submit(task_of(f"{gate}\n{n}"), you))[0] for n in range(3)]
        for job in others:
            assert (await ended(made.manager, job.id, you)).state is JobState.SUCCEEDED
        assert await is_in(made.manager, jobs[2].id, JobState.QUEUED)
        accounts.may_spend_s["me"] = 6.0
        done = await ended(made.manager, jobs[2].id)
        assert (done.state, done.attempts) == (JobState.SUCCEEDED, 1)
        assert accounts.spent_s == {"me": 9.0, "you": 0.0}

        # One that waits so can be cancelled, and is left to others at the end.
        waiting = [(await made.manager.submit(task_of(f"late {n}"), ME))[0] for n in range(2)]
        assert (await made.manager.cancel(waiting[0].id, ME)).state is JobState.CANCELLED
        await made.manager.drain(60.0)
        assert await is_in(made.manager, waiting[1].id, JobState.QUEUED)


async def test_cancelled_work_counts_for_its_owner(tmp_path: Path) -> None:
    accounts = Allowance()
    async with parts(tmp_path, Choices(accounts=accounts)) as made:
        job, _ = await made.manager.submit(task_of(f"spend 3\n{_NEVER}"), ME)
        await until(lambda: has_begun(made, job.id))
        await made.manager.cancel(job.id, ME)

        async def is_counted() -> bool:
            return accounts.spent_s == {"me": 3.0}

        await until(is_counted)


async def test_a_job_that_loses_its_worker_again_and_again_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("robosc_server.jobs.runner._RETRY_S", 0.01)
    async with parts(tmp_path, Choices(capacity=1)) as made:
        gate = tmp_path / "gate"
        job, _ = await made.manager.submit(task_of(f"log {tmp_path / 'begun'}\nuntil {gate}\nlose"), ME)
        await until(lambda: has_begun(made, job.id))
        # That the workers are away, or the server ends, is no loss.
        made.workers.is_away = True
        await until(lambda: is_in(made.manager, job.id, JobState.QUEUED))
        made.workers.is_away = False
        await until(lambda: has_begun(made, job.id, tasks=2))
    async with parts(tmp_path, Choices(capacity=1)) as made:
        gate.touch()
        begun = len((tmp_path / "begun").read_text().splitlines())
        done = await ended(made.manager, job.id)
        assert done.failure is not None
        assert (done.state, done.failure.reason) == (JobState.FAILED, Reason.WORKER_DIED)
        assert done.failure.message == "the worker process was lost 3 times during this job"
        assert 2 <= len((tmp_path / "begun").read_text().splitlines()) - begun <= 3
        assert (made.scheduler.running, made.scheduler.waiting) == (0, 0)


async def test_losses_count_also_when_servers_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robosc_server.jobs.runner._RETRY_S", 0.01)

    async def has_lost_once(made: Parts, job_id: str) -> bool:
        return (await made.manager.get(job_id, ME)).losses == 1

    gate = tmp_path / "gate"
    text = f"until {gate}\nlose"
    async with parts(tmp_path) as made:
        job, _ = await made.manager.submit(task_of(text), ME)
        await until(lambda: has_begun(made, job.id))
        made.workers.capacity = 0
        gate.touch()
        await until(lambda: has_lost_once(made, job.id))
    async with parts(tmp_path) as made:
        assert (await ended(made.manager, job.id)).state is JobState.FAILED
        assert made.workers.begun == [text] * 2


async def test_who_asks_and_goes_away_has_submitted_or_not_but_not_halfway(tmp_path: Path) -> None:
    async with parts(tmp_path) as made:
        asking = asyncio.create_task(made.manager.submit(task_of("hello"), ME, idempotency_key="k"))
        await asyncio.sleep(0)
        asking.cancel()
        await asyncio.gather(asking, return_exceptions=True)
        job, existed = await made.manager.submit(task_of("hello"), ME, idempotency_key="k")
        assert existed
        assert (await ended(made.manager, job.id)).state is JobState.SUCCEEDED
        assert (made.scheduler.running, made.scheduler.waiting) == (0, 0)


async def test_an_acceptance_whose_answer_was_lost_is_found_and_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with parts(tmp_path) as made:
        keep = made.store.accept

        async def accept_and_lose(*arguments: object) -> None:
            await keep(*arguments)  # type: ignore[arg-type]
            raise StoreUnavailableError

        monkeypatch.setattr(made.store, "accept", accept_and_lose)
        lost = made.manager.submit(task_of("hello"), ME, idempotency_key="k")
        assert await refusal_of(lost) is Reason.STORE_UNAVAILABLE
        monkeypatch.undo()
        job, existed = await made.manager.submit(task_of("hello"), ME, idempotency_key="k")
        assert existed
        assert (await ended(made.manager, job.id)).state is JobState.SUCCEEDED


@pytest.mark.parametrize("has_happened", [False, True])
async def test_a_beginning_that_may_have_been_kept_is_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, has_happened: bool
) -> None:
    monkeypatch.setattr("robosc_server.jobs.runner._RETRY_S", 0.01)
    async with parts(tmp_path) as made:
        begin, lost = made.store.begin, list[str]()

        async def begin_and_lose(job_id: str, replica: str) -> object:
            if not lost:
                lost.append(job_id)
                if has_happened:
                    await begin(job_id, replica)
                raise StoreUnavailableError
            return await begin(job_id, replica)

        monkeypatch.setattr(made.store, "begin", begin_and_lose)
        job, _ = await made.manager.submit(task_of("hello"), ME)
        done = await ended(made.manager, job.id)
        assert (done.state, done.attempts) == (JobState.SUCCEEDED, 1)


async def test_a_thousand_watchers_wait_without_a_question_to_the_database(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep_by_hand(monkeypatch)
    async with parts(tmp_path, Choices(limits=JobLimits(poll_s=0.005, sweep_s=3600.0))) as made:
        gate = tmp_path / "gate"
        job, _ = await made.manager.submit(task_of(f"until {gate}"), ME)
        await until(lambda: has_begun(made, job.id))
        watching = [asyncio.create_task(ended(made.manager, job.id)) for _ in range(1000)]
        database = made.store._database
        await until(lambda: _idle(made, 1000))
        asked: list[object] = []
        original = database._run

        async def counted(*arguments: object, **named: object) -> object:
            asked.append(arguments)
            return await original(*arguments, **named)  # type: ignore[arg-type]

        database._run = counted  # type: ignore[assignment, method-assign]
        for _ in range(20):
            await made.manager.poll()
        assert asked == []
        gate.touch()
        assert {record.state for record in await asyncio.gather(*watching)} == {JobState.SUCCEEDED}


async def _idle(made: Parts, number: int) -> bool:
    watches = [watch for some in made.manager._watchers._by_job.values() for watch in some.watches]
    return len(watches) == number and all(watch.revision for watch in watches)


async def test_a_job_whose_result_cannot_be_kept_ends_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with parts(tmp_path) as made:
        end = made.store.end

        async def without_results(job_id: str, replica: str, outcome: Result | Failure) -> JobRecord | None:
            if isinstance(outcome, Result):
                raise ValueError("no such result")
            return await end(job_id, replica, outcome)

        monkeypatch.setattr(made.store, "end", without_results)
        job, _ = await made.manager.submit(task_of("a"), ME)
        record = await ended(made.manager, job.id)
        assert record.state is JobState.FAILED
        assert record.failure is not None
        assert record.failure.reason is Reason.INTERNAL_FAULT
        assert record.failure.message.startswith("the result cannot be stored; internal error ")
        assert (made.scheduler.running, made.scheduler.waiting) == (0, 0)


async def test_a_job_whose_outcome_cannot_be_stored_yet_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with parts(tmp_path) as made:
        end, is_full = made.store.end, [True]

        async def end_if_there_is_room(job_id: str, replica: str, outcome: Result | Failure) -> JobRecord | None:
            if is_full[0]:
                error = StoreUnavailableError()
                error.retry_after_s = 0.001
                raise error
            return await end(job_id, replica, outcome)

        monkeypatch.setattr(made.store, "end", end_if_there_is_room)
        job, _ = await made.manager.submit(task_of("a"), ME)

        async def is_waiting() -> bool:
            record = await made.manager.get(job.id, ME)
            return record.progress is not None and record.progress.stage == "waiting"

        await until(is_waiting)
        waiting = await made.manager.get(job.id, ME)
        assert waiting.state is JobState.RUNNING
        assert waiting.progress is not None
        assert "stored once the database is available and has room" in waiting.progress.message
        is_full[0] = False
        assert (await ended(made.manager, job.id)).state is JobState.SUCCEEDED


async def test_jobs_that_wait_for_workers_count_like_those_in_the_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "_LONGEST_RETRY_S", 1.0)
    # Up to six wait of a caller who may have four: two more came while two were at the workers.
    queue = QueueLimits(waiting=7, waiting_per_caller=4)
    async with parts(tmp_path, Choices(queue=queue, capacity=2)) as made:
        made.workers.is_away = True
        jobs: list[JobRecord] = []

        async def is_refused() -> bool:
            # Each tries a worker, and waits beside the line then.
            try:
                job, _ = await made.manager.submit(task_of(f"again {len(jobs)}"), ME)
            except RefusedError as error:
                assert error.reason is Reason.SERVER_BUSY
                return made.scheduler.running == made.scheduler.waiting == 0
            jobs.append(job)
            return False

        await until(is_refused)
        assert 4 <= len(jobs) <= 6
        theirs, _ = await made.manager.submit(task_of("of somebody else"), Caller("you"))
        made.workers.is_away = False
        for job in jobs:
            done = await ended(made.manager, job.id)
            assert (done.state, done.attempts) == (JobState.SUCCEEDED, 1)
        assert (await ended(made.manager, theirs.id, Caller("you"))).state is JobState.SUCCEEDED
        made.scheduler.require_room(ME.name)
