import math
from collections import deque
from dataclasses import dataclass

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc_bridge.devices.interface import STANDSTILL
from robosc_bridge.skills import Rotate, RotateSettings, RotateState
from robosc_bridge.skills.rotate import MAXIMUM_ANGLE_RAD
from support.effort import examples

USUAL = RotateSettings()
PERIOD_S = 0.02


@dataclass
class Body:
    """Robot that turns as commanded, with a delay, a lag and a largest acceleration; readings are old and noisy.

    Delays are in periods, as is the time constant of the lag.
    """

    heading_rad: float = 0.0
    command_delay: int = 0
    reading_delay: int = 0
    lag: float = 0.0
    acceleration_rad_s2: float = math.inf
    noise_rad: float = 0.0
    is_blocked: bool = False

    def __post_init__(self) -> None:
        self.rate_rad_s = 0.0
        self._commands = deque([0.0] * self.command_delay)
        self._readings = deque([self.heading_rad] * self.reading_delay)
        self._count = 0

    def read(self) -> float:
        self._count += 1
        # Noise that is as bad as it may be, by turns.
        noise = self.noise_rad * (1 if self._count % 3 else -1)
        self._readings.append(self.heading_rad + noise)
        return math.remainder(self._readings.popleft(), math.tau)

    def step(self, wanted_rad_s: float, period_s: float) -> None:
        self._commands.append(wanted_rad_s)
        goal = self._commands.popleft()
        change = (goal - self.rate_rad_s) / (1 + self.lag)
        limit = self.acceleration_rad_s2 * period_s
        self.rate_rad_s += max(-limit, min(limit, change))
        if not self.is_blocked:
            self.heading_rad += self.rate_rad_s * period_s


def turn(rotate: Rotate, body: Body, angle_rad: float, period_s: float = PERIOD_S) -> float:
    """Turn, and return the time that it took, in seconds; every command is within the limit."""
    now_s = 1000.0
    assert rotate.start(angle_rad, now_s)
    while rotate.is_rotating:
        velocity = rotate.update(body.read(), now_s)
        assert velocity.linear_m_s == 0.0
        assert abs(velocity.angular_rad_s) <= USUAL.speed_rad_s
        body.step(velocity.angular_rad_s, period_s)
        now_s += period_s
        assert now_s < 1000.0 + 5000.0
    return now_s - 1000.0


@pytest.mark.parametrize("start_deg", [0, 170, 180, -170, 90])
@pytest.mark.parametrize("angle_deg", [90, -90, 179, 180, -180, 181, 360, -720, 3600, 2, 0])
def test_a_body_that_obeys_turns_by_the_angle(start_deg: int, angle_deg: int) -> None:
    start_rad, angle_rad = math.radians(start_deg), math.radians(angle_deg)
    rotate, body = Rotate(USUAL), Body(start_rad)
    taken_s = turn(rotate, body, angle_rad)
    assert rotate.state is RotateState.DONE
    assert body.heading_rad - start_rad == pytest.approx(angle_rad, abs=USUAL.tolerance_rad)
    # At full speed most of the way, and two seconds for the rest.
    assert taken_s < abs(angle_rad) / USUAL.speed_rad_s + 3


@settings(max_examples=examples(60))
@given(
    start_rad=st.floats(-math.pi, math.pi),
    angle_rad=st.floats(-5 * math.pi, 5 * math.pi),
    command_delay=st.integers(0, 3),
    reading_delay=st.integers(0, 3),
    lag=st.floats(0, 2),
    acceleration_rad_s2=st.floats(2, 100),
    noise=st.floats(0, 0.2),
    period_s=st.sampled_from([0.01, 0.02, 0.03]),
)
def test_any_turn_ends_within_the_tolerance(
    start_rad: float,
    angle_rad: float,
    command_delay: int,
    reading_delay: int,
    lag: float,
    acceleration_rad_s2: float,
    noise: float,
    period_s: float,
) -> None:
    noise_rad = noise * USUAL.tolerance_rad
    body = Body(start_rad, command_delay, reading_delay, lag, acceleration_rad_s2, noise_rad)
    rotate = Rotate(USUAL)
    turn(rotate, body, angle_rad, period_s)
    assert rotate.state is RotateState.DONE
    # It is settled: what is read is what it is, but for the noise of the first reading and the last.
    assert abs(body.heading_rad - start_rad - angle_rad) <= USUAL.tolerance_rad + 2 * noise_rad + 1e-9


@settings(max_examples=examples(60))
@given(
    angle_rad=st.floats(-3 * math.pi, 3 * math.pi),
    delay=st.integers(0, 60),
    noise_rad=st.floats(0, 0.5),
    is_blocked=st.booleans(),
)
def test_whatever_the_body_does_it_ends_in_time(
    angle_rad: float, delay: int, noise_rad: float, is_blocked: bool
) -> None:
    rotate = Rotate(USUAL)
    body = Body(0.0, delay, 0, 0.0, math.inf, noise_rad, is_blocked)
    taken_s = turn(rotate, body, angle_rad)
    assert taken_s <= 2 * abs(angle_rad) / USUAL.speed_rad_s + USUAL.patience_s + 2 * PERIOD_S
    assert rotate.state in (RotateState.DONE, RotateState.FAILED)
    assert rotate.update(0.0, 1e6) == STANDSTILL


