"""The jobs that one server carries: from their acceptance, through their turn at a worker, to their end."""

import asyncio
import contextlib
import secrets
import traceback
from collections.abc import Collection, Coroutine, Iterable
from dataclasses import dataclass, replace
from typing import Any

from robosc_server.failures import RefusedError, fault_words, for_callers
from robosc_server.jobs.results import Results
from robosc_server.jobs.retention import Retention
from robosc_server.jobs.scheduler import Place, Scheduler
from robosc_server.jobs.watching import Watchers
from robosc_server.operations.logs import tell_fault
from robosc_server.operations.tracing import Tracing
from robosc_server.store import JobRecord, JobState, Store, StoreUnavailableError
from robosc_server.store.records import STEP
from robosc_server.tasks.task import Failure, Outcome, Reason, Report, Result, Task, TaskLimits
from robosc_server.workers import WorkerLostError, WorkersError

_RETRY_S = 0.5
"""Waiting time of a job before the database or the workers are tried again for it, in seconds."""

_LONGEST_RETRY_S = 8.0
"""The same, where it was in vain again and again."""

_QUOTA_S = 30.0
"""Longest time in seconds before a waiting job's quota is checked again: quotas are changed."""

MAXIMUM_LOSSES = 3
"""A job whose worker was lost under it so often has failed: whoever starts workers may end of it."""

_LOST = f"the job's worker was lost {MAXIMUM_LOSSES} times while it did the task"
_SHORTEST_S = 0.01
_WAITING = "waiting"
"""The stage of a job that waits for its owner's quota."""


@dataclass(slots=True)
class Carried:
    """A job of this server that has not ended.

    Attributes:
        record: Record of the job, with the reports of its worker, which may not be in the database yet.
        place: Place in the queue; None: it waits for the database or for workers.
        carrier: Task that carries it to its end; None: it is being accepted.
        is_kept: True if it is known to be in the database.
        noted: Revision that the database has, at least.
    """

    record: JobRecord
    place: Place | None
    carrier: asyncio.Task[None] | None = None
    is_kept: bool = False
    noted: int = 0

    @property
    def runs(self) -> bool:
        """True if a worker is busy with it."""
        return self.record.state is JobState.RUNNING


