"""Jobs from their acceptance to their end, in one of the servers that share a database.

What is told about a job is on disk before. A job belongs to one server, which has a place in its line for it and
carries it to its end; others read it in the database, and cancel it there: whatever its server tells about it after
that comes too late, and it finds out at its next look. A server that is taken for dead has its jobs adopted by another.
Here callers are answered; `carrying` has the jobs of this server, `lookout` looks what others have done, and
`retention` deletes what need not be kept.
"""

import asyncio
import logging
from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from types import TracebackType
from typing import Self

from robosc_server.clock import monotonic
from robosc_server.failures import RefusedError
from robosc_server.jobs.callers import Caller
from robosc_server.jobs.carrying import Carrying, new_id
from robosc_server.jobs.limits import JobLimits
from robosc_server.jobs.lookout import Lookout
from robosc_server.jobs.results import Results
from robosc_server.jobs.retention import Retention
from robosc_server.jobs.scheduler import Scheduler
from robosc_server.jobs.watching import Watchers
from robosc_server.operations.tracing import NO_TRACING, Tracing
from robosc_server.store import JobFilter, JobRecord, JobState, Store, StoreUnavailableError
from robosc_server.store.records import messages_of
from robosc_server.tasks.task import Reason, Task, TaskKind, TaskLimits

_log = logging.getLogger(__name__)

_LEFT = "the server ends; ask another one, or later"


class JobManager:
    """The jobs of one server.

    Inside the context it carries on what was left, and looks after its jobs.

    Args:
        store: The database.
        scheduler: The queue before the workers, in which direct calls wait, too.
        results: Results that were worked out before.
        task_limits: Limits of one task.
        limits: Limits of jobs.
        clock: Seconds of a monotonic clock, for leases.
        tracing: Tracing that receives a span of each job.
    """

    def __init__(
        self,
        store: Store,
        scheduler: Scheduler,
        results: Results,
        task_limits: TaskLimits,
        limits: JobLimits,
        clock: Callable[[], float] = monotonic,
        tracing: Tracing = NO_TRACING,
    ) -> None:
        self._store, self._scheduler, self._results, self._limits = store, scheduler, results, limits
        self._watchers = Watchers()
        self._retention = Retention(store, limits)
        self._carrying = Carrying(store, scheduler, results, task_limits, self._retention, self._watchers, tracing)
        self._lookout = Lookout(store, self._carrying, self._watchers, limits, clock)
        self._keepers: list[asyncio.Task[None]] = []
        self._is_draining = False
        self._has_left = False

    async def __aenter__(self) -> Self:
        await self._carrying.enter()
        keepers = self._lookout.look_often(), self._retention.sweep_often()
        self._keepers = [asyncio.create_task(keeper) for keeper in keepers]
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self._has_left:
            await self.drain(0.0)

    @property
    def counts(self) -> Mapping[JobState, int]:
        """Number of jobs that the database has in each state, as of the last sweep."""
        return self._retention.counts

    @property
    def carried(self) -> int:
        """Number of jobs of this server that have not ended."""
        return len(self._carrying)

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
            task: Task to be done.
            caller: Caller whose job it is.
            idempotency_key: Key that answers with the same job when it is given again; empty: no such care.
            label: Owner's name for the job.
            retention_s: Time that it is kept after its end, in seconds; None, or too long: as long as jobs are kept.

        Returns:
            The job, and whether it was there before.

        Raises:
            RefusedError: It is not accepted. After STORE_UNAVAILABLE it is not known whether it was.
        """
        if self._is_draining:
            raise RefusedError(Reason.SHUTTING_DOWN, _LEFT, retry_after_s=1.0)
        self._retention.admit()
        try:
            place = self._scheduler.enter(caller.name)
        except RefusedError:
            there = await self.submitted(task, caller, idempotency_key) if idempotency_key else None
            if there is None:
                raise
            return there, True
        record = JobRecord(
            id=new_id(),
            owner=caller.name,
            kind=task.kind,
            state=JobState.QUEUED,
            revision=1,
            key=task.key,
            main_file=task.main_file,
            label=label,
            idempotency_key=idempotency_key or None,
            retention_us=self._retention.kept_us(retention_s),
            created_us=self._store.now_us(),
            replica=self._carrying.replica,
        )
        answer = await self._carrying.accept(record, place, task, self._limits.jobs_per_owner)
        if answer is None:
            raise self._retention.too_many()
        accepted, existed = answer
        return self._carrying.current(_same_task(accepted, task) if existed else accepted), existed

    def require_room(self, caller: Caller) -> None:
        """Do nothing if a new job of a caller would be accepted, as far as this server knows.

        Raises:
            RefusedError: It would not.
        """
        if self._is_draining:
            raise RefusedError(Reason.SHUTTING_DOWN, _LEFT, retry_after_s=1.0)
        self._retention.admit()
        self._scheduler.require_room(caller.name)

    async def submitted(self, task: Task, caller: Caller, idempotency_key: str) -> JobRecord | None:
        """The job that was submitted with a key, if there is one.

        Raises:
            RefusedError: The key was used for another task.
        """
        there = await self._store.find_by_key(caller.name, idempotency_key)
        return None if there is None else self._carrying.current(_same_task(there, task))

    async def get(self, job_id: str, caller: Caller) -> JobRecord:
        """A job of the caller.

        Raises:
            RefusedError: There is none, or the database is away.
        """
        return self._carrying.current(await self._find(job_id, caller))

    def waiting_before(self, record: JobRecord) -> int:
        """Return the number of tasks that wait before a job on its server; 0 if that is another one."""
        carried = self._carrying.get(record.id)
        return 0 if carried is None or carried.place is None else self._scheduler.before(carried.place)

    async def watch(self, job_id: str, caller: Caller, after_revision: int) -> AsyncIterator[JobRecord]:
        """Yield a job whenever it has changed, up to its end.

        Args:
            job_id: Id of the job.
            caller: Caller whose job it is.
            after_revision: Revision that was seen before; 0: none.

        Raises:
            RefusedError: There is none, the database is away, or the server ends.
        """
        seen = after_revision
        with self._watchers.watch(job_id) as watch:
            carried = self._carrying.get(job_id)
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
        self._carrying.ended(ended)
        return ended

    async def list_jobs(self, chosen: JobFilter, after: tuple[int, str] | None, limit: int) -> list[JobRecord]:
        """Jobs, the youngest first.

        Raises:
            RefusedError: The database is away.
        """
        return [self._carrying.current(record) for record in await self._store.list_jobs(chosen, after, limit)]

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
        self._lookout.stop_adopting()
        ours = self._carrying.ids
        await self._carrying.leave_waiting()
        await self._carrying.wait_for_running(seconds)
        for keeper in self._keepers:
            keeper.cancel()
        await asyncio.gather(*self._keepers, return_exceptions=True)
        self._keepers = []
        ours |= self._carrying.ids
        await self._carrying.stop_all()
        try:
            await self._store.put_back(ours, self._carrying.replica, None)
            await self._store.leave(self._carrying.replica)
        except StoreUnavailableError:
            _log.error("the database is away: jobs that have not ended are carried on after the next start")
        self._has_left = True
        self._watchers.wake()

    async def look(self) -> None:
        """Look at once what others have done in the database."""
        await self._lookout.look()

    async def sweep(self) -> None:
        """Delete at once what need not be kept any more."""
        await self._retention.sweep()

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


async def _each(messages: Iterable[bytes]) -> AsyncIterator[bytes]:
    for message in messages:
        yield message


def _may_see(caller: Caller, record: JobRecord) -> bool:
    return caller.is_admin or record.owner == caller.name


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
