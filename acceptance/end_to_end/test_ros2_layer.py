"""The generated supervision layer over DDS, between a robot and a controller that knows nothing of it."""

import json
import math
import signal
import sys
from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from robosc.targets import generate, write_files
from support.background import children_of, has_ended
from support.porter import CARELESS, LIMIT_S, PACKAGE, Porter, porter_robot, porter_supervisor
from support.ros2_servers import End, HeldAction, HeldService

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
pytest.importorskip("test_msgs", reason="test_msgs, with the only actions in a package index, is not installed")

pytestmark = pytest.mark.ros2

PATIENCE_S = 60.0


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The generated package."""
    folder = tmp_path_factory.mktemp("workspace")
    write_files(generate(porter_supervisor(), "ros2"), folder)
    return folder


@pytest.fixture
def porter(workspace: Path, tmp_path: Path) -> Iterator[Porter]:
    with porter_robot(workspace, tmp_path) as made:
        yield made


# Connections that cannot exist.


def test_what_the_existing_controller_cannot_be_connected_with_is_told(porter: Porter) -> None:
    from diagnostic_msgs.msg import DiagnosticArray
    from geometry_msgs.msg import TwistStamped
    from rclpy.duration import Duration
    from rclpy.qos import QoSProfile
    from sensor_msgs.msg import LaserScan
    from std_srvs.srv import Trigger

    reports = porter.peer.receive(DiagnosticArray, "/diagnostics")
    porter.peer.publisher(TwistStamped, "/supervised/cmd_vel")
    porter.peer.node.create_client(Trigger, "/supervised/power")
    late = QoSProfile(depth=1, deadline=Duration(seconds=0.5))
    porter.peer.node.create_subscription(LaserScan, "/supervised/scan", lambda message: None, late)
    porter.start("server_wait:=0.0")
    for text in (
        "/supervised/cmd_vel: /test_peer sends geometry_msgs/msg/TwistStamped, this node takes geometry_msgs/msg/Twist",
        "/supervised/power: another node uses it as std_srvs/srv/Trigger, this node as std_srvs/srv/SetBool",
        "/supervised/scan: /test_peer takes and this node sends in vain: deadline unlimited is sent, of 0.5 s is taken",
    ):
        porter.until(lambda text=text: text in _messages(reports), text)  # type: ignore[misc]
        assert text in porter.layer.stderr, "on the console, too"


def _messages(reports: list[Any]) -> str:
    return "; ".join(status.message for report in reports for status in report.status)


# Messages.


def test_whatever_a_careless_controller_sends_the_robot_stands_still_unless_it_may_move(porter: Porter) -> None:
    porter.start_with_careless("server_wait:=0.0")
    porter.blocks("/cmd_vel", 30)
    assert porter.speed == 0.0
    assert porter.commands == []

    porter.allow(True)
    porter.until(lambda: porter.speed == 0.3, "the robot to move")
    porter.allow(False)
    porter.until(lambda: porter.speed == 0.0, "the robot to stand still")
    stood = len(porter.commands)
    porter.blocks("/cmd_vel", 30)
    assert porter.speed == 0.0
    assert len(porter.commands) == stood
    porter.end()
    assert porter.speed == 0.0

    events = porter.events()
    walks = [entry for entry in events if entry.get("event") == "walk.request"]
    assert walks
    assert all(entry["state"]["Permission"]["state"] == "granted" for entry in walks)
    reasons = {entry["why"] for entry in events if entry["kind"] == "blocked"}
    assert "not allowed now" in reasons
    assert {"kind": "release", "identifier": "/cmd_vel"}.items() <= next(
        entry for entry in events if entry["kind"] == "release"
    ).items()


def test_messages_of_the_robot_come_through_as_they_are(porter: Porter) -> None:
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import LaserScan

    passed = porter.peer.receive(LaserScan, "/supervised/scan")
    porter.start("server_wait:=0.0", "resample_scans:=true")
    scan = LaserScan(angle_min=-0.125, angle_increment=0.125, range_max=9.0, ranges=array("f", [0.25, 0.75, math.inf]))
    scan.header.frame_id = "laser"
    scan.header.stamp.sec = 7
    scan.intensities = array("f", [1.0, 2.0, 3.0])
    porter.until(lambda: bool(passed), "a scan", lambda: porter.peer.publish(scan, "/scan", qos_profile_sensor_data))
    assert all(message == scan for message in passed)
    # The supervisor sees 360 ranges: the first is straight ahead, which the middle beam measured.
    porter.until(lambda: porter.variable("Permission", "seen") == "far", "the scan to be seen")


def test_every_field_of_a_message_goes_to_the_robot(porter: Porter) -> None:
    porter.start("server_wait:=0.0")
    porter.allow(True)
    porter.until(lambda: porter.speed == 0.5, "the velocity", lambda: porter.send(0.5, x=1.5, y=-2.5, z=1e300))
    turning = porter.commands[-1].angular
    assert (turning.x, turning.y, turning.z) == (1.5, -2.5, 1e300)


def test_numbers_beyond_their_limits_are_moved_and_everything_else_goes_out_as_it_came(porter: Porter) -> None:
    porter.start("server_wait:=0.0")
    porter.allow(True)
    porter.until(lambda: porter.speed == 1.0, "a velocity within its limit", lambda: porter.send(2.5, z=0.75))
    porter.until(lambda: porter.speed == -1.0, "the same backwards", lambda: porter.send(-7.0, z=0.75))
    assert {command.angular.z for command in porter.commands} == {0.75}
    assert max(abs(command.linear.x) for command in porter.commands) == 1.0
    limited = [entry for entry in porter.end() if entry["kind"] == "limited"]
    assert limited[0]["event"] == "walk.request"
    assert limited[0]["limited"] == ["linear.x: 2.5 -> 1.0"]


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_what_is_no_number_is_held_back_also_where_the_model_does_not_look(porter: Porter, number: float) -> None:
    porter.start("server_wait:=0.0")
    porter.drive()
    before = len(porter.blocked)
    porter.until(lambda: len(porter.blocked) > before, "a message held back", lambda: porter.send(0.4, y=number))
    porter.until(lambda: porter.speed == 0.2, "a sound message", lambda: porter.send(0.2))
    assert all(math.isfinite(command.angular.y) for command in porter.commands)
    assert 0.4 not in {command.linear.x for command in porter.commands}
    assert "a NaN or an infinity" in {entry["why"] for entry in porter.end() if entry["kind"] == "blocked"}


def test_messages_on_one_name_are_told_apart(porter: Porter) -> None:
    from std_msgs.msg import Float32

    porter.start("server_wait:=0.0")
    # Walking is forbidden, standing is not; a loud sound is forbidden, a quiet one is not.
    porter.until(lambda: bool(porter.blocked), "a turn held back", lambda: porter.send(0.0, z=0.25))
    assert porter.reasons() == {"no message of the model"}
    assert porter.commands == [], "turning is no halt"
    porter.until(lambda: bool(porter.commands), "a halt", lambda: porter.send(0.0))
    porter.until(lambda: "not allowed now" in porter.reasons(), "a walk held back", lambda: porter.send(0.1))
    assert {command.linear.x for command in porter.commands} == {0.0}

    def sound(level: float) -> None:
        porter.peer.publish(Float32(data=level), "/supervised/volume")

    porter.until(lambda: bool(porter.volumes), "a quiet sound", lambda: sound(0.5))
    before = len(porter.blocked)
    porter.until(lambda: len(porter.blocked) > before, "a loud sound held back", lambda: sound(2.0))
    assert porter.held_back()[-1] == "volume"
    assert {message.data for message in porter.volumes} == {0.5}
    porter.allow(True)
    porter.until(lambda: porter.volumes[-1].data == 2.0, "a loud sound", lambda: sound(2.0))


# Stops of the wheels.


def test_a_controller_that_dies_leaves_a_robot_that_stands_still(porter: Porter) -> None:
    porter.start("server_wait:=0.0", "command_timeout:=0.3")
    with porter.careless() as careless:
        porter.allow(True)
        porter.until(lambda: porter.speed == 0.3, "the robot to move")
        careless.signal(signal.SIGKILL)
        careless.wait()
        porter.until(lambda: porter.speed == 0.0, "the robot to stand still")
    assert porter.layer.is_running
    # Once, and not again and again.
    stood = len(porter.commands)
    porter.peer.spin_for(0.5)
    assert len(porter.commands) == stood


def test_a_controller_that_falls_silent_after_a_zero_is_left_alone(porter: Porter) -> None:
    porter.start("server_wait:=0.0", "command_timeout:=0.2")
    porter.until(lambda: bool(porter.commands), "a halt", lambda: porter.send(0.0))
    porter.peer.spin_for(0.6)
    events = porter.end()
    begin = next(index for index, entry in enumerate(events) if entry.get("event") == "halt.request")
    end = next(index for index, entry in enumerate(events) if entry["kind"] == "stop")
    assert "release" not in {entry["kind"] for entry in events[begin:end]}


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_stops_the_robot_first(porter: Porter, number: signal.Signals) -> None:
    porter.start("server_wait:=0.0", "command_timeout:=0.0", command=("-m", f"{PACKAGE}.node"))
    porter.drive()
    porter.layer.signal(number)
    porter.peer.spin_until(lambda: not porter.layer.is_running and porter.speed == 0.0, LIMIT_S, "a zero and the end")
    assert porter.layer.wait() == 0
    assert all(line.startswith(("[INFO]", "[WARN]")) for line in porter.layer.stderr.splitlines())


@pytest.mark.parametrize(("place", "method"), [("caller.CallerSide", "pass_on"), ("robot.RobotSide", "check_servers")])
def test_an_exception_stops_the_robot_first(porter: Porter, place: str, method: str) -> None:
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import LaserScan

    module, name = place.split(".")
    # A scan, or the file, makes it fail: until then it does what it does.
    broken = f"""
