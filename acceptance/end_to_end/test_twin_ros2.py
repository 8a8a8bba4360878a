"""The twin as a ROS 2 node, and both scenarios of the paper on it: generated nodes and helper nodes over DDS."""

import json
import math
import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from robosc_experiments.ros2 import run_line, run_maze
from robosc_experiments.scenario import Outcome, ScenarioError
from robosc_simulated.ros.readings import Mounted, Odometry
from robosc_simulated.ros.ros2 import mounting, moved
from support.ros2 import Peer, RosProcess, environment, own_domain

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
pytest.importorskip("cv2", reason="OpenCV (the extra examples) is not installed")

pytestmark = [pytest.mark.ros2, pytest.mark.real_time]

TWIN = ("-m", "robosc_simulated.ros.ros2")
LIMIT_S = 20.0


class Served:
    """A twin that is served, and the test's side."""

    def __init__(self, process: RosProcess, peer: Peer, commands: int) -> None:
        self.process = process
        self.peer = peer
        self._commands = commands

    def send(self, command: str) -> None:
        os.write(self._commands, command.encode() + b"\n")

    def until(self, condition: Callable[[], bool], what: str, repeat: Callable[[], object] = lambda: None) -> None:
        self.peer.spin_until(condition, LIMIT_S, what, self.process, repeat, repeat_every_s=0.05)


@pytest.fixture
def serve(tmp_path: Path) -> Iterator[Callable[..., Served]]:
    """Starts a twin."""
    read, write = os.pipe()
    with own_domain() as domain:
        variables = environment(domain, tmp_path)
        made: list[RosProcess] = []
        with Peer(domain, variables) as peer:

            def start(*arguments: str) -> Served:
                process = RosProcess([*TWIN, *arguments], variables, tmp_path / "twin", stdin=read)
                made.append(process)
                return Served(process, peer, write)

            try:
                yield start
            finally:
                for process in made:
                    process.__exit__(None, None, None)
                os.close(read)
                os.close(write)


@pytest.mark.smoke
def test_other_nodes_see_a_turtlebot(serve: Callable[..., Served], tmp_path: Path) -> None:
    from geometry_msgs.msg import Twist
    from nav_msgs.msg import Odometry as OdometryMessage
    from rclpy.qos import qos_profile_sensor_data
    from rosgraph_msgs.msg import Clock
    from sensor_msgs.msg import BatteryState, Image, LaserScan

    motion = tmp_path / "motion.jsonl"
    twin = serve("--scene", "line-oval", "--speed", "5", "--motion", str(motion))
    peer = twin.peer
    clocks, odometry = peer.receive(Clock, "/clock"), peer.receive(OdometryMessage, "/odom")
    batteries = peer.receive(BatteryState, "/battery_state")
    scans: list[LaserScan] = []
    pictures: list[Image] = []
    peer.node.create_subscription(LaserScan, "/scan", scans.append, qos_profile_sensor_data)
    peer.node.create_subscription(Image, "/camera/image_raw", pictures.append, qos_profile_sensor_data)
    twin.until(lambda: all((clocks, odometry, batteries, scans, pictures)), "a message of each kind")
    scan, picture = scans[0], pictures[0]
    assert len(scan.ranges) == 360
    assert scan.header.frame_id == "base_scan"
    assert (scan.angle_min, scan.angle_increment) == pytest.approx((0.0, math.tau / 360))
    assert (scan.range_min, scan.range_max) == pytest.approx((0.12, 3.5))
    assert scan.ranges[0] == pytest.approx(2.0 + 0.032, abs=0.01)
    assert (picture.encoding, picture.width, picture.height, picture.step) == ("mono8", 160, 120, 160)
    assert batteries[0].voltage == pytest.approx(12.0)
    assert (odometry[0].header.frame_id, odometry[0].child_frame_id) == ("odom", "base_footprint")

    # It drives as commanded, for as long as commanded.
    velocity = Twist()
    velocity.linear.x = 0.2
    twin.until(
        lambda: odometry[-1].pose.pose.position.x > 0.4,
        "the robot to drive",
        lambda: peer.publish(velocity, "/cmd_vel"),
    )
    twin.until(lambda: odometry[-1].twist.twist.linear.x == 0.0, "a velocity to end that nobody repeats")

    # Stamps are those of the world, which goes faster.
    times_s = [message.clock.sec + message.clock.nanosec / 1e9 for message in clocks]
    assert times_s == sorted(times_s)
    assert times_s[-1] > 1.0
    stamp = odometry[-1].header.stamp
    assert stamp.sec + stamp.nanosec / 1e9 == pytest.approx(times_s[-1], abs=1.0)

    # Commands on its standard input happen to it.
    behind_m = scans[-1].ranges[0]
    twin.send("obstacle box 1.2 0.0")
    twin.until(lambda: scans[-1].ranges[0] < behind_m - 0.3, "the box to be seen")
    twin.send("what is this")
    twin.send("collisions")
    twin.until(lambda: "collisions 0" in twin.process.stdout, "an answer")
    assert twin.process.stdout.splitlines()[:2] == ["ready", "error: unknown command 'what is this'; `help` lists them"]

    twin.process.signal(signal.SIGTERM)
    assert twin.process.wait() == 0
    assert twin.process.stdout.count("Traceback") == twin.process.stderr.count("Traceback") == 0
    last = [json.loads(line) for line in motion.read_text().splitlines() if '"happening"' not in line][-1]
    assert last["x_m"] == pytest.approx(odometry[-1].pose.pose.position.x, abs=0.1)


