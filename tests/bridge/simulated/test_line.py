"""The wire: faults, plugs, and a thread that waits."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import serial

from robosc.execution.runtime.clock import ManualClock
from robosc_simulated import SimulatedTurtleBot3, VirtualHost
from support.descriptors import open_descriptors
from support.waiting import wait_until
from support.wire import Host

PING = "ff ff fd 00 01 03 00 01 19 4e"

PONG = "ff ff fd 00 01 07 00 55 00 24 04 2d f4 df"

LENGTH = 14


@pytest.fixture
def robot() -> Iterator[SimulatedTurtleBot3]:
    with SimulatedTurtleBot3(base="dynamixel", clock=ManualClock(), seed=3) as found:
        yield found


@pytest.fixture
def host(robot: SimulatedTurtleBot3) -> Iterator[Host]:
    with Host(robot.base_path) as found:
        yield found


def test_a_late_answer_keeps_its_turn(robot: SimulatedTurtleBot3, host: Host) -> None:
    robot.base_faults.delay_s = 0.1
    host.send(PING)
    wait_until(lambda: robot.base_line.received == 10)
    robot.base_faults.clear()
    host.send("ff ff fd 00 fe 03 00 01 31 42")
    assert [host.packet()[4] for _ in range(3)] == [1, 1, 2]


def test_an_answer_can_be_late() -> None:
    with (
        VirtualHost() as passing,
        SimulatedTurtleBot3(base="dynamixel", clock=passing) as robot,
        Host(robot.base_path, time=passing) as host,
    ):
        began_s = passing.monotonic()
        assert host.ask(PING) == PONG
        prompt_s = passing.monotonic() - began_s
        robot.base_faults.delay_s = 0.15
        assert host.ask(PING) == PONG
        assert passing.monotonic() - began_s == pytest.approx(0.15 + 2 * prompt_s)


def test_answers_can_be_lost(robot: SimulatedTurtleBot3, host: Host) -> None:
    robot.base_faults.drop_next = 2
    for _ in range(2):
        host.send(PING)
        assert host.hears_nothing()
    assert host.ask(PING) == PONG
    robot.base_faults.drop_share = 1.0
    host.send(PING)
    assert host.hears_nothing()


def test_a_share_of_answers_is_lost_by_a_seeded_chance() -> None:
    def fate() -> list[int]:
        with SimulatedTurtleBot3(base="dynamixel", clock=ManualClock(), seed=5) as robot, Host(robot.base_path) as host:
            robot.base_faults.drop_share = 0.5
            line, found = robot.base_line, []
            for _ in range(20):
                before, sent = line.received, line.sent
                host.send(PING)
                # It looks under the lock: what is taken off the wire is counted before the lock is given back.
                wait_until(lambda before=before: line.has_answered(before + 10))  # type: ignore[misc]
                found.append(int(line.sent > sent))
            return found

    first = fate()
    assert 3 < sum(first) < 17
    assert fate() == first


def test_answers_can_be_corrupt(robot: SimulatedTurtleBot3, host: Host) -> None:
    robot.base_faults.corrupt_next = 1
    host.send(PING)
    answer = host.receive(LENGTH).hex(" ")
    assert answer != PONG
    assert sum(one != other for one, other in zip(answer.split(), PONG.split(), strict=True)) == 1
    assert host.ask(PING) == PONG


def test_answers_can_be_cut(robot: SimulatedTurtleBot3, host: Host) -> None:
    robot.base_faults.cut_next = 1
    host.send(PING)
    assert host.receive(7).hex(" ") == PONG[:20]
    assert host.hears_nothing()
    assert host.ask(PING) == PONG


@pytest.mark.parametrize(("fault", "value", "before"), [("garbage", b"\xff\xff\x00", "ff ff 00"), ("echo", True, PING)])
def test_other_bytes_come_before_answers(
    robot: SimulatedTurtleBot3, host: Host, fault: str, value: object, before: str
) -> None:
    setattr(robot.base_faults, fault, value)
    host.send(PING)
    assert host.receive(len(before.split()) + LENGTH).hex(" ") == f"{before} {PONG}"


def test_bytes_can_come_one_by_one(robot: SimulatedTurtleBot3, host: Host) -> None:
    robot.base_faults.split_s = 0.01
    began_s = time.monotonic()
    assert host.ask(PING) == PONG
    assert time.monotonic() - began_s > 0.12
    robot.base_faults.split_s = 0.0
    assert host.ask(PING) == PONG


def test_a_wire_can_be_deaf(robot: SimulatedTurtleBot3, host: Host) -> None:
    robot.base_faults.is_deaf = True
    host.send(PING)
    assert host.hears_nothing()
    robot.base_faults.clear()
    assert host.ask(PING) == PONG


def test_another_id_answers(robot: SimulatedTurtleBot3, host: Host) -> None:
    assert robot.bus is not None
    robot.bus.answers_as = 7
    host.send(PING)
    assert host.packet()[4] == 7


def test_opencr_answers_as_another_id() -> None:
    with SimulatedTurtleBot3(clock=ManualClock()) as robot, Host(robot.base_path) as host:
        assert robot.opencr is not None
        robot.opencr.answers_as = 7
        host.send("ff ff fd 00 c8 03 00 01 3b fa")
        assert host.packet()[4] == 7


def test_servos_hear_noise_at_another_speed(robot: SimulatedTurtleBot3) -> None:
    with Host(robot.base_path, 57_600) as host:
        host.send(PING)
        assert host.hears_nothing()


def test_a_pulled_plug_hangs_up_and_another_one_has_the_same_name(robot: SimulatedTurtleBot3, host: Host) -> None:
    robot.left.set_position(100_000)
    path = Path(robot.base_path)
    before = path.resolve()
    robot.base_line.disconnect()
    assert not path.exists()
    assert not path.is_symlink()
    assert not robot.base_line.is_connected
    with pytest.raises(serial.SerialException):
        while host.port.read(1) == b"":
            pass
    with pytest.raises(serial.SerialException):
        Host(robot.base_path)
    # Twice is once.
    robot.base_line.disconnect()
    robot.base_line.reconnect()
    robot.base_line.reconnect()
    assert path.resolve() != before
    with Host(robot.base_path) as again:
        assert again.ask(PING) == PONG
        # The servos have power of their own.
        assert robot.left.read(132, 4)[1] == (100_000).to_bytes(4, "little")


def test_a_device_lives_on_without_its_line(robot: SimulatedTurtleBot3, host: Host) -> None:
    for packet in ((64, b"\x01"), (104, b"\x64\0\0\0"), (98, b"\x05")):
        assert robot.left.write(*packet) == 0
    robot.base_line.disconnect()
    robot.advance(0.08)
    assert robot.left.table["bus watchdog"] == 5
    robot.advance(0.08)
    assert robot.left.table["bus watchdog"] == 255


def test_links_are_where_they_are_wanted(tmp_path: Path) -> None:
    links = tmp_path / "base", tmp_path / "scanner"
    with SimulatedTurtleBot3(base_link=links[0], scanner_link=links[1], clock=ManualClock()) as robot:
        assert (robot.base_path, robot.scanner_path) == tuple(str(link) for link in links)
        assert links[0].is_symlink()
    assert list(tmp_path.iterdir()) == []


def test_what_is_there_already_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "scanner").write_text("mine")
    files, threads = open_descriptors(), set(threading.enumerate())
    with pytest.raises(FileExistsError):
        SimulatedTurtleBot3(base_link=tmp_path / "base", scanner_link=tmp_path / "scanner", clock=ManualClock())
    assert (tmp_path / "scanner").read_text() == "mine"
    assert set(threading.enumerate()) <= threads
    assert open_descriptors() <= files
    assert not (tmp_path / "base").is_symlink()


def test_nothing_is_left_behind() -> None:
    files, threads = open_descriptors(), set(threading.enumerate())
    for _ in range(3):
        robot = SimulatedTurtleBot3()
        folder = Path(robot.base_path).parent
        robot.base_line.disconnect()
        robot.base_line.reconnect()
        robot.close()
        robot.close()
        assert not folder.exists()
    assert set(threading.enumerate()) <= threads
    assert open_descriptors() <= files


def test_a_host_that_does_not_read_loses_bytes_and_blocks_nobody() -> None:
    with SimulatedTurtleBot3(lidar="lds01", clock=ManualClock()) as robot, Host(robot.scanner_path, 230_400):
        robot.advance(2.0)
        # The line holds 4 KiB, and the kernel 8 KiB and a buffer more on the way there.
        assert robot.scanner_line.lost_bytes > 2 * 12_600 - 4 * 4096


def test_what_nobody_read_is_gone_when_the_port_is_opened() -> None:
    with SimulatedTurtleBot3(lidar="lds01", clock=ManualClock()) as robot:
        line = robot.scanner_line
        for _ in range(400):
            robot.advance(0.005)
            # Bytes that the kernel still carries when the port is opened would come afterwards.
            wait_until(lambda: line._end.unread() == line.sent)
        assert line.lost_bytes > 0
        with Host(robot.scanner_path, 230_400) as host:
            assert host.hears_nothing()
            robot.advance(0.1)
            assert host.receive(1)
