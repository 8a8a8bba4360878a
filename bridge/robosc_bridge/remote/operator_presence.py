"""Proof from an operator's messages that the operator is there now.

Messages that waited in buffers may be older than the operator. A machine that sends as fast as it can fills every
buffer on the way; once it hangs, its messages go on arriving.
"""

from collections.abc import Callable

MESSAGES_A_S = 200
"""More than any terminal sends; beyond it messages are no sign of life."""

FLOOD_S = 3
"""After so many seconds in a row with more than that the stream is ended."""


class FloodError(Exception):
    """An operator sends more messages than a person could give."""


class OperatorPresence:
    """Counter of an operator's messages in each second.

    Args:
        clock: Monotonic clock, in seconds.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._begin_s = clock()
        self._count = 0
        self._seconds_over = 0

    def message_received(self) -> bool:
        """Count a message; return True if it proves that the operator is there now.

        Raises:
            FloodError: There were too many for too long.
        """
        now_s = self._clock()
        if now_s - self._begin_s >= 1.0:
            self._seconds_over = self._seconds_over + 1 if self._count > MESSAGES_A_S else 0
            self._begin_s, self._count = now_s, 0
        if self._seconds_over >= FLOOD_S:
            raise FloodError(f"an operator may send at most {MESSAGES_A_S} messages a second; this one sends more")
        self._count += 1
        # A second with few of them, and nothing is waiting any more.
        return self._seconds_over == 0 and self._count <= MESSAGES_A_S
