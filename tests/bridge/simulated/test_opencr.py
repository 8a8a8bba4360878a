"""OpenCR as its host meets it: heartbeat, clamps, memory without protection, battery."""

import math
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from dynamixel_sdk import PacketHandler

from robosc.execution.runtime.clock import ManualClock
from robosc_simulated import Noise, OpenCr, Scene, SimulatedTurtleBot3, Walls
from robosc_simulated.packets import crc16
from support.wire import SdkPort

OPEN_SPACE = Walls(())


class Station:
    """A host with dynamixel-sdk, and the robot at the other end."""

    def __init__(self, robot: SimulatedTurtleBot3) -> None:
        assert robot.opencr is not None
        self.robot = robot
        self.opencr: OpenCr = robot.opencr
        self.port = SdkPort(robot.base_line)
        self.handler = PacketHandler(2.0)
        self.beats = 0

    def read(self, address: int, code: str) -> float:
        data, result, error = self.handler.readTxRx(self.port, 200, address, struct.calcsize("<" + code))
        assert (result, error) == (0, 0)
        value: float = struct.unpack("<" + code, bytes(data))[0]
        return value

    def write(self, address: int, data: bytes) -> None:
        assert self.handler.writeTxRx(self.port, 200, address, len(data), list(data)) == (0, 0)

    def command(self, linear: int, angular: int = 0) -> None:
        self.write(150, struct.pack("<6i", linear, 0, 0, 0, 0, angular))

    def beat(self) -> None:
        self.beats = self.beats % 255 + 1
        self.write(19, bytes((self.beats,)))

    def update(self, seconds: float) -> None:
        """With a heartbeat every 100 ms."""
        for _ in range(round(seconds / 0.1)):
            self.beat()
            self.robot.advance(0.1)

    def wheels(self) -> tuple[float, float]:
        return self.read(128, "i"), self.read(132, "i")


@pytest.fixture
def station() -> Iterator[Station]:
    with SimulatedTurtleBot3("burger", "opencr", walls=OPEN_SPACE, clock=ManualClock()) as robot:
        station = Station(robot)
        yield station
        station.port.closePort()


@pytest.fixture
def waffle() -> Iterator[Station]:
    with SimulatedTurtleBot3("waffle", "opencr", walls=OPEN_SPACE, clock=ManualClock()) as robot:
        station = Station(robot)
        yield station
        station.port.closePort()


def test_it_drives_while_it_hears_a_heartbeat(station: Station) -> None:
    station.update(0.2)
    assert station.read(15, "B") == 1
    station.command(10)
    station.update(1.0)
    assert station.robot.world.pose == pytest.approx((0.1, 0.0, 0.0), abs=0.004)
    # 0.10 m/s is 126 after the cast.
    assert station.wheels() == (126, 126)
    assert station.read(136, "i") == pytest.approx(0.1 / (2 * math.pi * 0.033) * 4096, abs=120)


def test_commands_without_a_heartbeat_are_void(station: Station) -> None:
    station.command(10)
    station.robot.advance(1.0)
    assert station.wheels() == (0, 0)
    assert station.read(15, "B") == 0


def test_a_heartbeat_that_does_not_change_is_none(station: Station) -> None:
    station.update(0.2)
    station.command(10)
    station.write(19, b"\x07")
    for _ in range(6):
        station.robot.advance(0.1)
        station.write(19, b"\x07")
    assert station.wheels() == (0, 0)


def test_it_stops_half_a_second_after_the_last_heartbeat(station: Station) -> None:
    station.update(0.3)
    station.command(10)
    station.update(0.3)
    station.beat()
    station.robot.advance(0.48)
    assert station.wheels() == (126, 126)
    station.robot.advance(0.08)
    assert station.wheels() == (0, 0)
    # Its torque stays on, and it does not go on by itself.
    assert station.read(149, "B") == 1
    station.update(1.0)
    assert station.read(15, "B") == 1
    assert station.wheels() == (0, 0)
    station.command(10)
    station.update(0.2)
    assert station.wheels() == (126, 126)


def test_after_a_change_of_state_the_half_second_begins_anew(station: Station) -> None:
    station.robot.advance(0.1)
    station.beat()
    # One comparison is skipped, in the cycle after it.
    station.robot.advance(0.51)
    assert station.opencr.is_connected
    station.robot.advance(0.05)
    assert not station.opencr.is_connected


def test_the_last_command_holds_for_ever(station: Station) -> None:
    station.update(0.2)
    station.command(5)
    station.update(20.0)
    assert station.robot.world.x_m == pytest.approx(1.0, abs=0.02)


def test_a_servo_keeps_its_speed_when_it_is_asked_for_more_than_its_limit(station: Station) -> None:
    station.update(0.2)
    station.command(10)
    station.update(0.3)
    # Clamped to 0.2108 m/s, 266 raw, and the servo's limit is 265.
    station.command(22)
    station.update(0.5)
    assert station.wheels() == (126, 126)
    # One wheel refuses, the other turns on.
    station.command(10, 150)
    station.update(0.5)
    assert station.wheels() == (-25, 126)


