"""The servos as dynamixel-sdk meets them: registers, access rules, protections, what a restart forgets."""

import math
import time
from collections.abc import Iterator

import pytest
from dynamixel_sdk import GroupBulkRead, GroupBulkWrite, GroupSyncRead, GroupSyncWrite, PacketHandler

from robosc.execution.runtime.clock import ManualClock
from robosc_simulated import HardwareError, Servo, SimulatedTurtleBot3, Walls
from support.wire import SdkPort

OPEN_SPACE = Walls(())
RAM_GOAL, TORQUE, WATCHDOG, HARDWARE_ERROR = 104, 64, 98, 70
SILENT = -3001


class Station:
    """A host with dynamixel-sdk, and the robot at the other end."""

    def __init__(self, robot: SimulatedTurtleBot3) -> None:
        self.robot = robot
        self.port = SdkPort(robot.base_line)
        self.handler = PacketHandler(2.0)

    def write(self, address: int, size: int, value: int, device_id: int = 1) -> tuple[int, int]:
        data = list((value % 2 ** (8 * size)).to_bytes(size, "little"))
        found: tuple[int, int] = self.handler.writeTxRx(self.port, device_id, address, size, data)
        return found

    def read(self, address: int, size: int, device_id: int = 1, *, signed: bool = False) -> int:
        data, result, error = self.handler.readTxRx(self.port, device_id, address, size)
        assert (result, error & 0x7F) == (0, 0)
        return int.from_bytes(bytes(data), "little", signed=signed)

    def ping(self, device_id: int = 1) -> tuple[int, int, int]:
        found: tuple[int, int, int] = self.handler.ping(self.port, device_id)
        return found

    def go(self, raw: int) -> None:
        for device_id in (1, 2):
            assert self.write(TORQUE, 1, 1, device_id) == (0, 0)
            assert self.write(RAM_GOAL, 4, raw, device_id) == (0, 0)


def stations(robot: str) -> Iterator[Station]:
    with SimulatedTurtleBot3(robot, "dynamixel", walls=OPEN_SPACE, clock=ManualClock()) as simulated:
        station = Station(simulated)
        yield station
        station.port.closePort()


@pytest.fixture
def station() -> Iterator[Station]:
    yield from stations("burger")


@pytest.fixture
def waffle() -> Iterator[Station]:
    yield from stations("waffle")


def test_the_factory_settings(station: Station, waffle: Station) -> None:
    assert [station.read(address, 1) for address in (6, 7, 9, 12, 13, 31, 60, 63)] == [45, 1, 250, 255, 2, 72, 0, 52]
    assert [station.read(address, 4) for address in (24, 44, 48, 52)] == [10, 265, 4095, 0]
    assert [waffle.read(address, 2) for address in (32, 34, 36, 38)] == [160, 95, 885, 1193]
    assert (waffle.read(44, 4), waffle.read(31, 1), waffle.read(76, 2)) == (330, 80, 1920)


def test_registers_are_where_the_sdk_says(station: Station, waffle: Station) -> None:
    from dynamixel_sdk import __file__ as place

    folder = place.replace("dynamixel_sdk/__init__.py", "dynamixel_easy_sdk/control_table")
    for name, servo in (("xl430_w250", station.robot.left), ("xm430_w210", waffle.robot.left)):
        with open(f"{folder}/{name}.model") as file:  # noqa: PTH123
            rows = file.read().split("[control table]\n")[1].splitlines()[1:]
        known = {(int(row.split("\t")[0]), int(row.split("\t")[1])) for row in rows if int(row.split("\t")[0]) < 168}
        # Start-up configuration is newer than the SDK's table of these.
        assert {(item.address, item.size) for item in servo.table.model.items} - {(60, 1)} == known


def test_the_eeprom_is_locked_while_torque_is_on(station: Station) -> None:
    assert station.write(44, 4, 200) == (0, 0)
    assert station.write(TORQUE, 1, 1) == (0, 0)
    assert station.write(44, 4, 265) == (0, 7)
    assert station.read(44, 4) == 200
    assert station.write(TORQUE, 1, 0) == (0, 0)
    assert station.write(44, 4, 265) == (0, 0)


