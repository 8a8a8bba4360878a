"""A MAVLink rover as a drive base, on a virtual host."""

import math

import pytest

from robosc_bridge.devices.interface import STANDSTILL, BatteryLevel, DriveBase, Velocity
from robosc_bridge.devices.mavlink_odometry import estimate
from robosc_bridge.driver_registry import make_drive_base, make_range_scanner
from robosc_bridge.errors import DeviceError, DeviceSilentError, LineMissingError, WrongDeviceError
from support.rovers import BODY, FORWARD, POSE, Bench, rig


def test_a_missing_port_is_reported() -> None:
    base: DriveBase = make_drive_base("mavlink-rover", path="/dev/none", robot=BODY)
    with pytest.raises(LineMissingError, match="/dev/none: there is no such port"):
        base.open()
    base.close()
    with pytest.raises(DeviceError, match="not open"):
        base.exchange(FORWARD)


def test_it_goes_where_the_fields_of_the_worked_packets_send_it(bench: Bench) -> None:
    bench.start()
    bench.drive(Velocity(0.1, -0.5), 0.05)
    values = bench.rover.targets[-1]
    assert (values["vx"], values["yaw_rate"]) == pytest.approx((0.1, 0.5))
    assert (values["type_mask"], values["frame"]) == (0x05E7, 8)
    assert (values["target_system"], values["target_component"]) == (1, 1)
    # Beyond its limits.
    bench.drive(Velocity(-9.0, 9.0), 0.05)
    assert (bench.rover.targets[-1]["vx"], bench.rover.targets[-1]["yaw_rate"]) == pytest.approx((-0.5, -2.0))


def test_targets_are_repeated_and_new_ones_go_at_once(bench: Bench) -> None:
    bench.start()
    before = len(bench.rover.targets)
    begin_s = bench.host.monotonic()
    bench.drive(FORWARD, 1.0)
    passed_s = bench.host.monotonic() - begin_s
    count = len(bench.rover.targets) - before
    assert 5 * passed_s <= count <= 11 * passed_s + 2
    bench.base.exchange(STANDSTILL)
    bench.until(lambda: bench.rover.targets[-1]["vx"] == 0.0, 0.08)
    before = len(bench.rover.targets)
    for step in range(100):
        bench.base.exchange(Velocity(0.1 + step / 1000))
        bench.host.sleep(0.001)
    # A slow radio is not filled.
    assert len(bench.rover.targets) - before < 15


class _Source:
    """Source without anything newer that counts what was written."""

    count = 0

    def newer(self) -> Velocity | None:
        return None

    def written(self) -> None:
        self.count += 1


def test_a_velocity_counts_as_written_when_the_rover_was_sent_it(bench: Bench) -> None:
    bench.start()
    bench.drive(STANDSTILL, 0.2)
    source = _Source()
    bench.base.attend(source)
    bench.host.sleep(0.05)
    # One goes out ahead of the second one's turn, and the third one waits.
    for step, count in enumerate((1, 2, 2)):
        bench.base.exchange(Velocity(0.1 + step / 100))
        assert source.count == count
        bench.host.sleep(0.001)
    bench.host.sleep(0.02)
    bench.base.exchange(Velocity(0.12))
    assert source.count == 3
    # It has that one.
    bench.base.exchange(Velocity(0.12))
    assert source.count == 4
    bench.host.sleep(0.001)
    assert [round(target["vx"], 2) for target in bench.rover.targets[-3:]] == [0.1, 0.11, 0.12]


def test_a_vehicle_that_does_not_report_its_motion_is_stopped_and_reported_after_1_s(bench: Bench) -> None:
    bench.start()
    last_s = bench.drive(FORWARD, 0.2).time_s
    bench.rover.is_silent = True
    with pytest.raises(DeviceSilentError, match="has not reported its motion for 1 s"):
        bench.drive(FORWARD, 30.0)
    # It is looked at every 10 ms.
    assert 1.0 < bench.host.monotonic() - last_s < 1.015
    bench.host.sleep(0.001)
    assert bench.rover.targets[-1]["vx"] == 0.0
    assert bench.speed_m_s == 0.0


