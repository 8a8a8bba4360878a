"""What programs tell the loop on its way there: bounded for each of them, so that none can hold up the others.

The loop takes some at each of its turns, from each program in turn. Who sends faster than they are taken loses what is
beyond the limit, is told so in its place in the order, and whatever it keeps moving stops then: what was lost may have
been the message that stops it.
"""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from robosc_bridge.daemon.plain_data import why_not_plain
from robosc_bridge.daemon.programs import Attached, Detached, FromProgram, Program

MAXIMUM_WAITING = 200
"""Of one program."""


@dataclass(frozen=True)
class Unreadable:
    """What a program sent is no plain data of a reasonable size.

    Attributes:
        program: That sent it.
        why: One sentence.
    """

    program: Program
    why: str


@dataclass
class Overflowed:
    """A program has sent more than is taken.

    Attributes:
        program: That sent it.
        lost: How much was lost.
    """

    program: Program
    lost: int = 1


Arrived = FromProgram | Unreadable | Overflowed


@dataclass
class _Waiting:
    """Of one program."""

    items: deque[Arrived] = field(default_factory=deque)
    overflow: Overflowed | None = None


class ProgramInbox:
    """Filled by the faces' threads, emptied by the loop's.

    Args:
        wake: Called when something waits where nothing did.
    """

    def __init__(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._lock = threading.Lock()
        # In the order in which they are asked next.
        self._waiting: dict[Program, _Waiting] = {}

    def put(self, item: FromProgram) -> None:
        """Tell the loop something; waits for nobody but another `put` or `take`."""
        arrived: Arrived = item
        if not isinstance(item, Attached | Detached):
            # Here and not in the loop: looking through it takes time.
            why = why_not_plain(getattr(item, "data", None))
            arrived = Unreadable(item.program, why) if why else item
        with self._lock:
            was_empty = not self._waiting
            waiting = self._waiting.setdefault(item.program, _Waiting())
            if len(waiting.items) < MAXIMUM_WAITING or isinstance(item, Attached | Detached):
                waiting.items.append(arrived)
            elif waiting.overflow is None:
                waiting.overflow = Overflowed(item.program)
                waiting.items.append(waiting.overflow)
            else:
                waiting.overflow.lost += 1
        if was_empty:
            self._wake()

    @property
    def is_empty(self) -> bool:
        """Whether nothing waits."""
        return not self._waiting

    def take(self, limit: int) -> list[Arrived]:
        """What waits, at most so much of it, one of each program in turn."""
        found: list[Arrived] = []
        with self._lock:
            while self._waiting and len(found) < limit:
                program, waiting = next(iter(self._waiting.items()))
                del self._waiting[program]
                item = waiting.items.popleft()
                if item is waiting.overflow:
                    waiting.overflow = None
                found.append(item)
                if waiting.items:
                    self._waiting[program] = waiting
        return found
