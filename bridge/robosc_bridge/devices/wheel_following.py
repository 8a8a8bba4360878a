"""Monitors of whether the wheels follow their commands, and nothing but these."""

from collections.abc import Callable, Sequence

_LEAST_RAW = 20
_SHARE = 0.5


class _LastingMonitor:
    """Finds a wheel for which something is so in all readings of longer than a limit.

    Args:
        is_so: Function that returns, of the goal and the velocity of a wheel, whether it is so now.
        limit_s: Time limit, in seconds.
    """

    def __init__(self, is_so: Callable[[int, int], bool], limit_s: float) -> None:
        self._is_so = is_so
        self._limit_s = limit_s
        self._since_s: list[float | None] = []
        self._time_s = 0.0

    def forget(self) -> None:
        """Begin anew: nothing is asked of the wheels."""
        self._since_s = []

    def lasts(self, goals_raw: Sequence[int], velocities_raw: Sequence[int], time_s: float) -> bool:
        """Return True if it has been so for any wheel in all readings of longer than the limit.

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
            if not self._is_so(goal, velocity):
                self._since_s[index] = None
            elif self._since_s[index] is None:
                self._since_s[index] = time_s
        return any(since_s is not None and time_s - since_s > self._limit_s for since_s in self._since_s)


class FollowingMonitor(_LastingMonitor):
    """Finds a wheel that is held, rotates by itself, or has refused its goal without a word.

    Args:
        limit_s: For how long a wheel may be far from its goal.
    """

    def __init__(self, limit_s: float = 0.7) -> None:
        super().__init__(_is_far, limit_s)

    def is_blocked(self, goals_raw: Sequence[int], velocities_raw: Sequence[int], time_s: float) -> bool:
        """Return True if any wheel has been far from its goal for too long; see `lasts`."""
        return self.lasts(goals_raw, velocities_raw, time_s)


class ExcessMonitor(_LastingMonitor):
    """Finds a wheel that something else drives, too: it is faster than its goal, or rotates the other way.

    Args:
        limit_s: For how long a wheel may be so, as one that is braking.
    """

    def __init__(self, limit_s: float = 0.5) -> None:
        super().__init__(_is_beyond, limit_s)

    def is_driven(self, goals_raw: Sequence[int], velocities_raw: Sequence[int], time_s: float) -> bool:
        """Return True if any wheel has gone beyond its goal for too long; see `lasts`."""
        return self.lasts(goals_raw, velocities_raw, time_s)


def _is_far(goal_raw: int, velocity_raw: int) -> bool:
    return abs(goal_raw - velocity_raw) > max(_LEAST_RAW, _SHARE * abs(goal_raw))


def _is_beyond(goal_raw: int, velocity_raw: int) -> bool:
    return not min(goal_raw, 0) - _LEAST_RAW <= velocity_raw <= max(goal_raw, 0) + _LEAST_RAW
