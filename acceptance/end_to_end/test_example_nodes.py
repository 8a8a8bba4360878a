"""Behaviour of the example robots' nodes when something goes wrong: each as a process over DDS."""

import math
import os
import pty
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from support.example_robots import LIMIT_S, Stage, stage
from support.kinematic_robot import KinematicRobot, World, floor_picture

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
pytest.importorskip("cv2", reason="OpenCV (the extra examples) is not installed")

pytestmark = pytest.mark.ros2


@pytest.fixture
def at(tmp_path: Path) -> Iterator[Stage]:
    with stage(tmp_path) as made:
        yield made


def robot_at(at: Stage, topics: list[str]) -> KinematicRobot:
    robot = at.robot = KinematicRobot(at.peer, World())
    at.peer.wait_for_peers(topics)
    return robot


def ask(at: Stage, message: Any, topic: str, condition: Callable[[], bool]) -> None:
    """Send a message once both sides know each other, and wait for what it does."""
    publisher = at.peer.publisher(type(message), topic)
    at.until(lambda: publisher.get_subscription_count() > 0, f"a reader of {topic}")
    at.go_on(0.3)
    publisher.publish(message)
    at.until(condition, f"what {topic} asks for")


def test_the_rotator_turns_across_the_jump_of_the_yaw_both_ways(at: Stage) -> None:
    from std_msgs.msg import Empty, Int16

    at.helper("rotator", "speed_limit:=3.0", "tolerance:=2.0")
    done = at.peer.receive(Empty, "/rotate_done")
    robot = robot_at(at, ["/odom", "/cmd_vel", "/rotate_left", "/rotate_right", "/rotate_done"])
    robot.yaw = math.radians(170)
    ask(at, Int16(data=30), "/rotate_left", lambda: len(done) == 1)
    assert math.degrees(robot.yaw) == pytest.approx(-160, abs=3)
    ask(at, Int16(data=40), "/rotate_right", lambda: len(done) == 2)
    assert math.degrees(robot.yaw) == pytest.approx(160, abs=4)
    # More than a whole turn is no less; nothing is nothing.
    ask(at, Int16(data=-400), "/rotate_left", lambda: len(done) == 3)
    assert math.degrees(robot.yaw) == pytest.approx(120, abs=5)
    ask(at, Int16(data=0), "/rotate_left", lambda: len(done) == 4)
    assert robot.turn == 0.0


def test_without_odometry_the_rotator_stands_still_and_goes_on_when_it_is_back(at: Stage) -> None:
    from std_msgs.msg import Empty, Int16

    node = at.helper("rotator", "speed_limit:=1.0", "odometry_timeout:=0.2")
    done = at.peer.receive(Empty, "/rotate_done")
    robot = robot_at(at, ["/odom", "/cmd_vel", "/rotate_left", "/rotate_done"])
    ask(at, Int16(data=60), "/rotate_left", lambda: robot.turn == 1.0)
    robot.has_odometry = False
    at.until(lambda: robot.turn == 0.0, "the rotator to stop", node)
    count = len(robot.commands)
    at.go_on(0.3)
    assert robot.turn == 0.0
    assert len(robot.commands) == count
    assert "standing still: no odometry for 0.2 s" in node.stderr
    robot.has_odometry = True
    at.until(lambda: len(done) == 1, "the end of the turn", node)
    assert math.degrees(robot.yaw) == pytest.approx(60, abs=3)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_a_signal_in_the_middle_of_a_turn_stops_the_robot(at: Stage, number: signal.Signals) -> None:
    from std_msgs.msg import Int16

    node = at.helper("rotator")
    robot = robot_at(at, ["/odom", "/cmd_vel", "/rotate_left"])
    ask(at, Int16(data=180), "/rotate_left", lambda: robot.turn > 0.0)
    node.signal(number)
    at.until(lambda: robot.turn == 0.0 and not node.is_running, "a zero and the end")
    assert node.wait() == 0
    assert node.stderr == ""


