"""Runner of the jobs of one server: from acceptance through the queue and a worker to the stored outcome."""

import asyncio
import contextlib
import secrets
import traceback
from collections.abc import Collection, Coroutine, Iterable
from dataclasses import dataclass, replace
from typing import Any

from robosc_server.jobs.result_cache import ResultCache
from robosc_server.jobs.retention import Retention
from robosc_server.jobs.scheduler import Place, Scheduler
from robosc_server.jobs.watchers import Watchers
from robosc_server.operations.failures import fault_message, public_failure
from robosc_server.operations.logs import log_fault
from robosc_server.operations.tracing import Tracing
from robosc_server.store import JobRecord, JobState, Store, StoreUnavailableError
from robosc_server.store.records import STEP
from robosc_server.tasks.task import Failure, Outcome, Reason, RefusedError, Report, Result, Task, TaskLimits
from robosc_server.workers import WorkerLostError, WorkersError

_RETRY_S = 0.5
"""Delay before the first retry of the database or the workers, in seconds."""

_LONGEST_RETRY_S = 8.0
"""Maximum delay between retries, in seconds."""

_QUOTA_S = 30.0
"""Maximum time between checks of a waiting job's quota, in seconds: quotas may be changed."""

MAXIMUM_LOSSES = 3
"""Lost workers after which a job fails: the job may be what crashes them."""

_LOST = f"the worker process was lost {MAXIMUM_LOSSES} times during this job"
_SHORTEST_S = 0.01
_WAITING = "waiting"
"""The stage of a job that waits for its owner's quota, or for the database."""

_UNSTORED = Report(_WAITING, "the task is done; its outcome is stored once the database is available and has room")


@dataclass(slots=True)
class ActiveJob:
    """A job of this server that has not ended.

    Attributes:
        record: Record of the job, with the reports of its worker, which may not be in the database yet.
        place: Place in the queue; None: it waits for the database or for workers.
        work: Asyncio task that runs the job; None: it is being accepted.
        is_stored: True if the job is known to be in the database.
        stored_revision: Lowest revision that the database may have.
    """

    record: JobRecord
    place: Place | None
    work: asyncio.Task[None] | None = None
    is_stored: bool = False
    stored_revision: int = 0

    @property
    def runs(self) -> bool:
        """True if a worker runs the job."""
        return self.record.state is JobState.RUNNING