def test_linear_and_angular_are_clamped_apart_and_each_wheel_at_337(waffle: Station) -> None:
    waffle.update(0.2)
    waffle.command(100)
    waffle.update(0.5)
    # 0.26609 m/s is 336 raw, above the XM430's limit of 330: refused.
    assert waffle.wheels() == (0, 0)
    for servo in (waffle.robot.left, waffle.robot.right):
        servo.table["velocity limit"] = 1023
    waffle.update(0.5)
    assert waffle.wheels() == (336, 336)
    waffle.command(100, 1000)
    waffle.update(0.5)
    # The left one stands: both clamps are the same speed of a wheel.
    # The limit by 77 rpm at 12 V is 336 raw.
    assert waffle.wheels() == (0, 336)
    assert [servo.table["goal velocity"] for servo in (waffle.robot.left, waffle.robot.right)] == [0, 337]


def test_what_is_not_registered_reads_as_zero(station: Station) -> None:
    assert station.read(8, "B") == 0
    # A part of an item is none.
    assert station.read(1, "B") == 0
    assert station.read(42, "H") == 0
    data, result, error = station.handler.readTxRx(station.port, 200, 300, 100)
    assert (bytes(data), result, error) == (bytes(100), 0, 0)


def test_a_written_read_only_item_lasts_until_the_next_cycle(station: Station) -> None:
    station.write(42, struct.pack("<I", 4711))
    assert station.read(42, "I") == 4711
    station.robot.advance(0.025)
    assert station.read(42, "I") == 1200
    # Only a part of it is written: nothing happens.
    station.write(43, b"\xff")
    assert station.read(42, "I") == 1200


def test_the_model_information_alone_is_protected(station: Station) -> None:
    answer = station.handler.writeTxRx(station.port, 200, 2, 4, [9, 0, 0, 0])
    assert answer == (0, 7)
    assert station.read(2, "I") == 1


def test_it_does_not_know_of_other_instructions(station: Station) -> None:
    handler, port = station.handler, station.port
    assert handler.reboot(port, 200)[0] == -3001
    assert handler.regWriteTxRx(port, 200, 19, 1, [1])[0] == -3001
    assert handler.ping(port, 1)[1] == -3001
    assert handler.ping(port, 200) == (0x5000, 0, 0)


def test_a_read_that_is_too_long_is_not_answered(station: Station) -> None:
    assert station.handler.readTxRx(station.port, 200, 0, 2038)[1] == -3001
    assert station.handler.ping(station.port, 200)[1] == 0


def test_a_recalibration_keeps_the_wheels_turning(station: Station) -> None:
    station.update(0.2)
    station.command(10)
    station.update(0.2)
    assert station.handler.writeTxRx(station.port, 200, 59, 1, [1])[0] == -3001
    before_m = station.robot.world.pose[0]
    station.robot.advance(4.9)
    assert station.robot.world.pose[0] - before_m == pytest.approx(0.49, abs=0.01)
    station.robot.advance(0.6)
    assert station.read(59, "B") == 0
    station.robot.advance(0.1)
    assert station.wheels() == (0, 0)


def test_torque_is_switched_for_both_and_read_back_from_both(station: Station) -> None:
    assert station.read(149, "B") == 1
    station.write(149, b"\0")
    station.robot.advance(0.025)
    assert station.read(149, "B") == 0
    assert not station.robot.left.table["torque enable"]
    station.write(149, b"\1")
    station.robot.left.overload()
    station.robot.advance(0.025)
    assert station.robot.right.table["torque enable"]
    assert station.read(149, "B") == 0


@contextmanager
def station_in(noise: Noise, walls: Walls = OPEN_SPACE) -> Iterator[Station]:
    with SimulatedTurtleBot3(scene=Scene("floor", walls, noise=noise), clock=ManualClock()) as robot:
        station = Station(robot)
        yield station
        station.port.closePort()


def test_the_gyroscope_feels_how_the_body_turns_and_not_the_wheels() -> None:
    with station_in(Noise(slip_share=0.5)) as station:
        station.update(0.3)
        station.command(0, 50)
        station.update(1.0)
        before_rad = station.robot.world.pose[2]
        station.update(1.0)
        turned_rad = station.robot.world.pose[2] - before_rad
        assert turned_rad == pytest.approx(0.25, rel=0.03)
        assert station.read(68, "f") == pytest.approx(turned_rad, rel=0.01)
        station.command(0, 0)
        station.update(0.5)
        assert station.read(68, "f") == 0.0


def test_accelerations_are_those_of_the_body() -> None:
    """Accelerations are felt when the robot comes to a wall; and no more while its wheels turn there."""
    with station_in(Noise(), Walls([(0.205, -1.0, 0.205, 1.0)])) as station:
        station.update(0.3)
        station.command(20)
        felt_m_s2 = []
        for _ in range(8):
            station.beat()
            for _ in range(5):
                station.robot.advance(0.02)
                felt_m_s2.append(station.read(72, "f"))
        assert station.robot.world.collisions == 1
        # From 0 to 0.2 m/s and back, over one cycle of 20 ms at the wall.
        assert sum(felt_m_s2) * 0.02 == pytest.approx(0.0, abs=0.005)
        assert min(felt_m_s2) == pytest.approx(-0.2 / 0.02, rel=0.05)
        assert sum(each for each in felt_m_s2 if each > 0) * 0.02 == pytest.approx(0.2, rel=0.05)
        assert felt_m_s2[-10:] == [0.0] * 10
        assert station.wheels()[0] > 0


