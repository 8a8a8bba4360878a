"""The numbers of the safety layer: their defaults and their bounds.

The configuration, its schema, its page and the template of `robosc-bridge init` take them from here.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from types import MappingProxyType

REVOLUTIONS = 3
"""Revolutions of a scanner without a full scan after which it counts as silent."""

SCAN_TIMEOUT_S = 0.6
"""Time after which a scanner counts as silent whose driver does not state the time of a revolution, in seconds."""

SCAN_TIMEOUTS_S: Mapping[str, float] = MappingProxyType({"lds01": 0.6, "lds02": 0.5, "lds03": 0.3})
"""Time after which a scanner counts as silent, by its driver's name: three revolutions, in seconds."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """Bounds of a number.

    Attributes:
        least: Smallest value; None: any above 0.
        most: Largest value; None: any finite one.
    """

    least: float | None = None
    most: float | None = None

    def problem(self, value: float) -> str:
        """Return the condition that the value violates; empty: it is within the bounds."""
        if not (math.isfinite(value) and value > 0):
            return "must be finite and above 0"
        if self.least is not None and value < self.least:
            return f"must be at least {self.least:g}"
        return f"must be at most {self.most:g}" if self.most is not None and value > self.most else ""


# A time that was meant in milliseconds, or is as long as a journey, must not switch a rule off.
BOUNDS: Mapping[str, Bounds] = MappingProxyType(
    {
        "linear_m_s": Bounds(most=5),
        "angular_rad_s": Bounds(most=20),
        "linear_acceleration_m_s2": Bounds(most=50),
        "linear_deceleration_m_s2": Bounds(most=50),
        "angular_acceleration_rad_s2": Bounds(most=200),
        "angular_deceleration_rad_s2": Bounds(most=200),
        "command_timeout_s": Bounds(0.02, 1),
        "scan_timeout_s": Bounds(0.05, 2),
        "motor_timeout_s": Bounds(0.06, 1),
        "loop_timeout_s": Bounds(0.005, 2),
        "pause_s": Bounds(most=2),
        "operator_timeout_s": Bounds(0.1, 10),
        "battery_warn_v": Bounds(most=100),
        "battery_stop_v": Bounds(most=100),
        "battery_mean_s": Bounds(most=10),
        "astray_s": Bounds(most=5),
        "unbidden_s": Bounds(most=5),
        "torque_on_s": Bounds(most=10),
        "torque_off_s": Bounds(most=5),
        "min_valid_share": Bounds(most=1),
    }
)
"""Bounds of the numbers that a configuration may set, and of the times; the others are above 0 and finite."""

_NOT_BELOW = (
    ("linear_deceleration_m_s2", "linear_acceleration_m_s2"),
    ("angular_deceleration_rad_s2", "angular_acceleration_rad_s2"),
    ("battery_warn_v", "battery_stop_v"),
)
_MAY_BE_NONE = ("scan_timeout_s", "operator_timeout_s", "battery_warn_v", "battery_stop_v")


@dataclass(frozen=True, kw_only=True)
class SafetyLimits:
    """Limits of the velocities that the safety layer lets pass, and times after which it stops the robot.

    Attributes:
        linear_m_s: Fastest speed forward and backward.
        angular_rad_s: Fastest rotation.
        wheel_m_s: Highest speed of a wheel; if one would be faster, both are slowed by the same factor, which keeps the
            curvature.
        separation_m: Distance between the wheels' middles.
        scan_timeout_s: Longest time without a full scan (`SCAN_TIMEOUTS_S`); None: no scanner is needed. There is no
            default, so that the scanner cannot be forgotten.
        linear_acceleration_m_s2: Acceleration away from standstill.
        linear_deceleration_m_s2: Deceleration towards standstill. A command of zero passes at once.
        angular_acceleration_rad_s2: Acceleration away from standstill.
        angular_deceleration_rad_s2: Deceleration towards standstill.
        command_timeout_s: Time for which a command to move holds.
        motor_timeout_s: Longest time without a reading of the drive base, and for which an output holds.
        motor_failures: Number of failed exchanges in a row that count as silence, too.
        loop_timeout_s: Longest time between two cycles of the supervisor's loop.
        pause_s: Longest time in which neither the drive base's thread nor the loop runs while the motors hold.
        operator_timeout_s: Longest time without a sign of life of an operator; None: none is needed.
        battery_warn_v: Mean voltage at and below which the safety layer warns; None: only the drive base's own
            judgement of its battery counts.
        battery_stop_v: Mean voltage at and below which it stops the robot; None: likewise.
        battery_mean_s: Time over which the mean is taken, so that a short dip does not stop the robot.
        astray_m_s: Difference from its goal above which a wheel is astray, if it is also more than half of the goal.
        astray_s: Longest time that a wheel may be astray.
        unbidden_s: Longest time that a wheel may rotate faster than `astray_m_s`, after all wheels have stood still and
            without a command since.
        torque_on_s: Longest time that the motors take to hold.
        torque_off_s: Longest wait for the wheels to stand still before torque goes off.
        standstill_m_s: Fastest speed of a wheel that counts as standstill.
        min_valid_share: Smallest share of valid ranges in the direction of motion in a full scan, at most 1; with a
            smaller share, the scanner is blind in that direction.
        has_own_controls: True if the drive base has controls of its own that move the wheels while torque is on.
        is_torque_off_on_operator_stop: True if an operator's stop also switches torque off.
        is_stopped_when_blind: True if the robot may not move in a direction in which the scanner is blind, as if there
            were an obstacle; False: it may, with a warning.

    Raises:
        ValueError: A number is not finite, not within its bounds or inconsistent with another; all of them are
            listed.
    """

    linear_m_s: float
    angular_rad_s: float
    wheel_m_s: float
    separation_m: float
    scan_timeout_s: float | None
    linear_acceleration_m_s2: float = 1.0
    linear_deceleration_m_s2: float = 2.5
    angular_acceleration_rad_s2: float = 6.0
    angular_deceleration_rad_s2: float = 10.0
    command_timeout_s: float = 0.3
    motor_timeout_s: float = 0.2
    motor_failures: int = 3
    loop_timeout_s: float = 0.1
    pause_s: float = 0.5
    operator_timeout_s: float | None = None
    battery_warn_v: float | None = None
    battery_stop_v: float | None = None
    battery_mean_s: float = 2.0
    astray_m_s: float = 0.02
    astray_s: float = 0.8
    unbidden_s: float = 0.5
    torque_on_s: float = 2.0
    torque_off_s: float = 1.0
    standstill_m_s: float = 0.01
    min_valid_share: float = 0.05
    has_own_controls: bool = False
    is_torque_off_on_operator_stop: bool = False
    is_stopped_when_blind: bool = True

    def __post_init__(self) -> None:
        values: dict[str, float] = {
            each.name: getattr(self, each.name) for each in fields(self) if not each.name.startswith(("is_", "has_"))
        }
        for name in _MAY_BE_NONE:
            if values[name] is None:
                del values[name]
        problems = [
            f"{name} {problem}, not {value}"
            for name, value in values.items()
            if (problem := BOUNDS.get(name, Bounds()).problem(value))
        ]
        problems += [
            f"{name} ({values[name]}) must not be below {other} ({values[other]})"
            for name, other in _NOT_BELOW
            if name in values and other in values and values[name] < values[other]
        ]
        if problems:
            raise ValueError("; ".join(problems))
