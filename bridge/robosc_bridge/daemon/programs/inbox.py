"""Queue of items from programs to the loop, bounded for each program, so that none can hold up the others.

The loop takes some items in each of its cycles, from each program in turn. A program that sends faster than the loop
takes them loses the items beyond the limits, and all that follow until it is notified, in its turn. All its requests
end then: a lost item may have been the message that ends one.
"""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from robosc_bridge.daemon.programs.items import Attached, Detached, FromProgram, Program
from robosc_bridge.daemon.programs.plain_data import weight_bytes, why_not_plain
from robosc_bridge.daemon.programs.request_checker import InvalidRequestError

MAXIMUM_WAITING = 200
"""Maximum number of waiting messages of one program."""

MAXIMUM_WAITING_BYTES = 2_000_000
"""Maximum memory for the data of one program, in bytes; one message may wait whatever its size."""


@dataclass(frozen=True)
class Unreadable:
    """Item of a program that is not plain data of a reasonable size, or that is an invalid request.

    Attributes:
        program: Program that sent it.
        why: Reason, in one sentence.
    """

    program: Program
    why: str


@dataclass
class Overflowed:
    """Record that a program has sent more than the inbox takes.

    Attributes:
        program: Program that sent it.
        lost: Number of lost items.
    """

    program: Program
    lost: int = 1


Arrived = FromProgram | Unreadable | Overflowed


@dataclass
class _Waiting:
    """Waiting messages of one program, each with the memory that its data takes."""

    items: deque[tuple[Arrived, int]] = field(default_factory=deque)
    weight_bytes: int = 0
    overflow: Overflowed | None = None

    def has_room(self, weight_bytes: int) -> bool:
        if len(self.items) >= MAXIMUM_WAITING:
            return False
        return not self.items or self.weight_bytes + weight_bytes <= MAXIMUM_WAITING_BYTES

    def append(self, item: Arrived, weight_bytes: int) -> None:
        self.items.append((item, weight_bytes))
        self.weight_bytes += weight_bytes


class ProgramInbox:
    """Inbox that is filled by the endpoints' threads and emptied by the loop's.

    Args:
        wake: Function that is called when the first item begins to wait.
        look: Function that converts an item that was sent to the one that the loop gets; raises `InvalidRequestError`
            if the item is invalid. Called from any thread.
    """

    def __init__(self, wake: Callable[[], None], look: Callable[[FromProgram], FromProgram]) -> None:
        self._wake = wake
        self._look = look
        self._lock = threading.Lock()
        # Programs stand in the order of their next turns.
        self._waiting: dict[Program, _Waiting] = {}

    def put(self, item: FromProgram) -> None:
        """Put an item of a program into the inbox; waits for nothing but another `put` or `take`."""
        # Here and not in the loop: looking through data takes time.
        is_always_taken = isinstance(item, Attached | Detached)
        arrived, weight = (item, 0) if is_always_taken else self._looked_through(item)
        with self._lock:
            was_empty = not self._waiting
            waiting = self._waiting.setdefault(item.program, _Waiting())
            if is_always_taken or (waiting.overflow is None and waiting.has_room(weight)):
                waiting.append(arrived, weight)
            elif waiting.overflow is None:
                waiting.overflow = Overflowed(item.program)
                waiting.append(waiting.overflow, 0)
            else:
                waiting.overflow.lost += 1
        if was_empty:
            self._wake()

    def _looked_through(self, item: FromProgram) -> tuple[Arrived, int]:
        """Return the item that the loop gets, and the memory that its data takes, in bytes."""
        why = why_not_plain(getattr(item, "data", None))
        if why:
            return Unreadable(item.program, why), 0
        try:
            looked = self._look(item)
        except InvalidRequestError as error:
            return Unreadable(item.program, str(error)), 0
        return looked, weight_bytes(getattr(looked, "data", None))

    @property
    def is_empty(self) -> bool:
        """True if nothing waits."""
        return not self._waiting

    def take(self) -> Arrived | None:
        """Return the next item, one of each program in turn; None: no item waits."""
        with self._lock:
            if not self._waiting:
                return None
            program, waiting = next(iter(self._waiting.items()))
            del self._waiting[program]
            item, weight = waiting.items.popleft()
            waiting.weight_bytes -= weight
            if item is waiting.overflow:
                waiting.overflow = None
            if waiting.items:
                self._waiting[program] = waiting
        return item
