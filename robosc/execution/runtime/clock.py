"""Time of the executor: one interface, so that tests and simulations control it."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Two readings of time."""

    def monotonic(self) -> float:
        """Seconds since some moment; never goes back. It measures all waiting times."""

    def wall(self) -> float:
        """Seconds since 1970-01-01 UTC, for the event log; no decision depends on them."""


class SystemClock:
    """The computer's clocks."""

    monotonic = staticmethod(time.monotonic)
    wall = staticmethod(time.time)


class ManualClock:
    """
    A clock that moves only on request.

    :param now_s: Its first reading.
    :param epoch_s: Number of seconds added to a reading for the wall clock.
    """

    __slots__ = ('epoch_s', 'now_s')

    def __init__(self, now_s: float = 0.0, epoch_s: float = 0.0) -> None:
        self.now_s = now_s
        self.epoch_s = epoch_s

    def monotonic(self) -> float:
        """Return the reading it was set to."""
        return self.now_s

    def wall(self) -> float:
        """Return the reading it was set to, after the epoch."""
        return self.epoch_s + self.now_s

    def advance(self, seconds: float) -> None:
        """
        Let time pass.

        :raises ValueError: Time would go back.
        """
        if seconds < 0:
            raise ValueError('time does not go back')
        self.now_s += seconds
