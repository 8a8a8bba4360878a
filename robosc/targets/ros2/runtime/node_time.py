"""
Simulated time as the executor's clock: it stops with the simulation, and never goes back.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Callable
import time

from robosc.execution.runtime.clock import SystemClock


class SimulatedClock:
    """
    The executor's clock where the time of ROS is that of `/clock`.

    No time passes before the first message on `/clock`, which would seem to be years after zero.
    Where time jumps back, as a replayed bag does at its end, the executor's goes on from where it
    was.

    :param now_ns: Function that returns the time of ROS in nanoseconds; 0 before the first message
        on `/clock`.
    """

    wall = staticmethod(time.time)

    def __init__(self, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._last_ns = 0
        self._passed_ns = 0
        self._went_back_ns = 0

    def monotonic(self) -> float:
        """Seconds of simulated time that have passed."""
        now_ns = self._now_ns()
        if self._last_ns and now_ns > 0:
            step_ns = now_ns - self._last_ns
            self._passed_ns += max(step_ns, 0)
            self._went_back_ns -= min(step_ns, 0)
        self._last_ns = now_ns or self._last_ns
        return self._passed_ns * 1e-9

    @property
    def has_begun(self) -> bool:
        """Return True if there was a message on `/clock` when the time was last taken."""
        return self._last_ns > 0

    def take_jump(self) -> float:
        """Seconds by which time has gone back since this was last asked; 0 if it has not."""
        self.monotonic()
        jump_ns, self._went_back_ns = self._went_back_ns, 0
        return jump_ns * 1e-9


class SteadyClock(SystemClock):
    """
    The executor's clock where the time of ROS is the computer's.

    Steady, whatever happens to that time.
    """

    has_begun = True

    def take_jump(self) -> float:
        """Go on: a steady clock never goes back."""
        return 0.0