@pytest.mark.parametrize(
    ("address", "size", "value", "error"),
    [
        (0, 2, 5, 7),  # read-only
        (14, 1, 5, 7),  # nothing there
        (132, 4, 0, 7),  # read-only
        (300, 1, 0, 7),  # beyond the table
        (105, 1, 0, 7),  # the middle of an item
        (104, 2, 0, 5),  # a part of an item
        (104, 5, 0, 5),  # one and a part
        (64, 1, 2, 4),  # neither on nor off
        (11, 1, 2, 4),  # no such mode
        (11, 1, 0, 4),  # a mode that only the XM430 has
        (10, 1, 2, 4),  # no such bit
        (98, 1, 128, 4),
        (104, 4, 266, 6),  # beyond the velocity limit
        (104, 4, -266, 6),
        (100, 2, 886, 6),  # beyond the PWM limit
        (102, 2, 0, 7),  # the XL430 has no current
    ],
)
def test_what_is_refused_changes_nothing(station: Station, address: int, size: int, value: int, error: int) -> None:
    before = station.robot.left.read(0, 120)
    assert station.write(address, size, value) == (0, error)
    assert station.robot.left.read(0, 120) == before


def test_several_items_are_written_together_or_not_at_all(station: Station) -> None:
    assert station.write(108, 8, 5 | 9 << 32) == (0, 0)
    assert (station.read(108, 4), station.read(112, 4)) == (5, 9)
    assert station.write(108, 8, 6 | 40_000 << 32) == (0, 4)
    assert (station.read(108, 4), station.read(112, 4)) == (5, 9)


def test_a_sync_write_beyond_the_limit_is_ignored_without_a_word(station: Station) -> None:
    station.go(100)
    group = GroupSyncWrite(station.port, station.handler, RAM_GOAL, 4)
    group.addParam(1, [10, 1, 0, 0])
    group.addParam(2, [50, 0, 0, 0])
    assert group.txPacket() == 0
    assert (station.read(RAM_GOAL, 4), station.read(RAM_GOAL, 4, 2)) == (100, 50)


def test_speed_is_reached_with_the_profile_acceleration(station: Station) -> None:
    station.write(108, 4, 10)
    station.go(100)
    station.robot.advance(0.25)
    # 10 x 214.577 rev/min2 for a quarter of a second.
    assert station.read(128, 4, signed=True) == pytest.approx(10 * 214.577 / 60 * 0.25 / 0.229, abs=3)
    station.robot.advance(1.0)
    assert station.read(128, 4, signed=True) == 100
    assert station.read(122, 1) == 1


def test_a_time_based_profile_takes_its_time(station: Station) -> None:
    station.write(10, 1, 4)
    station.write(108, 4, 500)
    station.go(100)
    station.robot.advance(0.25)
    assert station.read(128, 4, signed=True) == pytest.approx(50, abs=4)


def test_a_servo_that_is_not_reversed_drives_backward_on_the_right(station: Station) -> None:
    assert station.write(10, 1, 0, 2) == (0, 0)
    station.go(100)
    station.robot.advance(0.5)
    assert station.robot.world.left.speed_rad_s > 2
    assert station.robot.world.right.speed_rad_s < -2
    assert station.read(128, 4, 2, signed=True) == 100


def test_torque_by_a_goal(station: Station) -> None:
    station.write(10, 1, 8)
    assert station.write(RAM_GOAL, 4, 50) == (0, 0)
    assert station.read(TORQUE, 1) == 1
    station.robot.advance(0.2)
    assert station.read(128, 4, signed=True) == 50


def test_a_goal_that_came_without_torque_waits(station: Station) -> None:
    assert station.write(RAM_GOAL, 4, 50) == (0, 0)
    station.robot.advance(0.2)
    assert station.read(128, 4, signed=True) == 0
    station.write(TORQUE, 1, 1)
    station.robot.advance(0.2)
    assert station.read(128, 4, signed=True) == 50


