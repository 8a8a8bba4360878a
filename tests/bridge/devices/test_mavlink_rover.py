"""A MAVLink rover as a drive base and as a source of obstacles, over a real pseudo-terminal and real UDP."""

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from robosc_bridge.devices import mavlink_rover
from robosc_bridge.devices.interface import (
    STANDSTILL,
    DriveBase,
    DriveReading,
    MotorFault,
    RangeScanner,
    Scan,
    Velocity,
)
from robosc_bridge.devices.mavlink_rover import MavlinkRover
from robosc_bridge.devices.mavlink_signing import Signing
from robosc_bridge.devices.registry import make_drive_base, make_range_scanner
from robosc_bridge.devices.robots import Body
from robosc_bridge.errors import (
    DeviceError,
    DeviceFaultError,
    DeviceSilentError,
    LineBusyError,
    LineError,
    LineLostError,
    LineMissingError,
    WrongDeviceError,
)
from robosc_bridge.simulated import BODIES, DatagramLine, Rover, SimulatedLine, Timebase, Walls, World, room
from robosc_bridge.simulated.rover import AUTO, GUIDED, HOLD, MANUAL
from support.wire import wait_until

BODY = Body(0.5, 2.0, BODIES["burger"].wheel_separation_m)
FORWARD = Velocity(0.2)
POSE = (0.3, 0.2, 0.7)
KEY = bytes(range(32))


@dataclass
class Bench:
    """A simulated rover in a world, and drivers of it."""

    rover: Rover
    world: World
    time: Timebase
    line: SimulatedLine | DatagramLine
    base: MavlinkRover
    path: str

    def start(self) -> None:
        self.base.open()
        self.base.set_torque(True)

    def drive(self, velocity: Velocity = STANDSTILL, seconds: float = 0.0) -> DriveReading:
        end_s = time.monotonic() + seconds
        while True:
            reading = self.base.exchange(velocity)
            if time.monotonic() >= end_s:
                return reading
            time.sleep(0.01)

    def drive_until(
        self, is_so: Callable[[DriveReading], bool], velocity: Velocity = STANDSTILL, limit_s: float = 5.0
    ) -> DriveReading:
        end_s = time.monotonic() + limit_s
        while not is_so(reading := self.base.exchange(velocity)):
            assert time.monotonic() < end_s, f"not within {limit_s} s; the last reading is {reading}"
            time.sleep(0.01)
        return reading

    @property
    def speed_m_s(self) -> float:
        """That its motors are told."""
        wheels = (self.world.left, self.world.right)
        return sum(wheel.goal_rad_s * 0.033 / 2 for wheel in wheels if wheel.is_driven)


@contextmanager
def rig(
    kind: str = "pty", key: bytes | None = None, vehicle: tuple[int, int] = (10, 3), **arguments: Any
) -> Iterator[Bench]:
    passing = Timebase()
    world = World(BODIES["burger"], room(4.0, 3.0), passing, POSE)
    rover = Rover(world, key=key, heartbeat_s=0.2)
    rover.kind, rover.autopilot = vehicle
    line: SimulatedLine | DatagramLine
    if kind == "pty":
        line = SimulatedLine(rover, passing)
        path = line.path
    elif kind == "udpout":
        line = DatagramLine(rover, passing)
        path = f"udpout:127.0.0.1:{line.port}"
    else:
        with DatagramLine(rover, passing) as other:
            free = other.port
        line = DatagramLine(rover, passing, free)
        path = f"udpin:127.0.0.1:{free}"
    base = make_drive_base("mavlink-rover", path=path, robot=BODY, **arguments)
    assert isinstance(base, MavlinkRover)
    try:
        yield Bench(rover, world, passing, line, base, path)
    finally:
        base.close()
        line.close()


@pytest.fixture(params=["pty", "udpin", "udpout"])
def any_bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    with rig(request.param) as found:
        yield found


