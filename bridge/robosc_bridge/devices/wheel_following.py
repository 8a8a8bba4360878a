"""Monitor of whether the wheels follow their commands."""

from collections.abc import Sequence

_LEAST_RAW = 20
_SHARE = 0.5


class FollowingMonitor:
    """Finds a wheel that is held, rotates by itself, or has refused its goal without a word.

    Args:
        limit_s: For how long a wheel may be far from its goal.
    """

    def __init__(self, limit_s: float = 0.7) -> None:
        self._limit_s = limit_s
        self._since_s: list[float | None] = []
        self._time_s = 0.0

    def forget(self) -> None:
        """Begin anew: nothing is asked of the wheels."""
        self._since_s = []

    def is_blocked(self, goals_raw: Sequence[int], velocities_raw: Sequence[int], time_s: float) -> bool:
        """Return True if any wheel has been far from its goal in all readings of longer than the limit.

        After a pause it begins anew: what the wheels did meanwhile is not known.

        Args:
            goals_raw: Goal of each wheel.
            velocities_raw: Velocity that each wheel has.
            time_s: Time when they were read, in seconds.
        """
        if not self._since_s or time_s - self._time_s > self._limit_s / 2:
            self._since_s = [None] * len(goals_raw)
        self._time_s = time_s
        for index, (goal, velocity) in enumerate(zip(goals_raw, velocities_raw, strict=True)):
            if abs(goal - velocity) <= max(_LEAST_RAW, _SHARE * abs(goal)):
                self._since_s[index] = None
            elif self._since_s[index] is None:
                self._since_s[index] = time_s
        return any(since_s is not None and time_s - since_s > self._limit_s for since_s in self._since_s)