def test_it_slows_down_towards_the_end() -> None:
    rotate = Rotate(USUAL)
    rotate.start(math.pi, 0.0)
    speeds = [rotate.update(heading, 0.1).angular_rad_s for heading in (0.0, 2.0, 2.9, 3.0, 3.1, 3.13)]
    assert speeds[:2] == [USUAL.speed_rad_s] * 2
    assert speeds[2:] == sorted(speeds[2:], reverse=True)
    assert speeds[2] == pytest.approx(2.0 * (math.pi - 2.9))
    assert speeds[4] == pytest.approx(0.0832, abs=1e-3)
    assert speeds[5] == 0.0
    rotate.update(3.2, 0.2)
    assert rotate.update(3.2, 0.2).angular_rad_s < 0, "it has gone too far"


@pytest.mark.parametrize(
    ("settings", "angle_rad", "speed_rad_s"),
    [
        (RotateSettings(speed_rad_s=5.0, braking_rad_s2=0.5, gain_per_s=10.0), 1.0, 1.0),
        (RotateSettings(tolerance_rad=0.01, slowest_rad_s=0.1, gain_per_s=2.0), 0.02, 0.1),
    ],
    ids=["braking bounds it", "it is never so slow that wheels stand still"],
)
def test_the_first_speed(settings: RotateSettings, angle_rad: float, speed_rad_s: float) -> None:
    rotate = Rotate(settings)
    rotate.start(angle_rad, 0.0)
    assert rotate.update(0.0, 0.0).angular_rad_s == pytest.approx(speed_rad_s)


def test_only_a_stay_within_the_tolerance_ends_it() -> None:
    rotate = Rotate(USUAL)
    rotate.start(1.0, 0.0)
    for heading, now_s, state in (
        (0.0, 0.0, RotateState.TURNING),
        (1.0, 1.0, RotateState.TURNING),
        (1.03, 1.25, RotateState.TURNING),  # Rolled on: from anew.
        (1.01, 1.35, RotateState.TURNING),
        (1.01, 1.6, RotateState.TURNING),
        (1.01, 1.66, RotateState.DONE),
    ):
        rotate.update(heading, now_s)
        assert rotate.state is state, now_s
    assert rotate.remaining_rad == pytest.approx(-0.01)


def test_the_next_turn_settles_by_itself() -> None:
    rotate = Rotate(USUAL)
    for start_s in (0.0, 10.0):
        assert rotate.start(0.01, start_s)
        rotate.update(0.5, start_s)
        assert rotate.is_rotating
        rotate.update(0.5, start_s + 0.31)
        assert rotate.state is RotateState.DONE


def test_a_blocked_body_fails_after_the_stated_time() -> None:
    rotate = Rotate(USUAL)
    taken_s = turn(rotate, Body(is_blocked=True), math.pi / 2)
    assert (rotate.state, rotate.reason) == (RotateState.FAILED, "the rotation has taken too long")
    assert taken_s == pytest.approx(2 * (math.pi / 2) / 0.8 + 5.0, abs=2 * PERIOD_S)


@pytest.mark.parametrize("heading_rad", [None, math.nan, math.inf])
def test_without_odometry_it_stands_still_and_fails_in_the_end(heading_rad: float | None) -> None:
    rotate = Rotate(USUAL)
    rotate.start(0.8, 0.0)
    assert rotate.update(heading_rad, 0.1) == STANDSTILL
    assert rotate.update(heading_rad, 6.9) == STANDSTILL
    assert rotate.is_rotating
    assert rotate.update(heading_rad, 7.0) == STANDSTILL
    assert (rotate.state, rotate.reason) == (RotateState.FAILED, "there is no odometry")


def test_a_gap_in_the_odometry_is_bridged() -> None:
    rotate = Rotate(USUAL)
    rotate.start(math.pi / 2, 0.0)
    rotate.update(3.0, 0.0)
    assert rotate.update(None, 0.1) == STANDSTILL
    assert rotate.update(-3.0, 0.2).angular_rad_s == USUAL.speed_rad_s
    assert rotate.remaining_rad == pytest.approx(math.pi / 2 - (math.tau - 6.0))


@pytest.mark.parametrize("angle_rad", [math.nan, math.inf, -math.inf, MAXIMUM_ANGLE_RAD + 1, -MAXIMUM_ANGLE_RAD - 1])
def test_an_impossible_angle_fails_at_once(angle_rad: float) -> None:
    rotate = Rotate(USUAL)
    assert rotate.start(angle_rad, 0.0)
    assert rotate.state is RotateState.FAILED
    assert "beyond a hundred revolutions" in rotate.reason
    assert rotate.update(0.0, 0.0) == STANDSTILL


def test_one_turn_at_a_time_and_another_one_afterwards() -> None:
    rotate = Rotate(USUAL)
    assert rotate.state is RotateState.IDLE
    assert rotate.update(0.0, 0.0) == STANDSTILL
    assert rotate.start(1.0, 0.0)
    assert not rotate.start(-1.0, 0.0)
    assert rotate.update(0.0, 0.0).angular_rad_s > 0
    rotate.cancel("the robot was stopped")
    assert (rotate.state, rotate.reason) == (RotateState.FAILED, "the robot was stopped")
    assert rotate.update(0.5, 0.1) == STANDSTILL
    assert rotate.start(-1.0, 10.0)
    assert rotate.reason == ""
    assert rotate.update(2.0, 10.0).angular_rad_s < 0
    assert rotate.remaining_rad == -1.0
    turned = Rotate(USUAL)
    turned.cancel("nothing is under way")
    assert turned.state is RotateState.IDLE
