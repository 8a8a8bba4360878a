"""Monitors that keep track of the reports to the safety layer.

Times come from outside and are not trusted fully: a time in the future counts as the moment at which the monitor first
sees it, and a time that is not finite is ignored.
"""

import math
from collections.abc import Sequence

from robosc_bridge.devices.interface import BatteryLevel, DriveReading
from robosc_bridge.devices.wheel_following import FollowingMonitor
from robosc_bridge.safety.limits import SafetyLimits

SECTOR_DEG = 30
"""Degrees to both sides of the robot's direction that the scanner must see: its own width, half a metre away."""

REFUSAL_SHOWN_S = 10.0
"""Time for which a person is warned of a reading that was refused, in seconds."""


class Freshness:
    """Age of the last report of one kind.

    Args:
        timeout_s: Age after which the report is stale, in seconds; None: it never is.
    """

    def __init__(self, timeout_s: float | None) -> None:
        self._timeout_s = timeout_s
        self._heard_s: float | None = None

    def update(self, time_s: float) -> None:
        """Note the time of a report."""
        if math.isfinite(time_s):
            self._heard_s = time_s

    def forget(self) -> None:
        """Forget the last report."""
        self._heard_s = None

    def is_stale(self, now_s: float) -> bool:
        """Return True if the last report is too old, or there was none."""
        if self._timeout_s is None:
            return False
        if self._heard_s is None:
            return True
        self._heard_s = min(self._heard_s, now_s)
        return now_s - self._heard_s > self._timeout_s


class ScanCoverageMonitor:
    """Monitor that finds out whether the scanner measures anything in the direction of motion, or something touches.

    Ahead and behind are the sectors of 30 degrees to both sides of the front and of the back.

    Args:
        min_share: Share of valid ranges in a sector, below which the scanner is blind there.
    """

    def __init__(self, min_share: float) -> None:
        self._min_share = min_share
        # No scan, no proof of a missing part of the view.
        self._is_blind_ahead = self._is_blind_behind = False
        self._is_touching_ahead = self._is_touching_behind = False

    def update(self, ranges_m: Sequence[float]) -> None:
        """Record a full scan.

        Args:
            ranges_m: One for each degree, counter-clockwise from the front; 0 where something is nearer than can be
                measured, NaN where nothing valid was measured.
        """
        ahead = (*ranges_m[-SECTOR_DEG:], *ranges_m[: SECTOR_DEG + 1])
        behind = ranges_m[180 - SECTOR_DEG : 180 + SECTOR_DEG + 1]
        self._is_blind_ahead, self._is_blind_behind = self._is_blind(ahead), self._is_blind(behind)
        self._is_touching_ahead, self._is_touching_behind = 0.0 in ahead, 0.0 in behind

    def _is_blind(self, ranges_m: Sequence[float]) -> bool:
        return sum(map(math.isfinite, ranges_m)) < self._min_share * len(ranges_m)

    def is_blind(self, linear_m_s: float) -> bool:
        """Return True if the scanner is blind in the direction of a speed; a rotation on the spot has no direction."""
        return (linear_m_s > 0 and self._is_blind_ahead) or (linear_m_s < 0 and self._is_blind_behind)

    def is_touching(self, linear_m_s: float) -> bool:
        """Return True if something in the direction of a speed is nearer than the scanner can measure."""
        return (linear_m_s > 0 and self._is_touching_ahead) or (linear_m_s < 0 and self._is_touching_behind)


class RefusalMonitor:
    """Monitor of the readings that a drive base has refused, as no body moves like that."""

    def __init__(self) -> None:
        self._refused = 0
        self._refused_s = -math.inf

    def update(self, refused: int, time_s: float) -> None:
        """Record how many have been refused; a smaller number than before begins anew."""
        if refused > self._refused:
            self._refused_s = time_s
        self._refused = refused

    def is_recent(self, now_s: float) -> bool:
        """Return True if one was refused less than `REFUSAL_SHOWN_S` ago; a time in the future counts as now."""
        self._refused_s = min(self._refused_s, now_s)
        return now_s - self._refused_s < REFUSAL_SHOWN_S


class BatteryMonitor:
    """Monitor of the battery, by mean voltages and by the drive base's own judgement.

    The means are of successive times, so that an empty battery is found after two of them at the latest.

    Args:
        limits: The voltages, and the time of a mean.
    """

    def __init__(self, limits: SafetyLimits) -> None:
        self._limits = limits
        self._level: BatteryLevel | None = None
        self._mean_v = math.inf
        self._sum_v = 0.0
        self._count = 0
        self._begin_s = 0.0

    def update(self, voltage_v: float | None, time_s: float, level: BatteryLevel | None = None) -> None:
        """Record a voltage and the drive base's own judgement; None and a voltage that is not finite are ignored."""
        self._level = level or self._level
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
        """True if a person should be warned."""
        warn_v = self._limits.battery_warn_v
        return self._level in (BatteryLevel.LOW, BatteryLevel.EMPTY) or (warn_v is not None and self._mean_v <= warn_v)

    @property
    def is_empty(self) -> bool:
        """True if the robot must stop."""
        stop_v = self._limits.battery_stop_v
        return self._level is BatteryLevel.EMPTY or (stop_v is not None and self._mean_v <= stop_v)


class WheelMonitor:
    """Monitor that finds wheels that are held, rotate without a command, or do not stop.

    Args:
        limits: Largest difference of a wheel from its goal, and longest time of such a difference.

    Attributes:
        is_astray: True if a wheel has been off its goal for too long.
        is_unbidden: True if a wheel has rotated for too long without a command, after all wheels had stood still.
    """

    def __init__(self, limits: SafetyLimits) -> None:
        self._limits = limits
        self._following = FollowingMonitor(limits.astray_s, limits.astray_m_s, math.inf)
        self.forget()

    def forget(self) -> None:
        """Forget how long a wheel has been off its goal."""
        self.is_astray = self.is_unbidden = False
        self._following.forget()
        self._has_rested = False
        self._moving_since_s: float | None = None

    def update(self, goals_m_s: tuple[float, float], reading: DriveReading) -> None:
        """Record a reading of the wheels.

        Args:
            goals_m_s: Goals of the left and the right wheel.
            reading: Reading with the speeds of the wheels, and the acceleration to which their motors are limited.
        """
        self.is_astray = self._following.is_blocked(
            goals_m_s, reading.wheels_m_s, reading.time_s, reading.acceleration_m_s2
        )
        self.is_unbidden = False
        if goals_m_s != (0.0, 0.0):
            self._has_rested = False
        elif self._are_within(reading.wheels_m_s, self._limits.standstill_m_s):
            self._has_rested = True
        if not self._has_rested or self._are_within(reading.wheels_m_s, self._limits.astray_m_s):
            self._moving_since_s = None
        else:
            since_s = self._moving_since_s
            self._moving_since_s = since_s = reading.time_s if since_s is None else min(since_s, reading.time_s)
            self.is_unbidden = reading.time_s - since_s > self._limits.unbidden_s

    @staticmethod
    def _are_within(wheels_m_s: tuple[float, float], limit_m_s: float) -> bool:
        # NaN is not within the limit.
        return all(abs(speed) <= limit_m_s for speed in wheels_m_s)
