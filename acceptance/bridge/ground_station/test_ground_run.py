"""`robosc-bridge run` as a program, on a simulated TurtleBot3, with a ground station of pymavlink's at a UDP socket."""

import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

os.environ.setdefault("MAVLINK20", "1")

import pytest
from pymavlink import mavutil

from robosc_simulated import SimulatedTurtleBot3
from support.bridge_process import LIMIT_S, MODEL, START_LIMIT_S, configured, speeds
from support.ground import joined_texts
from support.waiting import wait_until

pytestmark = pytest.mark.real_time

HELD_BACK = "Held back: /cmd_vel: not allowed now"

LAYER = """
robot Careful {
    interface twist use Twist from geometry_msgs
    interface laser_scan use LaserScan from sensor_msgs
    datatype object Vector { x: double z: double }
    datatype object Twist { linear: Vector angular: Vector }
    datatype object Scan { ranges: array(double) }
    datatype enum Clearance from Scan to { value.ranges[0] > 0.6 -> clear default -> obstructed }
    component Laser {
        outgoing message scan with identifier: "/scan", type: Clearance links laser_scan
        behaviour {
            variable ahead: Clearance = obstructed
            on response from scan do ahead := value
            initial marked state seeing {}
        }
    }
    component Wheels {
        incoming message move with identifier: "/cmd_vel", type: Twist links twist
        behaviour { initial marked state ready { on request to move } }
    }
    requirement move needs Laser.ahead = clear
}
"""


class Station:
    """A ground station as pymavlink has it."""

    def __init__(self, address: str) -> None:
        self.line: Any = mavutil.mavlink_connection(
            address, source_system=255, source_component=190, dialect="ardupilotmega"
        )
        self.heard: list[Any] = []
        self._beat_s = 0.0

    def until(self, is_so: Callable[[Any], bool], what: str, limit_s: float = LIMIT_S) -> Any:
        """The first message that is so; its own heartbeat goes on."""
        end_s = time.monotonic() + limit_s
        while time.monotonic() < end_s:
            if time.monotonic() - self._beat_s > 1.0 and self.line.last_address is not None:
                self._beat_s = time.monotonic()
                self.line.mav.heartbeat_send(6, 8, 0, 0, 4)
            message = self.line.recv_match(blocking=True, timeout=0.2)
            if message is None:
                continue
            self.heard.append(message)
            if is_so(message):
                return message
        raise AssertionError(f"waited {limit_s} s in vain for {what}; heard {joined_texts(self.heard)}")

    def beat(self, what: str, is_so: Callable[[Any], bool] = lambda _: True, limit_s: float = LIMIT_S) -> Any:
        return self.until(lambda item: item.get_type() == "HEARTBEAT" and is_so(item), what, limit_s)

    def command(self, number: int, *parameters: float) -> int:
        """Its result."""
        self.line.mav.command_long_send(1, 1, number, 0, *parameters, *(0.0,) * (7 - len(parameters)))
        ack = self.until(
            lambda item: item.get_type() == "COMMAND_ACK" and item.command == number, f"answer to {number}"
        )
        return int(ack.result)

    def velocity(self, speed_m_s: float) -> None:
        """One set-point: forward."""
        self.line.mav.set_position_target_local_ned_send(0, 1, 1, 8, 0x05E7, 0, 0, 0, speed_m_s, 0, 0, 0, 0, 0, 0, 0)

    def asking_for(self, speed_m_s: float, is_so: Callable[[], bool], what: str) -> None:
        """Send set-points until something is so."""
        end_s = time.monotonic() + LIMIT_S
        while not is_so():
            assert time.monotonic() < end_s, f"waited in vain for {what}; heard {joined_texts(self.heard)}"
            self.velocity(speed_m_s)
            self.until(lambda _: True, "anything")


def _armed(beat: Any) -> bool:
    return bool(beat.base_mode & 128)


