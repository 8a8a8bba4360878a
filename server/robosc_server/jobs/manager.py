"""Jobs from their acceptance to their end, in one of the servers that share a database.

Callers are informed of a change of a job only after it is on disk. A job belongs to one server, which queues and runs
it. Other servers read it in the database and cancel it there; its own server finds out at its next poll, and later
reports of it are ignored. The jobs of a server that is taken for dead are adopted by another. This module answers
callers; `runner` runs the jobs of this server, `lease_monitor` follows the other servers, and `retention` deletes
expired jobs and results.
"""

import asyncio
import logging
from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from robosc_api.security.callers import network_of
from robosc_server.clock import monotonic
from robosc_server.jobs.lease_monitor import LeaseMonitor
from robosc_server.jobs.result_cache import ResultCache
from robosc_server.jobs.retention import JobLimits, Retention
from robosc_server.jobs.runner import JobRunner, new_id
from robosc_server.jobs.scheduler import Scheduler
from robosc_server.jobs.watchers import Watchers
from robosc_server.operations.tracing import NO_TRACING, Tracing
from robosc_server.store import JobFilter, JobRecord, JobState, Store, StoreUnavailableError
from robosc_server.store.records import OwnerLoad, messages_of
from robosc_server.tasks.task import Reason, RefusedError, Task, TaskKind, TaskLimits, shared_key

_log = logging.getLogger(__name__)

_LATELY_S = 60.0
"""Time within which jobs have ended lately."""

_MAXIMUM_CALLERS = 1000
"""Maximum number of callers whose load is reported."""

_LEFT = "the server is shutting down; call another server, or try again later"


@dataclass(frozen=True, slots=True)
class Caller:
    """Caller of the server.

    Attributes:
        name: Name that distinguishes callers.
        is_admin: True if the caller may see and cancel the jobs of all callers.
    """

    name: str
    is_admin: bool = False


@dataclass(frozen=True, slots=True)
class CallerLoad:
    """Load of one caller.

    Attributes:
        jobs: Load of its jobs, at all servers; names the caller.
        waiting: Number of its tasks that wait at this server.
        running: Number of its tasks that run for this server.
    """

    jobs: OwnerLoad
    waiting: int = 0
    running: int = 0

    def weight(self) -> tuple[int, int]:
        """Return the order of callers by load: first by unfinished work, then by finished work."""
        return max(self.waiting + self.running, self.jobs.queued + self.jobs.running), self.jobs.ended


@dataclass(frozen=True, slots=True)
class ServiceLoad:
    """Load of the service.

    Attributes:
        callers: Load of each caller, the largest first.
        workers: Number of tasks that workers can be busy with at once.
        running: Number of tasks that run for this server.
        waiting: Number of tasks that wait at this server.
        servers: Number of servers that share the jobs.
        now_us: Time, in microseconds since 1970.
    """

    callers: tuple[CallerLoad, ...]
    workers: int
    running: int
    waiting: int
    servers: int
    now_us: int


