"""Monitors that check whether the wheels follow their commands and no others, for the drivers and the safety layer.

A driver knows the commands to its motors, in their units, and names the fault; the safety layer trusts no driver and
checks again. Both use the rules of this module.
"""

import math
from collections.abc import Iterable, Sequence

FOLLOWING_LIMIT_S = 0.7
"""Longest time that a wheel may be far from its goal, as drivers see it: before the safety layer does."""

SHARE = 0.5
"""Share of its goal by which a wheel is far from it, at least."""

_LEAST_RAW = 20


class _LastingMonitor:
    """Finds a wheel for which something is so in all readings of longer than a limit.

    Args:
        limit_s: Time limit, in seconds.
        longest_gap_s: Longest time between two readings; after a longer one it begins anew, as what the wheels did
            meanwhile is not known. None: half of `limit_s`; infinite: it goes on.
    """

    def __init__(self, limit_s: float, longest_gap_s: float | None = None) -> None:
        self._limit_s = limit_s
        self._longest_gap_s = limit_s / 2 if longest_gap_s is None else longest_gap_s
        self._since_s: list[float | None] = []
        self._time_s = 0.0

    def forget(self) -> None:
        """Begin anew, when nothing is commanded to the wheels."""
        self._since_s = []

    def _begins(self, count: int, time_s: float) -> bool:
        """Return True if a reading of so many wheels is the first one."""
        if self._since_s and time_s - self._time_s <= self._longest_gap_s:
            return False
        self._since_s = [None] * count
        self._time_s = time_s
        return True

    def _lasts(self, are_so: Iterable[bool], time_s: float) -> bool:
        """Return True if it has been so for any wheel for too long; where time goes back, it begins anew."""
        self._time_s = time_s
        for index, is_so in enumerate(are_so):
            since_s = self._since_s[index]
            self._since_s[index] = None if not is_so else time_s if since_s is None else min(since_s, time_s)
        return any(since_s is not None and time_s - since_s > self._limit_s for since_s in self._since_s)


class FollowingMonitor(_LastingMonitor):
    """Monitor that finds a wheel that is held, rotates without a command, or has silently refused its goal.

    Args:
        limit_s: Longest time that a wheel may be far from its goal.
        least: Difference that is never far, in the unit of the speeds.
        longest_gap_s: Longest time between two readings, as of a `_LastingMonitor`.
    """

    def __init__(
        self, limit_s: float = FOLLOWING_LIMIT_S, least: float = _LEAST_RAW, longest_gap_s: float | None = None
    ) -> None:
        super().__init__(limit_s, longest_gap_s)
        self._least = least
        self._goals: list[float] = []

    def is_blocked(
        self, goals: Sequence[float], speeds: Sequence[float], time_s: float, ramp: float | None = None
    ) -> bool:
        """Return True if any wheel has been far from its goal in all readings of longer than the limit.

        Args:
            goals: Goal of each wheel.
            speeds: Speed of each wheel; what is not a number is far from any goal.
            time_s: Time when they were read, in seconds.
            ramp: Acceleration with which the motors go to a goal, in the unit of the speeds a second: the speeds are
                compared with a ramp of this slope. None: the motors go to the goal as fast as they can.
        """
        if self._begins(len(goals), time_s):
            self._goals = [speed if math.isfinite(speed) else 0.0 for speed in speeds]
        step = math.inf if ramp is None else ramp * max(time_s - self._time_s, 0.0)
        self._goals = [
            goal if abs(goal - now) <= step else now + math.copysign(step, goal - now)
            for goal, now in zip(goals, self._goals, strict=True)
        ]
        are_far = [
            not abs(goal - speed) <= max(self._least, SHARE * abs(goal))
            for goal, speed in zip(self._goals, speeds, strict=True)
        ]
        return self._lasts(are_far, time_s)


class ExcessMonitor(_LastingMonitor):
    """Monitor that finds a wheel that is driven by others, too: faster than its goal, or in the opposite direction.

    Args:
        limit_s: Longest time that a wheel may rotate like this, since a braking wheel does so for a while.
    """

    def __init__(self, limit_s: float = 0.5) -> None:
        super().__init__(limit_s)

    def is_driven(self, goals_raw: Sequence[int], velocities_raw: Sequence[int], time_s: float) -> bool:
        """Return True if any wheel has gone beyond its goal in all readings of longer than the limit."""
        self._begins(len(goals_raw), time_s)
        return self._lasts(map(_is_beyond, goals_raw, velocities_raw), time_s)


def _is_beyond(goal_raw: int, velocity_raw: int) -> bool:
    return not min(goal_raw, 0) - _LEAST_RAW <= velocity_raw <= max(goal_raw, 0) + _LEAST_RAW