class JobRunner:
    """The jobs of this server that have not ended.

    Args:
        store: The database.
        scheduler: Queue in front of the workers.
        results: Cache of results.
        task_limits: Limits of one task.
        retention: Retention that is notified of new results.
        watchers: Watchers that are notified of changes.
        tracing: Tracing that receives a span of each job.

    Attributes:
        replica: The name of this server in the database.
        has_uncertain_acceptance: True if the acceptance of a job failed and the database may have stored it anyway.
    """

    def __init__(
        self,
        store: Store,
        scheduler: Scheduler,
        results: ResultCache,
        task_limits: TaskLimits,
        retention: Retention,
        watchers: Watchers,
        tracing: Tracing,
    ) -> None:
        self._store, self._scheduler, self._results = store, scheduler, results
        self._task_limits, self._retention, self._watchers, self._tracing = task_limits, retention, watchers, tracing
        self._active: dict[str, ActiveJob] = {}
        self._tasks: set[asyncio.Task[Any]] = set()
        self._is_closed = False
        self.replica = new_id()
        self.has_uncertain_acceptance = False

    def __len__(self) -> int:
        return len(self._active)

    def __contains__(self, job_id: object) -> bool:
        return job_id in self._active

    @property
    def ids(self) -> set[str]:
        """Return the present ids of all jobs."""
        return set(self._active)

    @property
    def all(self) -> list[ActiveJob]:
        """Return all present jobs."""
        return list(self._active.values())

    def get(self, job_id: str) -> ActiveJob | None:
        """Return one of the jobs."""
        return self._active.get(job_id)

    def current(self, record: JobRecord) -> JobRecord:
        """Return a job with the newest progress that its worker has reported."""
        job = self._active.get(record.id)
        return job.record if job is not None and job.record.revision > record.revision else record

    async def enter(self) -> None:
        """Join the servers of the database under a new name, and resume the jobs that this assigns to it."""
        self.replica = new_id()
        await self._store.enter(self.replica)
        self.take_over(await self._store.active_of(self.replica))

    async def accept(self, record: JobRecord, place: Place, task: Task, bound: int) -> tuple[JobRecord, bool] | None:
        """Store a job, then run it.

        Args:
            record: The job.
            place: Place that it has in the queue.
            task: Task to be done.
            bound: Number of jobs of its owner that may be kept.

        Returns:
            The job, or the one that was accepted with its idempotency key, and whether that was there before; None:
            its owner has too many.

        Raises:
            StoreUnavailableError: It is unknown whether the job was accepted.
        """
        job = self._active[record.id] = ActiveJob(record, place)
        # A caller that disconnects must not leave a half-accepted job.
        return await asyncio.shield(self._spawn(self._accept(job, task, bound)))

    def take_over(self, records: Iterable[JobRecord]) -> None:
        """Run queued jobs that this server does not run yet; none after `release_waiting`."""
        for record in () if self._is_closed else records:
            if record.id not in self._active and record.state is JobState.QUEUED:
                job = ActiveJob(record, self._scheduler.enter_unbounded(record.owner))
                self._active[record.id] = job
                self._start(job, record)

    def ended(self, record: JobRecord) -> None:
        """Stop a job that was ended in the database, and notify its watchers."""
        job = self._active.get(record.id)
        if job is not None and job.work is not None:
            # Its place is released when its worker is free.
            job.work.cancel()
        self._watchers.notify(record)

    async def stop(self, some: Collection[ActiveJob]) -> None:
        """Stop the workers of jobs; the database keeps the jobs as they are."""
        works = [job.work for job in some if job.work is not None]
        for work in works:
            work.cancel()
        if works:
            await asyncio.wait(works)
        for job in some:
            self._remove(job)

    async def release_waiting(self) -> None:
        """Release waiting jobs to other servers; jobs that are accepted from now on are released as well."""
        self._is_closed = True
        waiting = [job for job in self.all if not job.runs]
        await self.stop(waiting)
        with contextlib.suppress(StoreUnavailableError):  # Retried at the end of the shutdown.
            # Jobs may have started at this moment.
            await self._store.requeue({job.record.id for job in waiting}, self.replica, None)
            await self._store.release_queued(self.replica)

    async def wait_for_running(self, seconds: float) -> None:
        """Wait for running jobs to end, at most so many seconds."""
        running = [job.work for job in self.all if job.work is not None]
        if running:
            await asyncio.wait(running, timeout=seconds)

    async def stop_all(self) -> None:
        """Stop all jobs, and their tasks."""
        await self.stop(self.all)
        if self._tasks:
            await asyncio.wait(self._tasks)

    async def _accept(self, job: ActiveJob, task: Task, bound: int) -> tuple[JobRecord, bool] | None:
        record = job.record
        try:
            result = self._results.unwritten(task.key)
            answer = await self._store.accept(record, task.request, result, bound)
        except BaseException:
            # The database may have stored it anyway: one of the next polls finds it then.
            self.has_uncertain_acceptance = True
            self._remove(job)
            raise
        if answer is None:
            self._remove(job)
            return None
        accepted, existed = answer
        if existed or accepted.state.has_ended or self._is_closed:
            self._remove(job)
            self._watchers.notify(accepted)
            if self._is_closed:
                with contextlib.suppress(StoreUnavailableError):
                    await self._store.release_queued(self.replica)
        else:
            self._start(job, accepted)
        return accepted, existed

    def _start(self, job: ActiveJob, record: JobRecord) -> None:
        """Start to run a job that is stored."""
        job.is_stored = True
        job.stored_revision = record.revision
        job.work = self._spawn(self._run(job))
        # A coroutine that is cancelled before it starts never gets to its end, so the job is not removed there.
        job.work.add_done_callback(lambda _: self._remove(job))

    async def _run(self, job: ActiveJob) -> None:
        """Run a job to its end, with retries while the database or the workers are unavailable."""
        try:
            with self._tracing.span("job", {"job.id": job.record.id, "task.kind": job.record.kind.value}):
                outcome = await self._outcome(job)
        except Exception:
            outcome = Failure(Reason.INTERNAL_FAULT, "the server has an internal error", traceback.format_exc())
        self._release_place(job)
        if outcome is not None:
            try:
                await self._end(job, outcome)
            except Exception as error:
                log_fault(error)

    async def _outcome(self, job: ActiveJob) -> Outcome | None:
        """Return the outcome of a job; None: it has ended, or belongs to another server."""
        pause_s = _RETRY_S
        while True:
            place = job.place = job.place or self._scheduler.enter_unbounded(job.record.owner)
            await place.wait_for_worker()
            if (wait_s := self._quota_wait_s(job)) > 0:
                # The job waits outside the queue, where it blocks no other task.
                self._release_place(job)
                await asyncio.sleep(wait_s)
                continue
            try:
                begun = await self._store.begin(job.record.id, self.replica)
                if begun is None:
                    return None
                record, request = begun
                self._update(job, record)
                return None if record.state.has_ended else await self._work(job, place, request)
            except WorkerLostError:
                if job.record.losses + 1 >= MAXIMUM_LOSSES:
                    return Failure(Reason.WORKER_DIED, _LOST)
                await self._requeue(job, place, _RETRY_S, is_lost=True)
            except (StoreUnavailableError, WorkersError):
                await self._requeue(job, place, pause_s)
                pause_s = min(_LONGEST_RETRY_S, 2 * pause_s)

    def _quota_wait_s(self, job: ActiveJob) -> float:
        """Return the seconds until the quota of a job's owner is to be checked again; 0: the job may start."""
        try:
            self._scheduler.check(job.record.owner)
        except RefusedError as error:
            self._publish_progress(job, Report(_WAITING, error.message))
            return min(_QUOTA_S, max(error.retry_after_s or 0.0, _SHORTEST_S))
        return 0.0

    async def _work(self, job: ActiveJob, place: Place, request: bytes) -> Outcome:
        record = job.record

        async def report(progress: Report) -> None:
            self._publish_progress(job, progress)

        task = Task(record.kind, request, record.key, record.main_file)
        return await self._scheduler.work(place, task, self._task_limits, report)

    def _publish_progress(self, job: ActiveJob, progress: Report) -> None:
        """Publish the progress of a job to its watchers."""
        now = job.record
        revision = now.revision + (1 if (now.revision + 1) % STEP else 0)
        job.record = replace(now, progress=progress, revision=revision)
        self._watchers.notify(job.record)

    async def _requeue(self, job: ActiveJob, place: Place, pause_s: float, *, is_lost: bool = False) -> None:
        """Queue a job again that could not run, also in the database if it is marked as running there.

        Args:
            job: The job.
            place: Place that it had in the queue.
            pause_s: Waiting time, in seconds.
            is_lost: True if its worker was lost while it ran; that is counted.
        """
        job.place = None
        with self._scheduler.waiting_outside(place):
            is_noted = await self._requeue_stored(job, is_lost=is_lost)
            await asyncio.sleep(pause_s)
            while not (is_noted or await self._requeue_stored(job, is_lost=is_lost)):
                await asyncio.sleep(pause_s)

    async def _requeue_stored(self, job: ActiveJob, *, is_lost: bool) -> bool:
        """Mark a job as queued in the database; return False if the database is unavailable."""
        try:
            back = await self._store.requeue([job.record.id], self.replica, self.replica, is_lost=is_lost)
        except StoreUnavailableError:
            return False
        for record in back:
            self._update(job, record)
        return True

    async def _end(self, job: ActiveJob, outcome: Outcome) -> None:
        """Store the outcome of a job, with retries until the database takes it."""
        job_id = job.record.id
        if isinstance(outcome, Failure):
            outcome = public_failure(outcome)
        while True:
            try:
                ended = await self._store.end(job_id, self.replica, outcome)
                break
            except StoreUnavailableError as error:
                if job.record.progress != _UNSTORED:
                    self._publish_progress(job, _UNSTORED)
                await asyncio.sleep(error.retry_after_s or _RETRY_S)
            except Exception as error:
                # The result cannot be stored: the job fails instead.
                words = fault_message(log_fault(error))
                if isinstance(outcome, Failure):
                    return
                outcome = Failure(Reason.INTERNAL_FAULT, f"the result cannot be stored; {words}")
        if ended is None:
            return
        self._update(job, ended)
        if isinstance(outcome, Result):
            self._results.remember(ended.key, ended.kind, outcome)
            self._retention.note(outcome)

    def _update(self, job: ActiveJob, record: JobRecord) -> None:
        """Take over a record that has changed in the database."""
        job.record = record
        job.stored_revision = record.revision
        self._watchers.notify(record)

    def _remove(self, job: ActiveJob) -> None:
        self._release_place(job)
        if self._active.get(job.record.id) is job:
            del self._active[job.record.id]

    def _release_place(self, job: ActiveJob) -> None:
        if job.place is not None:
            self._scheduler.leave(job.place)
            job.place = None

    def _spawn[T](self, work: Coroutine[Any, Any, T]) -> asyncio.Task[T]:
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._forget)
        return task

    def _forget(self, task: asyncio.Task[Any]) -> None:
        self._tasks.discard(task)
        if not task.cancelled():
            task.exception()


def new_id() -> str:
    """Return a random id that cannot be guessed."""
    return secrets.token_hex(16)
