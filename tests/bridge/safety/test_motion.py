"""Velocities, dense around each limit."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.devices.interface import STANDSTILL, Velocity
from robosc_bridge.safety.motion import ramped, wheels, within
from support.safety import LIMITS, near

ROOMY = replace(LIMITS, wheel_m_s=10.0)
ANY = st.floats(allow_nan=False)
INSIDE = st.builds(lambda v, w: within(Velocity(v, w), LIMITS), st.floats(-0.3, 0.3), st.floats(-3, 3))


def around(limit: float) -> list[float]:
    """Values at a limit, one step of a float and one thousandth beside it, far beyond, and both signs."""
    near = [0.0, limit / 2, limit * 0.999, math.nextafter(limit, 0), limit, math.nextafter(limit, 9), limit * 1.001]
    return [sign * value for value in [*near, limit * 1e6, 1e308, math.inf, 10**400] for sign in (1, -1)]


@pytest.mark.parametrize("value", around(ROOMY.linear_m_s))
def test_linear_speed_is_clamped(value: float) -> None:
    expected = value if abs(value) <= 0.2 else math.copysign(0.2, 1 if value > 0 else -1)
    assert within(Velocity(value, 0.0), ROOMY) == Velocity(expected, 0.0)


@pytest.mark.parametrize("value", around(ROOMY.angular_rad_s))
def test_angular_speed_is_clamped(value: float) -> None:
    expected = value if abs(value) <= 2.0 else math.copysign(2.0, 1 if value > 0 else -1)
    assert within(Velocity(0.1, value), ROOMY) == Velocity(0.1, expected)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("turn", [1, -1])
def test_a_wheel_that_would_be_too_fast_slows_both_alike(sign: int, turn: int) -> None:
    # 0.12 + 1 * 0.08 is 0.2 exactly at the wheel.
    assert within(Velocity(sign * 0.12, turn * 1.0), LIMITS) == Velocity(sign * 0.12, turn * 1.0)
    found = within(Velocity(sign * 0.2, turn * 2.0), LIMITS)
    assert found.linear_m_s == pytest.approx(sign * 0.2 / 1.8, rel=1e-15)
    assert found.angular_rad_s == pytest.approx(turn * 2.0 / 1.8, rel=1e-15)
    assert max(map(abs, wheels(found, LIMITS))) == pytest.approx(0.2, rel=1e-15)


def test_what_fits_is_not_touched() -> None:
    assert within(Velocity(0.2, 0.0), LIMITS) == Velocity(0.2, 0.0)
    tight = replace(LIMITS, wheel_m_s=0.25, separation_m=0.25, linear_m_s=1.0)
    assert within(Velocity(0.125, 1.0), tight) == Velocity(0.125, 1.0)  # exactly at the limit of the wheel


@given(ANY, ANY)
def test_nothing_is_beyond_any_limit(linear_m_s: float, angular_rad_s: float) -> None:
    found = within(Velocity(linear_m_s, angular_rad_s), LIMITS)
    assert abs(found.linear_m_s) <= LIMITS.linear_m_s
    assert abs(found.angular_rad_s) <= LIMITS.angular_rad_s
    assert max(map(abs, wheels(found, LIMITS))) <= LIMITS.wheel_m_s * (1 + 1e-12)


def test_wheels_of_a_worked_example() -> None:
    # Burger, 0.10 m/s and 0.5 rad/s: left 0.06 m/s, right 0.14 m/s.
    assert wheels(Velocity(0.10, 0.5), LIMITS) == pytest.approx((0.06, 0.14))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("present", "wanted", "after"),
    [
        (0.0, 0.1, 0.02),  # 1 m/s2 for 20 ms
        (0.0, 0.02, 0.02),
        (0.0, math.nextafter(0.02, 0), math.nextafter(0.02, 0)),
        (0.0, math.nextafter(0.02, 1), 0.02),
        (0.05, 0.1, 0.07),
        (0.1, 0.1, 0.1),
        (0.1, 0.0, 0.05),  # 2.5 m/s2
        (0.1, 0.05, 0.05),
        (0.1, 0.06, 0.06),
        (0.1, 0.01, 0.05),
        (0.05, 0.0, 0.0),
        (0.03, 0.0, 0.0),
        (0.1, -0.1, 0.05),
        (0.05, -0.1, 0.0),  # a change of direction passes standstill
        (0.01, -0.1, 0.0),
        (0.0, -0.1, -0.02),
        (0.0, 0.0, 0.0),
    ],
)
def test_steps_of_the_linear_part(sign: int, present: float, wanted: float, after: float) -> None:
    found = ramped(Velocity(sign * present), Velocity(sign * wanted), LIMITS, 0.02)
    assert found.linear_m_s == pytest.approx(sign * after, abs=1e-15)
    assert found.angular_rad_s == 0.0
    # The other part has accelerations of its own: four times as large, here.
    turned = ramped(Velocity(0.0, sign * present * 4), Velocity(0.0, sign * wanted * 4), LIMITS, 0.02)
    assert turned.angular_rad_s == pytest.approx(sign * after * 4, abs=1e-15)
    assert turned.linear_m_s == 0.0


def test_braking_does_not_wait_for_the_turn() -> None:
    found = ramped(Velocity(0.2, 0.0), Velocity(0.0, 2.0), LIMITS, 0.02)
    assert found == near(0.15, 0.08)


def test_on_the_way_no_wheel_is_too_fast() -> None:
    found = ramped(Velocity(0.2, 0.0), Velocity(0.19, 0.1), LIMITS, 0.02)
    assert found == near(0.19, 0.08)
    found = ramped(Velocity(0.15, 0.5), Velocity(0.16, 0.5), replace(LIMITS, wheel_m_s=0.19), 0.02)
    assert found == near(0.152, 0.475)


@given(INSIDE, INSIDE, st.floats(0, 0.3))
def test_no_step_speeds_up_beyond_the_acceleration(present: Velocity, wanted: Velocity, step_s: float) -> None:
    found = ramped(present, wanted, LIMITS, step_s)
    rates = [
        (present.linear_m_s, wanted.linear_m_s, found.linear_m_s, LIMITS.linear_acceleration_m_s2),
        (present.angular_rad_s, wanted.angular_rad_s, found.angular_rad_s, LIMITS.angular_acceleration_rad_s2),
    ]
    for before, aim, after, rate in rates:
        assert abs(after) <= abs(before) + rate * step_s + 1e-12
        assert after * before >= 0
        assert min(before, aim, 0.0) - 1e-12 <= after <= max(before, aim, 0.0) + 1e-12
    assert max(map(abs, wheels(found, LIMITS))) <= LIMITS.wheel_m_s * (1 + 1e-12)


@given(INSIDE, INSIDE)
def test_no_time_is_no_step_and_enough_time_is_all_of_it(present: Velocity, wanted: Velocity) -> None:
    found = ramped(present, wanted, LIMITS, 0.0)
    assert found == near(present.linear_m_s, present.angular_rad_s)
    for _ in range(2):  # a change of direction passes standstill
        present = ramped(present, wanted, LIMITS, 10.0)
    assert present == near(wanted.linear_m_s, wanted.angular_rad_s)
    assert ramped(STANDSTILL, STANDSTILL, LIMITS, 10.0) == STANDSTILL
