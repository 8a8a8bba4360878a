"""Offset between the clocks of two computers, from the times of sending on one and of arrival on the other.

The transmission time of a message is unknown, but never less than zero, so that the smallest of many differences is the
nearest to the offset of the clocks. That is the minimum filter of NTP (D. L. Mills, "Internet time synchronization: the
Network Time Protocol", IEEE Transactions on Communications 39 (10), 1991), in one direction only: the remaining error
is the shortest transmission time, below a millisecond on one computer and a few milliseconds on a network.
"""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

WINDOW_S = 30.0
"""Differences that are older no longer count: crystals differ by up to 0.1 ms in a second."""


def monotonic() -> float:
    """Return this computer's time in seconds, by the clock that bridges take their times from."""
    return time.clock_gettime(time.CLOCK_BOOTTIME) if hasattr(time, "CLOCK_BOOTTIME") else time.monotonic()


class ClockOffset:
    """Offset of this computer's clock from a sender's, which follows both of them.

    Args:
        window_s: Time for which a difference counts, in seconds.
    """

    def __init__(self, window_s: float = WINDOW_S) -> None:
        self._window_s = window_s
        # Grows from the first to the last: the first is the smallest of those that still count.
        self._differences: deque[tuple[float, float]] = deque()

    def add(self, sent_s: float, received_s: float) -> None:
        """Add a pair of times.

        Args:
            sent_s: Time by the sender's clock.
            received_s: Time by this computer's.
        """
        difference_s = received_s - sent_s
        while self._differences and self._differences[-1][1] >= difference_s:
            self._differences.pop()
        self._differences.append((received_s, difference_s))
        while self._differences[0][0] < received_s - self._window_s:
            self._differences.popleft()

    def local_s(self, sender_s: float) -> float:
        """Convert a time of the sender's clock to this computer's; needs at least one pair of times."""
        return sender_s + self._differences[0][1]


@dataclass(frozen=True)
class LocalClocks:
    """Clocks of this computer.

    Attributes:
        monotonic: Function that returns the time of the clock for comparing times, in seconds.
        wall_ns: Function that returns the time of the ROS clock, in nanoseconds since 1970-01-01 UTC.
    """

    monotonic: Callable[[], float] = monotonic
    wall_ns: Callable[[], int] = time.time_ns

    def stamp_ns(self, local_s: float) -> int:
        """Return a time of the first clock by the clock of ROS, as that is set now."""
        return self.wall_ns() + round((local_s - self.monotonic()) * 1e9)