def test_transforms_say_where_the_robot_and_its_parts_are() -> None:
    # No package index has tf2_msgs: what stands in its messages.
    from geometry_msgs.msg import TransformStamped

    found = moved(TransformStamped(), Odometry(1.5, 0.3, -0.2, math.pi / 2, 0.1, 0.0))
    assert (found.header.frame_id, found.child_frame_id) == ("odom", "base_footprint")
    assert (found.header.stamp.sec, found.header.stamp.nanosec) == (1, 500_000_000)
    assert (found.transform.translation.x, found.transform.translation.y) == (0.3, -0.2)
    assert found.transform.rotation.z == pytest.approx(math.sqrt(0.5))
    assert found.transform.rotation.w == pytest.approx(math.sqrt(0.5))
    camera = mounting(TransformStamped(), Mounted("base_link", "camera_link", 0.06, 0.14, math.pi / 3))
    assert (camera.header.frame_id, camera.child_frame_id) == ("base_link", "camera_link")
    assert (camera.transform.translation.x, camera.transform.translation.z) == (0.06, 0.14)
    assert camera.transform.rotation.y == pytest.approx(0.5)


@pytest.mark.parametrize("asked", [("--stamped", "--ros-args"), ("--ros-args", "-p", "enable_stamped_cmd_vel:=true")])
def test_stamped_velocities_and_other_names(serve: Callable[..., Served], asked: tuple[str, ...]) -> None:
    from geometry_msgs.msg import TwistStamped
    from nav_msgs.msg import Odometry as OdometryMessage

    twin = serve(*asked, "-r", "/odom:=/wheels/odometry", "-r", "/cmd_vel:=/robot/cmd_vel")
    odometry = twin.peer.receive(OdometryMessage, "/wheels/odometry")
    velocity = TwistStamped()
    velocity.twist.angular.z = 1.0
    twin.until(
        lambda: bool(odometry) and odometry[-1].pose.pose.orientation.z > 0.1,
        "the robot to turn",
        lambda: twin.peer.publish(velocity, "/robot/cmd_vel"),
    )


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--scene", "nowhere"], "there is no scene and no file 'nowhere'"),
        (["--speed", "nan"], "the speed factor must be a positive number"),
        (["--wait", "-1"], "the patience must be a positive number"),
        (["--ros-args", "-p", "enable_stamped_cmd_vel:=maybe"], "enable_stamped_cmd_vel must be true or false"),
        (["--motion", "/nowhere/motion.jsonl"], "/nowhere/motion.jsonl"),
    ],
)
def test_what_cannot_be_served_is_one_clear_line(tmp_path: Path, arguments: list[str], said: str) -> None:
    with RosProcess([*TWIN, *arguments], {}, tmp_path) as process:
        assert process.wait() == 1
        (line,) = process.stderr.splitlines()
        assert said in line


def test_without_ros_2_it_says_what_is_missing(tmp_path: Path) -> None:
    (tmp_path / "rclpy.py").write_text("raise ImportError('no rclpy here')\n")
    with RosProcess(TWIN, {}, tmp_path / "twin", [tmp_path]) as process:
        assert process.wait() == 1
        (line,) = process.stderr.splitlines()
        assert "ROS 2 is not there (no rclpy here)" in line


@pytest.fixture
def alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder for what is written; messages are strict."""
    monkeypatch.setenv("ROS_PYTHON_CHECK_FIELDS", "1")
    return tmp_path / "run"


def test_the_maze_solver_gets_out_of_the_spiral(alone: Path, record_property: Callable[[str, object], None]) -> None:
    outcome = run_maze(alone, "maze-spiral", speed=6.0, say=lambda line: None)
    assert outcome.faults == ()
    assert outcome.figures["collisions"] == 0.0
    assert outcome.connection == "ros2"
    assert all(path.is_file() for path in (outcome.event_log, outcome.motion, outcome.supervisor))
    record_property("maze over ROS 2", f"{outcome.figures['speed']:.1f} times real time")


def blocked(outcome: Outcome) -> int:
    """Return the number of velocities that were held back."""
    return sum('"kind":"blocked"' in line for line in outcome.event_log.read_text().splitlines())


@pytest.mark.smoke
def test_a_careless_line_follower_keeps_the_line_and_stands_when_it_must(
    alone: Path, record_property: Callable[[str, object], None]
) -> None:
    outcome = run_line(alone, "line-oval", speed=5.0, say=lambda line: None)
    assert outcome.faults == ()
    assert outcome.figures["aside_most_m"] < 0.03
    assert outcome.figures["collisions"] == 0.0
    # The follower went on asking for a second of the clock at the least.
    assert blocked(outcome) > 5
    record_property("lateral error over ROS 2", f"{1000 * outcome.figures['aside_rms_m']:.1f} mm (RMS)")


def test_a_scenario_that_cannot_be_run_says_why(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="needs a line"):
        run_line(tmp_path, "maze-spiral", speed=5.0, say=lambda line: None)
    with pytest.raises(ScenarioError, match="has no goal"):
        run_maze(tmp_path, "room", speed=5.0, say=lambda line: None)
    with pytest.raises(ScenarioError, match="speed"):
        run_maze(tmp_path, "maze-spiral", speed=1000.0, say=lambda line: None)
    (tmp_path / "something").touch()
    with pytest.raises(ScenarioError, match="is not empty"):
        run_maze(tmp_path, "maze-spiral", speed=5.0, say=lambda line: None)
