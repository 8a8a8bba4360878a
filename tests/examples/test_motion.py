"""Angles, turns and steering."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_examples.motion import Turn, clamped, steered, turning_speed, wrapped, yaw_of

ANGLES = st.floats(-20.0, 20.0)


@given(ANGLES)
def test_a_wrapped_angle_is_the_same_direction(angle: float) -> None:
    assert -math.pi <= wrapped(angle) <= math.pi
    assert math.cos(wrapped(angle)) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped(angle)) == pytest.approx(math.sin(angle), abs=1e-9)


@given(st.floats(-math.pi, math.pi), st.floats(0.5, 100.0))
def test_the_yaw_of_a_quaternion_of_any_length(yaw: float, length: float) -> None:
    found = yaw_of(0.0, 0.0, length * math.sin(yaw / 2), length * math.cos(yaw / 2))
    assert found is not None
    assert abs(wrapped(found - yaw)) < 1e-9


@given(st.floats(-1.0, 1.0), st.floats(-math.pi, math.pi))
def test_pitch_does_not_change_the_yaw(pitch: float, yaw: float) -> None:
    # The product of the two rotations, about z and then about y.
    cy, sy, cp, sp = math.cos(yaw / 2), math.sin(yaw / 2), math.cos(pitch / 2), math.sin(pitch / 2)
    found = yaw_of(-sy * sp, cy * sp, sy * cp, cy * cp)
    assert found is not None
    assert abs(wrapped(found - yaw)) < 1e-9


@pytest.mark.parametrize("wrong", [0.0, math.nan, math.inf])
def test_a_quaternion_that_looks_nowhere(wrong: float) -> None:
    assert yaw_of(0.0, 0.0, 0.0, wrong) is None


@given(ANGLES, st.floats(-math.pi, math.pi), st.lists(st.floats(-3.0, 3.0), max_size=30))
def test_a_turn_is_followed_across_every_jump_of_the_yaw(angle: float, start: float, steps: list[float]) -> None:
    turn = Turn(angle, start)
    yaw = start
    for step in steps:
        yaw += step
        turn.update(wrapped(yaw))
    assert turn.remaining_rad == pytest.approx(angle - (yaw - start), abs=1e-6)


@given(st.floats(-10, 10), st.floats(0.05, 3.0))
def test_a_turn_slows_down_and_ends(remaining: float, limit: float) -> None:
    seen = []
    for _ in range(100_000):
        if abs(remaining) <= 0.017:
            break
        speed = turning_speed(remaining, limit)
        assert abs(speed) <= limit
        assert speed * remaining > 0.0
        seen.append(abs(speed))
        remaining -= 0.02 * speed
    assert abs(remaining) <= max(0.017, 0.02 * limit)
    assert all(later <= earlier + 1e-9 for earlier, later in pairwise(seen))


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-math.pi, math.pi))
def test_steering_comes_to_the_goal(x: float, y: float, yaw: float) -> None:
    at_x = at_y = 0.0
    for _ in range(20_000):
        distance = math.hypot(x - at_x, y - at_y)
        if distance < 0.05:
            return
        speed = steered(distance, wrapped(math.atan2(y - at_y, x - at_x) - yaw), 0.2, 1.0)
        assert 0.0 <= speed.ahead_m_s <= 0.2
        assert abs(speed.turn_rad_s) <= 1.0
        assert speed.turn_rad_s * wrapped(math.atan2(y - at_y, x - at_x) - yaw) >= 0.0
        yaw += 0.02 * speed.turn_rad_s
        at_x += 0.02 * speed.ahead_m_s * math.cos(yaw)
        at_y += 0.02 * speed.ahead_m_s * math.sin(yaw)
    raise AssertionError(f"still {distance} m away")


@given(st.floats(-10, 10), st.floats(0, 5))
def test_clamped(value: float, limit: float) -> None:
    assert abs(clamped(value, limit)) <= limit
    if abs(value) <= limit:
        assert clamped(value, limit) == value
