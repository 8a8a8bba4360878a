"""The numbers of the safety layer."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from types import MappingProxyType

SCAN_TIMEOUTS_S: Mapping[str, float] = MappingProxyType({"lds01": 0.6, "lds02": 0.5, "lds03": 0.3})
"""After how long a scanner counts as silent: three revolutions, by its driver's name."""

# A time that was meant in milliseconds, or is as long as a journey, must not switch a rule off.
_LONGEST_S = {
    "command_timeout_s": 1.0,
    "scan_timeout_s": 2.0,
    "motor_timeout_s": 1.0,
    "loop_timeout_s": 2.0,
    "pause_s": 2.0,
    "operator_timeout_s": 10.0,
    "battery_mean_s": 10.0,
    "astray_s": 5.0,
    "torque_on_s": 10.0,
    "torque_off_s": 5.0,
}
_NOT_BELOW = (
    ("linear_deceleration_m_s2", "linear_acceleration_m_s2"),
    ("angular_deceleration_rad_s2", "angular_acceleration_rad_s2"),
    ("battery_warn_v", "battery_stop_v"),
)


@dataclass(frozen=True, kw_only=True)
class SafetyLimits:
    """Limits of what the safety layer lets pass, and times after which it stops the robot.

    Attributes:
        linear_m_s: Fastest speed forward and backward.
        angular_rad_s: Fastest rotation.
        wheel_m_s: Fastest wheel; where one would be faster, both are slowed alike, so that the curvature stays.
        separation_m: Distance between the wheels' middles.
        scan_timeout_s: Longest time without a full scan (`SCAN_TIMEOUTS_S`); None: no scanner is needed. It has no
            default, so that nobody forgets the scanner.
        linear_acceleration_m_s2: Acceleration away from standstill.
        linear_deceleration_m_s2: Deceleration towards standstill. A command of zero passes at once.
        angular_acceleration_rad_s2: Acceleration away from standstill.
        angular_deceleration_rad_s2: Deceleration towards standstill.
        command_timeout_s: Time for which a command to move holds.
        motor_timeout_s: Longest time without a reading of the drive base.
        motor_failures: Number of failed exchanges in a row that count as silence, too.
        loop_timeout_s: Longest time between two cycles of the supervisor's loop.
        pause_s: Longest time in which neither the drive base's thread nor the loop turns while the motors hold.
        operator_timeout_s: Longest time without a sign of the operator; None: none is needed.
        battery_warn_v: Mean voltage at and below which the safety layer warns.
        battery_stop_v: Mean voltage at and below which it stops the robot.
        battery_mean_s: Time that a mean is made of, so that a dip stops nothing.
        astray_m_s: Difference from its goal above which a wheel is astray, if it is also more than half of the goal.
        astray_s: Longest time that a wheel may be astray.
        torque_on_s: Longest time that the motors take to hold.
        torque_off_s: Longest wait for the wheels to stand still before torque goes off.
        standstill_m_s: Fastest speed of a wheel that counts as standstill.
        min_valid_share: Smallest share of the scanner's ranges where the robot goes that must be valid in a full
            scan; with a smaller one, the scanner sees nothing there; at most 1.
        is_torque_off_on_operator_stop: True if an operator's stop wants torque off, too.
        is_stopped_when_blind: True if the robot may not go where the scanner sees nothing; else a person is informed.

    Raises:
        ValueError: A number is not finite, not above 0, too large or inconsistent with another; all of them are
            listed.
    """

    linear_m_s: float
    angular_rad_s: float
    wheel_m_s: float
    separation_m: float
    scan_timeout_s: float | None
    linear_acceleration_m_s2: float = 1.0
    linear_deceleration_m_s2: float = 2.5
    angular_acceleration_rad_s2: float = 4.0
    angular_deceleration_rad_s2: float = 10.0
    command_timeout_s: float = 0.3
    motor_timeout_s: float = 0.2
    motor_failures: int = 3
    loop_timeout_s: float = 0.2
    pause_s: float = 0.5
    operator_timeout_s: float | None = None
    battery_warn_v: float = 11.5
    battery_stop_v: float = 11.1
    battery_mean_s: float = 2.0
    astray_m_s: float = 0.02
    astray_s: float = 0.8
    torque_on_s: float = 2.0
    torque_off_s: float = 1.0
    standstill_m_s: float = 0.01
    min_valid_share: float = 0.05
    is_torque_off_on_operator_stop: bool = False
    is_stopped_when_blind: bool = False

    def __post_init__(self) -> None:
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        del values["is_torque_off_on_operator_stop"], values["is_stopped_when_blind"]
        for name in ("scan_timeout_s", "operator_timeout_s"):
            if values[name] is None:
                del values[name]
        problems = [
            f"{name} must be finite and above 0, not {value}"
            for name, value in values.items()
            if not (math.isfinite(value) and value > 0)
        ]
        problems += [
            f"{name} must be at most {longest} s, not {values[name]}"
            for name, longest in _LONGEST_S.items()
            if name in values and values[name] > longest
        ]
        problems += [
            f"{name} ({values[name]}) must not be below {other} ({values[other]})"
            for name, other in _NOT_BELOW
            if values[name] < values[other]
        ]
        if self.min_valid_share > 1:
            problems.append(f"min_valid_share must be at most 1, not {self.min_valid_share}")
        if problems:
            raise ValueError("; ".join(problems))
