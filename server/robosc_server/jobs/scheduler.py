"""Queue of tasks: bounded, and fair between callers.

The queue serves callers round-robin, so that a caller with a thousand tasks delays a caller with a single task by at
most one task (M. Shreedhar and G. Varghese, "Efficient Fair Queuing Using Deficit
Round-Robin", IEEE/ACM Transactions on Networking 4(3), 1996, pages 375-385; here each task counts the same).
"""

import asyncio
from collections import Counter, OrderedDict, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

from robosc_api.security.callers import network_of
from robosc_server.clock import monotonic
from robosc_server.tasks.task import Failure, Outcome, Reason, RefusedError, Task, TaskLimits
from robosc_server.workers import OnReport, WorkerLostError, Workers, WorkersError

_POLL_S = 1.0
"""Period at which the number of workers is checked while tasks wait, in seconds."""

_FIRST_GUESS_S = 1.0
_WEIGHT = 0.2
_SHORTEST_RETRY_S = 0.1
_LONGEST_RETRY_S = 60.0


@dataclass(frozen=True, slots=True)
class QueueLimits:
    """Limits on the number of tasks that wait for a worker.

    Attributes:
        waiting: Waiting tasks of all callers.
        waiting_per_caller: Waiting tasks of one caller.
        reserved: Tasks that may run beyond the capacity of the workers, one for each caller without a running task: a
            caller whose tasks occupy all workers for a long time makes others a little slower, but does not make them
            wait.
    """

    waiting: int = 1000
    waiting_per_caller: int = 100
    reserved: int = 0


class Accounts(Protocol):
    """Quotas and consumption of single callers."""

    def waiting(self, caller: str) -> int | None:
        """Return the maximum number of waiting tasks of a caller; None: the general limit."""

    def check(self, caller: str) -> None:
        """Do nothing if a task of a caller may start.

        Raises:
            RefusedError: The task may not start yet.
        """

    def charge(self, caller: str, cpu_s: float) -> None:
        """Count the CPU time of a task of a caller."""


class Place:
    """Place in the queue, and later at a worker; it must be given back with `Scheduler.leave`, whatever happens.

    Args:
        caller: Caller whose place it is.

    Attributes:
        line: Name of its line in the queue; all addresses of one network share a line.
    """

    __slots__ = ("_begun_s", "_worker_is_free", "caller", "line")

    def __init__(self, caller: str) -> None:
        self.caller = caller
        self.line = network_of(caller)
        self._worker_is_free: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._begun_s: float | None = None

    @property
    def has_worker(self) -> bool:
        """True if a worker is free for the task."""
        return self._begun_s is not None

    async def wait_for_worker(self) -> None:
        """Wait until a worker is free for the task."""
        await asyncio.shield(self._worker_is_free)


