"""The worked packets of the vendors' manuals, byte for byte, over real pseudo-terminals."""

import math
from collections.abc import Iterator

import pytest

from robosc.execution.runtime.clock import ManualClock
from robosc_simulated import SimulatedTurtleBot3
from support.waiting import wait_until
from support.wire import Host

OK_200 = "ff ff fd 00 c8 04 00 55 00 19 2d"
OK_1 = "ff ff fd 00 01 04 00 55 00 a1 0c"


@pytest.fixture
def board() -> Iterator[tuple[SimulatedTurtleBot3, Host]]:
    with SimulatedTurtleBot3("burger", "opencr", clock=ManualClock()) as robot, Host(robot.base_path) as host:
        yield robot, host


@pytest.fixture
def bus() -> Iterator[tuple[SimulatedTurtleBot3, Host]]:
    with SimulatedTurtleBot3("burger", "dynamixel", clock=ManualClock()) as robot, Host(robot.base_path) as host:
        yield robot, host


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        ("ff ff fd 00 c8 03 00 01 3b fa", "ff ff fd 00 c8 07 00 55 00 00 50 05 4c b7"),
        ("ff ff fd 00 c8 07 00 02 00 00 02 00 bf c3", "ff ff fd 00 c8 06 00 55 00 00 50 b6 1f"),
        ("ff ff fd 00 c8 07 00 02 12 00 01 00 ba 21", "ff ff fd 00 c8 05 00 55 00 00 95 99"),
        ("ff ff fd 00 c8 06 00 03 13 00 00 32 27", OK_200),
        ("ff ff fd 00 c8 06 00 03 13 00 01 37 a7", OK_200),
        ("ff ff fd 00 c8 06 00 03 95 00 01 4c 2d", OK_200),
        ("ff ff fd 00 c8 1d 00 03 96 00 0a 00 00 00" + 16 * " 00" + " 32 00 00 00 4d 37", OK_200),
        ("ff ff fd 00 c8 1d 00 03 96 00" + 24 * " 00" + " 06 a0", OK_200),
    ],
)
def test_opencr_answers_as_written(board: tuple[SimulatedTurtleBot3, Host], request_: str, answer: str) -> None:
    assert board[1].ask(request_) == answer


def test_opencr_reports_its_battery(board: tuple[SimulatedTurtleBot3, Host]) -> None:
    robot, host = board
    assert robot.opencr is not None
    robot.opencr.set_battery(11.85)
    robot.advance(0.05)
    answer = "ff ff fd 00 c8 0c 00 55 00 a1 04 00 00 4c 1d 00 00 8d ad"
    assert host.ask("ff ff fd 00 c8 07 00 02 2a 00 08 00 b3 f7") == answer


def test_opencr_reports_that_it_has_no_motors() -> None:
    with SimulatedTurtleBot3(has_motors=False, clock=ManualClock()) as robot, Host(robot.base_path) as host:
        assert host.ask("ff ff fd 00 c8 07 00 02 12 00 01 00 ba 21") == "ff ff fd 00 c8 05 00 55 00 ff 97 9b"


def test_opencr_sends_all_at_once(board: tuple[SimulatedTurtleBot3, Host]) -> None:
    answer = bytes.fromhex(board[1].ask("ff ff fd 00 c8 07 00 02 0a 00 ac 00 b6 2f"))
    assert len(answer) == 183
    assert answer[5:9] == bytes.fromhex("b0 00 55 00")


def test_opencr_answers_a_recalibration_when_it_is_done(board: tuple[SimulatedTurtleBot3, Host]) -> None:
    robot, host = board
    host.send("ff ff fd 00 c8 06 00 03 3b 00 01 17 a5")
    host.send("ff ff fd 00 c8 03 00 01 3b fa")
    # The five seconds begin when the board hears the first of the two.
    wait_until(lambda: robot.base_line.received == 13 + 10)
    assert host.hears_nothing()
    robot.advance(4.9)
    assert host.hears_nothing()
    robot.advance(0.2)
    assert host.packet().hex(" ") == OK_200
    assert host.packet().hex(" ") == "ff ff fd 00 c8 07 00 55 00 00 50 05 4c b7"


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        ("ff ff fd 00 01 03 00 01 19 4e", "ff ff fd 00 01 07 00 55 00 24 04 2d f4 df"),
        ("ff ff fd 00 01 06 00 03 40 00 01 db 66", OK_1),
        ("ff ff fd 00 01 06 00 03 0b 00 01 47 63", OK_1),
        ("ff ff fd 00 01 03 00 08 2f 4e", OK_1),
    ],
)
def test_servos_answer_as_written(bus: tuple[SimulatedTurtleBot3, Host], request_: str, answer: str) -> None:
    assert bus[1].ask(request_) == answer


def test_the_waffles_servos_report_what_they_are() -> None:
    with SimulatedTurtleBot3("waffle", "dynamixel", clock=ManualClock()) as robot, Host(robot.base_path) as host:
        assert host.ask("ff ff fd 00 01 03 00 01 19 4e") == "ff ff fd 00 01 07 00 55 00 06 04 26 65 5d"


def test_all_servos_answer_a_broadcast_ping(bus: tuple[SimulatedTurtleBot3, Host]) -> None:
    _, host = bus
    assert host.ask("ff ff fd 00 fe 03 00 01 31 42") == "ff ff fd 00 01 07 00 55 00 24 04 2d f4 df"
    assert host.packet()[4] == 2


