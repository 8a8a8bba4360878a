"""Limits that could switch a rule off are refused, all at once."""

import math
from dataclasses import fields, replace
from typing import Any

import pytest

from robosc_bridge.safety import SCAN_TIMEOUTS_S, SafetyLimits
from support.safety import LIMITS

NUMBERS = [each.name for each in fields(SafetyLimits) if not each.name.startswith(("is_", "has_"))]
LONGEST = {
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


def changed(name: str, value: float) -> SafetyLimits:
    changes: dict[str, Any] = {name: value}
    return replace(LIMITS, **changes)


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("value", [0, -1, math.nan, math.inf, -math.inf])
def test_a_number_that_is_none_is_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=rf"{name} must be finite and above 0, not {value}(;|$)"):
        changed(name, value)


def test_the_defaults_are_these() -> None:
    assert SafetyLimits(
        linear_m_s=1, angular_rad_s=1, wheel_m_s=1, separation_m=1, scan_timeout_s=None
    ) == SafetyLimits(
        linear_m_s=1,
        angular_rad_s=1,
        wheel_m_s=1,
        separation_m=1,
        scan_timeout_s=None,
        linear_acceleration_m_s2=1.0,
        linear_deceleration_m_s2=2.5,
        angular_acceleration_rad_s2=6.0,
        angular_deceleration_rad_s2=10.0,
        command_timeout_s=0.3,
        motor_timeout_s=0.2,
        motor_failures=3,
        loop_timeout_s=0.1,
        pause_s=0.5,
        operator_timeout_s=None,
        battery_warn_v=None,
        battery_stop_v=None,
        battery_mean_s=2.0,
        astray_m_s=0.02,
        astray_s=0.8,
        unbidden_s=0.5,
        torque_on_s=2.0,
        torque_off_s=1.0,
        standstill_m_s=0.01,
        min_valid_share=0.05,
        has_own_controls=False,
        is_torque_off_on_operator_stop=False,
        is_stopped_when_blind=True,
    )
    assert SCAN_TIMEOUTS_S == {"lds01": 0.6, "lds02": 0.5, "lds03": 0.3}


@pytest.mark.parametrize(("name", "longest"), LONGEST.items())
def test_a_time_has_a_longest_value(name: str, longest: float) -> None:
    assert getattr(changed(name, longest), name) == longest
    beyond = math.nextafter(longest, math.inf)
    with pytest.raises(ValueError, match=f"^{name} must be at most {longest:g}, not {beyond}$"):
        changed(name, beyond)


@pytest.mark.parametrize(
    ("name", "shortest"),
    [
        ("command_timeout_s", 0.02),
        ("scan_timeout_s", 0.05),
        ("motor_timeout_s", 0.06),
        ("loop_timeout_s", 0.005),
        ("operator_timeout_s", 0.1),
    ],
)
def test_a_time_that_would_always_be_over_is_refused(name: str, shortest: float) -> None:
    assert getattr(changed(name, shortest), name) == shortest
    below = math.nextafter(shortest, 0)
    with pytest.raises(ValueError, match=f"^{name} must be at least {shortest:g}, not {below}$"):
        changed(name, below)


def test_a_share_is_at_most_all() -> None:
    assert changed("min_valid_share", 1.0).min_valid_share == 1.0
    beyond = math.nextafter(1.0, 2.0)
    with pytest.raises(ValueError, match=f"^min_valid_share must be at most 1, not {beyond}$"):
        changed("min_valid_share", beyond)


@pytest.mark.parametrize(
    ("name", "other"),
    [
        ("linear_deceleration_m_s2", "linear_acceleration_m_s2"),
        ("angular_deceleration_rad_s2", "angular_acceleration_rad_s2"),
        ("battery_warn_v", "battery_stop_v"),
    ],
)
def test_what_belongs_together_is_consistent(name: str, other: str) -> None:
    value = getattr(LIMITS, other)
    assert getattr(changed(name, value), name) == value
    below = math.nextafter(value, 0)
    with pytest.raises(ValueError, match=rf"^{name} \({below}\) must not be below {other} \({value}\)$"):
        changed(name, below)


def test_only_scanner_operator_and_battery_may_be_missing() -> None:
    assert replace(LIMITS, scan_timeout_s=None, operator_timeout_s=None).scan_timeout_s is None
    # Each of the two is free of the other.
    assert replace(LIMITS, battery_warn_v=None).battery_stop_v == 11.1
    assert replace(LIMITS, battery_stop_v=None, battery_warn_v=3.0).battery_warn_v == 3.0
    with pytest.raises(TypeError, match="scan_timeout_s"):
        SafetyLimits(linear_m_s=1, angular_rad_s=1, wheel_m_s=1, separation_m=1)  # type: ignore[call-arg]


def test_all_problems_are_reported_at_once() -> None:
    wrong: dict[str, Any] = {"linear_m_s": 0, "torque_off_s": 300, "battery_warn_v": 11, "min_valid_share": 5}
    with pytest.raises(ValueError, match=r"^linear_m_s .*; torque_off_s .*; min_valid_share .*; battery_warn_v .*$"):
        replace(LIMITS, **wrong)
