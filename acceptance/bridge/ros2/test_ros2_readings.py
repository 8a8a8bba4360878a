"""`robosc-bridge ros2` beside a bridge on a simulated TurtleBot3: what other nodes receive over real DDS."""

import json
import math
import re
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from robosc_api.security import Credentials
from robosc_bridge.terminal.client import BridgeClient, RequestedCommand
from robosc_simulated import SimulatedTurtleBot3
from support.bridge_runs import LIMIT_S, RUNNER, START_LIMIT_S, Running, configured
from support.colcon import Workspace
from support.ros2 import Peer, RosProcess, environment, own_domain
from support.waiting import wait_until

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")

pytestmark = [pytest.mark.ros2, pytest.mark.real_time]

ROS2 = ("-m", "robosc_bridge.command", "ros2", "--address")
OK, WARN, ERROR, STALE = b"\x00", b"\x01", b"\x02", b"\x03"


class Heard:
    """A node that hears all that is published, as RViz and Nav2 do.

    Args:
        peer: Peer whose node it is.
        namespace: Before the topics.
    """

    def __init__(self, peer: Peer, namespace: str = "") -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from nav_msgs.msg import Odometry
        from rclpy.qos import qos_profile_sensor_data
        from sensor_msgs.msg import BatteryState, Imu, JointState, LaserScan

        def received(message_class: Any, topic: str, qos: Any = 100) -> list[tuple[float, Any]]:
            found: list[tuple[float, Any]] = []
            peer.node.create_subscription(message_class, topic, lambda it: found.append((time.time(), it)), qos)
            return found

        self.odometry = received(Odometry, f"{namespace}/odom")
        self.joints = received(JointState, f"{namespace}/joint_states")
        self.batteries = received(BatteryState, f"{namespace}/battery_state")
        self.scans = received(LaserScan, f"{namespace}/scan", qos_profile_sensor_data)
        self.imus = received(Imu, f"{namespace}/imu", qos_profile_sensor_data)
        self.diagnostics = received(DiagnosticArray, "/diagnostics")

    def level(self, name: str) -> bytes:
        """Return the level of an entry as it was published last."""
        status = self.diagnostics[-1][1].status if self.diagnostics else ()
        return next((bytes(item.level) for item in status if item.name == f"robosc_bridge: {name}"), b"")

    def message(self, name: str) -> str:
        """Return the message of an entry as it was published last."""
        status = self.diagnostics[-1][1].status
        return next(str(item.message) for item in status if item.name == f"robosc_bridge: {name}")


def stamp_s(message: Any) -> float:
    return float(message.header.stamp.sec) + float(message.header.stamp.nanosec) / 1e9


def yaw(orientation: Any) -> float:
    return 2 * math.atan2(orientation.z, orientation.w)


@pytest.fixture
def peer(tmp_path: Path) -> Iterator[Peer]:
    with own_domain() as domain, Peer(domain, environment(domain, tmp_path)) as made:
        yield made


@contextmanager
def bridge_of(folder: Path, robot: SimulatedTurtleBot3, address: str = "127.0.0.1:0") -> Iterator[Running]:
    with Running(configured(folder, robot, RUNNER, address=address, lidar="lds01")) as made:
        made.address()
        yield made


def published(address: str, folder: Path, *options: str) -> RosProcess:
    """The program under test; the peer has set the variables of its environment."""
    return RosProcess([*ROS2, address, *options], {}, folder / "ros2")


def until(peer: Peer, process: RosProcess) -> Callable[[Callable[[], bool], str], None]:
    return lambda condition, what: peer.spin_until(condition, LIMIT_S, what, process)


def other_threads_blocking(process: RosProcess, number: signal.Signals) -> list[bool]:
    """Return, for each thread but the main one, whether it blocks a signal; the kernel shows it as a mask of bits."""
    pid = process.popen.pid
    tasks = [path for path in Path(f"/proc/{pid}/task").iterdir() if path.name != str(pid)]
    masks = [re.search(r"^SigBlk:\s*(\w+)", (task / "status").read_text(), re.MULTILINE) for task in tasks]
    return [bool(int(mask[1], 16) >> (number - 1) & 1) for mask in masks if mask]