def test_another_operating_mode_resets_gains_and_profile(station: Station) -> None:
    station.write(108, 4, 9)
    station.write(76, 2, 77)
    station.robot.left.set_position(100_000)
    assert station.write(11, 1, 3) == (0, 0)
    assert (station.read(108, 4), station.read(76, 2), station.read(100, 2)) == (0, 1000, 885)
    assert station.read(132, 4, signed=True) == 100_000 % 4096


def test_the_watchdog_stops_a_servo_that_hears_nothing(station: Station) -> None:
    station.go(100)
    assert station.write(WATCHDOG, 1, 5) == (0, 0)
    for _ in range(5):
        station.robot.advance(0.08)
        station.read(128, 4)
    assert station.read(WATCHDOG, 1) == 5
    station.robot.advance(0.12)
    # It has no profile acceleration then, and the other one has no watchdog.
    station.robot.advance(0.1)
    assert station.read(WATCHDOG, 1) == 255
    assert station.read(128, 4, signed=True) == 0
    assert station.read(128, 4, 2, signed=True) == 100
    # Its goals are locked until it is cleared.
    assert station.write(RAM_GOAL, 4, 50) == (0, 4)
    assert station.write(WATCHDOG, 1, 5) == (0, 4)
    assert station.write(WATCHDOG, 1, 0) == (0, 0)
    # The goal from before drives it again.
    station.robot.advance(0.1)
    assert station.read(128, 4, signed=True) == 100
    assert station.write(RAM_GOAL, 4, 50) == (0, 0)


def test_packets_for_others_do_not_feed_the_watchdog(station: Station) -> None:
    station.go(100)
    station.write(WATCHDOG, 1, 5)
    for _ in range(3):
        station.robot.advance(0.05)
        station.read(128, 4, 2)
    assert station.read(WATCHDOG, 1) == 255


def test_the_watchdog_waits_for_torque(station: Station) -> None:
    station.write(WATCHDOG, 1, 5)
    station.robot.advance(1.0)
    assert station.read(WATCHDOG, 1) == 5


def test_registered_writes_act_together(station: Station) -> None:
    station.go(0)
    handler, port = station.handler, station.port
    # The SDK does not wait for what a single servo answers to an action.
    assert handler.action(port, 1) == 0
    port.setPacketTimeout(11)
    answer, result = handler.rxPacket(port, False)
    assert (result, answer[8]) == (0, 2)
    for device_id in (1, 2):
        assert handler.regWriteTxRx(port, device_id, RAM_GOAL, 4, [50, 0, 0, 0]) == (0, 0)
    assert handler.regWriteTxRx(port, 1, RAM_GOAL, 4, [50, 1, 0, 0]) == (0, 6)
    assert (station.read(69, 1), station.read(RAM_GOAL, 4)) == (1, 0)
    handler.action(port, 254)
    assert [station.read(RAM_GOAL, 4, device_id) for device_id in (1, 2)] == [50, 50]
    assert station.read(69, 1) == 0


def test_bulk_packets(station: Station) -> None:
    write = GroupBulkWrite(station.port, station.handler)
    write.addParam(1, 108, 4, [7, 0, 0, 0])
    write.addParam(2, 65, 1, [1])
    assert write.txPacket() == 0
    read = GroupBulkRead(station.port, station.handler)
    read.addParam(1, 108, 4)
    read.addParam(2, 65, 1)
    assert read.txRxPacket() == 0
    assert (read.getData(1, 108, 4), read.getData(2, 65, 1)) == (7, 1)


def test_sync_read_answers_in_the_listed_order(station: Station) -> None:
    read = GroupSyncRead(station.port, station.handler, 126, 21)
    read.addParam(2)
    read.addParam(1)
    assert read.txRxPacket() == 0
    assert (read.getData(2, 146, 1), read.getData(1, 144, 2)) == (33, 120)


def test_a_restart_is_silent_and_forgets(station: Station) -> None:
    station.go(100)
    station.robot.left.set_position(50_000)
    station.robot.left.overload()
    assert station.ping() == (1060, 0, 0x80)
    assert station.write(TORQUE, 1, 1) == (0, 0x81)
    assert station.handler.reboot(station.port, 1) == (0, 0x80)
    assert station.ping()[1] == SILENT
    station.robot.advance(0.5)
    assert station.ping() == (1060, 0, 0)
    assert station.read(TORQUE, 1) == 0
    assert 0 <= station.read(132, 4) < 4096
    assert station.write(TORQUE, 1, 1) == (0, 0)
    # Values in the EEPROM have stayed.
    assert station.read(11, 1) == 1