class JobManager:
    """The jobs of one server.

    Inside the context it resumes unfinished jobs and runs new ones.

    Args:
        store: The database.
        scheduler: Queue in front of the workers, which jobs share with direct calls.
        results: Cache of results.
        task_limits: Limits of one task.
        limits: Limits of jobs.
        clock: Seconds of a monotonic clock, for leases.
        tracing: Tracing that receives a span of each job.
    """

    def __init__(
        self,
        store: Store,
        scheduler: Scheduler,
        results: ResultCache,
        task_limits: TaskLimits,
        limits: JobLimits,
        clock: Callable[[], float] = monotonic,
        tracing: Tracing = NO_TRACING,
    ) -> None:
        self._store, self._scheduler, self._results, self._limits = store, scheduler, results, limits
        self._watchers = Watchers()
        self._retention = Retention(store, limits)
        self._runner = JobRunner(store, scheduler, results, task_limits, self._retention, self._watchers, tracing)
        self._lease_monitor = LeaseMonitor(store, self._runner, self._watchers, limits, clock)
        self._background: list[asyncio.Task[None]] = []
        self._is_draining = False
        self._has_left = False

    async def __aenter__(self) -> Self:
        await self._runner.enter()
        loops = self._lease_monitor.poll_forever(), self._retention.sweep_forever()
        self._background = [asyncio.create_task(loop) for loop in loops]
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
    def active_jobs(self) -> int:
        """Number of jobs of this server that have not ended."""
        return len(self._runner)

    async def submit(
        self,
        task: Task,
        caller: Caller,
        *,
        idempotency_key: str = "",
        label: str = "",
        retention_s: float | None = None,
    ) -> tuple[JobRecord, bool]:
        """Accept a job; it is stored when this returns.

        Args:
            task: Task to be done.
            caller: Caller whose job it is.
            idempotency_key: Key by which a repeated submission returns the same job; empty: none.
            label: Owner's name for the job.
            retention_s: Time that it is kept after its end, in seconds; None, or too long: the server's maximum.

        Returns:
            The job, and whether it was there before.

        Raises:
            RefusedError: The job is not accepted; after STORE_UNAVAILABLE its acceptance is uncertain.
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
            retention_us=self._retention.retention_us_of(retention_s),
            created_us=self._store.now_us(),
            replica=self._runner.replica,
        )
        answer = await self._runner.accept(record, place, task, self._limits.jobs_per_owner)
        if answer is None:
            raise self._retention.too_many()
        accepted, existed = answer
        return self._runner.current(_same_task(accepted, task) if existed else accepted), existed

    def require_room(self, caller: Caller) -> None:
        """Do nothing if a new job of a caller would be accepted, as far as this server knows.

        Raises:
            RefusedError: It would not be accepted.
        """
        if self._is_draining:
            raise RefusedError(Reason.SHUTTING_DOWN, _LEFT, retry_after_s=1.0)
        self._retention.admit()
        self._scheduler.require_room(caller.name)

    async def submitted(self, task: Task, caller: Caller, idempotency_key: str) -> JobRecord | None:
        """Return the job that was submitted with a key, if there is one.

        Raises:
            RefusedError: The key was used for another task.
        """
        there = await self._store.find_by_key(caller.name, idempotency_key)
        return None if there is None else self._runner.current(_same_task(there, task))

    async def get(self, job_id: str, caller: Caller) -> JobRecord:
        """Return a job of the caller.

        Raises:
            RefusedError: There is no such job of the caller, or the database is unavailable.
        """
        return self._runner.current(await self._find(job_id, caller))

    def waiting_before(self, record: JobRecord) -> int:
        """Return the number of tasks ahead of a job in the queue of this server; 0 if another server has the job."""
        job = self._runner.get(record.id)
        return 0 if job is None or job.place is None else self._scheduler.tasks_ahead(job.place)

    async def watch(self, job_id: str, caller: Caller, after_revision: int) -> AsyncIterator[JobRecord]:
        """Yield a job whenever it has changed, up to its end.

        Args:
            job_id: Id of the job.
            caller: Caller whose job it is.
            after_revision: Revision that was seen before; 0: none.

        Raises:
            RefusedError: There is no such job, the database is unavailable, or the server is shutting down.
        """
        seen = after_revision
        with self._watchers.watch(job_id) as watch:
            job = self._runner.get(job_id)
            record: JobRecord | None
            if job is not None and job.is_stored and _may_see(caller, job.record):
                # Thousands may come at once after a lost connection: they cause no database queries.
                record = job.record
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
                record = await watch.next_record()
                if record is None and watch.is_gone:
                    raise _no_such_job()

    async def cancel(self, job_id: str, caller: Caller) -> JobRecord:
        """Cancel a job at any server; a job that has ended does not change.

        Raises:
            RefusedError: There is no such job of the caller, or the database is unavailable.
        """
        await self._find(job_id, caller)
        ended = await self._store.cancel(job_id)
        if ended is None:
            raise _no_such_job()
        self._runner.ended(ended)
        return ended

    async def list_jobs(self, chosen: JobFilter, after: tuple[int, str] | None, limit: int) -> list[JobRecord]:
        """Return jobs, newest first.

        Raises:
            RefusedError: The database is unavailable.
        """
        return [self._runner.current(record) for record in await self._store.list_jobs(chosen, after, limit)]

    async def load(self, caller: Caller, *, all_callers: bool) -> ServiceLoad:
        """Return the load of the service.

        Args:
            caller: Caller whose load it is.
            all_callers: True for the load of all callers.

        Raises:
            RefusedError: The database is unavailable.
        """
        lines = self._scheduler.tasks_by_line()
        if not all_callers:
            line = network_of(caller.name)
            lines = {caller.name: lines[line]} if line in lines else {}
        loads = {load.owner: load for load in await self._store.loads(None if all_callers else caller.name, _LATELY_S)}
        callers = [
            CallerLoad(loads.get(name, OwnerLoad(name)), *lines.get(name, (0, 0)))
            for name in sorted(loads.keys() | lines.keys())
        ]
        return ServiceLoad(
            tuple(sorted(callers, key=CallerLoad.weight, reverse=True)[:_MAXIMUM_CALLERS]),
            workers=self._scheduler.capacity,
            running=self._scheduler.running,
            waiting=self._scheduler.waiting,
            servers=1 + len(self._lease_monitor.seen),
            now_us=self._store.now_us(),
        )

    async def result(self, job_id: str, caller: Caller) -> tuple[JobRecord, AsyncIterator[bytes]]:
        """Return a job that has succeeded, and the messages of its result, which are read during the iteration.

        Raises:
            RefusedError: There is no such job or result, or the database is unavailable, also during the iteration.
        """
        record = await self._find(job_id, caller)
        if record.state is JobState.FAILED:
            raise RefusedError(Reason.JOB_HAS_FAILED, "the job has failed and has no result")
        if record.state is JobState.CANCELLED:
            raise RefusedError(Reason.JOB_CANCELLED, "the job was cancelled and has no result")
        if record.result_key is None:
            raise RefusedError(Reason.JOB_NOT_ENDED, "the job has not ended: watch it until it has")
        if record.kind is TaskKind.SYNTHESIZE:
            # One message, and the only one that has something done to it before it is sent.
            result = await self._results.find(record.result_key)
            if result is None:
                raise StoreUnavailableError
            return record, _stream_of(result.messages)
        number = await self._store.count_blocks(record.result_key)
        if number is None:
            raise _no_such_job()
        return record, self._messages(record.result_key, number)

    async def drain(self, seconds: float) -> None:
        """Shut down: jobs that do not end in time are resumed by another server or after the next start.

        No more jobs are accepted, waiting jobs are released to other servers at once, and watchers are cut off at the
        end.

        Args:
            seconds: Time for running jobs to end, in seconds.
        """
        self._is_draining = True
        self._lease_monitor.stop_adopting()
        ours = self._runner.ids
        await self._runner.release_waiting()
        await self._runner.wait_for_running(seconds)
        for task in self._background:
            task.cancel()
        await asyncio.gather(*self._background, return_exceptions=True)
        self._background = []
        ours |= self._runner.ids
        await self._runner.stop_all()
        try:
            await self._store.requeue(ours, self._runner.replica, None)
            await self._store.leave(self._runner.replica)
        except StoreUnavailableError:
            _log.error("the database is unavailable: jobs that have not ended will be resumed after the next start")
        self._has_left = True
        self._watchers.wake()

    async def poll(self) -> None:
        """Poll the database once."""
        await self._lease_monitor.poll()

    async def sweep(self) -> None:
        """Delete expired jobs and excess results once."""
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


async def _stream_of(messages: Iterable[bytes]) -> AsyncIterator[bytes]:
    for message in messages:
        yield message


def _may_see(caller: Caller, record: JobRecord) -> bool:
    return caller.is_admin or record.owner == caller.name


def _same_task(record: JobRecord, task: Task) -> JobRecord:
    """Return the job of an idempotency key.

    Raises:
        RefusedError: Its task is another one.
    """
    if shared_key(record.key) != shared_key(task.key):
        raise RefusedError(Reason.IDEMPOTENCY_KEY_REUSED, "the idempotency key belongs to another task: use a new key")
    return record


def _no_such_job() -> RefusedError:
    return RefusedError(Reason.NO_SUCH_JOB, "there is no job with this id that the caller may see")