def test_who_drives_a_curve_is_pressed_outwards(station: Station) -> None:
    station.update(0.3)
    station.command(10, 50)
    station.update(1.0)
    assert station.read(68, "f") == pytest.approx(0.5, rel=0.03)
    # Towards the middle of the curve, which is on the left.
    assert station.read(76, "f") == pytest.approx(0.1 * 0.5, rel=0.05)


def test_profile_accelerations_reach_the_servos(station: Station) -> None:
    station.write(174, struct.pack("<2I", 5, 7))
    assert station.robot.left.table["profile acceleration"] == 5
    assert station.robot.right.table["profile acceleration"] == 7
    station.update(0.2)
    station.command(15)
    station.update(0.5)
    left, right = station.wheels()
    # 5 x 0.3745 rad/s2 for half a second is 39 raw, 7 x is 55.
    assert left == pytest.approx(39, abs=4)
    assert right == pytest.approx(55, abs=5)


def test_a_low_battery_cuts_the_motors_off(station: Station) -> None:
    station.update(0.2)
    station.opencr.set_battery(10.8)
    station.update(5.5)
    assert station.read(149, "B") == 1
    assert station.read(46, "I") == pytest.approx((10.8 - 10.5) / 1.8 * 10_000, abs=1)
    station.command(10)
    station.robot.advance(1.0)
    assert not (station.robot.left.answers or station.robot.right.answers)
    assert station.robot.world.speed_m_s == 0.0
    station.opencr.set_battery(12.0)
    station.robot.advance(1.5)
    station.update(2.0)
    # The servos have restarted; their torque stays off.
    assert station.robot.left.answers
    assert station.read(149, "B") == 0
    assert 0 <= station.read(136, "i") <= 4095


def test_an_empty_battery_keeps_its_last_percentage(station: Station) -> None:
    station.opencr.set_battery(10.6)
    station.robot.advance(0.1)
    last = station.read(46, "I")
    station.opencr.set_battery(10.4)
    station.robot.advance(0.1)
    assert station.read(46, "I") == last > 0


def test_buttons_and_bumpers_are_reported(station: Station) -> None:
    station.opencr.press(button_2=True, bumper_1=True)
    station.robot.advance(0.025)
    assert [station.read(address, "B") for address in (26, 27, 28, 29)] == [0, 1, 1, 0]
    station.opencr.press(button_2=False)
    station.robot.advance(0.025)
    assert station.read(27, "B") == 0
    with pytest.raises(ValueError, match="no button"):
        station.opencr.press(battery_v=True)


def test_who_touches_it_takes_no_answer_from_its_host() -> None:
    clock = ManualClock()
    with SimulatedTurtleBot3("burger", "opencr", walls=OPEN_SPACE, clock=clock) as robot:
        board = OpenCr(robot.world, robot.left, robot.right, pass_s=0.005)
        head = b"\xff\xff\xfd\x00" + struct.pack("<BHBHH", 200, 7, 2, 26, 1)
        acts: tuple[Callable[[], None], ...] = (
            lambda: board.press(button_1=True),
            lambda: board.steer(0.0, 0.0),
            lambda: board.set_battery(12.0),
        )
        for touch in acts:
            clock.advance(0.001)
            assert list(board.receive(head + struct.pack("<H", crc16(head)), 1_000_000)) == []
            clock.advance(0.012)
            touch()
            (answer,) = board.update()
            assert answer.data[7:9] == b"\x55\x00"
            assert list(board.update()) == []


def test_the_imu_reports_the_heading(station: Station) -> None:
    station.update(0.2)
    station.command(0, 50)
    station.update(1.0)
    assert station.read(68, "f") == pytest.approx(0.5, abs=0.02)
    w, x, y, z = (station.read(address, "f") for address in (96, 100, 104, 108))
    yaw = math.atan2(x * y + w * z, 0.5 - y * y - z * z)
    assert yaw == pytest.approx(station.robot.world.heading_rad, abs=0.01)
    assert yaw == pytest.approx(0.5, abs=0.03)
    assert station.read(80, "f") == pytest.approx(9.8, abs=0.1)


def test_without_motors_it_stands_and_says_so() -> None:
    with SimulatedTurtleBot3(has_motors=False, clock=ManualClock()) as robot:
        station = Station(robot)
        station.update(0.2)
        station.command(10)
        station.update(0.5)
        assert (station.read(18, "b"), station.read(148, "B"), station.read(149, "B")) == (-1, 0, 0)
        assert station.wheels() == (0, 0)
        assert robot.world.speed_m_s == 0.0
        station.port.closePort()
