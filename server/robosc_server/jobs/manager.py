"""Jobs from their acceptance to their end, in one of the servers that share a database.

What is told about a job is on disk before. A job belongs to one server, which has a place in its line for it and
carries it to its end; others read it in the database, and cancel it there: whatever its server tells about it after
that comes too late, and it finds out at its next look. A server that is taken for dead has its jobs adopted by another.
"""

import asyncio
import contextlib
import logging
import math
import secrets
import time
import traceback
from collections.abc import AsyncIterator, Callable, Coroutine, Iterable, Mapping
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Any, Self

from robosc_server.failures import RefusedError, for_callers
from robosc_server.jobs.callers import Caller
from robosc_server.jobs.limits import JobLimits
from robosc_server.jobs.results import Results
from robosc_server.jobs.scheduler import Place, Scheduler
from robosc_server.jobs.watching import Watchers
from robosc_server.operations.tracing import NO_TRACING, Tracing
from robosc_server.store import JobFilter, JobRecord, JobState, Store, StoreUnavailableError
from robosc_server.store.records import STEP, messages_of
from robosc_server.tasks.task import Failure, Outcome, Reason, Report, Result, Task, TaskKind, TaskLimits
from robosc_server.workers import Workers, WorkersError

_log = logging.getLogger(__name__)

_RETRY_S = 0.5
"""How long a job waits before the database or the workers are tried again for it."""

_DOUBTFUL_LOOKS = 40
"""So often it is looked for a job whose acceptance failed in a way that leaves open whether it is kept."""

_LEFT = "the server ends; ask another one, or later"


@dataclass(slots=True)
class _Carried:
    """A job of this server that has not ended.

    Attributes:
        record: How it is; with what its worker has told, which may not be in the database yet.
        place: In the line; None: it waits for the database or for workers.
        carrier: What carries it to its end; None: it is being accepted.
        is_kept: Whether it is known to be in the database.
        noted: The revision that the database has, at least.
    """

    record: JobRecord
    place: Place | None
    carrier: asyncio.Task[None] | None = None
    is_kept: bool = False
    noted: int = 0