def test_an_idle_rotator_leaves_the_wheels_to_others(at: Stage) -> None:
    node = at.helper("rotator")
    robot = robot_at(at, ["/odom", "/cmd_vel"])
    at.go_on(0.5)
    node.signal(signal.SIGTERM)
    at.until(lambda: not node.is_running, "its end")
    at.go_on(0.2)
    assert robot.commands == []


def test_odometry_that_looks_nowhere_is_none(at: Stage) -> None:
    from std_msgs.msg import Int16

    node = at.helper("rotator", "odometry_timeout:=0.2")
    robot = robot_at(at, ["/odom", "/cmd_vel", "/rotate_left"])
    ask(at, Int16(data=180), "/rotate_left", lambda: robot.turn > 0.0)
    robot.yaw = math.nan
    at.until(lambda: robot.turn == 0.0, "the rotator to stop", node)
    assert node.is_running


def test_a_push_ends_by_distance_bumper_time_or_at_once(at: Stage) -> None:
    from std_msgs.msg import Bool, Empty, Float32

    at.helper("pusher", "distance:=0.1", "push_timeout:=0.8")
    pushed = at.peer.receive(Empty, "/pushed")
    robot = robot_at(at, ["/odom", "/cmd_vel", "/push", "/pushed", "/bumper"])

    def has_rested(times: int) -> bool:
        return len(pushed) == times and robot.speed == 0.0

    ask(at, Float32(data=0.3), "/push", lambda: has_rested(1))
    assert robot.x == pytest.approx(0.1, abs=0.05)
    ask(at, Float32(data=0.0), "/push", lambda: has_rested(2))
    ask(at, Float32(data=math.nan), "/push", lambda: has_rested(3))
    ask(at, Float32(data=0.01), "/push", lambda: has_rested(4))
    ask(at, Float32(data=0.02), "/push", lambda: robot.speed == pytest.approx(0.02))
    at.peer.publish(Bool(data=True), "/bumper")
    at.until(lambda: has_rested(5), "the bumper to end the push")
    x = robot.x
    ask(at, Float32(data=0.3), "/push", lambda: has_rested(6))
    assert robot.x == x


def test_the_careless_line_follower_heeds_nothing_but_the_line(at: Stage) -> None:
    from std_msgs.msg import Empty, Float32

    node = at.helper("careless_line_follower", "gain:=2.0", "correction_timeout:=0.3")
    robot = robot_at(at, ["/cmd_vel", "/line/correction"])

    def correct(value: float) -> Callable[[], object]:
        return lambda: at.peer.publish(Float32(data=value), "/line/correction")

    robot.on_step = correct(0.25)
    at.until(lambda: (robot.speed, robot.turn) == (0.15, 0.5), "it to steer", node)
    robot.on_step = correct(-5.0)
    at.until(lambda: (robot.speed, robot.turn) == (0.15, -1.0), "it to steer no faster than it may", node)
    at.peer.publish(Empty(), "/emergency_stop/stop")
    at.go_on(0.2)
    assert robot.speed == 0.15
    robot.on_step = correct(math.nan)
    at.until(lambda: robot.speed == 0.0, "it to stop without corrections", node)
    robot.on_step = correct(0.1)
    at.until(lambda: robot.speed == 0.15, "it to go on", node)
    node.signal(signal.SIGINT)
    at.until(lambda: robot.speed == 0.0 and not node.is_running, "a zero and the end")