def test_overheating_comes_back_until_it_is_cool(station: Station) -> None:
    station.go(100)
    station.robot.left.overheat()
    assert station.read(HARDWARE_ERROR, 1) == 0x04
    assert (station.read(TORQUE, 1), station.read(146, 1)) == (0, 77)
    for expected in (0x04, 0):
        station.handler.reboot(station.port, 1)
        station.robot.advance(0.5)
        assert station.read(HARDWARE_ERROR, 1) == expected
        station.robot.left.cool_down()


def test_a_voltage_beyond_its_limits_is_flagged_only(station: Station) -> None:
    station.go(100)
    station.robot.left.brown_out(5.8)
    assert station.ping() == (1060, 0, 0x80)
    assert (station.read(HARDWARE_ERROR, 1), station.read(TORQUE, 1), station.read(144, 2)) == (1, 1, 58)


def test_without_voltage_it_is_gone_and_starts_anew(station: Station) -> None:
    station.go(100)
    station.robot.left.brown_out(3.0)
    assert station.ping()[1] == SILENT
    station.robot.advance(0.2)
    assert station.robot.world.left.speed_rad_s == 0.0
    station.robot.left.brown_out(12.0)
    station.robot.advance(0.5)
    assert station.ping() == (1060, 0, 0)
    assert station.read(TORQUE, 1) == 0


def test_a_blocked_wheel_is_overloaded_after_a_second(station: Station) -> None:
    station.go(100)
    station.robot.advance(0.2)
    station.robot.left.block_wheel()
    station.robot.advance(0.8)
    assert (station.read(128, 4), station.read(126, 2)) == (0, 1000)
    assert station.read(HARDWARE_ERROR, 1) == 0
    station.robot.advance(0.3)
    assert (station.read(HARDWARE_ERROR, 1), station.read(TORQUE, 1)) == (0x20, 0)
    assert station.read(TORQUE, 1, 2) == 1


@pytest.mark.parametrize("error", HardwareError)
def test_every_error_alerts_and_the_chosen_ones_shut_off(station: Station, error: HardwareError) -> None:
    station.go(100)
    station.robot.left.trip(error)
    assert station.ping() == (1060, 0, 0x80)
    assert station.read(HARDWARE_ERROR, 1) == error
    assert station.read(TORQUE, 1) == int(not error & 0x34)


def test_the_bus_takes_its_time(station: Station) -> None:
    station.write(9, 1, 0)
    station.write(8, 1, 1)
    station.port.set_speed(57_600)
    # 10 bytes there and 14 back.
    for _ in range(5):
        began_s = time.monotonic()
        station.ping()
        assert time.monotonic() - began_s > 24 * 10 / 57_600


def test_a_shutdown_that_is_not_chosen_leaves_torque_on(station: Station) -> None:
    assert station.write(63, 1, 0x10) == (0, 0)
    station.go(100)
    station.robot.left.overload()
    assert (station.read(HARDWARE_ERROR, 1), station.read(TORQUE, 1)) == (0x20, 1)


def test_the_position_wraps_at_32_bits(station: Station) -> None:
    station.robot.left.set_position(2**31 - 10)
    station.go(50)
    station.robot.advance(0.5)
    assert station.read(132, 4, signed=True) < -(2**31) + 1000


def test_clear_brings_the_position_into_one_turn_at_a_standstill(station: Station) -> None:
    station.robot.left.set_position(10_000)
    station.go(50)
    station.robot.advance(0.2)
    assert station.handler.clearMultiTurn(station.port, 1) == (0, 1)
    station.write(RAM_GOAL, 4, 0)
    station.robot.advance(0.2)
    assert station.handler.clearMultiTurn(station.port, 1) == (0, 0)
    assert 0 <= station.read(132, 4, signed=True) < 4096


