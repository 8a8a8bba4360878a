"""
Inbox between the threads of rospy and the one thread of the executor.

It is bounded, and keeps the order of arrival.

rospy calls back in a thread of its own for each connection. The executor does not run there: a
callback puts a function into the inbox, and the node's loop takes and calls it.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
import threading
from typing import Callable

Action = Callable[[], None]


class Inbox:
    """
    Things to be done by another thread.

    :param depths: Maximum number that may wait of each kind, such as the messages on a topic; of
        more the oldest are lost. What is of no kind is never lost.
    """

    def __init__(self, depths: Mapping[str, int]) -> None:
        self._arrived = threading.Condition()
        self._count = 0
        self._dropped = 0
        self._waiting: dict[str | None, deque[tuple[int, Action]]] = {
            kind: deque(maxlen=depth) for kind, depth in depths.items()
        }
        self._waiting[None] = deque()

    @property
    def dropped(self) -> int:
        """Return number lost so far."""
        return self._dropped

    def put(self, action: Action, kind: str | None = None) -> None:
        """Keep something to be done; from any thread."""
        with self._arrived:
            waiting = self._waiting[kind]
            self._dropped += len(waiting) == waiting.maxlen
            self._count += 1
            waiting.append((self._count, action))
            self._arrived.notify()

    def take(self, timeout_s: float) -> list[Action]:
        """All that is to be done, in the order in which it came; waits a while for the first."""
        with self._arrived:
            if timeout_s > 0.0 and not any(self._waiting.values()):
                self._arrived.wait(timeout_s)
            found = sorted(
                (entry for entries in self._waiting.values() for entry in entries),
                key=lambda entry: entry[0],
            )
            for entries in self._waiting.values():
                entries.clear()
        return [action for _, action in found]
