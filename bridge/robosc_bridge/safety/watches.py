"""What the safety layer remembers of what was reported to it.

Times come from outside and are believed in one direction only: a time in the future counts as the moment in which it is
first looked at, and one that is no time is not heard.
"""

import math

from robosc_bridge.safety.limits import SafetyLimits


class Freshness:
    """How long ago something was heard of.

    Args:
        timeout_s: After how long it is stale; None: it never is.
    """

    def __init__(self, timeout_s: float | None) -> None:
        self._timeout_s = timeout_s
        self._heard_s: float | None = None

    def hear(self, time_s: float) -> None:
        """It was heard of then."""
        if math.isfinite(time_s):
            self._heard_s = time_s

    def is_stale(self, now_s: float) -> bool:
        """Whether that is too long ago, or never was."""
        if self._timeout_s is None:
            return False
        if self._heard_s is None:
            return True
        self._heard_s = min(self._heard_s, now_s)
        return now_s - self._heard_s > self._timeout_s


class BatteryWatch:
    """Mean voltages of times that follow each other, so that two of them at the latest tell of an empty battery.

    Args:
        limits: The voltages, and the time of a mean.
    """

    def __init__(self, limits: SafetyLimits) -> None:
        self._limits = limits
        self._mean_v = math.inf
        self._sum_v = 0.0
        self._count = 0
        self._begin_s = 0.0

    def hear(self, voltage_v: float | None, time_s: float) -> None:
        """A voltage was measured; None and what is not finite tell nothing."""
        if voltage_v is None or not math.isfinite(voltage_v) or not math.isfinite(time_s):
            return
        if not self._count or time_s < self._begin_s:
            self._sum_v, self._count, self._begin_s = 0.0, 0, time_s
        self._sum_v += voltage_v
        self._count += 1
        if time_s - self._begin_s >= self._limits.battery_mean_s:
            self._mean_v = self._sum_v / self._count
            self._count = 0

    @property
    def is_near_empty(self) -> bool:
        """Whether a person should be told."""
        return self._mean_v <= self._limits.battery_warn_v

    @property
    def is_empty(self) -> bool:
        """Whether the robot must stop."""
        return self._mean_v <= self._limits.battery_stop_v


class WheelWatch:
    """Finds wheels that are held, turn by themselves, or do not stop.

    Args:
        limits: How far off a wheel may be, and for how long.
    """

    def __init__(self, limits: SafetyLimits) -> None:
        self._limits = limits
        self._since_s: float | None = None

    def forget(self) -> None:
        """Nothing is asked of the wheels."""
        self._since_s = None

    def is_astray(self, goals_m_s: tuple[float, float], wheels_m_s: tuple[float, float], time_s: float) -> bool:
        """Whether some wheel has been off its goal for too long.

        Args:
            goals_m_s: Of the left and the right wheel.
            wheels_m_s: What they do.
            time_s: When that was measured.
        """
        if self._follows(goals_m_s[0], wheels_m_s[0]) and self._follows(goals_m_s[1], wheels_m_s[1]):
            self._since_s = None
            return False
        self._since_s = time_s if self._since_s is None else min(self._since_s, time_s)
        return time_s - self._since_s > self._limits.astray_s

    def _follows(self, goal_m_s: float, speed_m_s: float) -> bool:
        # What is not a number does not follow.
        return abs(goal_m_s - speed_m_s) <= max(self._limits.astray_m_s, abs(goal_m_s) / 2)