@pytest.fixture
def bench() -> Iterator[Bench]:
    with rig() as found:
        yield found


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    """Waits for what never comes are short."""
    for name, limit_s in (("_ANSWER_LIMIT_S", 0.2), ("_SHOWN_LIMIT_S", 1.0), ("_FIRST_HEARTBEAT_LIMIT_S", 1.0)):
        monkeypatch.setattr(mavlink_rover, name, limit_s)


# What holds for every drive base.


def test_a_missing_port_is_told() -> None:
    base: DriveBase = make_drive_base("mavlink-rover", path="/dev/none", robot=BODY)
    with pytest.raises(LineMissingError, match="/dev/none: there is no such port"):
        base.open()
    base.close()
    with pytest.raises(DeviceError, match="not open"):
        base.exchange(FORWARD)


def test_it_opens_disarmed_and_drives_as_told(any_bench: Bench) -> None:
    bench = any_bench
    bench.base.open()
    reading = bench.drive(FORWARD, 0.2)
    assert not reading.is_torque_on
    assert not bench.rover.is_armed
    assert bench.rover.targets == []
    assert reading.battery_v is None or reading.battery_v == pytest.approx(12.0)
    bench.base.set_torque(True)
    assert bench.rover.is_armed
    assert bench.rover.mode == GUIDED
    reading = bench.drive(Velocity(0.2, 0.5), 0.6)
    assert reading.is_torque_on
    assert reading.faults == frozenset()
    assert reading.velocity.linear_m_s == pytest.approx(0.2, abs=0.001)
    assert reading.velocity.angular_rad_s == pytest.approx(0.5, abs=0.01)
    assert reading.wheels_m_s == pytest.approx((0.16, 0.24), abs=0.002)
    bench.drive_until(lambda reading: reading.velocity == STANDSTILL)
    reading = bench.drive(seconds=0.2)
    x_m, y_m, heading_rad = bench.world.pose
    # As seen from where it was.
    ahead_m = (x_m - POSE[0]) * math.cos(POSE[2]) + (y_m - POSE[1]) * math.sin(POSE[2])
    left_m = (y_m - POSE[1]) * math.cos(POSE[2]) - (x_m - POSE[0]) * math.sin(POSE[2])
    assert (reading.pose.x_m, reading.pose.y_m) == pytest.approx((ahead_m, left_m), abs=0.001)
    assert reading.pose.heading_rad == pytest.approx(heading_rad - POSE[2], abs=0.001)
    assert reading.pose.heading_rad > 0.2
    assert reading.battery_v == pytest.approx(12.0)
    assert reading.battery_share == pytest.approx(0.77)
    bench.base.close()
    assert not bench.rover.is_armed
    bench.base.close()


def test_it_goes_where_it_is_told_in_the_worked_packets_fields(bench: Bench) -> None:
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
    begin_s = time.monotonic()
    bench.drive(FORWARD, 1.0)
    passed_s = time.monotonic() - begin_s
    count = len(bench.rover.targets) - before
    assert 5 * passed_s <= count <= 11 * passed_s + 2
    bench.base.exchange(STANDSTILL)
    wait_until(lambda: bench.rover.targets[-1]["vx"] == 0.0, 0.08)
    before = len(bench.rover.targets)
    for step in range(100):
        bench.base.exchange(Velocity(0.1 + step / 1000))
        time.sleep(0.001)
    # A slow radio is not filled.
    assert len(bench.rover.targets) - before < 15


def test_our_heartbeat_goes_on_while_it_is_driven_and_never_without(any_bench: Bench) -> None:
    bench = any_bench
    bench.base.open()
    before = len(bench.rover.heartbeats)
    bench.drive(FORWARD, 2.3)
    assert 2 <= len(bench.rover.heartbeats) - before <= 3
    assert set(bench.rover.heartbeats) == {(255, 190)}
    before = len(bench.rover.heartbeats)
    time.sleep(1.3)
    assert len(bench.rover.heartbeats) - before == 0