def test_a_servo_reports_its_position_and_an_overload(bus: tuple[SimulatedTurtleBot3, Host]) -> None:
    robot, host = bus
    robot.left.set_position(166)
    assert host.ask("ff ff fd 00 01 07 00 02 84 00 04 00 1d 15") == "ff ff fd 00 01 08 00 55 00 a6 00 00 00 8c c0"
    robot.left.overload()
    assert host.ask("ff ff fd 00 01 07 00 02 46 00 01 00 3c a3") == "ff ff fd 00 01 05 00 55 80 20 99 21"


def test_refusals_are_reported_with_their_numbers(bus: tuple[SimulatedTurtleBot3, Host]) -> None:
    robot, host = bus
    host.ask("ff ff fd 00 01 06 00 03 40 00 01 db 66")
    # The operating mode is in the EEPROM, and torque is on.
    assert host.ask("ff ff fd 00 01 06 00 03 0b 00 01 47 63") == "ff ff fd 00 01 04 00 55 07 b0 8c"
    assert host.ask(signed("ff ff fd 00 01 06 00 03 40 00 02")) == "ff ff fd 00 01 04 00 55 04 ba 8c"
    assert host.ask(signed("ff ff fd 00 01 09 00 03 68 00 0a 01 00 00")) == "ff ff fd 00 01 04 00 55 06 b5 0c"
    robot.left.brown_out(5.8)
    assert host.ask("ff ff fd 00 01 06 00 03 40 00 01 db 66") == "ff ff fd 00 01 04 00 55 80 a2 8f"
    assert host.ask("ff ff fd 00 01 06 00 03 0b 00 01 47 63") == "ff ff fd 00 01 04 00 55 87 b3 0f"


def test_sync_packets_move_both_wheels(bus: tuple[SimulatedTurtleBot3, Host]) -> None:
    robot, host = bus
    host.send("ff ff fd 00 fe 0b 00 83 40 00 01 00 01 01 02 01 c7 64")
    host.send("ff ff fd 00 fe 11 00 83 68 00 04 00 01 4c 00 00 00 02 b1 00 00 00 54 b6")
    # An answer says that both have been heard.
    host.send("ff ff fd 00 fe 09 00 82 84 00 04 00 01 02 ce fa")
    assert [host.packet()[4] for _ in range(2)] == [1, 2]
    robot.advance(1.0)
    host.send("ff ff fd 00 fe 09 00 82 7e 00 15 00 01 02 3e 1e")
    left, right = host.packet(), host.packet()
    assert (left[:9], right[:9]) == (
        bytes.fromhex("ff ff fd 00 01 19 00 55 00"),
        bytes.fromhex("ff ff fd 00 02 19 00 55 00"),
    )
    assert int.from_bytes(left[11:15], "little", signed=True) == 76
    assert int.from_bytes(right[11:15], "little", signed=True) == 177
    # 0.10 m/s and 0.5 rad/s for a second, less the time that the motors need to get there.
    assert robot.world.heading_rad == pytest.approx(0.5, abs=0.02)
    host.send("ff ff fd 00 fe 11 00 83 68 00 04 00 01 b4 ff ff ff 02 4f ff ff ff 52 b9")
    host.ask("ff ff fd 00 01 03 00 01 19 4e")
    robot.advance(1.0)
    assert robot.world.heading_rad == pytest.approx(0.0, abs=0.04)
    host.send("ff ff fd 00 fe 11 00 83 68 00 04 00 01 00 00 00 00 02 00 00 00 00 e4 d0")
    host.ask("ff ff fd 00 01 03 00 01 19 4e")
    robot.advance(0.5)
    assert (robot.world.speed_m_s, robot.world.yaw_rate_rad_s) == (0.0, 0.0)
    assert math.hypot(*robot.world.pose[:2]) < 0.01


def test_the_watchdog_is_armed_as_written(bus: tuple[SimulatedTurtleBot3, Host]) -> None:
    robot, host = bus
    host.send("ff ff fd 00 fe 0b 00 83 62 00 01 00 01 19 02 19 b4 c5")
    host.ask("ff ff fd 00 01 03 00 01 19 4e")
    assert (robot.left.table["bus watchdog"], robot.right.table["bus watchdog"]) == (25, 25)


def test_what_looks_like_a_header_is_stuffed_both_ways(bus: tuple[SimulatedTurtleBot3, Host]) -> None:
    robot, host = bus
    # Torque off: the goal is refused for its size only after it was unstuffed.
    assert host.ask("ff ff fd 00 01 0a 00 03 68 00 ff ff fd fd ff e0 78") == "ff ff fd 00 01 04 00 55 06 b5 0c"
    host.ask("ff ff fd 00 01 06 00 03 40 00 01 db 66")
    host.ask(signed("ff ff fd 00 01 09 00 03 68 00 ff ff ff ff"))
    robot.advance(0.5)
    robot.left.set_position(253)
    answer = "ff ff fd 00 01 0d 00 55 00 ff ff ff ff fd fd 00 00 00 0f 3e"
    assert host.ask(signed("ff ff fd 00 01 07 00 02 80 00 08 00")) == answer


def signed(hexes: str) -> bytes:
    """A packet with its CRC, by the slow rule."""
    data = bytes.fromhex(hexes)
    crc = 0
    for byte in data:
        for bit in range(7, -1, -1):
            top = crc >> 15 ^ byte >> bit & 1
            crc = crc << 1 & 0xFFFF ^ (0x8005 if top else 0)
    return data + crc.to_bytes(2, "little")