def test_a_blind_line_detector_says_so(at: Stage) -> None:
    from std_msgs.msg import Empty, Float32

    node = at.helper("line_detector", "top:=0.0", "image_timeout:=0.3")
    lost, corrections = at.peer.receive(Empty, "/line/lost"), at.peer.receive(Float32, "/line/correction")
    at.robot = robot = KinematicRobot(at.peer, World())
    at.peer.wait_for_peers(["/image", "/line/lost", "/line/correction"])
    at.until(lambda: bool(lost), "a line that is lost without a camera", node)

    robot.y = -0.06
    robot.on_step = lambda: robot.publish_picture(floor_picture(robot))
    at.until(lambda: bool(corrections), "the line", node)
    assert corrections[-1].data == pytest.approx(2.0 * 0.1, abs=0.02)

    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import Image

    robot.on_step = lambda: at.peer.publish(Image(encoding="rgb8", width=9), "/image", qos_profile_sensor_data)
    lost.clear()
    at.until(lambda: bool(lost), "a line that is lost by an empty picture", node)
    at.until(lambda: "a picture of 9 x 0 pixels" in node.stderr, "the warning", node)

    robot.on_step = lambda: robot.publish_picture(floor_picture(robot))
    corrections.clear()
    at.until(lambda: bool(corrections), "the line again", node)
    robot.on_step = lambda: None
    lost.clear()
    at.until(lambda: bool(lost), "a line that is lost with the camera", node)
    node.signal(signal.SIGTERM)
    assert node.wait() == 0


def test_a_blind_person_detector_takes_it_that_somebody_may_stand_there(at: Stage) -> None:
    from geometry_msgs.msg import Point
    from std_msgs.msg import Float32

    node = at.helper("person_detector", "scan_timeout:=0.3")
    persons, distances = at.peer.receive(Point, "/person"), at.peer.receive(Float32, "/person/distance")
    robot = KinematicRobot(at.peer, World())
    at.peer.wait_for_peers(["/scan", "/person", "/person/distance"])
    at.until(lambda: bool(distances) and distances[-1].data == 0.0, "distance 0 without scans", node)
    at.robot = robot
    at.until(lambda: distances[-1].data == 3.5, "nobody in free space", node)
    at.robot = None
    at.until(lambda: distances[-1].data == 0.0, "distance 0 when the LiDAR is gone", node)
    assert {point.z for point in persons} == {0.0}


@pytest.fixture
def panel(at: Stage) -> SimpleNamespace:
    """Messages that the panel's listeners have heard."""
    from std_msgs.msg import Empty

    topics = {"stop": "/emergency_stop/stop", "resume": "/emergency_stop/resume", "button": "/button"}
    return SimpleNamespace(**{name: at.peer.receive(Empty, topic) for name, topic in topics.items()})


def test_the_panel_takes_keys_from_a_terminal_and_stops_when_it_is_lost(at: Stage, panel: SimpleNamespace) -> None:
    ours, its = pty.openpty()
    node = at.helper("stop_panel", "buttons:=['button=/button']", stdin=its)
    os.close(its)
    at.peer.wait_for_peers(["/emergency_stop/stop", "/emergency_stop/resume", "/button"])
    at.until(lambda: "space: stop" in node.stdout, "the keys to be printed", node)
    at.peer.spin_for(0.3)
    for key, heard in ((b" ", panel.stop), (b"r", panel.resume), (b"B", panel.button)):
        os.write(ours, key)
        at.until(lambda heard=heard: len(heard) == 1, f"the key {key!r}", node)  # type: ignore[misc]
    # A key beside the right one.
    os.write(ours, b"x")
    at.until(lambda: len(panel.stop) == 2, "a stop in doubt", node)
    os.close(ours)
    at.until(lambda: len(panel.stop) == 3 and not node.is_running, "a stop at the end")
    assert node.wait() == 0
    assert (len(panel.resume), len(panel.button)) == (1, 1)


def test_the_panel_reads_lines_and_stops_at_their_end(at: Stage, panel: SimpleNamespace) -> None:
    read, write = os.pipe()
    node = at.helper("stop_panel", stdin=read)
    os.close(read)
    at.peer.wait_for_peers(["/emergency_stop/stop", "/emergency_stop/resume"])
    at.peer.spin_for(0.3)
    os.write(write, b"\nRes")
    os.write(write, b"ume\n")
    at.until(lambda: len(panel.resume) == 1, "the line", node)
    assert panel.stop == []
    os.write(write, b"sotp\n")
    at.until(lambda: len(panel.stop) == 1, "a stop in doubt", node)
    os.write(write, b"quit\n")
    at.until(lambda: len(panel.stop) == 2 and not node.is_running, "a stop at the end")
    assert node.wait() == 0
    os.close(write)