def test_a_driver_that_dies_stops_the_vehicle(bench: Bench) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    assert bench.speed_m_s == pytest.approx(0.2, abs=0.001)
    begin_s = time.monotonic()
    wait_until(lambda: bench.speed_m_s == 0.0, 4.0)
    assert time.monotonic() - begin_s == pytest.approx(3.0, abs=0.3)


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
    bench.base._is_torque_wanted = False  # As a process that is gone, which closes nothing.
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
    bench.rover.tells_motion = False
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


# What the vehicle refuses, and what others do with it.


def test_a_refusal_to_arm_tells_the_vehicles_reason(bench: Bench) -> None:
    bench.rover.refusal = (
        "GPS 1: Bad fix, and the compass is not calibrated either, so that nothing at all can be known"
    )
    bench.base.open()
    with pytest.raises(
        DeviceFaultError, match=r"does not arm \(failed\): PreArm: GPS 1: .* nothing at all can be known"
    ):
        bench.base.set_torque(True)
    assert not bench.drive(FORWARD, 0.1).is_torque_on
    bench.rover.refusal = ""
    bench.base.set_torque(True)
    assert bench.drive(FORWARD, 0.1).is_torque_on


def test_a_refused_mode_is_told(bench: Bench) -> None:
    bench.rover.refused_modes = (GUIDED,)
    bench.base.open()
    with pytest.raises(DeviceFaultError, match=r"does not go to mode GUIDED \(failed\): it gives no reason"):
        bench.base.set_torque(True)
    assert not bench.rover.is_armed


@pytest.mark.usefixtures("hasty")
def test_an_accepted_command_is_not_a_done_one(bench: Bench) -> None:
    bench.base.open()
    bench.rover.obeys_commands = False
    with pytest.raises(DeviceFaultError, match="accepted the command, but does not show mode GUIDED"):
        bench.base.set_torque(True)


@pytest.mark.usefixtures("hasty")
def test_commands_are_repeated_and_their_silence_is_told(bench: Bench) -> None:
    bench.base.open()
    bench.rover.answers_commands = False
    with pytest.raises(DeviceSilentError, match="does not answer when told to go to mode GUIDED"):
        bench.base.set_torque(True)
    assert [number for number, _ in bench.rover.commands if number == 176] == [176] * 3


def test_disarming_that_is_refused_is_forced(bench: Bench) -> None:
    bench.start()
    bench.rover.refuses_disarming = True
    bench.base.set_torque(False)
    assert not bench.rover.is_armed
    assert bench.rover.commands[-1] == (400, (0.0, 21196.0, 0, 0, 0, 0, 0))


@pytest.mark.parametrize("how", ["mode", "disarmed"])
def test_a_vehicle_that_is_taken_away_is_told_and_left_alone(bench: Bench, how: str) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    if how == "mode":
        bench.rover.take_over(MANUAL, -0.1)
    else:
        bench.rover.disarm()
    reading = bench.drive_until(lambda reading: not reading.is_torque_on, FORWARD, 1.5)
    assert reading.faults == {MotorFault.TORQUE_LOST}
    # It stays lost, also if it is given back: nothing moves until a person says so.
    bench.rover.take_over(GUIDED)
    reading = bench.drive(FORWARD, 1.2)
    assert not reading.is_torque_on
    assert reading.faults == {MotorFault.TORQUE_LOST}
    assert bench.speed_m_s == 0.0
    bench.base.reset()
    assert not bench.rover.is_armed
    bench.base.set_torque(True)
    assert bench.drive(FORWARD, 0.1).is_torque_on


def test_closing_leaves_a_vehicle_that_a_person_drives_to_them(bench: Bench) -> None:
    bench.start()
    bench.rover.take_over(MANUAL, -0.1)
    bench.drive_until(lambda reading: not reading.is_torque_on, FORWARD, 1.5)
    bench.base.set_torque(False)
    with pytest.raises(DeviceFaultError, match="somebody else drives the rover"):
        bench.base.set_torque(True)
    bench.base.close()
    assert bench.rover.is_armed
    assert bench.speed_m_s == pytest.approx(-0.1)
    with pytest.raises(DeviceFaultError, match="somebody else drives the rover: it is armed in mode MANUAL"):
        bench.base.open()
    assert bench.speed_m_s == pytest.approx(-0.1)