@pytest.mark.smoke
def test_other_nodes_see_the_robot(robot: SimulatedTurtleBot3, peer: Peer, tmp_path: Path) -> None:
    with bridge_of(tmp_path, robot) as bridge:
        address = bridge.address()
        with published(address, tmp_path, "--no-tf") as process, BridgeClient(address, Credentials()) as client:
            heard, becomes = Heard(peer), until(peer, process)
            kinds = (heard.odometry, heard.joints, heard.batteries, heard.scans, heard.imus, heard.diagnostics)
            becomes(lambda: all(kinds), "a message of each kind")
            becomes(lambda: heard.level("bridge") == OK and heard.message("bridge") == "standby", "a bridge in standby")
            parts = ("safety", "supervisor", "drive", "scanner", "warnings")
            becomes(lambda: {heard.level(name) for name in parts} == {OK}, "all parts to be well")

            client.request(RequestedCommand.START)
            becomes(lambda: heard.odometry[-1][1].pose.pose.position.x > 0.15, "the robot to drive")
            becomes(lambda: heard.message("bridge") == "running", "the state to be reported")
            odometry, joints = heard.odometry[-1][1], heard.joints[-1][1]
            assert (odometry.header.frame_id, odometry.child_frame_id) == ("odom", "base_footprint")
            assert odometry.twist.twist.linear.x == pytest.approx(0.1, abs=0.02)
            assert 1e-6 < odometry.pose.covariance[0] < odometry.pose.covariance[14]
            assert list(joints.name) == ["wheel_left_joint", "wheel_right_joint"]
            assert joints.velocity[0] == pytest.approx(0.1 / 0.033, rel=0.2)

            # It sees the wall from the laser's place, 3.2 cm behind the axle.
            robot.world.catch_up()
            scan = heard.scans[-1][1]
            assert (scan.header.frame_id, len(scan.ranges)) == ("base_scan", 360)
            assert (scan.range_min, scan.range_max) == (pytest.approx(0.12), pytest.approx(3.5))
            assert scan.ranges[0] == pytest.approx(2.0 + 0.032 - robot.world.pose[0], abs=0.1)
            assert scan.ranges[90] == pytest.approx(1.5, abs=0.05)
            assert math.isfinite(heard.imus[-1][1].angular_velocity.z)
            assert heard.imus[-1][1].orientation_covariance[0] == 0.0025
            assert heard.batteries[-1][1].voltage == pytest.approx(12.0, abs=0.1)

            client.stop()
            becomes(lambda: heard.level("safety") == ERROR, "the stop to be reported")
            assert "An operator has stopped the robot." in heard.message("safety")
            becomes(lambda: heard.odometry[-1][1].twist.twist.linear.x == 0.0, "the robot to stop")

            def are_where_it_stands() -> bool:
                robot.world.catch_up()
                at, (x_m, y_m, heading_rad) = heard.odometry[-1][1].pose.pose, robot.world.pose
                return (
                    (at.position.x, at.position.y) == pytest.approx((x_m, y_m), abs=0.005)
                    and yaw(at.orientation) == pytest.approx(heading_rad, abs=0.01)
                    and heard.joints[-1][1].position[0] * robot.world.body.wheel_radius_m
                    == pytest.approx(x_m, abs=0.01)
                )

            becomes(are_where_it_stands, "readings of its place")

            # Times grow, are those of the readings, and come before the messages do.
            for received in (heard.odometry, heard.scans, heard.imus):
                stamps_s = [stamp_s(message) for _, message in received]
                assert stamps_s == sorted(set(stamps_s))
                assert all(arrival_s - at_s > 0.0 for (arrival_s, _), at_s in zip(received, stamps_s, strict=True))
                late_s = sorted(arrival_s - at_s for (arrival_s, _), at_s in zip(received, stamps_s, strict=True))
                assert late_s[len(late_s) // 2] < 0.4

            # It hears no node, and offers nothing that could command it.
            name = "robosc_bridge"
            assert peer.node.get_subscriber_names_and_types_by_node(name, "/") == []
            assert all(
                service.startswith(f"/{name}/get_type_description")
                for service, _ in peer.node.get_service_names_and_types_by_node(name, "/")
            )
            # The main thread waits for signals; one that any other thread took would kill the program.
            blocking = other_threads_blocking(process, signal.SIGTERM)
            assert len(blocking) > 4
            assert all(blocking)
            process.signal(signal.SIGTERM)
            assert process.wait() == 0
            lines = process.stderr.splitlines()
            assert [line.split(" at ")[0] for line in lines] == ["robosc-bridge: publishes what the bridge of Runner"]


def test_a_bridge_that_is_pulled_away_and_comes_back(robot: SimulatedTurtleBot3, peer: Peer, tmp_path: Path) -> None:
    with bridge_of(tmp_path, robot) as bridge:
        address = bridge.address()
        process = published(address, tmp_path, "--no-tf")
        heard, becomes = Heard(peer), until(peer, process)
        with process:
            becomes(lambda: bool(heard.odometry) and heard.level("bridge") == OK, "a bridge")
            # It hangs: nothing old is published as new.
            bridge.process.send_signal(signal.SIGSTOP)
            becomes(lambda: heard.level("bridge") == ERROR, "a bridge that hangs to be reported")
            assert heard.level("drive") == heard.level("safety") == STALE
            count = len(heard.odometry)
            peer.spin_for(1.0)
            assert len(heard.odometry) == count
            bridge.process.send_signal(signal.SIGCONT)
            becomes(lambda: len(heard.odometry) > count and heard.level("bridge") != ERROR, "it to go on")
            late_s = heard.odometry[-1][0] - stamp_s(heard.odometry[-1][1])
            assert late_s < 0.6

            bridge.end()
            becomes(lambda: heard.level("bridge") == ERROR, "a bridge that is gone to be reported")
            assert "bridge" in heard.message("bridge")
            count = len(heard.odometry)
            peer.spin_for(1.0)
            assert len(heard.odometry) == count
            with bridge_of(tmp_path, robot, address):
                becomes(lambda: len(heard.odometry) > count and heard.level("bridge") == OK, "it to be back")
                assert heard.level("drive") == OK
            process.signal(signal.SIGINT)
            assert process.wait() == 0
            assert "Traceback" not in process.stderr


def test_it_waits_for_a_bridge_that_is_not_there_yet(robot: SimulatedTurtleBot3, peer: Peer, tmp_path: Path) -> None:
    with bridge_of(tmp_path, robot) as bridge:
        address = bridge.address()
    with published(address, tmp_path, "--namespace", "r1", "--no-tf", "--ros-args", "-r", "odom:=wheels") as process:
        from nav_msgs.msg import Odometry

        heard, becomes = Heard(peer, "/r1"), until(peer, process)
        odometry = peer.receive(Odometry, "/r1/wheels")
        becomes(lambda: heard.level("bridge") == ERROR, "a bridge that is not there to be reported")
        wait_until(lambda: "no bridge answers at" in process.stderr, limit_s=LIMIT_S)
        with bridge_of(tmp_path, robot, address):
            becomes(lambda: bool(odometry) and bool(heard.scans), "readings under their names")
            assert heard.odometry == []


TF2_MSGS = {
    "msg/TFMessage.msg": "geometry_msgs/TransformStamped[] transforms\n",
    "package.xml": """<?xml version="1.0"?>
<package format="3">
  <name>tf2_msgs</name>
  <version>0.36.0</version>
  <description>Messages of tf2: no package index has them.</description>
  <maintainer email="nobody@example.org">nobody</maintainer>
  <license>BSD</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <depend>geometry_msgs</depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
""",
    "CMakeLists.txt": """cmake_minimum_required(VERSION 3.14)
project(tf2_msgs)
find_package(ament_cmake REQUIRED)
find_package(geometry_msgs REQUIRED)
find_package(rosidl_default_generators REQUIRED)
rosidl_generate_interfaces(${PROJECT_NAME} "msg/TFMessage.msg" DEPENDENCIES geometry_msgs)
ament_package()
""",
}
LISTENER = """
import json, sys, time
import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage

def heard(message):
    for item in message.transforms:
        place, turn = item.transform.translation, item.transform.rotation
        stamp = item.header.stamp.sec + item.header.stamp.nanosec / 1e9
        line = [item.header.frame_id, item.child_frame_id, stamp, [place.x, place.y, place.z],
                [turn.x, turn.y, turn.z, turn.w]]
        print(json.dumps(line), flush=True)

rclpy.init()
node = rclpy.create_node("tf_listener")
node.create_subscription(TFMessage, "/tf", heard, 100)
# The quality of service with which tf2_ros listens.
latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
node.create_subscription(TFMessage, "/tf_static", heard, latched)
rclpy.spin(node)
"""


def test_transforms_lead_from_the_odometry_to_the_laser(robot: SimulatedTurtleBot3, peer: Peer, tmp_path: Path) -> None:
    workspace = Workspace(tmp_path / "workspace")
    for name, text in TF2_MSGS.items():
        file = workspace.folder / "src" / "tf2_msgs" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    workspace.colcon("build")
    with bridge_of(tmp_path, robot) as bridge, BridgeClient(bridge.address(), Credentials()) as client:
        given = [*ROS2, bridge.address(), "--frame-prefix", "r1/"]
        with RosProcess(workspace.python(*given), {}, tmp_path / "ros2", program="/bin/bash") as process:
            heard = Heard(peer)
            peer.spin_until(lambda: bool(heard.odometry), START_LIMIT_S, "readings", process)
            client.request(RequestedCommand.START)
            peer.spin_until(lambda: heard.odometry[-1][1].pose.pose.position.x > 0.1, LIMIT_S, "it to drive", process)
            # Late joiners receive the places of the parts, too.
            listen = workspace.python("-c", LISTENER)
            with RosProcess(listen, {}, tmp_path / "listener", program="/bin/bash") as listener:

                def found(child: str) -> Any:
                    lines = [json.loads(line) for line in listener.stdout.splitlines() if line.endswith("]]")]
                    return next((line for line in reversed(lines) if line[1] == child), None)

                frames = ("r1/base_footprint", "r1/base_link", "r1/base_scan", "r1/imu_link")
                peer.spin_until(lambda: all(map(found, frames)), LIMIT_S, f"the transforms {listener.stderr}", process)
                client.stop()

                def is_where_it_stands() -> bool:
                    robot.world.catch_up()
                    (x_m, y_m, heading_rad), moved = robot.world.pose, found(frames[0])
                    return moved[3] == pytest.approx([x_m, y_m, 0.0], abs=0.005) and (
                        2 * math.atan2(moved[4][2], moved[4][3]) == pytest.approx(heading_rad, abs=0.01)
                    )

                peer.spin_until(is_where_it_stands, LIMIT_S, "the transform of its place", process)
                place = [found(child) for child in frames]
    assert [line[0] for line in place] == ["r1/odom", "r1/base_footprint", "r1/base_link", "r1/base_link"]
    (moved, _, laser, _) = place
    # Along the chain, the laser is where the burger has it: 3.2 cm behind the axle and 18.2 cm above the floor.
    assert [sum(line[3][axis] for line in place[1:3]) for axis in range(3)] == pytest.approx([-0.032, 0.0, 0.182])
    assert laser[4] == [0.0, 0.0, 0.0, 1.0]
    assert abs(moved[2] - time.time()) < 60.0


def test_without_tf2_msgs_it_is_one_clear_line(tmp_path: Path) -> None:
    (tmp_path / "tf2_msgs.py").write_text("raise ImportError('no tf2_msgs here')\n")
    with RosProcess([*ROS2, "127.0.0.1:1"], {}, tmp_path / "ros2", [tmp_path]) as process:
        assert process.wait() == 2
        (line,) = process.stderr.splitlines()
        assert re.search(r"transforms cannot be sent \(.*tf2_msgs.*\): install the package tf2_msgs", line)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--namespace", "no spaces here"], "ROS 2 refuses the node: "),
        (["--ros-args", "-r", "nonsense"], "ROS 2 refuses the node: "),
    ],
)
def test_what_ros_refuses_is_one_clear_line(options: list[str], words: str, tmp_path: Path) -> None:
    with RosProcess([*ROS2, "127.0.0.1:1", "--no-tf", *options], {}, tmp_path / "ros2") as process:
        assert process.wait() == 2
        # A line of ROS may come before it.
        assert process.stderr.splitlines()[-1].startswith(f"robosc-bridge: {words}")
        assert "Traceback" not in process.stderr


def test_it_loads_nothing_that_drives_a_robot() -> None:
    import subprocess

    text = (
        "import sys, robosc_bridge.ros2.node, robosc_bridge.ros2.relay, robosc_bridge.ros2.messages; "
        "print([name for name in sys.modules if name.startswith(('robosc_bridge.daemon', 'robosc_bridge.devices', "
        "'serial', 'cv2', 'robosc_bridge.safety'))])"
    )
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", text], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
