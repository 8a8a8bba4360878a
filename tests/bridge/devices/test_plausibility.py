"""Tests of the judgement of readings by what a body can do."""

import logging
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.devices.board_yaw import BoardYaw
from robosc_bridge.devices.interface import DriveLimits
from robosc_bridge.devices.mavlink_odometry import VehicleTracker
from robosc_bridge.devices.mavlink_state import Timestamped
from robosc_bridge.devices.plausibility import (
    FASTEST_RAW,
    TOLD_S,
    ReadingJudge,
    Verdict,
    WheelCounts,
    body_judge,
    measurable,
    wheel_judge,
    yaw_judge,
)
from robosc_bridge.protocol import opencr
from robosc_bridge.protocol.mavlink_messages import MotionEstimate

SOUND, REFUSED, ANEW = Verdict.SOUND, Verdict.REFUSED, Verdict.ANEW
LIMITS = DriveLimits(0.5, 2.0, 0.7)


def _judge() -> ReadingJudge[float]:
    """Return a judge of a number that changes by one a second at most, and is never negative."""
    return ReadingJudge(
        "it",
        lambda before, now, passed_s: ("" if abs(now - before) <= passed_s else "too far",),
        lambda now: "" if now >= 0 else "negative",
    )


class Twin:
    """The judge again, slow and obvious: it keeps all readings and their verdicts, and looks them up each time."""

    def __init__(self) -> None:
        self.past: list[tuple[float, float, Verdict]] = []

    def judge(self, now: float, time_s: float) -> Verdict:
        counted = [(value, at_s) for value, at_s, verdict in self.past if verdict is not REFUSED]
        verdict = SOUND
        if now < 0:
            verdict = REFUSED
        elif counted and abs(now - counted[-1][0]) > abs(time_s - counted[-1][1]):
            begin = max((k + 1 for k, each in enumerate(self.past) if each[2] is not REFUSED), default=0)
            refused = [(value, at_s) for value, at_s, _ in self.past[begin:] if value >= 0]
            agrees = bool(refused) and time_s > refused[-1][1] and abs(now - refused[-1][0]) <= time_s - refused[-1][1]
            verdict = ANEW if agrees else REFUSED
        self.past.append((now, time_s, verdict))
        return verdict


@given(
    st.lists(st.tuples(st.sampled_from([-1.0, 0.0, 0.5, 1.0, 1.5, 7.0, 7.5, 8.0]), st.sampled_from([0.0, 0.5, 1.0])))
)
def test_it_judges_as_its_slow_twin(steps: list[tuple[float, float]]) -> None:
    judge, twin, now_s = _judge(), Twin(), 0.0
    for value, step_s in steps:
        now_s += step_s
        assert judge.judge(value, now_s) is twin.judge(value, now_s)
    verdicts = [verdict for _, _, verdict in twin.past]
    assert (judge.refused, judge.begun_anew) == (verdicts.count(REFUSED), verdicts.count(ANEW))


def test_one_wrong_reading_is_refused_and_two_that_agree_are_another_beginning() -> None:
    judge = _judge()
    assert [judge.judge(*each) for each in ((1.0, 0.0), (9.0, 0.1), (1.1, 0.2))] == [SOUND, REFUSED, SOUND]
    assert [judge.judge(*each) for each in ((9.0, 0.3), (9.05, 0.4), (9.1, 0.5))] == [REFUSED, ANEW, SOUND]
    assert (judge.refused, judge.begun_anew) == (2, 1)
    # The same reading once more confirms nothing.
    assert [judge.judge(*each) for each in ((1.0, 0.6), (1.0, 0.6), (1.0, 0.7))] == [REFUSED, REFUSED, ANEW]
    # A reading that is impossible on its own is never begun from.
    assert [judge.judge(-1.0, at_s) for at_s in (0.8, 0.9, 1.0)] == [REFUSED] * 3
    assert judge.judge(1.1, 1.1) is SOUND
    judge.forget()
    assert judge.judge(99.0, 1.2) is SOUND


def test_each_is_counted_and_a_person_is_told_now_and_then(caplog: pytest.LogCaptureFixture) -> None:
    judge = _judge()
    judge.judge(1.0, 0.0)
    with caplog.at_level(logging.WARNING):
        for step in range(100):
            judge.judge(-1.0, step * 0.3)
    assert judge.refused == 100
    assert [record.getMessage() for record in caplog.records] == [
        f"it: a reading is refused ({count} so far): negative" for count in (1, 35, 69)
    ]
    assert math.ceil(TOLD_S / 0.3) == 34


