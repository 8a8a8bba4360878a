"""A whole robot that lives by itself."""

import threading
import time
from typing import NamedTuple

import pytest
from dynamixel_sdk import GroupSyncWrite, PacketHandler

from robosc.execution.clock import ManualClock
from robosc_bridge.simulated import BASES, BODIES, LIDARS, SimulatedTurtleBot3, Walls
from support.waiting import wait_until
from support.wire import Host, SdkPort


@pytest.mark.parametrize("robot", BODIES)
@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("lidar", LIDARS)
def test_every_robot_can_be_put_together(robot: str, base: str, lidar: str) -> None:
    with SimulatedTurtleBot3(robot, base, lidar) as simulated, Host(simulated.base_path) as host:
        if base == "mavlink-rover":
            # Its heartbeat comes by itself.
            assert host.receive(3)[0] == 0xFD
            return
        ping = "ff ff fd 00 c8 03 00 01 3b fa" if base == "opencr" else "ff ff fd 00 01 03 00 01 19 4e"
        assert host.ask(ping)


@pytest.mark.parametrize(("robot", "base", "lidar"), [("mule", "opencr", "lds01"), ("burger", "ros", "lds01"),
                                                      ("burger", "opencr", "lds04")])  # fmt: skip
def test_unknown_parts_are_told(robot: str, base: str, lidar: str) -> None:
    before = threading.active_count()
    with pytest.raises(ValueError, match=r"there is no .*; there are"):
        SimulatedTurtleBot3(robot, base, lidar)
    assert threading.active_count() == before


class Look(NamedTuple):
    """Where the robot was at some time between two others: a busy machine may make a look long."""

    before_s: float
    x_m: float
    after_s: float


def here(robot: SimulatedTurtleBot3, later_s: float = 0.0) -> Look:
    """Where it is, or will be when so much time has passed."""
    time.sleep(later_s)
    return Look(time.monotonic(), robot.world.pose[0], time.monotonic())


def drive_off(robot: SimulatedTurtleBot3) -> float:
    """Let both servos turn forward; how fast that is, in m/s of the world."""
    port, handler = SdkPort(robot.base_line), PacketHandler(2.0)
    for device_id in (1, 2):
        assert handler.write1ByteTxRx(port, device_id, 64, 1) == (0, 0)
    goals = GroupSyncWrite(port, handler, 104, 4)
    for device_id in (1, 2):
        goals.addParam(device_id, [100, 0, 0, 0])
    goals.txPacket()
    port.closePort()
    return 100 * 7.913672e-4


@pytest.mark.parametrize("factor", [1.0, 5.0])
def test_it_drives_as_far_as_its_time_passes(factor: float) -> None:
    with SimulatedTurtleBot3(base="dynamixel", walls=Walls(()), factor=factor, clock=ManualClock()) as robot:
        speed_m_s = drive_off(robot)
        # What was written is heard in the first step, and the wheels have their speed soon.
        robot.advance(0.2)
        x_m = robot.world.pose[0]
        robot.advance(0.5)
        assert robot.world.pose[0] - x_m == pytest.approx(speed_m_s * 0.5 * factor, rel=1e-6)


@pytest.mark.parametrize("factor", [1.0, 5.0])
def test_it_drives_by_the_computers_clock(factor: float) -> None:
    with SimulatedTurtleBot3(base="dynamixel", walls=Walls(()), factor=factor) as robot:
        speed_m_s = drive_off(robot) * factor
        wait_until(lambda: robot.world.pose[0] > 0.0)
        first, second = here(robot), here(robot, 0.5)
        passed_m = second.x_m - first.x_m
        assert passed_m > 0.95 * speed_m_s * (second.before_s - first.after_s)
        assert passed_m < 1.05 * speed_m_s * (second.after_s - first.before_s)