class Scheduler:
    """Queue in front of the workers.

    Args:
        workers: Workers that do the tasks.
        limits: Limits on the number of waiting tasks.
        clock: Seconds of a monotonic clock.
        accounts: Accounts of single callers; None: all callers have the same limits.
    """

    def __init__(
        self,
        workers: Workers,
        limits: QueueLimits,
        clock: Callable[[], float] = monotonic,
        accounts: Accounts | None = None,
    ) -> None:
        self._workers, self._limits, self._clock, self._accounts = workers, limits, clock, accounts
        self._ring: OrderedDict[str, deque[Place]] = OrderedDict()
        self._waiting = 0
        self._running = 0
        self._running_of: Counter[str] = Counter()
        self._waiting_outside: Counter[str] = Counter()
        self._mean_s: float | None = None
        self._is_closed = False
        self._calls: set[asyncio.Task[Any]] = set()
        self._has_ended_calls = False
        self._poll_timer: asyncio.TimerHandle | None = None
        self._order: dict[Place, int] | None = None

    @property
    def waiting(self) -> int:
        """Number of tasks that wait for a worker."""
        return self._waiting

    @property
    def running(self) -> int:
        """Number of workers that are occupied."""
        return self._running

    @property
    def capacity(self) -> int:
        """Number of tasks that workers can be busy with at once."""
        return self._workers.capacity

    def tasks_by_line(self) -> dict[str, tuple[int, int]]:
        """Return the numbers of waiting and of running tasks by the name of their line; see `Place.line`."""
        waiting = self._waiting_outside + Counter({name: len(line) for name, line in self._ring.items()})
        return {name: (waiting[name], self._running_of[name]) for name in waiting.keys() | self._running_of.keys()}

    def close(self) -> None:
        """Refuse new tasks from now on; waiting tasks stay in the queue."""
        self._is_closed = True

    def end_calls(self) -> None:
        """End the tasks that are bound to calls, which are refused; those of jobs stay as they are."""
        self._is_closed = self._has_ended_calls = True
        for call in self._calls:
            call.cancel()

    async def run(
        self,
        task: Task,
        caller: str,
        limits: TaskLimits,
        on_report: OnReport,
        known: Callable[[], Outcome | None] = lambda: None,
    ) -> Outcome:
        """Return the outcome of a task that is bound to its call; cancelling this ends it.

        Args:
            task: Task to be done.
            caller: Caller whose task it is.
            limits: Limits of the task.
            on_report: Callback that receives reports of the progress.
            known: Function that is called when the turn of the task comes; returns its outcome, if an equal task has
                ended meanwhile.

        Raises:
            RefusedError: The queue is full, there are no workers, the server shuts down before the task has ended, or
                the caller has used up its quota while the task waited.
        """
        if self._workers.capacity < 1:
            raise _no_workers()
        place = self.enter(caller)
        call: Any = asyncio.current_task()
        self._calls.add(call)
        try:
            await place.wait_for_worker()
            if (outcome := known()) is not None:
                return outcome
            self.check(caller)
            return await self.work(place, task, limits, on_report)
        except WorkerLostError:
            # The caller would retry the task that crashes workers on WORKERS_UNAVAILABLE.
            return Failure(Reason.WORKER_DIED, "the worker process was lost more than once during this task")
        except WorkersError as error:
            raise _no_workers() from error
        except asyncio.CancelledError:
            if not self._has_ended_calls:
                raise
            call.uncancel()
            raise _shutting_down() from None
        finally:
            self._calls.discard(call)
            self.leave(place)

    def check(self, caller: str) -> None:
        """Do nothing if a task of a caller whose turn it is may start.

        Raises:
            RefusedError: The task may not start yet.
        """
        if self._accounts is not None:
            self._accounts.check(caller)

    async def work(self, place: Place, task: Task, limits: TaskLimits, on_report: OnReport) -> Outcome:
        """Return the outcome of a task whose turn has come; its CPU time is charged to its caller, however it ends.

        Raises:
            WorkersError: See `Workers.run`.
        """
        return await self._workers.run(task, limits, on_report, partial(self._note_spent, place.caller))

    def _note_spent(self, caller: str, cpu_s: float) -> None:
        if self._accounts is not None:
            self._accounts.charge(caller, cpu_s)

    def enter(self, caller: str) -> Place:
        """Return a place in the queue, or at a worker if one is free.

        Raises:
            RefusedError: The queue is full, or the server shuts down.
        """
        self.require_room(caller)
        return self.enter_unbounded(caller)

    def require_room(self, caller: str) -> None:
        """Do nothing if `enter` would return a place.

        Raises:
            RefusedError: The queue is full, or the server shuts down.
        """
        if self._is_closed:
            raise _shutting_down()
        waiting = self._waiting + self._waiting_outside.total()
        is_free = not waiting and self._running < self._workers.capacity
        name = network_of(caller)
        if not is_free and not self._is_reserved_for(name):
            own = len(self._ring.get(name, ())) + self._waiting_outside[name]
            if own and own >= self._waiting_of(caller):
                after_s = self._retry_after_s(own * max(1, len(self._ring)))
                raise RefusedError(
                    Reason.SERVER_BUSY, "too many tasks of this caller are waiting; try again later", after_s
                )
            if waiting >= self._limits.waiting:
                after_s = self._retry_after_s(waiting)
                raise RefusedError(
                    Reason.SERVER_BUSY, "too many tasks are waiting at this server; try again later", after_s
                )

    def _is_reserved_for(self, line: str) -> bool:
        """Return True if a task of a line may begin although the workers are taken."""
        capacity = self._workers.capacity
        return 0 < capacity <= self._running < capacity + self._limits.reserved and not self._running_of[line]

    def _waiting_of(self, caller: str) -> int:
        own = None if self._accounts is None else self._accounts.waiting(caller)
        return self._limits.waiting_per_caller if own is None else own

    def enter_unbounded(self, caller: str) -> Place:
        """Enter the queue with a task that was accepted before, regardless of its limits."""
        place = Place(caller)
        self._ring.setdefault(place.line, deque()).append(place)
        self._waiting += 1
        self._start_waiting()
        return place

    def leave(self, place: Place) -> None:
        """Release a place in the queue or at a worker; releasing it again does nothing."""
        if place._begun_s is not None:
            took_s = self._clock() - place._begun_s
            self._mean_s = took_s if self._mean_s is None else self._mean_s + _WEIGHT * (took_s - self._mean_s)
            place._begun_s = None
            self._running -= 1
            self._running_of[place.line] -= 1
            self._running_of += Counter()  # The addition drops counts of zero.
            self._start_waiting()
            return
        line = self._ring.get(place.line)
        if line is not None and place in line:
            line.remove(place)
            self._waiting -= 1
            self._order = None
            if not line:
                del self._ring[place.line]

    @contextmanager
    def waiting_outside(self, place: Place) -> Iterator[None]:
        """Release a place and wait outside the queue; the task still counts as waiting."""
        self.leave(place)
        self._waiting_outside[place.line] += 1
        try:
            yield
        finally:
            self._waiting_outside[place.line] -= 1
            self._waiting_outside += Counter()

    def tasks_ahead(self, place: Place) -> int:
        """Return the number of tasks that would begin before a waiting one, if nothing else came.

        It is 0 for a task that does not wait.
        """
        if self._order is None:
            self._order = self._current_order()
        return self._order.get(place, 0)

    def _current_order(self) -> dict[Place, int]:
        lines = [iter(line) for line in self._ring.values()]
        order: dict[Place, int] = {}
        while lines:
            kept = []
            for line in lines:
                place = next(line, None)
                if place is not None:
                    order[place] = len(order)
                    kept.append(line)
            lines = kept
        return order

    def _start_waiting(self) -> None:
        self._order = None
        while self._waiting and self._running < self._workers.capacity:
            self._start(next(iter(self._ring)))
        while (name := next(filter(self._is_reserved_for, self._ring), None)) is not None:
            self._start(name)
        if self._waiting and self._poll_timer is None:
            # The number of workers of a cluster changes without notice.
            self._poll_timer = asyncio.get_running_loop().call_later(_POLL_S, self._poll_capacity)

    def _start(self, name: str) -> None:
        """Start the next task of a caller, whose other tasks then wait at the end of the ring."""
        line = self._ring.pop(name)
        place = line.popleft()
        if line:
            self._ring[name] = line
        self._waiting -= 1
        self._running += 1
        self._running_of[name] += 1
        place._begun_s = self._clock()
        place._worker_is_free.set_result(None)

    def _poll_capacity(self) -> None:
        self._poll_timer = None
        self._start_waiting()

    def _retry_after_s(self, before: int) -> float:
        """Estimate when so many tasks have started, from the mean duration of recent tasks."""
        mean_s = _FIRST_GUESS_S if self._mean_s is None else self._mean_s
        guess_s = mean_s * before / max(1, self._workers.capacity)
        return min(_LONGEST_RETRY_S, max(_SHORTEST_RETRY_S, guess_s))


def _shutting_down() -> RefusedError:
    message = "the server is shutting down; call another server, or try again later"
    return RefusedError(Reason.SHUTTING_DOWN, message, retry_after_s=1.0)


def _no_workers() -> RefusedError:
    return RefusedError(Reason.WORKERS_UNAVAILABLE, "no worker is available; try again later", retry_after_s=2.0)