import pathlib, sys
from {PACKAGE} import node
from {PACKAGE}.{module} import {name} as side
before = side.{method}
def fails(self, *arguments):
    if '/scan' in arguments or pathlib.Path('broken').exists():
        raise ValueError('no way')
    return before(self, *arguments)
side.{method} = fails
sys.exit(node.main(sys.argv))
"""
    porter.start("server_wait:=0.0", "command_timeout:=0.0", command=("-c", broken))
    porter.drive()
    if method == "pass_on":
        porter.peer.spin_until(
            lambda: not porter.layer.is_running,
            LIMIT_S,
            "the end",
            repeat=lambda: porter.peer.publish(LaserScan(), "/scan", qos_profile_sensor_data),
        )
    else:
        (porter.folder / "layer" / "broken").touch()
    porter.peer.spin_until(lambda: not porter.layer.is_running and porter.speed == 0.0, LIMIT_S, "a zero and the end")
    assert porter.layer.wait() == 1
    assert "no way" in porter.layer.stderr


def test_layer_and_controller_end_together(porter: Porter) -> None:
    porter.start_with_careless("server_wait:=0.0", "command_timeout:=0.0")
    porter.allow(True)
    porter.until(lambda: porter.speed == 0.3, "the robot to move")
    both = children_of(porter.layer.popen.pid)
    assert len(both) == 2
    porter.end()
    assert porter.speed == 0.0
    # The robot is at rest: the controller has ended, too.
    assert all(map(has_ended, both))


@pytest.mark.parametrize("number", [signal.SIGQUIT, signal.SIGKILL])
def test_a_starter_that_is_ended_in_another_way_leaves_nobody_driving(number: signal.Signals, porter: Porter) -> None:
    porter.start_with_careless("server_wait:=0.0", "command_timeout:=0.0")
    porter.allow(True)
    porter.until(lambda: porter.speed == 0.3, "the robot to move")
    both = children_of(porter.layer.popen.pid)
    assert len(both) == 2
    porter.layer.signal(number)
    porter.peer.spin_until(lambda: porter.speed == 0.0, LIMIT_S, "the robot to stand")
    porter.peer.spin_until(lambda: all(map(has_ended, both)), PATIENCE_S, "the end of both")
    assert porter.speed == 0.0


def test_what_had_come_before_a_request_is_heeded_first(porter: Porter) -> None:
    """The layer was busy elsewhere: the permission that it has not looked at is withdrawn already."""
    porter.start("server_wait:=0.0", "command_timeout:=0.0")
    porter.drive()
    before = len(porter.commands)
    porter.layer.signal(signal.SIGSTOP)
    for _ in range(8):
        porter.tell_allowed(True)
    porter.tell_allowed(False)
    porter.peer.spin_for(0.2)
    porter.send(0.7)
    porter.peer.spin_for(0.2)
    porter.layer.signal(signal.SIGCONT)
    porter.until(lambda: bool(porter.blocked), "the request to be held back")
    assert 0.7 not in [command.linear.x for command in porter.commands[before:]]


def test_a_controller_that_fails_ends_the_layer_and_the_robot_stands_still(porter: Porter) -> None:
    failing = f"""
