"""Tests that hold for every drive base, run on each over the serial line of a virtual host.

Most are about wheels that are asked for an answer in every cycle; a MAVLink rover reports by itself, at its own pace,
and takes part where that makes no difference. Its line's faults are in its own tests.
"""

import contextlib
import math
from collections.abc import Iterator

import pytest

from robosc_bridge.devices.interface import DriveBase, DriveReading, Velocity
from robosc_bridge.devices.kinematics import wheel_speeds
from robosc_bridge.devices.robots import ROBOTS
from robosc_bridge.driver_registry import make_drive_base
from robosc_bridge.errors import DeviceError, DeviceFaultError, DeviceSilentError, LineLostError, LineMissingError
from support.drive import PERIOD_S, Rig, rig

KINDS = ("opencr", "dynamixel")
ALL_KINDS = (*KINDS, "mavlink-rover")
FORWARD = Velocity(0.15, 0.0)


@pytest.fixture(params=KINDS)
def bench(request: pytest.FixtureRequest) -> Iterator[Rig]:
    with rig(request.param) as found:
        yield found


@pytest.fixture(params=ALL_KINDS)
def any_bench(request: pytest.FixtureRequest) -> Iterator[Rig]:
    with rig(request.param) as found:
        yield found


def _is_at_rest(reading: DriveReading) -> bool:
    return reading.wheels_m_s == (0.0, 0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_made_by_name(kind: str) -> None:
    base: DriveBase = make_drive_base(kind, path="/dev/none", robot=ROBOTS["burger"])
    with pytest.raises(LineMissingError, match="/dev/none: there is no such port"):
        base.open()
    base.close()


def test_it_opens_at_a_standstill_with_torque_off(any_bench: Rig) -> None:
    any_bench.base.open()
    reading = any_bench.drive(FORWARD, 0.3)
    assert not reading.is_torque_on
    assert reading.wheels_m_s == (0.0, 0.0)
    assert reading.faults == frozenset()
    assert not any_bench.robot.world.left.is_driven
    assert not any_bench.robot.world.right.is_driven
    assert any_bench.robot.world.pose == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("robot", sorted(ROBOTS))
@pytest.mark.parametrize("kind", KINDS)
def test_the_wheels_turn_as_commanded_and_the_odometry_follows_the_world(kind: str, robot: str) -> None:
    with rig(kind, robot) as bench:
        bench.start()
        velocity = Velocity(0.15, 0.6)
        reading = bench.drive(velocity, 0.6)
        separation_m = ROBOTS[robot].wheel_separation_m
        assert reading.wheels_m_s == pytest.approx(wheel_speeds(velocity, separation_m), abs=0.001)
        assert reading.velocity.linear_m_s == pytest.approx(0.15, abs=0.001)
        assert reading.velocity.angular_rad_s == pytest.approx(0.6, abs=0.01)
        bench.drive(Velocity(-0.1, -0.9), 0.6)
        reading = bench.drive_until(_is_at_rest)
        reading = bench.drive(seconds=0.05)
        x_m, y_m, heading_rad = bench.robot.world.pose
        assert (reading.pose.x_m, reading.pose.y_m) == pytest.approx((x_m, y_m), abs=0.001)
        assert reading.pose.heading_rad == pytest.approx(heading_rad, abs=0.005)
        assert abs(heading_rad) > 0.01
        assert reading.wheels_m is not None
        left_m, right_m = reading.wheels_m
        assert right_m - left_m == pytest.approx(heading_rad * separation_m, abs=0.001)
        assert abs(right_m + left_m) / 2 == pytest.approx(abs(0.15 * 0.6 - 0.1 * 0.6), abs=0.02)
        assert reading.wheel_radius_m == ROBOTS[robot].wheel_radius_m


@pytest.mark.parametrize("robot", sorted(ROBOTS))
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("velocity", [Velocity(1.0, 0.0), Velocity(-1.0, 0.0), Velocity(0.0, 9.0), Velocity(1.0, -9.0)])
def test_no_command_is_more_than_the_wheels_take(kind: str, robot: str, velocity: Velocity) -> None:
    with rig(kind, robot) as bench:
        bench.start()
        bench.drive(velocity, 0.1)
        goals = bench.goals_rad_s()
        limit_m_s = bench.base.limits.wheel_m_s
        fastest_m_s = max(map(abs, goals)) * 0.033
        assert 0.9 * limit_m_s < fastest_m_s <= limit_m_s * 1.0001


@pytest.mark.parametrize("position", [2**31 - 300, -(2**31) + 300])
@pytest.mark.parametrize("kind", KINDS)
def test_the_odometry_goes_on_where_the_encoders_wrap_around(kind: str, position: int) -> None:
    with rig(kind) as bench:
        bench.start()
        bench.robot.left.set_position(position)
        bench.robot.right.set_position(-position)
        bench.base.open()
        bench.base.set_torque(True)
        bench.drive(FORWARD, 0.4)
        bench.drive(Velocity(-0.2), 0.4)
        bench.drive_until(_is_at_rest)
        reading = bench.drive(seconds=0.05)
        assert reading.pose.x_m == pytest.approx(bench.robot.world.pose[0], abs=0.001)
        assert reading.pose.heading_rad == pytest.approx(bench.robot.world.pose[2], abs=0.005)


@pytest.mark.parametrize("kind", KINDS)
def test_in_a_world_that_is_faster_no_motion_is_taken_for_a_restart(kind: str) -> None:
    with rig(kind, factor=6.0) as bench:
        bench.start()
        for _ in range(5):
            bench.drive(Velocity(0.0, 2.5))
            bench.host.sleep(0.1)
        bench.drive_until(_is_at_rest)
        reading = bench.drive(seconds=0.05)
        assert bench.robot.world.pose[2] > 4.0
        assert math.cos(reading.pose.heading_rad - bench.robot.world.pose[2]) == pytest.approx(1.0, abs=1e-2)


def test_torque_off_is_after_a_stop_and_on_again_without_motion(any_bench: Rig) -> None:
    any_bench.start()
    any_bench.drive(FORWARD, 0.2)
    any_bench.base.set_torque(False)
    assert any_bench.goals_rad_s() == (0.0, 0.0)
    assert not any_bench.drive(FORWARD, 0.1).is_torque_on
    assert not any_bench.robot.world.left.is_driven
    any_bench.base.set_torque(True)
    assert any_bench.robot.world.left.is_driven
    assert any_bench.goals_rad_s() == (0.0, 0.0)
    assert any_bench.drive(FORWARD, 0.3).velocity.linear_m_s == pytest.approx(0.15, abs=0.001)


def test_readings_are_of_now(bench: Rig) -> None:
    bench.start()
    begin_s = bench.host.monotonic()
    reading = bench.base.exchange(FORWARD)
    assert begin_s <= reading.time_s <= bench.host.monotonic()


def test_it_reports_its_battery(bench: Rig) -> None:
    bench.base.open()
    assert bench.base.exchange(FORWARD).battery_v == pytest.approx(12.0)


def test_closing_stops_the_wheels_and_lets_them_go(any_bench: Rig) -> None:
    any_bench.start()
    any_bench.drive(FORWARD, 0.2)
    any_bench.base.close()
    assert any_bench.robot.world.left.speed_rad_s == pytest.approx(0, abs=0.1)
    assert not any_bench.robot.world.left.is_driven
    any_bench.base.close()
    with pytest.raises(DeviceError, match="not open"):
        any_bench.base.exchange(FORWARD)
    any_bench.start()
    assert any_bench.drive(FORWARD, 0.2).is_torque_on


def test_it_may_be_closed_before_it_was_opened(any_bench: Rig) -> None:
    any_bench.base.close()


def test_a_robot_that_stood_still_in_the_meantime_is_where_it_was(any_bench: Rig) -> None:
    any_bench.start()
    any_bench.drive(FORWARD, 0.3)
    any_bench.drive_until(_is_at_rest)
    pose = any_bench.drive(seconds=0.05).pose
    any_bench.base.close()
    any_bench.base.open()
    assert any_bench.base.exchange(FORWARD).pose == pose


# Faults of the line.


def test_silence_is_reported_in_time_and_a_driver_that_dies_stops_the_wheels(bench: Rig) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.hurry()
    bench.robot.base_faults.is_deaf = True
    begin_s = bench.host.monotonic()
    with pytest.raises(DeviceSilentError, match="not answer"):
        bench.base.exchange(FORWARD)
    assert bench.host.monotonic() - begin_s < 0.3
    # The heartbeat, or the bus watchdogs, have nothing to live on.
    assert bench.stops_within(0.7)


def test_an_unplugged_line_is_reported_at_once_and_can_be_plugged_in_again(bench: Rig) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.robot.base_line.disconnect()
    begin_s = bench.host.monotonic()
    with pytest.raises(LineLostError, match=bench.robot.base_path):
        bench.base.exchange(FORWARD)
    assert bench.host.monotonic() - begin_s < 0.1
    with pytest.raises(LineMissingError):
        bench.base.open()
    assert bench.stops_within(1.0)
    bench.robot.base_line.reconnect()
    bench.base.open()
    reading = bench.drive(FORWARD, 0.1)
    assert not reading.is_torque_on
    assert bench.goals_rad_s() == (0.0, 0.0)
    bench.base.set_torque(True)
    assert bench.drive(FORWARD, 0.2).is_torque_on


def test_unplugged_while_it_waits(bench: Rig) -> None:
    bench.start()
    bench.robot.base_faults.is_deaf = True

    def unplug() -> None:
        bench.host.sleep(0.05)
        bench.robot.base_line.disconnect()

    hand = bench.host.thread(unplug, "hand")
    hand.start()
    with pytest.raises(LineLostError):
        bench.base.exchange(FORWARD)
    hand.join()


@pytest.mark.parametrize("fault", ["drop_next", "corrupt_next"])
def test_one_bad_answer_is_asked_for_again(bench: Rig, fault: str) -> None:
    bench.start()
    for _ in range(3):
        setattr(bench.robot.base_faults, fault, 1)
        reading = bench.drive(FORWARD, 0.0)
        assert reading.velocity.linear_m_s >= 0.0


@pytest.mark.parametrize(
    "fault",
    [{"corrupt_share": 1.0}, {"drop_share": 1.0}, {"delay_s": 0.2}, {"lose_bytes_share": 0.4}],
    ids=["damaged", "lost", "late", "cut"],
)
def test_only_bad_answers_are_no_reading(bench: Rig, fault: dict[str, float]) -> None:
    bench.start()
    bench.drive(FORWARD, 0.1)
    bench.hurry()
    vars(bench.robot.base_faults).update(fault)
    # The third time, OpenCR is waited for: it may be slow and not silent.
    longest_s = 0.66 if bench.kind == "opencr" else 0.3
    begin_s = bench.host.monotonic()
    for _ in range(5):
        exchange_s = bench.host.monotonic()
        with pytest.raises((DeviceSilentError, DeviceFaultError)):
            bench.base.exchange(FORWARD)
        assert bench.host.monotonic() - exchange_s < longest_s
    assert bench.host.monotonic() - begin_s < longest_s + 4 * 0.3


@pytest.mark.parametrize("length", [0x01, 0x04, 0x07])
def test_a_request_whose_length_was_damaged_costs_no_more_than_two_exchanges(
    bench: Rig, length: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A device waits for the rest of it, and takes the requests that follow for that."""
    bench.start()
    bench.drive(FORWARD, 0.1)
    bench.hurry()
    receive, is_damaged = bench.tap.device.receive, False

    def damaged(data: bytes, baud: int) -> object:
        nonlocal is_damaged
        if not is_damaged:
            is_damaged = True
            data = data[:6] + bytes((length,)) + data[7:]
        return receive(data, baud)

    monkeypatch.setattr(bench.tap.device, "receive", damaged)
    failed = 0
    while True:
        try:
            reading = bench.base.exchange(FORWARD)
        except DeviceSilentError:
            failed += 1
            assert failed <= 2
            continue
        break
    assert reading.is_torque_on
    assert bench.drive(FORWARD, 0.3).velocity.linear_m_s == pytest.approx(0.15, abs=0.001)


@pytest.mark.parametrize(
    "fault",
    [{"echo": True}, {"split_s": 0.0}, {"garbage": b"\xff\xff\xfd\x00\x01\xff"}, {"garbage": bytes(range(200))}],
    ids=["echo", "single bytes", "half a header", "garbage"],
)
def test_a_disturbed_line_is_understood(bench: Rig, fault: dict[str, object]) -> None:
    vars(bench.robot.base_faults).update(fault)
    bench.start()
    reading = bench.drive(FORWARD, 0.3)
    assert reading.velocity.linear_m_s == pytest.approx(0.15, abs=0.001)


@pytest.mark.parametrize(("fault", "share"), [("corrupt_share", 0.1), ("drop_share", 0.1), ("lose_bytes_share", 0.002)])
def test_noise_leads_to_a_right_reading_or_to_none(bench: Rig, fault: str, share: float) -> None:
    bench.start()
    last_m = 0.0
    readings = 0
    bench.hurry()
    setattr(bench.robot.base_faults, fault, share)
    end_s = bench.host.monotonic() + 1.0
    while bench.host.monotonic() < end_s:
        with contextlib.suppress(DeviceSilentError):
            reading = bench.base.exchange(Velocity(0.1, 0.0))
            readings += 1
            # Forward only, never further than the world's robot, never faster than commanded.
            assert last_m - 1e-9 <= reading.pose.x_m <= bench.robot.world.pose[0] + 1e-4
            assert all(-0.002 <= speed <= 0.102 for speed in reading.wheels_m_s)
            last_m = reading.pose.x_m
        bench.host.sleep(PERIOD_S)
    assert readings > 0


def test_answers_that_are_late_for_a_while_are_never_taken_for_new_ones(bench: Rig) -> None:
    bench.start()
    bench.drive(Velocity(0.1), 0.2)
    bench.hurry()
    for delay_s in (0.04, 0.06, 0.09, 0.15):
        bench.robot.base_faults.delay_s = delay_s
        with pytest.raises(DeviceSilentError):
            bench.base.exchange(Velocity(0.1))
        bench.robot.base_faults.delay_s = 0.0
        end_s = bench.host.monotonic() + 3.0
        while True:
            before_m = bench.robot.world.pose[0]
            try:
                reading = bench.base.exchange(Velocity(0.1))
            except DeviceSilentError:
                assert bench.host.monotonic() < end_s
                continue
            break
        # Reports of OpenCR are at most 20 ms old, and the wheels slip nowhere.
        assert before_m - 0.1 * 0.045 <= reading.pose.x_m <= bench.robot.world.pose[0] + 1e-4


def test_another_id_is_not_its_device(bench: Rig) -> None:
    device = bench.robot.opencr or bench.robot.bus
    assert device is not None
    device.answers_as = 7
    with pytest.raises(DeviceSilentError, match=r"does not answer.*but device 7 does|does not answer at 1000000 baud"):
        bench.base.open()


def test_a_busy_port_is_reported_as_such(bench: Rig) -> None:
    bench.base.open()
    other = make_drive_base(bench.kind, path=bench.robot.base_path, robot=ROBOTS["burger"], host=bench.host)
    with pytest.raises(Exception, match="another program uses this port"):
        other.open()


def test_wheels_that_are_held_are_reported(bench: Rig) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.robot.left.block_wheel()
    begin_s = bench.host.monotonic()
    reading = bench.drive_until(lambda reading: bool(reading.faults), FORWARD)
    assert bench.host.monotonic() - begin_s < 1.3
    assert reading.wheels_m_s[0] == 0.0
    # A person holds it until the motor gives up.
    reading = bench.drive_until(lambda reading: not reading.is_torque_on, FORWARD)
    assert reading.faults
    assert bench.stops_within(0.2)


def test_heading_is_within_half_a_turn(any_bench: Rig) -> None:
    any_bench.start()
    seen = [any_bench.drive(Velocity(0.0, 2.5), 0.1).pose.heading_rad for _ in range(16)]
    assert all(-math.pi < heading <= math.pi for heading in seen)
    assert min(seen) < -1.0


@pytest.mark.parametrize(
    ("kind", "torque_on"),
    [
        ("opencr", "ff ff fd 00 c8 06 00 03 95 00 01 4c 2d"),
        ("dynamixel", "ff ff fd 00 fe 0b 00 83 40 00 01 00 01 01 02 01 c7 64"),
    ],
)
def test_torque_is_not_switched_on_while_the_wheels_turn(kind: str, torque_on: str) -> None:
    with rig(kind) as bench:
        bench.base.open()
        # A push moves it, whatever its motor does.
        bench.robot.left._drive = lambda: None  # type: ignore[method-assign]
        wheel = bench.robot.world.left
        wheel.is_driven = True
        wheel.goal_rad_s = 2.0
        bench.until(lambda: bool(bench.robot.world.pose) and wheel.speed_rad_s == 2.0)
        with pytest.raises(DeviceError, match=r"still rotates?"):
            bench.base.set_torque(True)
        assert torque_on not in bench.tap.packets
