"""Tests of the commands to the wheels: within every limit, with the curvature kept."""

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from robosc_bridge.devices.interface import Velocity
from robosc_bridge.devices.kinematics import body_velocity, opencr_words, wheel_goals, wheel_speeds, within_limits
from robosc_bridge.devices.robots import BURGER, ROBOTS, WAFFLE, Robot

FIRMWARE_RAW_PER_M_S = 1263.632956882
ANY = st.floats(-5, 5)
ROBOT = st.sampled_from(sorted(ROBOTS.values(), key=lambda robot: robot.name))


def _goals(velocity: Velocity, robot: Robot, limit_raw: int) -> tuple[int, int]:
    return wheel_goals(velocity, robot.limits(limit_raw), robot.wheel_separation_m, robot.raw_m_s)


def test_the_worked_velocity_is_rounded() -> None:
    assert _goals(Velocity(0.10, 0.5), BURGER, 265) == (76, 177)
    assert _goals(Velocity(-0.10, -0.5), BURGER, 265) == (-76, -177)


def test_published_and_enforced_limits() -> None:
    burger, waffle = BURGER.limits(265), WAFFLE.limits(330)
    assert burger.wheel_m_s == burger.linear_m_s == pytest.approx(0.20971, abs=1e-5)
    assert burger.angular_rad_s == pytest.approx(2.6214, abs=1e-4)
    assert BURGER.limits(1023).linear_m_s == pytest.approx(0.21080, abs=1e-5)
    assert BURGER.limits(1023).angular_rad_s == pytest.approx(2.6350, abs=1e-4)
    assert waffle.linear_m_s == 0.26
    assert waffle.wheel_m_s == pytest.approx(0.26115, abs=1e-5)
    assert waffle.angular_rad_s == pytest.approx(1.8199, abs=1e-4)


@given(ANY, ANY, ROBOT, st.integers(1, 1023))
def test_no_wheel_is_commanded_more_than_its_servo_takes(
    linear: float, angular: float, robot: Robot, limit_raw: int
) -> None:
    goals = _goals(Velocity(linear, angular), robot, limit_raw)
    assert max(map(abs, goals)) <= limit_raw


@given(ANY, ANY, ROBOT)
def test_both_wheels_are_slowed_alike(linear: float, angular: float, robot: Robot) -> None:
    limits = robot.limits(robot.motor.velocity_limit_raw)
    found = within_limits(Velocity(linear, angular), limits, robot.wheel_separation_m)
    clamped = Velocity(
        math.copysign(min(abs(linear), limits.linear_m_s), linear),
        math.copysign(min(abs(angular), limits.angular_rad_s), angular),
    )
    assert found.linear_m_s * clamped.angular_rad_s == pytest.approx(found.angular_rad_s * clamped.linear_m_s)
    fastest = max(map(abs, wheel_speeds(found, robot.wheel_separation_m)))
    wanted = max(map(abs, wheel_speeds(clamped, robot.wheel_separation_m)))
    assert fastest == pytest.approx(min(wanted, limits.wheel_m_s))


@given(ANY, ANY, ROBOT)
@example(0.22, 0.0, BURGER)
@example(0.2097, 0.0, BURGER)
@example(0.205, 0.05, BURGER)
@example(0.0, 2.84, BURGER)
@example(0.0, -2.624, BURGER)
@example(0.1936, 1.48116, BURGER)
@example(-0.10511, -2.87106, BURGER)
@example(-0.18282, 2.0846, BURGER)
@example(0.26, 0.0, WAFFLE)
@example(0.0, 1.82, WAFFLE)
def test_opencr_makes_nothing_of_it_that_a_servo_refuses(linear: float, angular: float, robot: Robot) -> None:
    limits = robot.limits(robot.motor.velocity_limit_raw)
    words = opencr_words(Velocity(linear, angular), limits, robot.wheel_separation_m)
    # The firmware's computation, before any of its clamps.
    speeds = wheel_speeds(Velocity(words[0] / 100, words[1] / 100), robot.wheel_separation_m)
    assert max(abs(speed) * FIRMWARE_RAW_PER_M_S for speed in speeds) <= robot.motor.velocity_limit_raw
    firmware_m_s = robot.firmware_rpm * 2 * math.pi / 60 * robot.wheel_radius_m
    assert abs(words[0]) <= firmware_m_s * 100
    assert abs(words[1]) <= firmware_m_s / (robot.wheel_separation_m / 2) * 100
    # And it is the nearest of that.
    found = within_limits(Velocity(linear, angular), limits, robot.wheel_separation_m)
    assert abs(words[0] - found.linear_m_s * 100) <= 1.0 + 1e-6
    assert abs(words[1] - found.angular_rad_s * 100) <= 1.0 + 1e-6


@given(st.floats(-0.19, 0.19), st.floats(-0.2, 0.2))
def test_opencr_gets_the_nearest_words_where_nothing_limits(linear: float, angular: float) -> None:
    words = opencr_words(Velocity(linear, angular), BURGER.limits(265), BURGER.wheel_separation_m)
    if max(map(abs, wheel_speeds(Velocity(abs(linear) + 0.005, abs(angular) + 0.005), 0.16))) < 0.2097:
        assert words == (round(linear * 100), round(angular * 100))


@pytest.mark.parametrize(
    ("velocity", "words"),
    [(Velocity(0.10, 0.50), (10, 50)), (Velocity(0.29, 0.0), (20, 0)), (Velocity(0.015, 0.0), (2, 0))],
)
def test_words_as_worked(velocity: Velocity, words: tuple[int, int]) -> None:
    assert opencr_words(velocity, BURGER.limits(265), BURGER.wheel_separation_m) == words


@pytest.mark.parametrize("linear", [math.nan, math.inf, -math.inf])
def test_what_is_no_velocity_moves_nothing_too_fast(linear: float) -> None:
    goals = _goals(Velocity(linear, math.nan), BURGER, 265)
    assert goals == ((0, 0) if math.isnan(linear) else (math.copysign(265, linear),) * 2)


@given(st.floats(-1, 1), st.floats(-3, 3))
def test_wheels_and_body_agree(linear: float, angular: float) -> None:
    found = body_velocity(*wheel_speeds(Velocity(linear, angular), 0.16), 0.16)
    assert found.linear_m_s == pytest.approx(linear, abs=1e-12)
    assert found.angular_rad_s == pytest.approx(angular, abs=1e-12)