def test_a_vehicle_that_is_held_is_told(bench: Bench) -> None:
    bench.start()
    bench.drive(FORWARD, 0.3)
    bench.world.left.is_blocked = bench.world.right.is_blocked = True
    begin_s = time.monotonic()
    reading = bench.drive_until(lambda reading: bool(reading.faults), FORWARD)
    assert reading.faults == {MotorFault.BLOCKED}
    assert 1.9 < time.monotonic() - begin_s < 3.0


@pytest.mark.usefixtures("hasty")
@pytest.mark.parametrize("vehicle", [(2, 3), (10, 12)])
def test_another_vehicle_is_told(vehicle: tuple[int, int]) -> None:
    with (
        rig(vehicle=vehicle) as bench,
        pytest.raises(WrongDeviceError, match="of type {} with autopilot {}, not ArduPilot Rover".format(*vehicle)),
    ):
        bench.base.open()


@pytest.mark.usefixtures("hasty")
def test_a_ground_station_is_no_vehicle() -> None:
    with rig(vehicle=(6, 8)) as bench, pytest.raises(DeviceSilentError, match="no heartbeat of a rover within 1 s"):
        bench.base.open()


@pytest.mark.usefixtures("hasty")
def test_another_system_than_was_asked_for_is_told() -> None:
    with rig(system=2) as bench, pytest.raises(WrongDeviceError, match="or has another system number"):
        bench.base.open()


@pytest.mark.usefixtures("hasty")
def test_a_vehicle_that_does_not_know_where_it_is_cannot_be_driven(bench: Bench) -> None:
    bench.rover.has_origin = False
    with pytest.raises(DeviceFaultError, match="does not tell where it is"):
        bench.base.open()


# Faults of the line.


def test_silence_is_told_in_time(any_bench: Bench) -> None:
    bench = any_bench
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.rover.is_silent = True
    begin_s = time.monotonic()
    with pytest.raises(DeviceSilentError, match="has not told its motion for 1 s"):
        bench.drive(FORWARD, 3.0)
    wait_until(lambda: bench.speed_m_s == 0.0, 0.5)
    assert 0.8 < time.monotonic() - begin_s < 1.4


def test_lost_heartbeats_are_told_though_telemetry_goes_on(bench: Bench) -> None:
    bench.start()
    bench.rover._due_s[0] = math.inf
    begin_s = time.monotonic()
    with pytest.raises(DeviceSilentError, match=r"no heartbeat of the rover for 3\.5 s"):
        bench.drive(FORWARD, 6.0)
    assert 3.0 < time.monotonic() - begin_s < 4.0


def test_a_vehicle_that_starts_anew_must_be_opened_again(bench: Bench) -> None:
    bench.start()
    bench.drive(FORWARD, 2.5)
    with bench.time.lock:
        bench.rover.restart()
        # A fast one, which goes on telling what it was asked for.
        bench.rover._after_interval(30, 0.05)
    with pytest.raises(DeviceError, match="has started anew"):
        bench.drive(FORWARD, 2.0)
    bench.start()
    assert bench.drive(FORWARD, 0.2).is_torque_on


def test_an_unplugged_line_is_told_at_once_and_can_be_plugged_in_again(bench: Bench) -> None:
    assert isinstance(bench.line, SimulatedLine)
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.line.disconnect()
    begin_s = time.monotonic()
    with pytest.raises(LineLostError, match=bench.path):
        bench.drive(FORWARD, 1.0)
    assert time.monotonic() - begin_s < 0.2
    with pytest.raises(LineMissingError):
        bench.base.open()
    bench.line.reconnect()
    bench.base.open()
    assert not bench.drive(FORWARD, 0.1).is_torque_on
    assert not bench.rover.is_armed


