"""A whole robot that lives by itself."""

import threading

import pytest
from dynamixel_sdk import GroupSyncWrite, PacketHandler

from robosc.execution.runtime.clock import ManualClock
from robosc_simulated import BASES, BODIES, LIDARS, SimulatedTurtleBot3, VirtualHost, Walls
from robosc_simulated.servo import Servo
from support.wire import Host, SdkPort


@pytest.mark.parametrize("robot", BODIES)
@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("lidar", LIDARS)
def test_every_robot_can_be_put_together(robot: str, base: str, lidar: str) -> None:
    with (
        VirtualHost() as virtual,
        SimulatedTurtleBot3(robot, base, lidar, clock=virtual) as simulated,
        Host(simulated.base_path, time=virtual) as host,
    ):
        if base == "mavlink-rover":
            # Its heartbeat comes by itself.
            assert host.receive(3)[0] == 0xFD
            return
        ping = "ff ff fd 00 c8 03 00 01 3b fa" if base == "opencr" else "ff ff fd 00 01 03 00 01 19 4e"
        assert host.ask(ping)


@pytest.mark.parametrize(("robot", "base", "lidar"), [("mule", "opencr", "lds01"), ("burger", "ros", "lds01"),
                                                      ("burger", "opencr", "lds04")])  # fmt: skip
def test_unknown_parts_are_reported(robot: str, base: str, lidar: str) -> None:
    before = set(threading.enumerate())
    with pytest.raises(ValueError, match=r"there is no .*; there are"):
        SimulatedTurtleBot3(robot, base, lidar)
    assert set(threading.enumerate()) <= before


def drive_off(robot: SimulatedTurtleBot3) -> float:
    """Let both servos turn forward; how fast that is, in m/s of the world."""
    port, handler = SdkPort(robot.base_line), PacketHandler(2.0)
    for device_id in (1, 2):
        assert handler.write1ByteTxRx(port, device_id, 64, 1) == (0, 0)
    goals = GroupSyncWrite(port, handler, 104, 4)
    for device_id in (1, 2):
        goals.addParam(device_id, [100, 0, 0, 0])
    goals.txPacket()
    port.settle()
    port.closePort()
    return 100 * 7.913672e-4


@pytest.mark.parametrize("factor", [1.0, 5.0])
def test_it_drives_as_far_as_its_time_passes(factor: float) -> None:
    with SimulatedTurtleBot3(base="dynamixel", walls=Walls(()), factor=factor, clock=ManualClock()) as robot:
        speed_m_s = drive_off(robot)
        # The wheels have their speed soon.
        robot.advance(0.2)
        x_m = robot.world.pose[0]
        robot.advance(0.5)
        assert robot.world.pose[0] - x_m == pytest.approx(speed_m_s * 0.5 * factor, rel=1e-6)


def write(robot: SimulatedTurtleBot3, servo: Servo, *packets: tuple[int, bytes]) -> None:
    """Write into a servo's table as its host does."""
    with robot.time.lock:
        for packet in packets:
            servo.instruction_received()
            assert servo.write(*packet) == 0


@pytest.mark.parametrize("factor", [1.0, 5.0])
def test_it_drives_by_its_hosts_clock(factor: float) -> None:
    with (
        VirtualHost() as virtual,
        SimulatedTurtleBot3(base="dynamixel", walls=Walls(()), factor=factor, clock=virtual) as robot,
    ):
        for servo in (robot.left, robot.right):
            write(robot, servo, (64, b"\x01"), (104, b"\x64\0\0\0"))
        virtual.sleep(1.0)
        x_m = robot.world.pose[0]
        virtual.sleep(1.0)
        robot.world.catch_up()
        assert robot.world.pose[0] - x_m == pytest.approx(100 * 7.913672e-4 * factor, rel=0.01)


def test_a_watchdog_trips_by_its_hosts_clock_however_fast_the_world_is() -> None:
    with (
        VirtualHost() as virtual,
        SimulatedTurtleBot3(base="dynamixel", walls=Walls(()), factor=10.0, clock=virtual) as robot,
        Host(robot.base_path, time=virtual) as host,
    ):
        write(robot, robot.left, (64, b"\x01"), (104, b"\x64\0\0\0"), (98, b"\x0a"))
        # It is heard, and its own thread must wake for the end.
        host.ask("ff ff fd 00 01 03 00 01 19 4e")
        began_s = virtual.monotonic()
        assert virtual.wait(lambda: robot.left.table["bus watchdog"] == 0xFF, 1.0)
        assert virtual.monotonic() - began_s == pytest.approx(0.2, abs=0.003)


def test_opencr_counts_as_left_after_half_a_second() -> None:
    with (
        VirtualHost() as virtual,
        SimulatedTurtleBot3(walls=Walls(()), clock=virtual) as robot,
        Host(robot.base_path, time=virtual) as host,
    ):
        opencr = robot.opencr
        assert opencr is not None
        began_s = virtual.monotonic()
        host.ask("ff ff fd 00 c8 06 00 03 13 00 01 37 a7")
        assert opencr.is_connected
        assert virtual.wait(lambda: not opencr.is_connected, 1.0)
        # It looks every 50 ms at most.
        assert 0.5 <= virtual.monotonic() - began_s <= 0.55
