"""Monitor of whether the wheels follow their commands: that of the drivers, and that of the safety layer.

A driver knows what it told its motors, in their units, and names the fault; the safety layer believes no driver, and
looks again. The rule stands here alone.
"""

import math
from collections.abc import Sequence

FOLLOWING_LIMIT_S = 0.7
"""Longest time that a wheel may be far from its goal, as drivers see it: before the safety layer does."""

SHARE = 0.5
"""Share of its goal by which a wheel is far from it, at least."""

_LEAST_RAW = 20


class FollowingMonitor:
    """Finds a wheel that is held, rotates by itself, or has refused its goal without a word.

    Args:
        limit_s: Longest time that a wheel may be far from its goal.
        least: Difference that is never far, in the unit of the speeds.
        longest_gap_s: Longest time between two readings; after a longer one it begins anew, as what the wheels did
            meanwhile is not known. None: half of `limit_s`; infinite: it goes on.
    """

    def __init__(
        self, limit_s: float = FOLLOWING_LIMIT_S, least: float = _LEAST_RAW, longest_gap_s: float | None = None
    ) -> None:
        self._limit_s = limit_s
        self._least = least
        self._longest_gap_s = limit_s / 2 if longest_gap_s is None else longest_gap_s
        self._since_s: list[float | None] = []
        self._goals: list[float] = []
        self._time_s = 0.0

    def forget(self) -> None:
        """Begin anew: nothing is asked of the wheels."""
        self._since_s = []

    def is_blocked(
        self, goals: Sequence[float], speeds: Sequence[float], time_s: float, ramp: float | None = None
    ) -> bool:
        """Return True if any wheel has been far from its goal in all readings of longer than the limit.

        Args:
            goals: Goal of each wheel.
            speeds: Speed of each wheel; what is not a number is far from any goal.
            time_s: Time when they were read, in seconds; where it goes back, the time off begins anew.
            ramp: Acceleration with which the motors go to a goal, in the unit of the speeds a second: what they are
                compared with goes there as well. None: they go there as fast as they can.
        """
        if not self._since_s or time_s - self._time_s > self._longest_gap_s:
            self._since_s = [None] * len(goals)
            self._goals = [speed if math.isfinite(speed) else 0.0 for speed in speeds]
            self._time_s = time_s
        step = math.inf if ramp is None else ramp * max(time_s - self._time_s, 0.0)
        self._time_s = time_s
        self._goals = [
            goal if abs(goal - now) <= step else now + math.copysign(step, goal - now)
            for goal, now in zip(goals, self._goals, strict=True)
        ]
        for index, (goal, speed) in enumerate(zip(self._goals, speeds, strict=True)):
            since_s = self._since_s[index]
            if abs(goal - speed) <= max(self._least, SHARE * abs(goal)):
                self._since_s[index] = None
            else:
                self._since_s[index] = time_s if since_s is None else min(since_s, time_s)
        return any(since_s is not None and time_s - since_s > self._limit_s for since_s in self._since_s)
