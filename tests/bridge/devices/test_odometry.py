"""Tests of the body's pose, computed from ticks that wrap around and fall back."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.devices.odometry import Odometry, Rotation, velocity_variances
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


def _twin(steps: list[tuple[int, int]]) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Covariance by matrices of numerical derivatives: of x, y and heading after a step, by these and by both ways."""
    covariance, place = np.zeros((3, 3)), np.zeros(3)

    def moved(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        x_m, y_m, heading_rad, left_m, right_m = values
        way_m, rotation_rad = (left_m + right_m) / 2, (right_m - left_m) / BURGER.wheel_separation_m
        middle_rad = heading_rad + rotation_rad / 2
        cosine, sine = np.cos(middle_rad), np.sin(middle_rad)
        return np.array([x_m + way_m * cosine, y_m + way_m * sine, heading_rad + rotation_rad])

    for step in steps:
        ways_m = np.array(step) * BURGER.tick_m
        values = np.concatenate((place, ways_m))
        derivatives = np.array(
            [(moved(values + change) - moved(values - change)) / 2e-6 for change in np.eye(5) * 1e-6]
        ).T
        before = np.zeros((5, 5))
        before[:3, :3] = covariance
        before[3:, 3:] = np.diag(2e-4 * np.abs(ways_m))
        covariance = derivatives @ before @ derivatives.T
        place = moved(values)
    return covariance


@given(STEPS)
def test_the_covariance_is_that_of_its_slow_twin(steps: list[tuple[int, int]]) -> None:
    found, at = _odometry().advanced(0, 0), [0, 0]
    for step in steps:
        at = [before + change for before, change in zip(at, step, strict=True)]
        found = found.advanced(at[0], at[1])
    assert np.array(found.covariance).reshape(3, 3) == pytest.approx(_twin(steps), rel=1e-4, abs=1e-9)


def test_the_rotation_is_the_mean_weighed_by_the_variances() -> None:
    wheels_rad = 200 * BURGER.tick_m / BURGER.wheel_separation_m
    wheels_rad2 = 2e-4 * 200 * BURGER.tick_m / BURGER.wheel_separation_m**2
    start = _odometry().advanced(0, 0)
    for variance in (0.0, wheels_rad2 / 9, wheels_rad2, 1e9):
        found = start.advanced(-100, 100, Rotation(0.02, variance))
        weight = wheels_rad2 / (wheels_rad2 + variance)
        assert found.pose.heading_rad == pytest.approx(weight * 0.02 + (1 - weight) * wheels_rad)
        # That of the mean of two independent measurements.
        assert found.covariance[8] == pytest.approx(wheels_rad2 * (1 - weight), abs=1e-15)
    assert start.advanced(-100, 100).pose.heading_rad == pytest.approx(wheels_rad)


def test_where_the_wheels_stand_no_rotation_is_believed() -> None:
    found = _odometry().advanced(0, 0).advanced(0, 0, Rotation(0.3, 1e-12))
    assert found.pose.heading_rad == 0.0
    assert found.covariance == (0.0,) * 9


def test_velocities_vary_by_a_unit_at_least_and_by_their_speed() -> None:
    still, fast = velocity_variances(0.0, 0.0, 0.001, 0.2), velocity_variances(0.2, -0.2, 0.001, 0.2)
    assert still == pytest.approx((5e-7, 5e-5))
    assert fast == pytest.approx((5e-7 + 4e-6, 5e-5 + 4e-4))
