"""Tests of the body's pose, computed from ticks that wrap around and fall back."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.devices.odometry import Odometry
from robosc_bridge.devices.robots import BURGER

STEPS = st.lists(st.tuples(st.integers(-400, 400), st.integers(-400, 400)), max_size=30)


def _odometry() -> Odometry:
    return Odometry(BURGER.tick_m, BURGER.wheel_separation_m)


def test_the_worked_step() -> None:
    found = _odometry().advanced(0, 0).advanced(100, 100)
    assert found.pose.x_m == pytest.approx(5.0621366e-3)
    assert (found.pose.y_m, found.pose.heading_rad) == (0.0, 0.0)


def test_the_first_reading_is_no_motion() -> None:
    found = _odometry().advanced(1_000_000, -7)
    assert found.pose == _odometry().pose


def test_a_full_turn_on_the_spot_ends_where_it_began() -> None:
    found = _odometry().advanced(0, 0)
    ticks = round(math.pi * BURGER.wheel_separation_m / BURGER.tick_m)
    for step in range(1, 101):
        found = found.advanced(-ticks * step // 100, ticks * step // 100)
    assert found.pose.x_m == pytest.approx(0, abs=1e-6)
    assert found.pose.heading_rad == pytest.approx(0, abs=1e-3)


@given(STEPS, st.integers(-(2**31), 2**31 - 1), st.integers(-(2**31), 2**31 - 1))
def test_where_the_count_begins_and_wraps_does_not_matter(steps: list[tuple[int, int]], left: int, right: int) -> None:
    plain, wrapped = _odometry().advanced(0, 0), _odometry().advanced(left, right)
    at = [0, 0]
    for step in steps:
        at = [before + change for before, change in zip(at, step, strict=True)]
        plain = plain.advanced(at[0], at[1])
        signed = [(begin + now + 2**31) % 2**32 - 2**31 for begin, now in zip((left, right), at, strict=True)]
        wrapped = wrapped.advanced(signed[0], signed[1])
    assert wrapped.pose == plain.pose


@given(STEPS)
def test_the_pose_is_that_of_a_slow_twin(steps: list[tuple[int, int]]) -> None:
    found = _odometry().advanced(0, 0)
    x_m = y_m = heading_rad = 0.0
    at = [0, 0]
    for left, right in steps:
        at = [at[0] + left, at[1] + right]
        found = found.advanced(at[0], at[1])
        way_m = (left + right) / 2 / 4096 * 2 * math.pi * 0.033
        rotation_rad = (right - left) / 4096 * 2 * math.pi * 0.033 / 0.16
        x_m += way_m * math.cos(heading_rad + rotation_rad / 2)
        y_m += way_m * math.sin(heading_rad + rotation_rad / 2)
        heading_rad += rotation_rad
    assert found.pose.x_m == pytest.approx(x_m, abs=1e-9)
    assert found.pose.y_m == pytest.approx(y_m, abs=1e-9)
    assert math.cos(found.pose.heading_rad - heading_rad) == pytest.approx(1.0)
    assert -math.pi < found.pose.heading_rad <= math.pi


@pytest.mark.parametrize("turns", [-3, -1, 1, 200])
def test_a_motor_that_falls_back_by_whole_turns_has_not_moved(turns: int) -> None:
    found = _odometry().advanced(100, 100).advanced(110, 110)
    now = (120, 110 + 4096 * turns)
    assert found.jumps(*now) == (False, True)
    jumped = found.rebased(*found.jumps(*now)).advanced(*now)
    # The other wheel goes on.
    assert jumped.pose.heading_rad == pytest.approx(-10 * BURGER.tick_m / BURGER.wheel_separation_m)
    after = jumped.advanced(130, 120 + 4096 * turns)
    assert after.pose.x_m - jumped.pose.x_m == pytest.approx(10 * BURGER.tick_m, rel=1e-3)


@pytest.mark.parametrize("begin", [0, 2**31 - 1000, -(2**31)])
def test_only_what_is_more_than_half_a_turn_is_a_jump(begin: int) -> None:
    found = _odometry().advanced(begin, begin)
    signed = [(begin + step + 2**31) % 2**32 - 2**31 for step in (2048, 2049)]
    assert found.jumps(signed[0], signed[1]) == (False, True)
    assert _odometry().jumps(9999, -9999) == (False, False)


def test_a_wheel_can_be_made_to_begin_anew() -> None:
    found = _odometry().advanced(0, 0).rebased(is_left=True, is_right=False).advanced(1000, 0)
    assert found.pose == _odometry().pose
    assert found.ticks == (1000, 0)


@given(STEPS)
def test_the_ways_of_the_wheels_are_what_they_have_rolled(steps: list[tuple[int, int]]) -> None:
    found = _odometry().advanced(0, 0)
    at = [0, 0]
    for left, right in steps:
        at = [at[0] + left, at[1] + right]
        found = found.advanced(at[0], at[1])
    assert found.wheels_m == pytest.approx((at[0] * BURGER.tick_m, at[1] * BURGER.tick_m), abs=1e-9)
    # A motor that has restarted counts anew, and has not rolled.
    assert found.rebased().advanced(7, 7).wheels_m == found.wheels_m