def test_a_driver_that_dies_stops_the_vehicle(bench: Bench) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    assert bench.speed_m_s == pytest.approx(0.2, abs=0.001)
    begin_s = bench.host.monotonic()
    bench.until(lambda: bench.speed_m_s == 0.0, 4.0)
    assert bench.host.monotonic() - begin_s == pytest.approx(3.0, abs=0.3)


def test_our_heartbeat_goes_on_while_it_is_driven_and_never_without(bench: Bench) -> None:
    bench.base.open()
    # It was sent when the vehicle was looked for; the next ones come once a second.
    assert bench.rover.heartbeats == [(254, 191)]
    bench.drive(FORWARD, 60.0)
    assert bench.rover.heartbeats == [(254, 191)] * 60
    bench.host.sleep(60.0)
    assert len(bench.rover.heartbeats) == 60


def test_it_is_no_ground_station_and_may_have_numbers_of_its_own() -> None:
    """Ground stations are 255/190: a second one of these would share their answers and their failsafe."""
    with rig(own_system=1, own_component=193) as bench:
        bench.base.open()
        assert bench.rover.heartbeats == [(1, 193)]
        bench.base.set_torque(True)
        assert bench.rover.is_armed


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        ({"system": 7, "own_system": 7, "own_component": 1}, "own_system 7 and own_component 1 are the autopilot's"),
        ({"own_system": 0}, "own_system must be from 1 to 255, not 0"),
        ({"own_component": 256}, "own_component must be from 1 to 255, not 256"),
        ({"system": 0}, "system must be from 1 to 255, not 0"),
    ],
)
@pytest.mark.parametrize("kind", ["drive base", "scanner"])
def test_numbers_that_cannot_be_are_refused_before_anything_is_opened(
    kind: str, arguments: dict[str, int], problem: str
) -> None:
    with pytest.raises(ValueError, match=problem):
        if kind == "scanner":
            make_range_scanner("mavlink-rover", path="/dev/none", **arguments)
        else:
            make_drive_base("mavlink-rover", path="/dev/none", robot=BODY, **arguments)


def test_a_rover_that_has_the_bridge_s_numbers_is_refused_before_anything_is_sent() -> None:
    with rig(own_system=1, own_component=1) as bench:
        with pytest.raises(
            WrongDeviceError, match=r"numbers 1 \(system\) and 1 \(component\), as the bridge; set own_"
        ):
            bench.base.open()
        assert bench.rover.targets == []
        assert not bench.rover.is_armed


def test_silence_stops_it_and_is_reported_when_its_last_estimate_has_grown_old(bench: Bench) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    motion = bench.base._link and estimate(bench.base._link.state)
    assert motion
    bench.rover.is_silent = True
    with pytest.raises(DeviceSilentError, match="has not reported its motion for 1 s"):
        bench.drive(FORWARD, 3.0)
    # It is looked at every 10 ms.
    assert bench.host.monotonic() - motion.time_s == pytest.approx(1.01, abs=1e-6)
    bench.host.sleep(0.0)
    assert bench.rover.targets[-1]["vx"] == 0.0
    assert bench.speed_m_s == 0.0


def test_torque_off_is_after_a_stop_and_on_again_without_motion(bench: Bench) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.base.set_torque(False)
    assert not bench.rover.is_armed
    assert bench.rover.targets[-1]["vx"] == 0.0
    assert not bench.drive(FORWARD, 0.1).is_torque_on
    assert bench.rover.targets[-1]["vx"] == 0.0
    bench.base.set_torque(True)
    assert bench.speed_m_s == 0.0
    assert bench.drive(FORWARD, 0.4).velocity.linear_m_s == pytest.approx(0.2, abs=0.001)


def test_a_vehicle_of_a_driver_that_died_is_left_at_rest_when_opened(bench: Bench) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.base._is_torque_wanted = False  # A process that is gone has closed nothing.
    bench.base._release()
    assert bench.rover.is_armed
    bench.base.open()
    assert not bench.rover.is_armed
    assert bench.world.speed_m_s == 0.0


def test_a_robot_that_was_moved_while_closed_is_where_it_was(bench: Bench) -> None:
    bench.start()
    bench.drive(FORWARD, 0.3)
    bench.drive_until(lambda reading: reading.velocity == STANDSTILL)
    pose = bench.drive(seconds=0.2).pose
    assert pose.x_m > 0.02
    bench.base.close()
    bench.world.place(-0.5, 0.1, 2.0)
    bench.base.open()
    assert bench.base.exchange(FORWARD).pose == pose