@contextmanager
def _running(
    folder: Path, robot: SimulatedTurtleBot3, remote: str, model: Path = MODEL, deployment: str = "controller"
) -> Iterator[subprocess.Popen[str]]:
    file = configured(folder, robot, "opencr", model=model)
    text, count = re.subn(r"^  mavlink_url: .*$", f"  mavlink_url: '{remote}'", file.read_text(), flags=re.MULTILINE)
    assert count == 1
    file.write_text(text)
    command = [sys.executable, "-m", "robosc_bridge.main", "run", "--standby", "--deployment", deployment]
    command += ["--model", str(model), "--config", str(file)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@pytest.fixture
def station() -> Iterator[tuple[Station, str]]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    found = Station(f"udpin:127.0.0.1:{port}")
    with contextlib.closing(found.line):
        yield found, f"udpout:127.0.0.1:{port}"


def test_a_ground_station_starts_holds_and_stops_the_robot(tmp_path: Path, station: tuple[Station, str]) -> None:
    there, remote = station
    with SimulatedTurtleBot3("burger", "opencr", "lds01") as robot, _running(tmp_path, robot, remote) as process:
        beat = there.beat("standby", lambda beat: beat.system_status == 3, START_LIMIT_S)
        assert not _armed(beat)
        assert (beat.type, beat.autopilot, beat.custom_mode) == (10, 0, 10)
        there.until(lambda item: item.get_type() == "OBSTACLE_DISTANCE" and min(item.distances) < 65535, "obstacles")
        there.until(lambda item: item.get_type() == "SYS_STATUS" and 9000 < item.voltage_battery < 13000, "the battery")
        # Arming is answered once it runs.
        assert there.command(400, 1.0) == 0
        there.beat("arming", _armed)
        wait_until(lambda: speeds(robot) != (0.0, 0.0), "motion")
        there.until(lambda item: item.get_type() == "ODOMETRY" and (item.x, item.y) != (0.0, 0.0), "odometry")
        # HOLD stops the wheels before it is answered, but for what the motors need.
        assert there.command(176, 1.0, 4.0) == 0
        wait_until(lambda: speeds(robot) == (0.0, 0.0), "standstill", 1.0)
        beat = there.beat("HOLD", lambda beat: beat.custom_mode == 4)
        assert _armed(beat)
        assert there.command(400, 1.0) == 1
        assert "Not armed: An operator has stopped the robot. Resume or reset it first." in joined_texts(there.heard)
        assert there.command(176, 1.0, 10.0) == 0
        there.beat("AUTO", lambda beat: beat.custom_mode == 10)
        wait_until(lambda: speeds(robot) != (0.0, 0.0), "motion")
        # Disarming leaves torque off.
        assert there.command(400, 0.0) == 0
        wait_until(lambda: speeds(robot) == (0.0, 0.0), "standstill", 1.0)
        there.beat("disarming", lambda beat: not _armed(beat))
        wait_until(lambda: robot.left.table["torque enable"] == 0, "torque off")
        assert there.command(400, 1.0) == 0
        there.beat("arming", _armed)
        # A fault of a device is reported, and after a reset and its return it goes on.
        robot.base_line.disconnect()
        there.beat("a fault", lambda beat: beat.system_status == 6 and not _armed(beat))
        there.until(lambda item: "drive base is lost" in " ".join(joined_texts(there.heard)), "its reason")
        robot.base_line.reconnect()
        there.beat("standby", lambda beat: beat.system_status == 3)
        assert there.command(400, 1.0) == 0
        there.beat("arming", _armed)
        process.send_signal(signal.SIGTERM)
        there.beat("the end", lambda beat: beat.system_status == 7)
        _, errors = process.communicate(timeout=LIMIT_S)
        assert process.returncode == 0, errors
        assert "Traceback" not in errors
    names = {item.name for item in there.heard if item.get_type() == "NAMED_VALUE_INT"}
    assert {"sup_state", "blocked"} < names
    assert not [item for item in there.heard if item.get_type() == "BAD_DATA"]


def test_set_points_move_the_wheels_as_far_as_the_layer_lets_them(tmp_path: Path, station: tuple[Station, str]) -> None:
    there, remote = station
    model = tmp_path / "careful.rscd"
    model.write_text(LAYER)
    with (
        SimulatedTurtleBot3("burger", "opencr", "lds01") as robot,
        _running(tmp_path, robot, remote, model, "layer") as process,
    ):
        there.beat("standby", lambda beat: beat.system_status == 3, START_LIMIT_S)
        # A velocity before it is armed comes to nothing.
        there.velocity(0.1)
        assert there.command(400, 1.0) == 0
        there.beat("arming", _armed)
        assert speeds(robot) == (0.0, 0.0)
        there.asking_for(0.1, lambda: min(speeds(robot)) > 0.0, "motion")
        # Wheels stop when the layer refuses, although the set-points go on.
        count = joined_texts(there.heard).count(HELD_BACK)
        robot.world.place(1.5, 0.0, 0.0)
        there.asking_for(0.1, lambda: speeds(robot) == (0.0, 0.0), "standstill before a wall")
        there.asking_for(0.1, lambda: joined_texts(there.heard).count(HELD_BACK) > count, "the refusal in words")
        robot.world.place(0.0, 0.0, 0.0)
        there.asking_for(0.1, lambda: min(speeds(robot)) > 0.0, "motion")
        # A station that falls silent leaves a robot that stands.
        wait_until(lambda: speeds(robot) == (0.0, 0.0), "standstill", 5.0)
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=LIMIT_S)
        assert process.returncode == 0, errors
        assert "Traceback" not in errors
