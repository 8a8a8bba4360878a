"""Who is next: a bounded line of tasks, fair between callers.

Callers take turns: whoever has had one goes to the end of the ring, so that a caller with a thousand tasks delays one
with a single task by no more than one task (M. Shreedhar and G. Varghese, "Efficient Fair Queuing Using Deficit
Round-Robin", IEEE/ACM Transactions on Networking 4(3), 1996, pages 375-385; here each task counts the same).
"""

import asyncio
import time
from collections import OrderedDict, deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Protocol

from robosc_server.failures import RefusedError
from robosc_server.tasks.task import Outcome, Reason, Task, TaskLimits
from robosc_server.workers import OnReport, Workers, WorkersError

_LOOK_S = 1.0
"""While tasks wait: how often it is looked whether there are more workers."""

_FIRST_GUESS_S = 1.0
_WEIGHT = 0.2
_SHORTEST_RETRY_S = 0.1
_LONGEST_RETRY_S = 60.0


@dataclass(frozen=True, slots=True)
class QueueLimits:
    """How many tasks may wait for a worker.

    Attributes:
        waiting: Of all callers.
        waiting_per_caller: Of one.
    """

    waiting: int = 1000
    waiting_per_caller: int = 100


class Accounts(Protocol):
    """What single callers may take, and have taken."""

    def waiting(self, caller: str) -> int | None:
        """How many tasks of a caller may wait; None: as many as anybody's."""

    def spent(self, caller: str, seconds: float) -> None:
        """Note for how long a worker was taken by a task of a caller."""


class Place:
    """A place in the line, and later at a worker; given back with `Scheduler.leave`, whatever happens.

    Args:
        caller: Whose.
    """

    __slots__ = ("_begun_s", "_turn", "caller")

    def __init__(self, caller: str) -> None:
        self.caller = caller
        self._turn: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._begun_s: float | None = None

    @property
    def has_turn(self) -> bool:
        """Whether a worker is free for it."""
        return self._begun_s is not None

    async def turn(self) -> None:
        """Wait until a worker is free for it."""
        await asyncio.shield(self._turn)


class Scheduler:
    """The line before the workers.

    Args:
        workers: Who does the tasks.
        limits: How many may wait.
        clock: Seconds of a monotonic clock.
        accounts: Of single callers; None: all may take the same.
    """

    def __init__(
        self,
        workers: Workers,
        limits: QueueLimits,
        clock: Callable[[], float] = time.monotonic,
        accounts: Accounts | None = None,
    ) -> None:
        self._workers, self._limits, self._clock, self._accounts = workers, limits, clock, accounts
        self._ring: OrderedDict[str, deque[Place]] = OrderedDict()
        self._waiting = 0
        self._running = 0
        self._mean_s: float | None = None
        self._is_closed = False
        self._look: asyncio.TimerHandle | None = None
        self._order: dict[Place, int] | None = None

    @property
    def waiting(self) -> int:
        """How many tasks wait for a worker."""
        return self._waiting

    @property
    def running(self) -> int:
        """How many workers are taken."""
        return self._running

    def close(self) -> None:
        """Refuse what comes from now on; what waits, waits on."""
        self._is_closed = True

    async def run(
        self,
        task: Task,
        caller: str,
        limits: TaskLimits,
        on_report: OnReport,
        on_begin: Callable[[], Awaitable[None]] | None = None,
    ) -> Outcome:
        """The outcome of a task that is bound to its call; cancelling this ends it.

        Args:
            task: What is to be done.
            caller: Whose it is.
            limits: What it may take.
            on_report: Is told where the work is.
            on_begin: Is told when a worker begins.

        Raises:
            RefusedError: There is too much to do, there are no workers, or the server ends.
        """
        if self._workers.capacity < 1:
            raise _no_workers()
        place = self.enter(caller)
        try:
            await place.turn()
            if on_begin is not None:
                await on_begin()
            return await self._workers.run(task, limits, on_report)
        except WorkersError as error:
            raise _no_workers() from error
        finally:
            self.leave(place)

    def enter(self, caller: str) -> Place:
        """A place in the line, or at once at a worker.

        Raises:
            RefusedError: There is too much to do, or the server ends.
        """
        if self._is_closed:
            raise RefusedError(Reason.SHUTTING_DOWN, "the server ends; ask another one, or later", retry_after_s=1.0)
        if self._waiting or self._running >= self._workers.capacity:
            line = self._ring.get(caller)
            if line is not None and len(line) >= self._waiting_of(caller):
                after_s = self._retry_after_s(len(line) * len(self._ring))
                raise RefusedError(Reason.SERVER_BUSY, "too many requests of yours wait already", after_s)
            if self._waiting >= self._limits.waiting:
                after_s = self._retry_after_s(self._waiting)
                raise RefusedError(Reason.SERVER_BUSY, "the server has too much to do; try again later", after_s)
        return self.enter_anyway(caller)

    def _waiting_of(self, caller: str) -> int:
        own = None if self._accounts is None else self._accounts.waiting(caller)
        return self._limits.waiting_per_caller if own is None else own

    def enter_anyway(self, caller: str) -> Place:
        """A place for a task that was accepted before: no bound holds."""
        place = Place(caller)
        self._ring.setdefault(caller, deque()).append(place)
        self._waiting += 1
        self._give_turns()
        return place

    def leave(self, place: Place) -> None:
        """Give a place back, wherever it is; again does nothing."""
        if place._begun_s is not None:
            took_s = self._clock() - place._begun_s
            self._mean_s = took_s if self._mean_s is None else self._mean_s + _WEIGHT * (took_s - self._mean_s)
            place._begun_s = None
            if self._accounts is not None:
                self._accounts.spent(place.caller, took_s)
            self._running -= 1
            self._give_turns()
            return
        line = self._ring.get(place.caller)
        if line is not None and place in line:
            line.remove(place)
            self._waiting -= 1
            self._order = None
            if not line:
                del self._ring[place.caller]

    def before(self, place: Place) -> int:
        """How many tasks would begin before one that waits, if nothing else came; 0 for one that does not wait."""
        if self._order is None:
            self._order = self._order_now()
        return self._order.get(place, 0)

    def _order_now(self) -> dict[Place, int]:
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

    def _give_turns(self) -> None:
        self._order = None
        while self._waiting and self._running < self._workers.capacity:
            caller, line = self._ring.popitem(last=False)
            place = line.popleft()
            if line:
                self._ring[caller] = line
            self._waiting -= 1
            self._running += 1
            place._begun_s = self._clock()
            place._turn.set_result(None)
        if self._waiting and self._look is None:
            # Workers of a cluster come and go without telling.
            self._look = asyncio.get_running_loop().call_later(_LOOK_S, self._look_again)

    def _look_again(self) -> None:
        self._look = None
        self._give_turns()

    def _retry_after_s(self, before: int) -> float:
        """About when so many tasks have begun, by how long tasks took lately."""
        mean_s = _FIRST_GUESS_S if self._mean_s is None else self._mean_s
        guess_s = mean_s * before / max(1, self._workers.capacity)
        return min(_LONGEST_RETRY_S, max(_SHORTEST_RETRY_S, guess_s))


def _no_workers() -> RefusedError:
    return RefusedError(Reason.WORKERS_UNAVAILABLE, "the server has no workers now; try again later", retry_after_s=2.0)
