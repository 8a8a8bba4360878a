"""Monitors of whether the wheels follow their commands, and nothing but these: of the drivers, and of the safety layer.

A driver knows what it told its motors, in their units, and names the fault; the safety layer believes no driver, and
looks again. The rules stand here alone.
"""

import math
from collections.abc import Callable, Sequence

FOLLOWING_LIMIT_S = 0.7
"""Longest time that a wheel may be far from its goal, as drivers see it: before the safety layer does."""

EXCESS_LIMIT_S = 0.5
"""Longest time that a wheel may be beyond its goal, as drivers see it, as one that is braking."""

SHARE = 0.5
"""Share of its goal by which a wheel is far from it, at least."""

_LEAST_RAW = 20


class _LastingMonitor:
    """Finds a wheel for which something is so in all readings of longer than a limit.

    Args:
        is_so: Function that returns, of the goal and the speed of a wheel, whether it is so now.
        limit_s: Longest time that it may be so, in seconds.
        longest_gap_s: Longest time between two readings; after a longer one it begins anew, as what the wheels did
            meanwhile is not known. None: half of `limit_s`; infinite: it goes on.
    """

    def __init__(
        self, is_so: Callable[[float, float], bool], limit_s: float, longest_gap_s: float | None = None
    ) -> None:
        self._is_so = is_so
        self._limit_s = limit_s
        self._longest_gap_s = limit_s / 2 if longest_gap_s is None else longest_gap_s
        self._since_s: list[float | None] = []
        self._time_s = 0.0

    def forget(self) -> None:
        """Begin anew: nothing is asked of the wheels."""
        self._since_s = []

    def begins(self, time_s: float) -> bool:
        """Return True if what was seen before a reading counts no more."""
        return not self._since_s or time_s - self._time_s > self._longest_gap_s

    def lasts(self, goals: Sequence[float], speeds: Sequence[float], time_s: float) -> bool:
        """Return True if it has been so for any wheel in all readings of longer than the limit.

        Args:
            goals: Goal of each wheel.
            speeds: Speed of each wheel, in the unit of the goals.
            time_s: Time when they were read, in seconds; where it goes back, the time begins anew.
        """
        if self.begins(time_s):
            self._since_s = [None] * len(goals)
        self._time_s = time_s
        for index, (goal, speed) in enumerate(zip(goals, speeds, strict=True)):
            since_s = self._since_s[index]
            if not self._is_so(goal, speed):
                self._since_s[index] = None
            else:
                self._since_s[index] = time_s if since_s is None else min(since_s, time_s)
        return any(since_s is not None and time_s - since_s > self._limit_s for since_s in self._since_s)


class FollowingMonitor(_LastingMonitor):
    """Finds a wheel that is held, rotates by itself, or has refused its goal without a word.

    Args:
        limit_s: Longest time that a wheel may be far from its goal, in seconds.
        least: Difference that is never far, in the unit of the speeds.
        longest_gap_s: Longest time between two readings, as above.
    """

    def __init__(
        self, limit_s: float = FOLLOWING_LIMIT_S, least: float = _LEAST_RAW, longest_gap_s: float | None = None
    ) -> None:
        # What is not a number is far from any goal.
        super().__init__(
            lambda goal, speed: not abs(goal - speed) <= max(least, SHARE * abs(goal)), limit_s, longest_gap_s
        )
        self._goals: list[float] = []

    def is_blocked(
        self, goals: Sequence[float], speeds: Sequence[float], time_s: float, ramp: float | None = None
    ) -> bool:
        """Return True if any wheel has been far from its goal in all readings of longer than the limit.

        Args:
            goals: Goal of each wheel.
            speeds: Speed of each wheel, in the unit of the goals.
            time_s: Time when they were read, in seconds; where it goes back, the time off begins anew.
            ramp: Acceleration with which the motors go to a goal, in the unit of the speeds a second: what they are
                compared with goes there as well. None: they go there as fast as they can.
        """
        if self.begins(time_s):
            self._goals = [speed if math.isfinite(speed) else 0.0 for speed in speeds]
            passed_s = 0.0
        else:
            passed_s = max(time_s - self._time_s, 0.0)
        step = math.inf if ramp is None else ramp * passed_s
        self._goals = [
            goal if abs(goal - now) <= step else now + math.copysign(step, goal - now)
            for goal, now in zip(goals, self._goals, strict=True)
        ]
        return self.lasts(self._goals, speeds, time_s)


class ExcessMonitor(_LastingMonitor):
    """Finds a wheel that something else drives, too: it is faster than its goal, or rotates the other way.

    Args:
        limit_s: Longest time that a wheel may be so, in seconds.
    """

    def __init__(self, limit_s: float = EXCESS_LIMIT_S) -> None:
        super().__init__(_is_beyond, limit_s)

    def is_driven(self, goals: Sequence[float], speeds: Sequence[float], time_s: float) -> bool:
        """Return True if any wheel has gone beyond its goal for too long; see `lasts`."""
        return self.lasts(goals, speeds, time_s)


def _is_beyond(goal: float, speed: float) -> bool:
    return not min(goal, 0) - _LEAST_RAW <= speed <= max(goal, 0) + _LEAST_RAW