def test_nobody_at_the_other_end_of_udp_is_silence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mavlink_rover, "_FIRST_HEARTBEAT_LIMIT_S", 0.2)
    base = make_drive_base("mavlink-rover", path="udpout:127.0.0.1:9", robot=BODY)
    with pytest.raises(DeviceSilentError):
        base.open()


@pytest.mark.parametrize("fault", ["corrupt_share", "drop_share"])
@pytest.mark.parametrize("kind", ["pty", "udpout"])
def test_a_disturbed_line_is_driven_on(kind: str, fault: str) -> None:
    with rig(kind) as bench:
        bench.start()
        setattr(bench.line.faults, fault, 0.2)
        reading = bench.drive(FORWARD, 1.0)
        assert reading.is_torque_on
        assert reading.velocity.linear_m_s == pytest.approx(0.2, abs=0.001)
        assert bench.base._link is not None
        assert (bench.base._link.counts.bad_frames > 0) == (fault == "corrupt_share")


def test_noise_before_every_packet_is_dropped(bench: Bench) -> None:
    assert isinstance(bench.line, SimulatedLine)
    bench.line.faults.garbage = bytes.fromhex("fd ff 00 00 01 01 01 00 00 00 fe")
    bench.start()
    assert bench.drive(FORWARD, 0.3).velocity.linear_m_s == pytest.approx(0.2, abs=0.001)


def test_a_busy_port_is_told(bench: Bench) -> None:
    bench.base.open()
    other = make_drive_base("mavlink-rover", path=bench.path, robot=BODY)
    with pytest.raises(LineBusyError, match="another drive base of this program uses this port"):
        other.open()
    stranger = make_range_scanner("mavlink-rover", path=bench.path, baud=9600)
    with pytest.raises(LineBusyError, match="with other settings"):
        stranger.open()
    assert not bench.drive(FORWARD).is_torque_on


def test_nothing_is_left_behind(any_bench: Bench) -> None:
    def count() -> tuple[int, int]:
        return len(list(Path("/proc/self/fd").iterdir())), threading.active_count()

    before = count()
    for _ in range(2):
        any_bench.base.open()
        any_bench.base.close()
    assert count() == before


@pytest.mark.parametrize("values", [(0.0, 1.0, 0.3), (0.5, math.nan, 0.3), (0.5, 1.0, -1.0)])
def test_a_body_needs_numbers(values: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="must be a positive number"):
        Body(*values)


# Signing.


def test_a_signed_vehicle_is_driven_with_its_key_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mavlink_rover, "_FIRST_HEARTBEAT_LIMIT_S", 1.0)
    key_file = tmp_path / "key"
    key_file.write_text(KEY.hex())
    with rig(key=KEY, signing=Signing(key_file)) as bench:
        # Its clock does not go back to when it was built.
        bench.rover._encoder.timestamp = Signing(key_file).begin().timestamp()
        bench.start()
        assert bench.drive(FORWARD, 0.3).velocity.linear_m_s == pytest.approx(0.2, abs=0.001)
        assert bench.rover.parser.rejected == 0
        bench.base.close()
        key_file.write_bytes(bytes(32))
        with pytest.raises(DeviceSilentError, match="the same signing key"):
            bench.base.open()


# Obstacles.


def _next(scanner: RangeScanner, limit_s: float = 3.0) -> Scan:
    scan = scanner.receive(limit_s)
    assert scan is not None
    return scan


def _check(bench: Bench, scan: Scan, width_deg: float) -> None:
    """Every bin is as near as the nearest in its sector: not nearer than anything there, not farther than the wall."""
    assert len(scan.ranges_m) == 360
    for k, range_m in enumerate(scan.ranges_m):
        around = [math.radians(k + part * width_deg / 20) for part in range(-20, 21)]
        assert min(bench.world.ranges(around)) - 0.02 <= range_m <= max(bench.world.ranges(around)) + 0.02, k