def test_place_and_attitude_do_where_there_is_no_odometry(bench: Bench) -> None:
    bench.rover.reports_motion = False
    bench.start()
    bench.drive(Velocity(0.2, 0.6), 0.5)
    reading = bench.drive(Velocity(-0.2, 0.6), 0.4)
    assert reading.velocity.linear_m_s == pytest.approx(-0.2, abs=0.01)
    assert reading.velocity.angular_rad_s == pytest.approx(0.6, abs=0.01)
    bench.drive_until(lambda reading: abs(reading.velocity.linear_m_s) < 1e-6)
    reading = bench.drive(seconds=0.2)
    assert reading.pose.heading_rad == pytest.approx(bench.world.pose[2] - POSE[2], abs=0.005)


def test_an_estimate_that_jumps_is_no_motion(bench: Bench) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.drive_until(lambda reading: reading.velocity == STANDSTILL)
    pose = bench.drive(seconds=0.2).pose
    with bench.time.lock:
        bench.rover.shift_m = (5.0, -3.0)
        bench.rover.resets += 1
    assert bench.drive(seconds=0.3).pose == pose


@pytest.mark.parametrize("reports_motion", [True, False])
def test_an_estimator_that_is_reset_without_a_word_moves_nothing_and_is_counted(
    bench: Bench, reports_motion: bool
) -> None:
    bench.rover.reports_motion = reports_motion
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.drive_until(lambda reading: abs(reading.velocity.linear_m_s) < 1e-6)
    before = bench.drive(seconds=0.3)
    assert before.refused == 0
    with bench.time.lock:
        bench.rover.shift_m = (112.0, -3.0)
        bench.rover.shift_rad = math.pi / 2
    after = bench.drive(seconds=0.5)
    assert (after.pose, after.refused > 0) == (before.pose, True)
    assert bench.base.counters.implausible == after.refused
    assert bench.base.counters.begun_anew >= 1
    # It is driven on, and ahead is where it looks.
    x_m = bench.drive(FORWARD, 1.0).pose.x_m
    assert x_m == pytest.approx(before.pose.x_m + 0.2, abs=0.05)


def test_a_single_estimate_that_cannot_be_counts_for_nothing(bench: Bench) -> None:
    bench.start()
    before = bench.drive(seconds=0.3)
    with bench.time.lock:
        bench.rover.shift_m = (50.0, 0.0)
    bench.drive_until(lambda reading: reading.refused == 1)
    with bench.time.lock:
        bench.rover.shift_m = (0.0, 0.0)
    after = bench.drive(seconds=0.3)
    assert after.pose.x_m == pytest.approx(before.pose.x_m, abs=1e-6)
    assert after.refused == 1
    assert bench.base.counters.begun_anew == 0


@pytest.mark.parametrize(
    ("states", "level"),
    [
        ((1, 1), BatteryLevel.SOUND),
        ((1, 2), BatteryLevel.LOW),
        ((1, 3), BatteryLevel.EMPTY),
        ((3, 1), BatteryLevel.EMPTY),
        ((1, 0), BatteryLevel.SOUND),
        ((0, 4), BatteryLevel.EMPTY),
        ((2, 6), BatteryLevel.LOW),
        ((0, 0), None),
    ],
)
def test_the_worst_battery_counts(bench: Bench, states: tuple[int, int], level: BatteryLevel | None) -> None:
    bench.rover.charge_state = states[0]
    bench.rover.more_batteries = [(5.0, states[1])]
    bench.start()
    reading = bench.drive(seconds=1.5)
    assert reading.battery_level is level
    # The voltage is that of the first.
    assert reading.battery_v == 12.0


@pytest.mark.parametrize("left_s", [1.0, 3.0, -100.0])
def test_a_rover_is_driven_on_when_its_clock_begins_anew(bench: Bench, left_s: float) -> None:
    # It counts milliseconds in 32 bits: 49.7 days.
    bench.rover._began_s -= 2**32 / 1000 - left_s
    bench.start()
    reading = bench.drive(FORWARD, 4.0)
    assert reading.is_torque_on
    assert bench.base.counters.implausible == 0