def _wheels(left: int, right: int = 0, raw: tuple[int, int] = (0, 0)) -> WheelCounts:
    return WheelCounts((left, right), raw)


# Half a revolution, and the fastest that a servo of the series can be set to in the time and the lag.
TICKS_S = FASTEST_RAW * 0.229 / 60 * 4096


@pytest.mark.parametrize("begin", [0, -1, 2**31 - 100, -(2**31)])
@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("passed_s", [0.0, 0.02, 0.3, 20.0])
def test_a_wheel_turns_no_further_than_a_servo_can(begin: int, sign: int, passed_s: float) -> None:
    reach = int(2048 + TICKS_S * (passed_s + 0.05))

    def verdict(step: int) -> Verdict:
        judge = wheel_judge("it", 0.05)
        judge.judge(_wheels(begin, 7), 100.0)
        now = (begin + sign * step + 2**31) % 2**32 - 2**31
        return judge.judge(_wheels(now, 7), 100.0 + passed_s)

    assert verdict(reach) is SOUND
    assert verdict(reach + 2) is REFUSED


def test_each_wheel_is_judged_and_named() -> None:
    judge = wheel_judge("it", 0.0)
    judge.judge(_wheels(0, 0), 0.0)
    assert judge.judge(_wheels(5, -33_686_019), 0.02) is REFUSED
    assert judge.excess == ("", "the right wheel would have turned by -8224.13 revolutions in 0.020 s")
    assert judge.judge(_wheels(0, 0, (0, FASTEST_RAW)), 0.04) is SOUND
    assert judge.judge(_wheels(0, 0, (-FASTEST_RAW - 1, 0)), 0.06) is REFUSED
    assert list(judge.excess) == ["a wheel would turn at -234 rpm"]


def _estimate(x_m: float = 0.0, heading_rad: float = 0.0, vehicle_s: float = 0.0, **more: float) -> MotionEstimate:
    speeds = more.get("linear_m_s", 0.0), more.get("angular_rad_s", 0.0)
    return MotionEstimate(x_m, 0.0, heading_rad, *speeds, place_s=vehicle_s, heading_s=vehicle_s)


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        ({"x_m": 0.49}, SOUND),
        ({"x_m": 0.51}, REFUSED),
        ({"x_m": -112.0}, REFUSED),
        ({"heading_rad": 0.51}, SOUND),
        ({"heading_rad": 0.52}, REFUSED),
        ({"heading_rad": -math.pi / 2}, REFUSED),
        ({"heading_rad": 2 * math.pi - 0.1}, SOUND),
        ({"linear_m_s": 5.0}, SOUND),
        ({"linear_m_s": -5.01}, REFUSED),
        ({"angular_rad_s": 6.28}, SOUND),
        ({"angular_rad_s": 6.29}, REFUSED),
    ],
)
def test_a_body_moves_no_further_and_no_faster_than_any_does(change: dict[str, float], verdict: Verdict) -> None:
    judge = body_judge("it", LIMITS)
    judge.judge(_estimate(), 0.0)
    assert judge.judge(_estimate(**change), 0.05) is verdict


def test_a_fast_body_may_be_twice_as_fast_as_it_is_commanded() -> None:
    judge = body_judge("it", DriveLimits(4.0, 10.0, 5.0))
    assert judge.judge(_estimate(linear_m_s=8.0, angular_rad_s=20.0), 0.0) is SOUND
    assert judge.judge(_estimate(linear_m_s=8.1), 0.1) is REFUSED


def test_estimates_that_come_late_and_together_are_far_apart() -> None:
    judge = body_judge("it", LIMITS)
    assert judge.judge(_estimate(), 10.0) is SOUND
    # A second was held back; the vehicle's clock says so.
    assert judge.judge(_estimate(x_m=2.0, vehicle_s=0.5), 11.0) is SOUND
    assert judge.judge(_estimate(x_m=4.0, vehicle_s=1.0), 11.0) is SOUND
    # It is not believed any time.
    assert judge.judge(_estimate(x_m=112.0, vehicle_s=1000.0), 11.05) is REFUSED


def test_a_yaw_turns_no_faster_than_a_body() -> None:
    judge = yaw_judge("it")
    assert [judge.judge(*each) for each in ((3.1, 0.0), (-3.1, 0.02), (1.0, 0.04), (-3.1, 0.06))] == [
        SOUND, SOUND, REFUSED, SOUND,
    ]  # fmt: skip