@pytest.mark.parametrize("obstacles", ["ring", "north ring", "sensors"])
def test_obstacles_are_where_they_are(any_bench: Bench, obstacles: str) -> None:
    bench = any_bench
    bench.rover.obstacles = obstacles
    bench.rover._interval_s[30] = 0.1  # Attitude: which way is north.
    bench.rover._due_s[30] = 0.0
    scanner = make_range_scanner("mavlink-rover", path=bench.path)
    scanner.open()
    try:
        begin_s = time.monotonic()
        scan = _next(scanner)
        _check(bench, scan, 45.0 if obstacles == "sensors" else 6.0)
        assert begin_s < scan.time_s <= time.monotonic()
        assert scanner.counters.scans >= 1
        # Alone on the line, it is who is there.
        end_s = time.monotonic() + 3.0
        while (255, 190) not in bench.rover.heartbeats:
            assert time.monotonic() < end_s
            scanner.receive(0.1)
    finally:
        scanner.close()
    with pytest.raises(LineLostError, match="not open"):
        scanner.receive(0.0)


def test_drive_base_and_scanner_share_a_line_and_outlive_each_other(bench: Bench) -> None:
    scanner = make_range_scanner("mavlink-rover", path=bench.path)
    bench.base.open()
    scanner.open()
    seen: list[Scan] = []
    ended = threading.Event()

    def look() -> None:
        while not ended.is_set():
            if scan := scanner.receive(0.5):
                seen.append(scan)

    thread = threading.Thread(target=look)
    thread.start()
    try:
        bench.base.set_torque(True)
        reading = bench.drive(Velocity(0.1, 0.3), 1.5)
        assert reading.velocity.linear_m_s == pytest.approx(0.1, abs=0.001)
        assert len(seen) >= 10
        assert 1 <= len(bench.rover.heartbeats) <= 4
        # The base no longer lives: its heartbeat ends though the scanner goes on, until the base is closed.
        before = len(bench.rover.heartbeats)
        time.sleep(1.3)
        assert len(bench.rover.heartbeats) == before
        bench.base.close()
        count = len(seen)
        wait_until(lambda: len(seen) > count + 2)
        bench.base.open()
    finally:
        ended.set()
        scanner.wake()
        thread.join()
        scanner.close()
    assert not bench.drive(FORWARD, 0.1).is_torque_on


def test_a_scanner_that_waits_is_woken_and_told_of_a_lost_line(bench: Bench) -> None:
    assert isinstance(bench.line, SimulatedLine)
    bench.rover.is_silent = True
    scanner = make_range_scanner("mavlink-rover", path=bench.path)
    scanner.open()
    timer = threading.Timer(0.1, scanner.wake)
    timer.start()
    begin_s = time.monotonic()
    assert scanner.receive(5.0) is None
    assert time.monotonic() - begin_s < 1.0
    timer.join()
    timer = threading.Timer(0.1, bench.line.disconnect)
    timer.start()
    with pytest.raises(LineError):
        scanner.receive(5.0)
    timer.join()
    scanner.close()


def test_a_scanner_asks_again_when_told_to(bench: Bench) -> None:
    scanner = make_range_scanner("mavlink-rover", path=bench.path)
    scanner.open()
    _next(scanner)
    bench.rover.restart()
    while scanner.receive(0.5):
        pass
    scanner.restart()
    _next(scanner)
    scanner.close()


def test_modes_of_others_have_names(bench: Bench) -> None:
    bench.rover.is_armed = True
    bench.rover.take_over(AUTO)
    with pytest.raises(DeviceFaultError, match="armed in mode AUTO"):
        bench.base.open()
    bench.rover.take_over(HOLD)
    with pytest.raises(DeviceFaultError, match="armed in mode HOLD"):
        bench.base.open()


def test_walls_that_are_too_far_are_none() -> None:
    with rig("udpout") as bench:
        bench.world.walls = Walls(())
        scanner = make_range_scanner("mavlink-rover", path=bench.path)
        scanner.open()
        assert all(map(math.isnan, _next(scanner).ranges_m))
        scanner.close()
