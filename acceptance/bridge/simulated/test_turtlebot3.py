"""A whole robot that lives by itself."""

import time

import pytest

from robosc_bridge.simulated import SimulatedTurtleBot3, Walls
from support.waiting import wait_until
from support.wire import Host


@pytest.mark.real_time
def test_a_watchdog_trips_by_the_computers_clock_however_fast_the_world_is() -> None:
    with SimulatedTurtleBot3(base="dynamixel", walls=Walls(()), factor=10.0) as robot:
        with robot.time.lock:
            for packet in ((64, b"\x01"), (104, b"\x64\0\0\0"), (98, b"\x0a")):
                robot.left.hear()
                assert robot.left.write(*packet) == 0
        began_s = time.monotonic()
        with Host(robot.base_path) as host:
            # It is heard, and its own thread must wake for the end.
            host.ask("ff ff fd 00 01 03 00 01 19 4e")
            wait_until(lambda: robot.left.table["bus watchdog"] == 0xFF)
        assert 0.19 < time.monotonic() - began_s < 2.0


@pytest.mark.real_time
@pytest.mark.parametrize(("lidar", "start", "bytes_s"), [("lds01", "", 12_600), ("lds02", "", 9_008),
                                                         ("lds03", "aa 55 f0 0f", 13_700)])  # fmt: skip
def test_a_lidar_is_paced_by_the_computers_clock(lidar: str, start: str, bytes_s: int) -> None:
    baud = 115_200 if lidar == "lds02" else 230_400
    with SimulatedTurtleBot3(lidar=lidar) as robot, Host(robot.scanner_path, baud) as host:
        host.send(start)
        host.receive(500)
        began_s = time.monotonic()
        host.receive(bytes_s // 2)
        # Not faster, and at most as late as a busy machine makes it.
        assert 0.35 < time.monotonic() - began_s < 2.0


@pytest.mark.real_time
def test_opencr_lives_by_the_computers_clock() -> None:
    with SimulatedTurtleBot3(walls=Walls(())) as robot, Host(robot.base_path) as host:
        assert robot.opencr is not None
        opencr = robot.opencr
        host.ask("ff ff fd 00 c8 06 00 03 13 00 01 37 a7")
        assert opencr.is_connected
        began_s = time.monotonic()
        wait_until(lambda: not opencr.is_connected)
        assert 0.45 < time.monotonic() - began_s < 2.0