def test_the_panel_does_one_thing_and_ends(at: Stage, panel: SimpleNamespace) -> None:
    node = at.helper("stop_panel", "command:=resume")
    at.until(lambda: len(panel.resume) == 1 and not node.is_running, "the command")
    assert node.wait() == 0
    assert panel.stop == []


WRONG_PARAMETERS = [
    ("rotator", "speed_limit:=-1.0", "parameter 'speed_limit' is -1.0; it must be a number from 0.05 to 10"),
    ("rotator", "speed_limit:=.nan", "parameter 'speed_limit' is nan; it must be a number from 0.05 to 10"),
    ("rotator", "tolerance:=true", "parameter 'tolerance' is True; it must be a number from 0.05 to 45"),
    ("rotator", "odometry_timeout:=soon", "parameter 'odometry_timeout' is 'soon'; it must be a number from"),
    ("rotator", "tolerance", "cannot start: "),
    ("line_detector", "line:=red", "parameter 'line' is 'red'; it must be one of 'dark', 'light'"),
    ("line_detector", "top:=1.0", "parameter 'top' is 1; it must be below 'bottom', which is 1"),
    ("person_detector", "widest:=0.01", "parameter 'narrowest' is 0.05; it must be below 'widest', which is 0.01"),
    ("person_detector", "beams:=2.5", "parameter 'beams' is 2.5; it must be a whole number"),
    ("stop_panel", "buttons:=['x']", "parameter 'buttons' has 'x'; it must be name=/topic, such as go=/button"),
    ("stop_panel", "buttons:=['run=/x']", "parameter 'buttons' has 'run=/x', but the key 'r' is taken"),
    ("stop_panel", "buttons:=3", "parameter 'buttons' is 3; it must be a list of texts"),
    ("stop_panel", "command:=jump", "parameter 'command' is 'jump'; it must be one of stop, resume"),
    ("announcer", "text:=''", "parameter 'text' is empty; there must be something to say"),
]


def test_a_wrong_parameter_is_one_line_and_exit_status_2(at: Stage) -> None:
    processes = [at.helper(node, parameter) for node, parameter, _ in WRONG_PARAMETERS]
    for process, (node, _, complaint) in zip(processes, WRONG_PARAMETERS, strict=True):
        assert process.wait(60.0) == 2
        # Lines of rcl itself about its arguments come before.
        *others, line = process.stderr.splitlines()
        assert line.startswith(f"{node}: {complaint}")
        assert all(other.startswith("[ERROR]") for other in others)


def test_a_misspelt_parameter_is_reported(at: Stage) -> None:
    node = at.helper("announcer", "texd:=hello")
    at.until(lambda: "there is no parameter 'texd'; did you mean 'text'?" in node.stderr, "the warning", node)


def test_the_calibrator_wants_odometry_at_rest(at: Stage) -> None:
    from std_srvs.srv import Trigger

    # So long that it sees enough of them on a busy machine.
    node = at.helper("calibrator", "duration:=20.0")
    client = at.peer.node.create_client(Trigger, "/calibrate")
    at.until(client.service_is_ready, "the service", node)
    at.peer.ask(client, Trigger.Request(), LIMIT_S, node)

    def answer() -> tuple[bool, str]:
        future = client.call_async(Trigger.Request())
        at.until(future.done, "the answer", node)
        return future.result().success, future.result().message

    assert answer() == (False, "0 poses within 20 s; there must be 5")
    at.robot = robot = KinematicRobot(at.peer, World())
    at.peer.wait_for_peers(["/odom"])
    while (reply := answer()) != (True, ""):
        assert reply[1].endswith(" poses within 20 s; there must be 5")

    def drive() -> None:
        robot.x += 0.005

    robot.on_step = drive
    while (reply := answer()) == (True, ""):
        at.go_on(0.1)
    assert reply[0] is False
    assert reply[1].startswith("the robot has moved by 0.")
