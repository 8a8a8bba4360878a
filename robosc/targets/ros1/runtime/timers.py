"""
Timers of the node's one loop, on the steady clock.

Neither a simulated time nor a set clock moves them.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Callable


class _Timer:
    __slots__ = ('action', 'next_s', 'period_s')

    def __init__(self, period_s: float, action: Callable[[], None], next_s: float) -> None:
        self.period_s = period_s
        self.action = action
        self.next_s = next_s


class Timers:
    """
    Actions that come again and again.

    :param monotonic: The clock.
    """

    def __init__(self, monotonic: Callable[[], float]) -> None:
        self._monotonic = monotonic
        self._timers: list[_Timer] = []

    def add(self, period_s: float, action: Callable[[], None]) -> None:
        """Do something every so many seconds, for the first time after one period."""
        self._timers.append(_Timer(period_s, action, self._monotonic() + period_s))

    def due_in_s(self, limit_s: float) -> float:
        """Seconds until the next one is due, at most `limit_s`."""
        next_s = min((timer.next_s for timer in self._timers), default=float('inf'))
        return max(0.0, min(limit_s, next_s - self._monotonic()))

    def run_due(self) -> None:
        """Do what is due. Periods that were missed are not made up for."""
        for timer in self._timers:
            now_s = self._monotonic()
            if now_s >= timer.next_s:
                next_s = timer.next_s + timer.period_s
                timer.next_s = next_s if next_s > now_s else now_s + timer.period_s
                timer.action()