def test_an_inertial_sensor_measures_no_more_than_it_can() -> None:
    motion = {"angular_velocity_z": 39.0, "angular_velocity_x": -4.2e37, "linear_acceleration_y": 201.0, "other": 1e9}
    assert measurable(motion) == {"angular_velocity_z": 39.0, "other": 1e9}


def _block(yaw_rad: float, uptime_ms: int) -> opencr.Block:
    data = bytearray(opencr.BLOCK_LENGTH)
    data[:4] = (uptime_ms % 2**32).to_bytes(4, "little")
    block = opencr.decode_block(bytes(data))
    motion = {"orientation_w": math.cos(yaw_rad / 2), "orientation_z": math.sin(yaw_rad / 2)}
    block.motion.update({"orientation_x": 0.0, "orientation_y": 0.0, **motion})
    return block


@pytest.mark.parametrize("begin_ms", [0, 2**32 - 30])
def test_a_yaw_that_jumps_is_no_rotation_and_goes_on_from_there(begin_ms: int) -> None:
    yaw = BoardYaw()

    def rotation(yaw_rad: float, step: int) -> float | None:
        found = yaw.rotation(_block(yaw_rad, begin_ms + 20 * step))
        return None if found is None else round(found.angle_rad, 6)

    assert [rotation(0.0, 0), rotation(0.01, 1)] == [None, 0.01]
    # Calibrated: two that agree.
    assert [rotation(2.0, 2), rotation(2.01, 3), rotation(2.03, 4)] == [None, None, 0.02]
    # A single wrong one: the rotation meanwhile is that of the wheels.
    assert [rotation(-1.0, 5), rotation(2.05, 6), rotation(2.06, 7)] == [None, None, 0.01]
    assert (yaw.judge.refused, yaw.judge.begun_anew) == (2, 1)


def _tracked(*reports: tuple[float, MotionEstimate]) -> VehicleTracker:
    tracker = VehicleTracker("it", LIMITS)
    for time_s, motion in reports:
        tracker.take(Timestamped(time_s, motion))
    return tracker


def test_an_estimator_that_is_reset_without_a_word_does_not_move_the_body() -> None:
    way = [(0.0, _estimate()), (0.05, _estimate(0.1, vehicle_s=0.05))]
    jump = [(0.1, _estimate(112.0, math.pi / 2, 0.1)), (0.15, _estimate(112.0, math.pi / 2, 0.15))]
    tracker = _tracked(*way, *jump)
    assert (tracker.odometry.pose.x_m, tracker.odometry.pose.heading_rad) == pytest.approx((0.1, 0.0))
    assert (tracker.judge.refused, tracker.judge.begun_anew, tracker.odometry.rebases) == (1, 1, 0)
    # It is followed from there: it looks to the left now, and goes on ahead.
    on = MotionEstimate(112.0, 0.1, math.pi / 2, 0.5, 0.0, place_s=0.2, heading_s=0.2)
    tracker.take(Timestamped(0.2, on))
    assert (tracker.odometry.pose.x_m, tracker.odometry.pose.y_m) == pytest.approx((0.2, 0.0))


def test_a_single_wrong_estimate_counts_for_nothing_and_is_no_fresh_one() -> None:
    tracker = _tracked((0.0, _estimate()), (0.05, _estimate(50.0, linear_m_s=1.0, vehicle_s=0.05)))
    assert tracker.accepted is not None
    assert tracker.accepted.time_s == 0.0
    assert tracker.odometry.velocity.linear_m_s == 0.0
    # Looked at again, it does not confirm itself.
    tracker.take(Timestamped(0.05, _estimate(50.0, linear_m_s=1.0, vehicle_s=0.05)))
    assert tracker.judge.refused == 1
    assert tracker.take(Timestamped(0.1, _estimate(0.05, vehicle_s=0.1)))
    assert tracker.odometry.pose.x_m == pytest.approx(0.05)


def test_a_reset_that_the_vehicle_counts_is_begun_from_at_once() -> None:
    reset = MotionEstimate(112.0, 5.0, 2.0, 0.1, 0.0, resets=1, place_s=0.05, heading_s=0.05)
    tracker = _tracked((0.0, _estimate()), (0.05, reset))
    assert tracker.judge.refused == 0
    assert tracker.odometry.pose.x_m == 0.0
    assert tracker.accepted == Timestamped(0.05, reset)