class Carrying:
    """The jobs of this server that have not ended.

    Args:
        store: The database.
        scheduler: The queue before the workers.
        results: Results that were worked out before.
        task_limits: Limits of one task.
        retention: Retention that is notified of new results.
        watchers: Watchers that are notified of changes.
        tracing: Tracing that receives a span of each job.

    Attributes:
        replica: The name of this server in the database.
        has_doubts: True if the acceptance of a job failed in a way that leaves open whether it is kept.
    """

    def __init__(
        self,
        store: Store,
        scheduler: Scheduler,
        results: Results,
        task_limits: TaskLimits,
        retention: Retention,
        watchers: Watchers,
        tracing: Tracing,
    ) -> None:
        self._store, self._scheduler, self._results = store, scheduler, results
        self._task_limits, self._retention, self._watchers, self._tracing = task_limits, retention, watchers, tracing
        self._carried: dict[str, Carried] = {}
        self._tasks: set[asyncio.Task[Any]] = set()
        self._is_closed = False
        self.replica = new_id()
        self.has_doubts = False

    def __len__(self) -> int:
        return len(self._carried)

    def __contains__(self, job_id: object) -> bool:
        return job_id in self._carried

    @property
    def ids(self) -> set[str]:
        """The ids of all of them, as of now."""
        return set(self._carried)

    @property
    def all(self) -> list[Carried]:
        """All of them, as of now."""
        return list(self._carried.values())

    def get(self, job_id: str) -> Carried | None:
        """One of them."""
        return self._carried.get(job_id)

    def current(self, record: JobRecord) -> JobRecord:
        """A job with what its worker has told meanwhile."""
        carried = self._carried.get(record.id)
        return carried.record if carried is not None and carried.record.revision > record.revision else record

    async def enter(self) -> None:
        """Take part, under a name that nobody had before, and carry on what is left to it."""
        self.replica = new_id()
        await self._store.enter(self.replica)
        self.take_up(await self._store.active_of(self.replica))

    async def accept(self, record: JobRecord, place: Place, task: Task, bound: int) -> tuple[JobRecord, bool] | None:
        """Have a job kept, then carry it.

        Args:
            record: The job.
            place: Place that it has in the queue.
            task: Task to be done.
            bound: Number of jobs of its owner that may be kept.

        Returns:
            The job, or the one that was accepted with its idempotency key, and whether that was there before; None:
            its owner has too many.

        Raises:
            StoreUnavailableError: It is not known whether it is accepted.
        """
        carried = self._carried[record.id] = Carried(record, place)
        # Whoever asks may go away meanwhile; the job is accepted or it is not, and neither halfway.
        return await asyncio.shield(self._spawn(self._accept(carried, task, bound)))

    def take_up(self, records: Iterable[JobRecord]) -> None:
        """Carry jobs that wait, and that nobody carries; none once those that wait were left to others."""
        for record in () if self._is_closed else records:
            if record.id not in self._carried and record.state is JobState.QUEUED:
                carried = Carried(record, self._scheduler.enter_anyway(record.owner))
                self._carried[record.id] = carried
                self._have_carried(carried, record)

    def ended(self, record: JobRecord) -> None:
        """A job has ended, perhaps one of ours that a worker is at."""
        carried = self._carried.get(record.id)
        if carried is not None and carried.carrier is not None:
            # Its place is free when its worker is.
            carried.carrier.cancel()
        self._watchers.tell(record)

    async def stop(self, some: Collection[Carried]) -> None:
        """Leave jobs as they are in the database; their workers are stopped."""
        carriers = [carried.carrier for carried in some if carried.carrier is not None]
        for carrier in carriers:
            carrier.cancel()
        if carriers:
            await asyncio.wait(carriers)
        for carried in some:
            self._drop(carried)

    async def leave_waiting(self) -> None:
        """Leave what waits to other servers. From now on, what is accepted is not carried, and left to them as well."""
        self._is_closed = True
        waiting = [carried for carried in self.all if not carried.runs]
        await self.stop(waiting)
        with contextlib.suppress(StoreUnavailableError):  # It is tried again at the end.
            # Some may have begun this moment.
            await self._store.put_back({carried.record.id for carried in waiting}, self.replica, None)
            await self._store.give_up_waiting(self.replica)

    async def wait_for_running(self, seconds: float) -> None:
        """Return when what runs has ended, or so many seconds have passed."""
        running = [carried.carrier for carried in self.all if carried.carrier is not None]
        if running:
            await asyncio.wait(running, timeout=seconds)

    async def stop_all(self) -> None:
        """Stop everything."""
        await self.stop(self.all)
        if self._tasks:
            await asyncio.wait(self._tasks)

    async def _accept(self, carried: Carried, task: Task, bound: int) -> tuple[JobRecord, bool] | None:
        record = carried.record
        try:
            result = self._results.unwritten(task.key)
            answer = await self._store.accept(record, task.request, result, bound)
        except BaseException:
            # It may be kept nevertheless: one of the next looks finds it then.
            self.has_doubts = True
            self._drop(carried)
            raise
        if answer is None:
            self._drop(carried)
            return None
        accepted, existed = answer
        if existed or accepted.state.has_ended or self._is_closed:
            self._drop(carried)
            self._watchers.tell(accepted)
            if self._is_closed:
                with contextlib.suppress(StoreUnavailableError):
                    await self._store.give_up_waiting(self.replica)
        else:
            self._have_carried(carried, accepted)
        return accepted, existed

    def _have_carried(self, carried: Carried, record: JobRecord) -> None:
        """Carry a job that is kept."""
        carried.is_kept = True
        carried.noted = record.revision
        carried.carrier = self._spawn(self._carry(carried))
        # And not at the end of the coroutine: cancelled before it has begun, it never gets there.
        carried.carrier.add_done_callback(lambda _: self._drop(carried))

    async def _carry(self, carried: Carried) -> None:
        """Bring a job to its end, as often as the database or the workers are away."""
        try:
            with self._tracing.span("job", {"job.id": carried.record.id, "task.kind": carried.record.kind.value}):
                outcome = await self._outcome(carried)
        except Exception:
            outcome = Failure(Reason.INTERNAL_FAULT, "a fault of the server", traceback.format_exc())
        self._give_place_back(carried)
        if outcome is not None:
            try:
                await self._end(carried, outcome)
            except Exception as error:
                tell_fault(error)

    async def _outcome(self, carried: Carried) -> Outcome | None:
        """Return the outcome of a job; None: it has ended, or is another server's."""
        pause_s = _RETRY_S
        while True:
            place = carried.place = carried.place or self._scheduler.enter_anyway(carried.record.owner)
            await place.turn()
            if (wait_s := self._quota_wait_s(carried)) > 0:
                # It waits beside the line, where it is in nobody's way.
                self._give_place_back(carried)
                await asyncio.sleep(wait_s)
                continue
            try:
                begun = await self._store.begin(carried.record.id, self.replica)
                if begun is None:
                    return None
                record, request = begun
                self._set(carried, record)
                return None if record.state.has_ended else await self._work(carried, place, request)
            except WorkerLostError:
                if carried.record.losses + 1 >= MAXIMUM_LOSSES:
                    return Failure(Reason.WORKER_DIED, _LOST)
                await self._wait_again(carried, place, _RETRY_S, is_lost=True)
            except (StoreUnavailableError, WorkersError):
                await self._wait_again(carried, place, pause_s)
                pause_s = min(_LONGEST_RETRY_S, 2 * pause_s)

    def _quota_wait_s(self, carried: Carried) -> float:
        """Seconds after which a job is to ask again whether it may begin; 0: it may."""
        try:
            self._scheduler.check(carried.record.owner)
        except RefusedError as error:
            self._tell(carried, Report(_WAITING, error.message))
            return min(_QUOTA_S, max(error.retry_after_s or 0.0, _SHORTEST_S))
        return 0.0

    async def _work(self, carried: Carried, place: Place, request: bytes) -> Outcome:
        record = carried.record

        async def report(told: Report) -> None:
            self._tell(carried, told)

        task = Task(record.kind, request, record.key, record.main_file)
        return await self._scheduler.work(place, task, self._task_limits, report)

    def _tell(self, carried: Carried, told: Report) -> None:
        """Tell watchers where a job is."""
        now = carried.record
        revision = now.revision + (1 if (now.revision + 1) % STEP else 0)
        carried.record = replace(now, progress=told, revision=revision)
        self._watchers.tell(carried.record)

    async def _wait_again(self, carried: Carried, place: Place, pause_s: float, *, is_lost: bool = False) -> None:
        """Make a job wait that could not run, also in the database if it is noted there that it runs.

        Args:
            carried: The job.
            place: Place that it had in the queue.
            pause_s: Waiting time, in seconds.
            is_lost: True if its worker was lost while it ran; that is counted.
        """
        carried.place = None
        with self._scheduler.aside(place):
            is_noted = await self._put_back(carried, is_lost=is_lost)
            await asyncio.sleep(pause_s)
            while not (is_noted or await self._put_back(carried, is_lost=is_lost)):
                await asyncio.sleep(pause_s)

    async def _put_back(self, carried: Carried, *, is_lost: bool) -> bool:
        """Note in the database that a job waits; whether that was possible."""
        try:
            back = await self._store.put_back([carried.record.id], self.replica, self.replica, is_lost=is_lost)
        except StoreUnavailableError:
            return False
        for record in back:
            self._set(carried, record)
        return True

    async def _end(self, carried: Carried, outcome: Outcome) -> None:
        """Have the end of a job kept, however long that takes."""
        job_id = carried.record.id
        if isinstance(outcome, Failure):
            outcome = for_callers(outcome)
        while True:
            try:
                ended = await self._store.end(job_id, self.replica, outcome)
                break
            except StoreUnavailableError as error:
                await asyncio.sleep(error.retry_after_s or _RETRY_S)
            except Exception as error:
                # What cannot be kept: a job ends in any case.
                words = fault_words(tell_fault(error))
                if isinstance(outcome, Failure):
                    return
                outcome = Failure(Reason.INTERNAL_FAULT, f"the result cannot be kept; {words}")
        if ended is None:
            return
        self._set(carried, ended)
        if isinstance(outcome, Result):
            self._results.remember(ended.key, ended.kind, outcome)
            self._retention.note(outcome)

    def _set(self, carried: Carried, record: JobRecord) -> None:
        """A job has changed in the database."""
        carried.record = record
        carried.noted = record.revision
        self._watchers.tell(record)

    def _drop(self, carried: Carried) -> None:
        self._give_place_back(carried)
        if self._carried.get(carried.record.id) is carried:
            del self._carried[carried.record.id]

    def _give_place_back(self, carried: Carried) -> None:
        if carried.place is not None:
            self._scheduler.leave(carried.place)
            carried.place = None

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
    """A name that nobody can guess."""
    return secrets.token_hex(16)