def test_status_return_levels(station: Station) -> None:
    assert station.write(68, 1, 1) == (0, 0) or station.read(68, 1) == 1
    assert station.write(65, 1, 1)[0] == SILENT
    assert station.read(65, 1) == 1
    station.handler.write1ByteTxOnly(station.port, 1, 68, 0)
    assert station.handler.readTxRx(station.port, 1, 65, 1)[1] == SILENT
    assert station.ping() == (1060, 0, 0)


def test_a_factory_reset_keeps_what_it_is_asked_to(station: Station) -> None:
    station.write(44, 4, 100)
    assert station.handler.factoryReset(station.port, 254, 0xFF)[1] == 0
    assert station.read(44, 4) == 100
    assert station.handler.factoryReset(station.port, 2, 0x02) == (0, 0)
    station.robot.advance(0.5)
    assert station.ping(2) == (1060, 0, 0)
    assert (station.read(11, 1, 2), station.read(44, 4, 2)) == (3, 265)
    # All of it: ID 1 at 57600 baud.
    assert station.handler.factoryReset(station.port, 1, 0xFF) == (0, 0)
    station.robot.advance(0.5)
    assert station.ping()[1] == SILENT
    station.port.set_speed(57_600)
    assert station.ping() == (1060, 0, 0)


def test_another_id_and_another_speed_act_at_once(station: Station) -> None:
    assert station.write(7, 1, 42) == (0, 0)
    assert station.ping()[1] == SILENT
    assert station.ping(42) == (1060, 0, 0)
    assert station.write(8, 1, 1, 42) == (0, 0)
    assert station.ping(42)[1] == SILENT
    station.port.set_speed(57_600)
    assert station.ping(42) == (1060, 0, 0)
    assert station.ping(2)[1] == SILENT


def test_a_secondary_id_is_obeyed_and_not_answered(station: Station) -> None:
    for device_id in (1, 2):
        assert station.write(12, 1, 5, device_id) == (0, 0)
    assert station.write(65, 1, 1, 5)[0] == SILENT
    assert [station.read(65, 1, device_id) for device_id in (1, 2)] == [1, 1]


def test_an_unknown_instruction_and_a_wrong_crc(station: Station) -> None:
    packet = [0xFF, 0xFF, 0xFD, 0, 1, 3, 0, 0x77, 0, 0]
    assert station.handler.txRxPacket(station.port, packet)[1:] == (0, 2)
    assert station.ping() == (1060, 0, 0)
    station.port.writePort(bytes.fromhex("ff ff fd 00 01 03 00 01 00 00"))
    station.port.setPacketTimeout(11)
    answer, result = station.handler.rxPacket(station.port, False)
    assert (result, answer[8]) == (0, 3)


def test_speed_is_what_the_voltage_allows(station: Station) -> None:
    station.robot.left.brown_out(9.0)
    station.go(265)
    station.robot.advance(1.0)
    assert station.read(128, 4, signed=True) == pytest.approx(61 * 9 / 12 / 0.229, abs=1)
    assert station.read(128, 4, 2, signed=True) == 265


def test_pwm_mode_turns_too(station: Station) -> None:
    assert station.write(11, 1, 16) == (0, 0)
    assert station.write(TORQUE, 1, 1) == (0, 0)
    station.write(100, 2, 442)
    station.robot.advance(0.5)
    assert station.read(128, 4, signed=True) == pytest.approx(133, abs=2)


def test_turned_as_far_as_commanded(station: Station) -> None:
    start = [station.read(132, 4, device_id, signed=True) for device_id in (1, 2)]
    station.go(100)
    station.robot.advance(2.0)
    turned = [station.read(132, 4, device_id, signed=True) - start[device_id - 1] for device_id in (1, 2)]
    ticks = 100 * 0.229 / 60 * 4096 * 2.0
    assert turned == [pytest.approx(ticks, abs=40)] * 2
    moved_m = station.robot.world.pose[0]
    assert moved_m == pytest.approx(turned[0] / 4096 * 2 * math.pi * 0.033, abs=0.002)


def test_a_servo_is_one_of_the_known_models(station: Station) -> None:
    with pytest.raises(KeyError):
        Servo("AX-12", station.robot.world, station.robot.world.left, 1)