class JobManager:
    """The jobs of one server.

    Inside the context it carries on what was left, and looks after its jobs.

    Args:
        store: The database.
        scheduler: The line before the workers, which direct calls stand in, too.
        workers: Who does the tasks.
        results: What was worked out before.
        task_limits: What one task may take.
        limits: What jobs may take.
        clock: Seconds of a monotonic clock, for leases.
        tracing: Where a span of each job goes.
    """

    def __init__(
        self,
        store: Store,
        scheduler: Scheduler,
        workers: Workers,
        results: Results,
        task_limits: TaskLimits,
        limits: JobLimits,
        clock: Callable[[], float] = time.monotonic,
        tracing: Tracing = NO_TRACING,
    ) -> None:
        self._store, self._scheduler, self._workers, self._results = store, scheduler, workers, results
        self._tracing = tracing
        self._task_limits, self._limits, self._clock = task_limits, limits, clock
        self._replica = _new_id()
        self._carried: dict[str, _Carried] = {}
        self._watchers = Watchers()
        self._seen: dict[str, tuple[int, float]] = {}
        self._needed_bytes = 0
        self._counts: Mapping[JobState, int] = dict.fromkeys(JobState, 0)
        self._tasks: set[asyncio.Task[Any]] = set()
        self._keepers: list[asyncio.Task[None]] = []
        self._beaten_s = -math.inf
        self._doubtful_looks = 0
        self._is_draining = False
        self._has_left = False

    async def __aenter__(self) -> Self:
        await self._enter()
        self._keepers = [asyncio.create_task(self._look_often()), asyncio.create_task(self._sweep_often())]
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self._has_left:
            await self.drain(0.0)

    @property
    def counts(self) -> Mapping[JobState, int]:
        """How many jobs the database has in each state, as of the last sweep or soon after a change there."""
        return self._counts

    @property
    def carried(self) -> int:
        """How many jobs this server has that have not ended."""
        return len(self._carried)

    # What callers ask for.

    async def submit(
        self,
        task: Task,
        caller: Caller,
        *,
        idempotency_key: str = "",
        label: str = "",
        retention_s: float | None = None,
    ) -> tuple[JobRecord, bool]:
        """Accept a job; when this returns, it is kept.

        Args:
            task: What is to be done.
            caller: Whose it is.
            idempotency_key: The same again answers with the same job; empty: no such care.
            label: What its owner calls it.
            retention_s: How long it is kept after its end; None, or too long: as long as jobs are kept.

        Returns:
            The job, and whether it was there before.

        Raises:
            RefusedError: It is not accepted. After STORE_UNAVAILABLE it is not known whether it was.
        """
        if self._is_draining:
            raise RefusedError(Reason.SHUTTING_DOWN, _LEFT, retry_after_s=1.0)
        if self._needed_bytes >= self._limits.results_bytes:
            message = "the server keeps as many results of jobs as it may; try again when some have expired"
            raise RefusedError(Reason.SERVER_BUSY, message, retry_after_s=self._limits.sweep_s)
        try:
            place = self._scheduler.enter(caller.name)
        except RefusedError:
            there = await self.submitted(task, caller, idempotency_key) if idempotency_key else None
            if there is None:
                raise
            return there, True
        kept_s = self._limits.retention_s if retention_s is None else min(retention_s, self._limits.retention_s)
        record = JobRecord(
            id=_new_id(),
            owner=caller.name,
            kind=task.kind,
            state=JobState.QUEUED,
            revision=1,
            key=task.key,
            main_file=task.main_file,
            label=label,
            idempotency_key=idempotency_key or None,
            retention_us=round(kept_s * 1e6),
            created_us=self._store.now_us(),
            replica=self._replica,
        )
        carried = _Carried(record, place)
        self._carried[record.id] = carried
        # Whoever asks may go away meanwhile; the job is accepted or it is not, and neither halfway.
        accepting = self._spawn(self._accept(carried, task))
        accepted, existed = await asyncio.shield(accepting)
        return self._current(_same_task(accepted, task) if existed else accepted), existed

    async def submitted(self, task: Task, caller: Caller, idempotency_key: str) -> JobRecord | None:
        """The job that was submitted with a key, if there is one.

        Raises:
            RefusedError: The key was used for another task.
        """
        there = await self._store.find_by_key(caller.name, idempotency_key)
        return None if there is None else self._current(_same_task(there, task))

    async def get(self, job_id: str, caller: Caller) -> JobRecord:
        """A job of the caller.

        Raises:
            RefusedError: There is none, or the database is away.
        """
        return self._current(await self._find(job_id, caller))

    def waiting_before(self, record: JobRecord) -> int:
        """How many tasks wait before a job on its server; 0 where that is another one."""
        carried = self._carried.get(record.id)
        return 0 if carried is None or carried.place is None else self._scheduler.before(carried.place)

    async def watch(self, job_id: str, caller: Caller, after_revision: int) -> AsyncIterator[JobRecord]:
        """A job whenever it has changed, up to its end.

        Args:
            job_id: Which.
            caller: Whose.
            after_revision: What was seen before; 0: nothing.

        Raises:
            RefusedError: There is none, the database is away, or the server ends.
        """
        seen = after_revision
        with self._watchers.watch(job_id) as watch:
            carried = self._carried.get(job_id)
            record: JobRecord | None
            if carried is not None and carried.is_kept and _may_see(caller, carried.record):
                # Thousands may come at once, after a lost connection: of these the database is not asked.
                record = carried.record
            else:
                record = await self.get(job_id, caller)
            while True:
                if record is not None:
                    watch.revision = record.revision
                    if record.revision > seen or record.state.has_ended:
                        seen = record.revision
                        yield record
                    if record.state.has_ended:
                        return
                if self._has_left:
                    raise RefusedError(Reason.SHUTTING_DOWN, _LEFT, retry_after_s=1.0)
                record = await watch.news()
                if record is None and watch.is_gone:
                    raise _no_such_job()

    async def cancel(self, job_id: str, caller: Caller) -> JobRecord:
        """End a job, wherever it is; one that has ended stays as it is.

        Raises:
            RefusedError: There is none, or the database is away.
        """
        await self._find(job_id, caller)
        ended = await self._store.cancel(job_id)
        if ended is None:
            raise _no_such_job()
        self._ended(ended)
        return ended

    async def list_jobs(self, chosen: JobFilter, after: tuple[int, str] | None, limit: int) -> list[JobRecord]:
        """Jobs, the youngest first.

        Raises:
            RefusedError: The database is away.
        """
        return [self._current(record) for record in await self._store.list_jobs(chosen, after, limit)]

    async def result(self, job_id: str, caller: Caller) -> tuple[JobRecord, AsyncIterator[bytes]]:
        """A job that has succeeded, and the messages of its result, read as they are taken.

        Raises:
            RefusedError: It has none, there is no such job, or the database is away; also while they are read.
        """
        record = await self._find(job_id, caller)
        if record.state is JobState.FAILED:
            raise RefusedError(Reason.JOB_HAS_FAILED, "the job has failed, and has no result")
        if record.state is JobState.CANCELLED:
            raise RefusedError(Reason.JOB_CANCELLED, "the job was cancelled, and has no result")
        if record.result_key is None:
            raise RefusedError(Reason.JOB_NOT_ENDED, "the job has not ended; watch it")
        if record.kind is TaskKind.SYNTHESIZE:
            # One message, and the only one that has something done to it before it is sent.
            result = await self._results.find(record.result_key)
            if result is None:
                raise StoreUnavailableError
            return record, _each(result.messages)
        number = await self._store.count_blocks(record.result_key)
        if number is None:
            raise _no_such_job()
        return record, self._messages(record.result_key, number)

    async def drain(self, seconds: float) -> None:
        """Come to an end: jobs that do not end in time are left to whoever comes next.

        Nothing is accepted any more, what waits is left to others at once, and watchers are told to ask there at last.

        Args:
            seconds: For what runs.
        """
        self._is_draining = True
        ours = set(self._carried)
        waiting = [carried for carried in self._carried.values() if not _runs(carried)]
        await self._stop_carrying(waiting)
        running = [carried.carrier for carried in self._carried.values() if carried.carrier is not None]
        if running:
            await asyncio.wait(running, timeout=seconds)
        for keeper in self._keepers:
            keeper.cancel()
        await asyncio.gather(*self._keepers, return_exceptions=True)
        self._keepers = []
        ours |= set(self._carried)
        await self._stop_carrying(list(self._carried.values()))
        if self._tasks:
            await asyncio.wait(self._tasks)
        try:
            await self._store.put_back(ours, self._replica, None)
            await self._store.leave(self._replica)
        except StoreUnavailableError:
            _log.error("the database is away: jobs that have not ended are carried on after the next start")
        self._has_left = True
        self._watchers.wake()

    # One job.

    async def _accept(self, carried: _Carried, task: Task) -> tuple[JobRecord, bool]:
        """Have a job kept, then carry it."""
        record = carried.record
        try:
            result = self._results.unwritten(task.key)
            answer = await self._store.accept(record, task.request, result, self._limits.jobs_per_owner)
        except BaseException:
            # It may be kept nevertheless: one of the next looks finds it then.
            self._doubtful_looks = _DOUBTFUL_LOOKS
            self._drop(carried)
            raise
        if answer is None:
            self._drop(carried)
            message = f"{self._limits.jobs_per_owner} jobs of yours are kept; try again when some have expired"
            raise RefusedError(Reason.QUOTA_EXCEEDED, message, retry_after_s=self._limits.sweep_s)
        accepted, existed = answer
        if existed or accepted.state.has_ended or self._is_draining:
            self._drop(carried)
            self._watchers.tell(accepted)
        else:
            self._have_carried(carried, accepted)
        return accepted, existed

    def _have_carried(self, carried: _Carried, record: JobRecord) -> None:
        """Carry a job that is kept."""
        carried.is_kept = True
        carried.noted = record.revision
        carried.carrier = self._spawn(self._carry(carried))
        # And not at the end of the coroutine: cancelled before it has begun, it never gets there.
        carried.carrier.add_done_callback(lambda _: self._drop(carried))

    async def _carry(self, carried: _Carried) -> None:
        """Bring a job to its end, as often as the database or the workers are away."""
        try:
            with self._tracing.span("job", {"job.id": carried.record.id, "task.kind": carried.record.kind.value}):
                outcome = await self._outcome(carried)
        except Exception:
            outcome = Failure(Reason.INTERNAL_FAULT, "a fault of the server", traceback.format_exc())
        self._give_place_back(carried)
        if outcome is not None:
            await self._end(carried, outcome)

    async def _outcome(self, carried: _Carried) -> Outcome | None:
        """What becomes of a job; None: it has ended, or is another server's."""
        while True:
            if carried.place is None:
                carried.place = self._scheduler.enter_anyway(carried.record.owner)
            await carried.place.turn()
            try:
                begun = await self._store.begin(carried.record.id, self._replica)
                if begun is None:
                    return None
                record, request = begun
                self._set(carried, record)
                return None if record.state.has_ended else await self._work(carried, request)
            except (StoreUnavailableError, WorkersError):
                self._give_place_back(carried)
                await self._wait_again(carried)

    async def _work(self, carried: _Carried, request: bytes) -> Outcome:
        record = carried.record

        async def report(told: Report) -> None:
            now = carried.record
            revision = now.revision + (1 if (now.revision + 1) % STEP else 0)
            carried.record = replace(now, progress=told, revision=revision)
            self._watchers.tell(carried.record)

        task = Task(record.kind, request, record.key, record.main_file)
        return await self._workers.run(task, self._task_limits, report)

    async def _wait_again(self, carried: _Carried) -> None:
        """Have a job wait that could not run, also in the database if it is noted there that it runs."""
        while True:
            await asyncio.sleep(_RETRY_S)
            with contextlib.suppress(StoreUnavailableError):
                for record in await self._store.put_back([carried.record.id], self._replica, self._replica):
                    self._set(carried, record)
                return

    async def _end(self, carried: _Carried, outcome: Outcome) -> None:
        """Have the end of a job kept, however long that takes."""
        job_id = carried.record.id
        if isinstance(outcome, Failure):
            outcome = for_callers(outcome)
        while True:
            try:
                ended = await self._store.end(job_id, self._replica, outcome)
                break
            except StoreUnavailableError as error:
                await asyncio.sleep(error.retry_after_s or _RETRY_S)
        if ended is None:
            return
        if isinstance(outcome, Result):
            self._results.remember(ended.key, ended.kind, outcome)
            self._needed_bytes += sum(map(len, outcome.messages))
        self._set(carried, ended)

    def _set(self, carried: _Carried, record: JobRecord) -> None:
        """A job has changed in the database."""
        carried.record = record
        carried.noted = record.revision
        self._watchers.tell(record)

    def _ended(self, record: JobRecord) -> None:
        """A job has ended, perhaps one of ours that a worker is at."""
        carried = self._carried.get(record.id)
        if carried is not None and carried.carrier is not None:
            # Its place is free when its worker is.
            carried.carrier.cancel()
        self._watchers.tell(record)

    def _drop(self, carried: _Carried) -> None:
        self._give_place_back(carried)
        if self._carried.get(carried.record.id) is carried:
            del self._carried[carried.record.id]

    def _give_place_back(self, carried: _Carried) -> None:
        if carried.place is not None:
            self._scheduler.leave(carried.place)
            carried.place = None

    def _current(self, record: JobRecord) -> JobRecord:
        """A job with what its worker has told meanwhile."""
        carried = self._carried.get(record.id)
        return carried.record if carried is not None and carried.record.revision > record.revision else record

    async def _find(self, job_id: str, caller: Caller) -> JobRecord:
        record = await self._store.find(job_id)
        if record is None or not _may_see(caller, record):
            raise _no_such_job()
        return record

    async def _messages(self, key: str, blocks: int) -> AsyncIterator[bytes]:
        for number in range(blocks):
            block = await self._store.read_block(key, number)
            if block is None:
                raise _no_such_job()
            for message in messages_of(block):
                yield message

    def _spawn[T](self, work: Coroutine[Any, Any, T]) -> asyncio.Task[T]:
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._forget)
        return task

    def _forget(self, task: asyncio.Task[Any]) -> None:
        self._tasks.discard(task)
        if not task.cancelled():
            task.exception()

    # All jobs.

    async def _enter(self) -> None:
        """Take part, under a name that nobody had before."""
        self._replica = _new_id()
        self._seen = {}
        await self._store.enter(self._replica)
        self._take_up(await self._store.active_of(self._replica))

    def _take_up(self, records: Iterable[JobRecord]) -> None:
        """Carry jobs that wait, and that nobody carries."""
        for record in records:
            if record.id not in self._carried and record.state is JobState.QUEUED:
                carried = _Carried(record, self._scheduler.enter_anyway(record.owner))
                self._carried[record.id] = carried
                self._have_carried(carried, record)

    async def _stop_carrying(self, some: list[_Carried]) -> None:
        """Leave jobs as they are in the database; their workers are stopped."""
        carriers = [carried.carrier for carried in some if carried.carrier is not None]
        for carrier in carriers:
            carrier.cancel()
        if carriers:
            await asyncio.wait(carriers)
        for carried in some:
            self._drop(carried)

    async def _look_often(self) -> None:
        while True:
            await asyncio.sleep(self._limits.look_s)
            try:
                await self.look()
            except StoreUnavailableError:
                # How long others have been silent is not known then.
                self._seen = {}
            except Exception:
                _log.exception("the jobs in the database cannot be looked after")

    async def look(self) -> None:
        """Look what others have done in the database, and whether it is there again; called often."""
        is_shared, now_s = self._store.is_shared, self._clock()
        is_beat_due = is_shared and now_s - self._beaten_s >= self._limits.lease_s / 5
        if is_beat_due or not self._store.is_available:
            if not await self._store.beat(self._replica):
                await self._start_again()
                return
            self._beaten_s = now_s
            self._doubtful_looks = max(1, self._doubtful_looks)
        if is_shared or self._doubtful_looks:
            await self._look_after_ours()
            self._doubtful_looks = max(0, self._doubtful_looks - 1)
        if is_shared:
            await self._look_for_dead()
            await self._tell_progress()
        watched = {
            job_id: revision for job_id, revision in self._watchers.revisions().items() if job_id not in self._carried
        }
        if watched:
            changed, forgotten = await self._store.find_changed(watched)
            for record in changed:
                self._watchers.tell(record)
            for job_id in forgotten:
                # It has ended and was forgotten between two looks: who watches is told that there is none.
                self._watchers.tell_gone(job_id)

    async def _start_again(self) -> None:
        """We were taken for dead: our jobs are another's now."""
        _log.warning("other servers took this one for dead; its jobs are theirs")
        await self._stop_carrying([carried for carried in self._carried.values() if carried.is_kept])
        await self._enter()

    async def _look_after_ours(self) -> None:
        """Stop what others have ended, and carry what was kept though its acceptance seemed to fail."""
        known = {job_id for job_id, carried in self._carried.items() if carried.is_kept}
        before = set(self._carried)
        active = await self._store.active_ids_of(self._replica)
        gone = [carried for job_id in known - active if (carried := self._carried.get(job_id)) is not None]
        if gone:
            await self._stop_carrying(gone)
            changed, _ = await self._store.find_changed({carried.record.id: -1 for carried in gone})
            for record in changed:
                self._watchers.tell(record)
        if active - before:
            records = await self._store.active_of(self._replica)
            self._take_up(record for record in records if record.id not in before)

    async def _look_for_dead(self) -> None:
        """Adopt the jobs of servers that have been silent for the length of a lease."""
        now_s = self._clock()
        beats, has_orphans = await self._store.others(self._replica)
        self._seen = {
            name: self._seen[name] if name in self._seen and self._seen[name][0] == count else (count, now_s)
            for name, count in beats.items()
        }
        dead = {name: count for name, (count, since_s) in self._seen.items() if now_s - since_s >= self._limits.lease_s}
        if self._is_draining or not (dead or has_orphans):
            return
        adopted = await self._store.adopt(self._replica, dead)
        if dead:
            _log.warning("%d servers were silent for too long; %d jobs are adopted", len(dead), len(adopted))
        for record in adopted:
            self._watchers.tell(record)
        self._take_up(adopted)

    async def _tell_progress(self) -> None:
        """Let other servers know how far our jobs are."""
        told = {
            job_id: (carried.record.revision, carried.record.progress)
            for job_id, carried in self._carried.items()
            if carried.record.progress is not None and carried.record.revision > carried.noted
        }
        if told:
            await self._store.note_progress(self._replica, told)
            for job_id, (revision, _) in told.items():
                if job_id in self._carried:
                    self._carried[job_id].noted = max(revision, self._carried[job_id].noted)

    async def _sweep_often(self) -> None:
        while True:
            with contextlib.suppress(StoreUnavailableError):
                try:
                    await self.sweep()
                except StoreUnavailableError:
                    raise
                except Exception:
                    _log.exception("what has expired cannot be deleted")
            await asyncio.sleep(self._limits.sweep_s)

    async def sweep(self) -> None:
        """Delete what need not be kept any more; called now and then."""
        await self._store.sweep(self._limits.results_bytes)
        self._needed_bytes = await self._store.size_of_needed()
        self._counts = await self._store.counts_by_state()


async def _each(messages: Iterable[bytes]) -> AsyncIterator[bytes]:
    for message in messages:
        yield message


def _may_see(caller: Caller, record: JobRecord) -> bool:
    return caller.is_admin or record.owner == caller.name


def _runs(carried: _Carried) -> bool:
    return carried.record.state is JobState.RUNNING


def _same_task(record: JobRecord, task: Task) -> JobRecord:
    """The job of an idempotency key.

    Raises:
        RefusedError: Its task is another one.
    """
    if record.key != task.key:
        raise RefusedError(Reason.IDEMPOTENCY_KEY_REUSED, "the idempotency key was used for another task")
    return record


def _no_such_job() -> RefusedError:
    return RefusedError(Reason.NO_SUCH_JOB, "there is no job of that id that is yours")


def _new_id() -> str:
    return secrets.token_hex(16)