import os, sys, threading, time
sys.path.insert(0, {str(CARELESS.parent)!r})
import ros2_careless
def fail():
    while not os.path.exists('fail'):
        time.sleep(0.02)
    os._exit(3)
threading.Thread(target=fail, daemon=True).start()
ros2_careless.main()
"""
    porter.start("server_wait:=0.0", "command_timeout:=0.0", after=["--controller", sys.executable, "-c", failing])
    porter.allow(True)
    porter.until(lambda: porter.speed == 0.3, "the robot to move")
    (porter.folder / "layer" / "fail").touch()
    porter.peer.spin_until(lambda: not porter.layer.is_running, LIMIT_S, "the end of both")
    assert porter.layer.wait() == 1
    assert "the controller ended with status 3" in porter.layer.stderr
    assert porter.speed == 0.0


def test_a_command_that_does_not_exist_is_one_line(porter: Porter) -> None:
    process = porter.process(["-m", f"{PACKAGE}.start", "--controller", "/no/such/program"], "nothing")
    assert process.wait() == 2
    assert "cannot start the controller: " in process.stderr
    assert "Traceback" not in process.stderr


def test_a_prefix_goes_before_both_sides(porter: Porter) -> None:
    from geometry_msgs.msg import Twist
    from std_msgs.msg import String

    blocked = porter.peer.receive(String, "/robot1/blocked")
    porter.layer = porter.process(
        ["-m", f"{PACKAGE}.start", "--topic-prefix", "/robot1", "--ros-args", "-p", "server_wait:=0.0"], "layer"
    )
    porter.peer.wait_for_peers(["/robot1/cmd_vel", "/robot1/supervised/cmd_vel", "/robot1/supervised/scan"])
    velocity = Twist()
    velocity.linear.x = 1.0
    porter.until(
        lambda: bool(blocked),
        "a message held back",
        lambda: porter.peer.publish(velocity, "/robot1/supervised/cmd_vel"),
    )
    assert json.loads(blocked[0].data)["identifier"] == "/cmd_vel"
    printing = porter.process(["-m", f"{PACKAGE}.start", "--topic-prefix", "/robot1", "--print-remappings"], "printing")
    assert printing.wait() == 0
    text = (porter.folder / "printing" / "stdout.txt").read_text()
    assert "-r /robot1/cmd_vel:=/robot1/supervised/cmd_vel" in text
    assert "-r /robot1/count/_action/send_goal:=/robot1/supervised/count/_action/send_goal" in text


@pytest.mark.parametrize("how", ["option", "argument", "file"])
def test_wherever_the_prefix_is_from_the_controller_is_remapped_by_it(how: str, porter: Porter) -> None:
    from geometry_msgs.msg import Twist

    given = {"option": ["--topic-prefix", "/robot1"], "argument": ["--ros-args", "-p", "topic_prefix:=/robot1"]}
    file = porter.folder / "own.yaml"
    file.write_text("/**:\n  ros__parameters:\n    topic_prefix: /robot1\n")
    arguments = given.get(how, ["--ros-args", "--params-file", str(file)])
    porter.layer = porter.process(
        [
            *("-m", f"{PACKAGE}.start", *arguments, "--ros-args", "-p", "server_wait:=0.0"),
            *("--controller", sys.executable, str(CARELESS), "--ros-args", "-r", "__ns:=/robot1"),
        ],
        "layer",
    )
    driven = porter.peer.receive(Twist, "/robot1/supervised/cmd_vel")
    porter.until(lambda: bool(driven), "the controller to drive")

    def publishers() -> list[str]:
        return [end.node_name for end in porter.peer.node.get_publishers_info_by_topic("/robot1/cmd_vel")]

    porter.until(lambda: PACKAGE in publishers(), "the layer")
    assert publishers() == [PACKAGE]


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["--ros-args", "-p", "a:=1", "--", "--controller", "x"], "--controller stands behind '--'"),
        (["--ros-args", "-p", "topic_prefix:=robot1"], "parameter 'topic_prefix' is 'robot1'"),
        (["--ros-args", "-p", "topic_prefix:=1"], "parameter 'topic_prefix' is 1; it must be a string"),
    ],
)
def test_what_would_part_layer_and_controller_is_refused(arguments: list[str], problem: str, porter: Porter) -> None:
    process = porter.process(["-m", f"{PACKAGE}.start", *arguments, "--controller", "x"], "nothing")
    assert process.wait() == 2
    assert problem in process.stderr


# Services.


def test_a_service_call_goes_through_or_is_answered_at_once(porter: Porter) -> None:
    from std_srvs.srv import SetBool

    server = HeldService(porter.host, SetBool, "/power")
    porter.start()
    porter.until(lambda: porter.state("Power") is not None, "the layer to begin")
    reply = porter.wait_for(porter.call(), "the answer to a call that is held back")
    assert reply.success is False
    assert reply.message in ("not started", "not allowed now")
    porter.until(lambda: porter.is_blocked("/power"), "a call to be reported as held back", porter.call)
    assert server.requests == []

    porter.allow(True)
    future = porter.call(data=True)
    porter.until(lambda: bool(server.requests), "the call")
    assert server.requests[0].data is True
    # Another one meanwhile is held back, and the layer waits for nothing.
    assert porter.wait_for(porter.call(), "the second answer").success is False
    assert not future.done()
    server.answer(success=True, message="every field")
    reply = porter.wait_for(future, "the answer")
    assert (reply.success, reply.message) == (True, "every field")
    porter.until(lambda: porter.variable("Power", "is_on") == "true", "the answer to be seen")


def test_a_call_that_fails_is_answered_with_the_default(porter: Porter) -> None:
    from std_srvs.srv import SetBool

    porter.start("server_wait:=0.0", "service_timeout:=0.5")
    porter.allow(True)
    assert porter.wait_for(porter.call(), "the answer without a server").success is False
    server = HeldService(porter.host, SetBool, "/power")
    porter.until(lambda: "/power" in dict(porter.peer.node.get_service_names_and_types()), "the server")
    future = porter.call()
    porter.until(lambda: bool(server.requests) or future.done(), "a call")
    if not server.requests:  # The layer had not seen the server.
        future = porter.call()
        porter.until(lambda: bool(server.requests), "a call")
    assert porter.wait_for(future, "the answer after the time is over").success is False
    server.answer(success=True)
    porter.peer.spin_for(0.2)
    errors = [entry for entry in porter.end() if entry.get("event") == "power.error"]
    assert len(errors) >= 2


# Actions.

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6


def test_a_goal_is_rejected_or_served(porter: Porter) -> None:
    from test_msgs.action import Fibonacci

    server = HeldAction(porter.host, Fibonacci, "/count")
    porter.start("server_wait:=2.0")
    porter.until(lambda: porter.state("Counter") is not None, "the layer to begin")
    assert not porter.send_goal().accepted
    porter.until(lambda: porter.is_blocked("/count"), "a goal to be reported as held back", porter.send_goal)
    assert server.requests == []

    porter.allow(True)
    heard: list[Any] = []
    handle = porter.send_goal(lambda message: heard.append(list(message.feedback.sequence)))
    assert handle.accepted
    porter.until(lambda: bool(server.handles), "the goal to reach the robot")
    assert server.requests[0].order == 5
    assert not porter.send_goal().accepted
    porter.until(lambda: [4, 2] in heard, "feedback", lambda: server.feedback(sequence=[4, 2]))
    porter.until(lambda: porter.variable("Counter", "steps") == "4", "the feedback to be seen")
    server.end(End.SUCCEED, sequence=[1, 2, 3])
    answer = porter.wait_for(handle.get_result_async(), "the result")
    assert (answer.status, list(answer.result.sequence)) == (SUCCEEDED, [1, 2, 3])
    porter.until(lambda: porter.state("Counter") == "idle", "the end to be seen")


def test_a_goal_that_its_server_aborts_ends_so_with_its_result(porter: Porter) -> None:
    from test_msgs.action import Fibonacci

    server = HeldAction(porter.host, Fibonacci, "/count")
    porter.start("server_wait:=2.0")
    porter.allow(True)
    handle = porter.send_goal()
    porter.until(lambda: bool(server.handles), "the goal to reach the robot")
    server.end(End.ABORT, sequence=[9])
    answer = porter.wait_for(handle.get_result_async(), "the result")
    assert (answer.status, list(answer.result.sequence)) == (ABORTED, [9])


def test_a_goal_without_a_server_and_one_that_is_rejected_end_as_aborted(porter: Porter) -> None:
    from test_msgs.action import Fibonacci

    porter.start("server_wait:=0.0")
    porter.allow(True)
    handle = porter.send_goal()
    assert handle.accepted
    assert porter.wait_for(handle.get_result_async(), "the end without a server").status == ABORTED
    server = HeldAction(porter.host, Fibonacci, "/count", accepts=False)

    def attempt() -> None:
        again = porter.send_goal()
        assert again.accepted
        assert porter.wait_for(again.get_result_async(), "the end").status == ABORTED

    attempt()
    while not server.requests:  # The layer had not seen the server.
        attempt()


def test_a_goal_that_turns_against_its_requirement_is_cancelled_and_aborted_when_it_has_ended(porter: Porter) -> None:
    from test_msgs.action import Fibonacci

    server = HeldAction(porter.host, Fibonacci, "/count", ends_on_cancel=False)
    porter.start("server_wait:=2.0")
    porter.allow(True)
    handle = porter.send_goal()
    porter.until(lambda: bool(server.handles), "the goal to reach the robot")
    result = handle.get_result_async()
    porter.allow(False)
    porter.until(lambda: server.cancels == 1, "the cancel to reach the robot")
    # It is still winding down: its caller has to wait, and so has another goal.
    porter.allow(True)
    assert not porter.send_goal().accepted
    assert not result.done()
    server.end(End.CANCEL)
    assert porter.wait_for(result, "the end").status == ABORTED
    porter.until(lambda: porter.send_goal().accepted, "the next goal")


def test_a_cancel_of_the_caller_is_always_forwarded(porter: Porter) -> None:
    from test_msgs.action import Fibonacci

    server = HeldAction(porter.host, Fibonacci, "/count", ends_on_cancel=False)
    porter.start("server_wait:=2.0", "max_age:=['/allowed=3600.0']")
    porter.allow(True)
    handle = porter.send_goal()
    porter.until(lambda: bool(server.handles), "the goal to reach the robot")
    answer = porter.wait_for(handle.cancel_goal_async(), "the answer to the cancel")
    assert len(answer.goals_canceling) == 1
    porter.until(lambda: server.cancels == 1, "the cancel to reach the robot")
    result = handle.get_result_async()
    porter.peer.spin_for(0.2)
    assert not result.done()
    server.end(End.CANCEL, sequence=[7])
    ended = porter.wait_for(result, "the end")
    assert (ended.status, list(ended.result.sequence)) == (CANCELED, [7])


def test_a_goal_under_way_is_cancelled_at_the_end_and_its_caller_learns_it(porter: Porter) -> None:
    from test_msgs.action import Fibonacci

    server = HeldAction(porter.host, Fibonacci, "/count")
    porter.start("server_wait:=2.0")
    porter.drive()
    handle = porter.send_goal()
    porter.until(lambda: bool(server.handles), "the goal to reach the robot")
    result = handle.get_result_async()
    porter.settle()
    porter.end()
    assert server.cancels == 1
    assert porter.speed == 0.0
    porter.peer.spin_until(result.done, LIMIT_S, "the result")
    assert result.result().status == ABORTED


def test_nothing_runs_while_a_goal_and_a_call_are_under_way(porter: Porter) -> None:
    from std_srvs.srv import SetBool
    from test_msgs.action import Fibonacci

    server, service = HeldAction(porter.host, Fibonacci, "/count"), HeldService(porter.host, SetBool, "/power")
    porter.start("server_wait:=2.0", command=("-m", f"{PACKAGE}.node"))
    porter.allow(True)
    handle, reply = porter.send_goal(), porter.call()
    porter.until(lambda: bool(server.handles and service.requests), "both to be under way")
    before = porter.layer.processor_s()
    porter.peer.spin_for(2.0)
    # A loop that asks again and again whether there is an answer would take all of it.
    assert porter.layer.processor_s() - before < 1.0
    server.end(End.SUCCEED)
    service.answer(success=True)
    assert porter.wait_for(reply, "the reply").success
    assert porter.wait_for(handle.get_result_async(), "the result").status == SUCCEEDED


def test_services_and_actions_of_a_program_that_knows_of_no_layer_are_remapped(porter: Porter) -> None:
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import LaserScan
    from std_srvs.srv import SetBool
    from test_msgs.action import Fibonacci

    action, service = HeldAction(porter.host, Fibonacci, "/count"), HeldService(porter.host, SetBool, "/power")
    porter.start("server_wait:=2.0")
    porter.until(lambda: porter.state("Counter") is not None, "the layer to begin")
    output = porter.folder / "careless" / "stdout.txt"
    with porter.careless() as careless:

        def received() -> list[Any]:
            return [json.loads(line) for line in output.read_text().splitlines()]

        scan = LaserScan(ranges=array("f", [0.5]))
        porter.peer.spin_until(
            lambda: {"reply", "goal", "scan"} <= {what for what, _ in received()},
            LIMIT_S,
            "what the controller receives",
            careless,
            lambda: porter.peer.publish(scan, "/scan", qos_profile_sensor_data),
        )
        assert ["reply", False] in received()
        assert ["goal", False] in received()
        assert ["scan", [0.5]] in received()
    assert action.requests == service.requests == []
    porter.until(lambda: {"/power", "/count", "/cmd_vel"} <= set(porter.held_back()), "all reports")
