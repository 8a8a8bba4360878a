"""The generated supervision layer on ROS 1, between a robot and a controller that knows nothing of it."""

import json
import math
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from robosc.targets import GeneratedFiles, generate, write_files
from support.porter_ros1 import (
    ABORTED,
    CARELESS,
    DONE,
    PACKAGE,
    PREEMPTED,
    REJECTED,
    SENT,
    SUCCEEDED,
    WAITING,
    Porter,
    porter_robot,
    porter_supervisor,
)
from support.process import Process
from support.ros1 import PYTHON, Peer, missing, until
from support.waiting import wait_until

pytestmark = [
    pytest.mark.ros1,
    pytest.mark.skipif(missing() is not None, reason=str(missing())),
    # One layer serves many tests.
]

# It begins when the robot's servers are connected, for a goal before that is lost, and nothing is taken back because
# the existing controller is silent.
PATIENT = ("_server_wait:=60.0", "_command_timeout:=0.0")


@pytest.fixture(scope="module")
def files() -> GeneratedFiles:
    """The generated package."""
    return generate(porter_supervisor(), "ros1")


@pytest.fixture(scope="module")
def package(files: GeneratedFiles, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the package, called like it, so that ROS finds it."""
    folder = tmp_path_factory.mktemp("workspace") / PACKAGE
    write_files(files, folder)
    return folder


@pytest.fixture(scope="module")
def porter(package: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Porter]:
    with porter_robot(package, tmp_path_factory.mktemp("porter")) as made:
        yield made


@pytest.fixture
def patient(porter: Porter) -> Porter:
    """With a layer in its initial state, which other tests may have used."""
    porter.ensure(*PATIENT)
    return porter


# An existing controller in a process of its own.


def require_that_a_careless_controller_is_supervised(porter: Porter) -> None:
    """While it drives, the robot stands still unless it may move; asserted of the robot itself."""
    porter.blocks("/cmd_vel", 30)
    porter.until(lambda: {"/power", "/count"} <= set(porter.blocked), "its call and its goal held back")
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


def test_an_existing_controller_of_another_type_is_worth_a_warning(porter: Porter, tmp_path: Path) -> None:
    porter.start("_server_wait:=0.0")
    text = "/supervised/cmd_vel: /drive sends geometry_msgs/TwistStamped, this node takes geometry_msgs/Twist"
    with Peer(porter.master, tmp_path, "drive") as other:
        other.advertise("/supervised/cmd_vel", "geometry_msgs/TwistStamped")
        layer = porter.layer
        assert layer is not None
        porter.until(lambda: text in layer.stderr, "a warning")
    porter.end()


def received(output: str) -> list[Any]:
    """Return everything that was reported to a careless controller."""
    return [json.loads(line) for line in output.splitlines() if line.startswith("[")]


def test_whatever_a_careless_controller_sends_the_robot_stands_still_unless_it_may_move(porter: Porter) -> None:
    porter.start("_server_wait:=0.0", after=["--controller", PYTHON, str(CARELESS)])
    require_that_a_careless_controller_is_supervised(porter)
    layer = porter.layer
    assert layer is not None
    # Its requests are answered by the layer, and the robot's sensors come through it.
    porter.until(
        lambda: {"reply", "goal", "scan"} <= {what for what, _ in received(layer.stdout)},
        "what the controller receives",
        lambda: porter.peer.publish("/scan", SENT["/scan"], ranges=[0.5]),
    )
    assert ["reply", False] in received(layer.stdout)
    assert ["goal", REJECTED] in received(layer.stdout)
    assert ["scan", [0.5]] in received(layer.stdout)

    porter.allow(True)
    porter.until(lambda: porter.speed == 0.3, "the robot to move")
    events = porter.end()
    assert porter.speed == 0.0
    through = [entry for entry in events if entry.get("event") in ("walk.request", "power.request", "count.request")]
    assert through
    assert all(entry["state"]["Permission"]["state"] == "granted" for entry in through)
    assert "not allowed now" in {entry["why"] for entry in events if entry["kind"] == "blocked"}
    # The controller has ended, too: the master knows it no more.
    wait_until(lambda: "/careless" not in str(porter.peer.names()), "the controller to be gone")


@pytest.mark.parametrize("way", ["node", "launch file"])
def test_roslaunch_starts_the_layer_and_a_careless_controller(porter: Porter, tmp_path: Path, way: str) -> None:
    drives = tmp_path / "drives"
    (drives / "launch").mkdir(parents=True)
    (drives / "package.xml").write_text(
        '<package format="2"><name>drives</name><version>0.0.0</version><description>x</description>'
        '<maintainer email="a@example.org">a</maintainer><license>MIT</license></package>'
    )
    (drives / "launch" / "drive.launch").write_text(
        '<launch><node pkg="drives" type="drive.py" name="careless"/></launch>'
    )
    program = drives / "drive.py"
    program.write_text(f"#!{PYTHON}\n{CARELESS.read_text()}")
    program.chmod(0o755)
    own = tmp_path / "own.yaml"
    own.write_text("publish_state: true\nserver_wait: 0.0\nperiod: 0.02\n")
    started = "controller_executable:=drive.py" if way == "node" else "controller_launch_file:=drive.launch"
    porter.leave()
    porter.master.delete_parameters(f"/{PACKAGE}")
    for messages in porter.peer.received.values():
        messages.clear()
    command = ["/usr/bin/roslaunch", "-p", str(porter.master.port), PACKAGE, "layer.launch"]
    arguments = [f"parameters:={own}", "controller_package:=drives", started]
    variables = {
        **porter.master.variables,
        "ROS_PACKAGE_PATH": f"{porter.package.parent}:{tmp_path}",
        "ROS_ROOT": "/usr/share/ros",
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    with Process([*command, *arguments], variables, tmp_path / "launch") as launch:
        porter.layer = launch
        porter.meet()
        require_that_a_careless_controller_is_supervised(porter)
        porter.allow(True)
        porter.until(lambda: porter.speed == 0.3, "the robot to move")
        launch.signal(signal.SIGINT)
        assert launch.wait(30.0) == 0
    porter.leave()
    wait_until(lambda: porter.speed == 0.0, "the robot to stand still")


def test_a_controller_that_dies_leaves_a_robot_that_stands_still(porter: Porter) -> None:
    porter.start("_server_wait:=0.0", "_command_timeout:=0.3")
    printing = porter.process("start", "--print-remappings", name="printing")
    assert printing.wait() == 0
    command = [PYTHON, str(CARELESS), *printing.stdout.split()]
    with Process(command, porter.master.variables, porter.home / "careless") as careless:
        porter.allow(True)
        porter.until(lambda: porter.speed == 0.3, "the robot to move")
        careless.signal(signal.SIGKILL)
        careless.wait()
        porter.until(lambda: porter.speed == 0.0, "the robot to stand still")
    assert porter.layer is not None and porter.layer.is_running
    # Once, and not again and again: the log reports it of all the time until a later state.
    porter.allow(False)
    events = porter.end()
    last_walk = max(index for index, entry in enumerate(events) if entry.get("event") == "walk.request")
    stop = next(index for index, entry in enumerate(events) if entry["kind"] == "stop")
    assert [entry["kind"] for entry in events[last_walk:stop]].count("release") == 1


def test_a_controller_that_fails_ends_the_layer_and_the_robot_stands_still(porter: Porter) -> None:
    failing = f"""
import os, sys, threading, time
sys.path.insert(0, {str(CARELESS.parent)!r})
import ros1_careless
def fail():
    while not os.path.exists('fail'):
        time.sleep(0.02)
    os._exit(3)
threading.Thread(target=fail, daemon=True).start()
ros1_careless.main()
"""
    porter.start(*PATIENT, after=["--controller", PYTHON, "-c", failing])
    porter.allow(True)
    porter.until(lambda: porter.speed == 0.3, "the robot to move")
    (porter.home / "layer" / "fail").touch()
    assert porter.layer is not None
    assert porter.layer.wait() == 1
    assert "the controller ended with status 3" in porter.layer.stderr
    wait_until(lambda: porter.speed == 0.0, "the robot to stand still")


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (("--controller", "/no/such/program"), "cannot start the controller: "),
        (("--topic-prefix", "x y"), "parameter 'topic_prefix' is 'x y'"),
        (("_command_timeout:=soon",), "parameter 'command_timeout' is 'soon'"),
        (("_release_identifiers:=[/nowhere]",), "parameter 'release_identifiers'"),
    ],
)
def test_what_cannot_be_started_is_one_line(porter: Porter, arguments: tuple[str, ...], problem: str) -> None:
    porter.leave()
    porter.master.delete_parameters(f"/{PACKAGE}")
    porter.run += 1
    with porter.process("start", *arguments) as process:
        assert process.wait() == 2
        assert problem in process.stderr
        assert "Traceback" not in process.stderr


# Messages.


def test_messages_of_the_robot_come_through_as_they_are(porter: Porter) -> None:
    porter.leave()
    porter.peer.subscribe("/scan", "sensor_msgs/LaserScan")
    wait_until(lambda: "/test_peer" in porter.peer.ends("/scan"), "the connection with itself")
    # From here on a layer that counted for itself would be behind.
    for _ in range(3):
        porter.peer.publish("/scan", SENT["/scan"])
    porter.start(*PATIENT, "_resample_scans:=true")
    scan: dict[str, Any] = {
        "header": {"seq": 77, "stamp": {"secs": 7, "nsecs": 5}, "frame_id": "laser"},
        "angle_min": -0.125,
        "angle_increment": 0.125,
        "range_max": 9.0,
        "ranges": [0.25, 0.75, 9.5],
        "intensities": [1.0, 2.0, 3.0],
    }
    passed = porter.peer.received["/supervised/scan"]
    porter.until(lambda: bool(passed), "a scan", lambda: porter.peer.publish("/scan", SENT["/scan"], **scan))
    # The number in the header, too, which rospy would count anew if it could.
    porter.peer.publish("/scan", SENT["/scan"], **scan)
    porter.until(
        lambda: len(passed) > 1 and passed[-1][1] in porter.peer.values("/scan"), "the same scan on both sides"
    )
    assert all(message in porter.peer.values("/scan") for message in porter.peer.values("/supervised/scan"))
    assert {key: passed[0][1][key] for key in scan if key != "header"} == {
        key: value for key, value in scan.items() if key != "header"
    }
    # The supervisor sees 360 ranges: the first is straight ahead, which the middle beam measured.
    porter.until(lambda: porter.variable("Permission", "seen") == "far", "the scan to be seen")


def test_every_field_of_a_message_goes_to_the_robot(patient: Porter) -> None:
    patient.allow(True)
    patient.until(lambda: patient.speed == 0.5, "the velocity", lambda: patient.send(0.5, x=1.5, y=-2.5, z=1e300))
    assert patient.commands[-1]["angular"] == {"x": 1.5, "y": -2.5, "z": 1e300}


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_what_is_no_number_is_held_back_also_where_the_model_does_not_look(patient: Porter, number: float) -> None:
    patient.drive()
    patient.blocks("/cmd_vel", repeat=lambda: patient.send(0.4, y=number))
    patient.until(lambda: patient.speed == 0.2, "a sound message", lambda: patient.send(0.2))
    assert all(math.isfinite(command["angular"]["y"]) for command in patient.commands)
    assert 0.4 not in {command["linear"]["x"] for command in patient.commands}


def test_messages_on_one_name_are_told_apart(patient: Porter) -> None:
    # Walking is forbidden, standing is not; a loud sound is forbidden, a quiet one is not.
    before = len(patient.commands)
    patient.blocks("/cmd_vel", repeat=lambda: patient.send(0.0, z=0.25))
    assert 0.25 not in {command["angular"]["z"] for command in patient.commands[before:]}, "turning is no halt"
    patient.until(lambda: patient.speed == 0.0 and len(patient.commands) > before, "a halt", lambda: patient.send(0.0))
    before = len(patient.commands)
    patient.blocks("/cmd_vel", repeat=lambda: patient.send(0.1))
    assert {command["linear"]["x"] for command in patient.commands[before:]} <= {0.0}

    def sound(level: float) -> None:
        patient.peer.publish("/supervised/volume", SENT["/supervised/volume"], data=level)

    volumes = patient.peer.received["/volume"]
    volumes.clear()
    patient.until(lambda: bool(volumes), "a quiet sound", lambda: sound(0.5))
    patient.blocks("volume", repeat=lambda: sound(2.0))
    assert {message["data"] for message in patient.peer.values("/volume")} == {0.5}
    patient.allow(True)
    patient.until(lambda: patient.peer.values("/volume")[-1]["data"] == 2.0, "a loud sound", lambda: sound(2.0))


# Services.


def test_a_call_that_is_held_back_is_answered_at_once(patient: Porter) -> None:
    before = len(patient.peer.requests["/power"])
    reply = patient.reply(patient.call())
    assert reply["success"] is False
    assert reply["message"] in ("not started", "not allowed now")
    patient.blocks("/power", repeat=patient.call)
    assert len(patient.peer.requests["/power"]) == before


def test_a_call_goes_through_and_its_reply_comes_back(patient: Porter) -> None:
    patient.allow(True)
    before = len(patient.peer.requests["/power"])
    number = patient.call()
    patient.until(lambda: len(patient.peer.requests["/power"]) > before, "the call")
    assert patient.peer.requests["/power"][-1] == {"data": True}
    # Another one meanwhile is held back, and the layer waits for nothing.
    assert patient.reply(patient.call())["success"] is False
    patient.drive()
    assert number not in patient.peer.replies
    patient.answer(success=True, message="every field")
    assert patient.reply(number) == {"success": True, "message": "every field"}
    patient.until(lambda: patient.variable("Power", "is_on") == "true", "the answer to be seen")


def test_a_call_that_is_refused_is_answered_with_the_default(patient: Porter) -> None:
    patient.allow(True)
    before = len(patient.peer.requests["/power"])
    number = patient.call()
    patient.until(lambda: len(patient.peer.requests["/power"]) > before, "the call")
    patient.peer.do("refuse", name="/power")
    assert patient.reply(number) == {"success": False, "message": "the call failed or took too long"}


def test_a_call_that_nobody_answers_is_answered_when_its_time_is_over(porter: Porter) -> None:
    porter.start(*PATIENT, "_service_timeout:=0.3")
    porter.allow(True)
    before = len(porter.peer.requests["/power"])
    number = porter.call()
    porter.until(lambda: len(porter.peer.requests["/power"]) > before, "the call")
    assert porter.reply(number) == {"success": False, "message": "the call failed or took too long"}
    porter.answer(success=True)
    porter.until(lambda: porter.state("Power") == "idle", "the error to be seen")
    errors = [entry for entry in porter.end() if entry.get("event") == "power.error"]
    assert len(errors) == 1


# Actions.


def test_a_goal_that_is_held_back_is_rejected(patient: Porter) -> None:
    patient.until(lambda: patient.end_of(patient.goal())[0] == REJECTED, "a rejection")
    patient.blocks("/count", repeat=patient.goal)


def test_a_goal_is_served(patient: Porter) -> None:
    patient.allow(True)
    goal = patient.reached_goal()
    assert patient.peer.goals["/count"][-1] == {"goal": 5}
    assert patient.end_of(patient.goal())[0] == REJECTED

    def heard() -> list[Any]:
        return [item["feedback"] for item in patient.peer.sent[goal] if "feedback" in item]

    patient.until(
        lambda: {"feedback": 4} in heard(),
        "feedback",
        lambda: patient.peer.do("feedback", name="/count", message={"feedback": 4}),
    )
    patient.until(lambda: patient.variable("Counter", "steps") == "4", "the feedback to be seen")
    patient.peer.do("end", name="/count", how="succeeded", message={"result": 123})
    assert patient.end_of(goal) == (SUCCEEDED, {"result": 123})
    patient.until(lambda: patient.state("Counter") == "idle", "the end to be seen")


def test_a_goal_that_its_server_aborts_ends_so_with_its_result(patient: Porter) -> None:
    patient.allow(True)
    goal = patient.reached_goal()
    patient.peer.do("end", name="/count", how="aborted", message={"result": 9})
    assert patient.end_of(goal) == (ABORTED, {"result": 9})


def test_a_cancel_of_the_caller_is_always_forwarded(patient: Porter) -> None:
    patient.allow(True)
    goal = patient.reached_goal()
    before = patient.peer.cancels["/count"]
    patient.peer.do("withdraw", id=goal)
    patient.until(lambda: patient.peer.cancels["/count"] > before, "the cancel to reach the robot")
    assert all(item.get("state") != DONE for item in patient.peer.sent[goal])
    patient.peer.do("end", name="/count", how="canceled", message={"result": 7})
    assert patient.end_of(goal) == (PREEMPTED, {"result": 7})
    patient.until(lambda: patient.state("Counter") == "idle", "the cancel to be seen")


def test_a_goal_that_turns_against_its_requirement_is_cancelled_and_aborted_when_it_has_ended(patient: Porter) -> None:
    patient.allow(True)
    goal = patient.reached_goal()
    before = patient.peer.cancels["/count"]
    patient.allow(False)
    patient.until(lambda: patient.peer.cancels["/count"] > before, "the cancel to reach the robot")
    # It is still winding down: its caller has to wait, and so has another goal.
    patient.allow(True)
    assert patient.end_of(patient.goal())[0] == REJECTED
    assert all(item.get("state") != DONE for item in patient.peer.sent[goal])
    patient.peer.do("end", name="/count", how="canceled")
    assert patient.end_of(goal)[0] == ABORTED
    goals = len(patient.peer.goals["/count"])
    patient.until(lambda: len(patient.peer.goals["/count"]) > goals, "the next goal", patient.goal)
    patient.peer.do("end", name="/count", how="succeeded")


def test_a_goal_that_its_server_rejects_ends_as_aborted(patient: Porter) -> None:
    patient.allow(True)
    patient.peer.do("accepts", name="/count", accepts=False)
    try:
        assert patient.end_of(patient.reached_goal())[0] == ABORTED
    finally:
        patient.peer.do("accepts", name="/count", accepts=True)


def test_a_goal_without_a_server_ends_as_aborted_and_a_call_with_the_default(package: Path, tmp_path: Path) -> None:
    with porter_robot(package, tmp_path, has_servers=False) as porter:
        porter.start("_server_wait:=0.0", "_command_timeout:=0.0")
        porter.allow(True)
        assert porter.end_of(porter.goal())[0] == ABORTED
        assert porter.reply(porter.call()) == {"success": False, "message": "the call failed or took too long"}


# The end of the layer.


def test_at_the_end_the_robot_stands_still_and_nobody_waits(porter: Porter) -> None:
    # An answer that takes a while to go out is awaited.
    slow = f"""
import time
from {PACKAGE} import node
from {PACKAGE}.runtime.servers import CalledService
before = CalledService.handle
def handle(self, request):
    response = before(self, request)
    time.sleep(1.0)
    return response
CalledService.handle = handle
node.LEAVE_S = 10.0
node.main()
"""
    porter.start(*PATIENT, "_service_timeout:=0.0", command=["-c", slow])
    porter.drive()
    calls, cancels = len(porter.peer.requests["/power"]), porter.peer.cancels["/count"]
    call, goal = porter.call(), porter.reached_goal()
    porter.until(lambda: len(porter.peer.requests["/power"]) > calls, "the call")
    porter.until(lambda: any(item.get("state") == WAITING for item in porter.peer.sent[goal]), "the goal to be active")
    porter.end()
    wait_until(lambda: porter.speed == 0.0, "the robot to stand still")
    wait_until(lambda: porter.peer.cancels["/count"] > cancels, "the cancel to reach the robot")
    wait_until(lambda: call in porter.peer.replies, "the reply")
    assert porter.peer.replies[call] == {"call": call, "reply": {"success": False, "message": "the layer has ended"}}
    wait_until(lambda: porter.peer.sent[goal][-1].get("state") == DONE, "the end of the goal")
    assert porter.peer.sent[goal][-1]["status"] == ABORTED
    porter.answer(success=True)
    porter.peer.do("end", name="/count", how="canceled")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_stops_the_robot_first(porter: Porter, number: signal.Signals) -> None:
    porter.start(*PATIENT, command=["-m", f"{PACKAGE}.node"])
    porter.drive()
    assert porter.layer is not None
    porter.layer.signal(number)
    porter.ended(0)
    wait_until(lambda: porter.speed == 0.0, "the robot to stand still")


@pytest.mark.parametrize(("place", "method"), [("caller.CallerSide", "pass_on"), ("robot.RobotSide", "check_servers")])
def test_an_exception_stops_the_robot_first(porter: Porter, place: str, method: str) -> None:
    module, name = place.split(".")
    # A scan, or the file, makes it fail: until then it does what it does.
    broken = f"""
import pathlib
from {PACKAGE} import node
from {PACKAGE}.{module} import {name} as side
before = side.{method}
def fails(self, *arguments):
    if '/scan' in arguments or pathlib.Path('broken').exists():
        raise ValueError('no way')
    return before(self, *arguments)
side.{method} = fails
node.main()
"""
    porter.start(*PATIENT, command=["-c", broken])
    porter.drive()
    assert porter.layer is not None
    if method == "pass_on":
        porter.peer.publish("/scan", SENT["/scan"])
    else:
        (porter.home / "layer" / "broken").touch()
    porter.ended(1)
    wait_until(lambda: porter.speed == 0.0, "the robot to stand still")
    assert "no way" in porter.layer.stderr


def test_a_lost_master_stops_the_robot(package: Path, tmp_path: Path) -> None:
    with porter_robot(package, tmp_path) as porter:
        porter.start(*PATIENT)
        porter.drive()
        porter.master.start_anew(tmp_path)
        porter.ended(1)
        wait_until(lambda: porter.speed == 0.0, "the robot to stand still")
        assert porter.layer is not None and "the ROS master is lost" in porter.layer.stderr


def test_a_prefix_goes_before_both_sides(porter: Porter) -> None:
    porter.leave()
    porter.master.delete_parameters(f"/{PACKAGE}")
    porter.run += 1
    porter.peer.subscribe("/robot1/blocked", "std_msgs/String")
    arguments = ("--topic-prefix", "/robot1", "_server_wait:=0.0")
    with porter.process("start", *arguments) as layer:
        until(
            lambda: bool(porter.peer.values("/robot1/blocked")),
            "a message held back",
            layer,
            lambda: porter.peer.publish("/robot1/supervised/cmd_vel", SENT["/supervised/cmd_vel"], linear={"x": 1.0}),
        )
    assert json.loads(porter.peer.values("/robot1/blocked")[0]["data"])["identifier"] == "/cmd_vel"
    with porter.process("start", "--topic-prefix", "/robot1", "--print-remappings", name="printing") as printing:
        assert printing.wait() == 0
    assert "/robot1/cmd_vel:=/robot1/supervised/cmd_vel" in printing.stdout.split()
    assert "/robot1/count/feedback:=/robot1/supervised/count/feedback" in printing.stdout.split()
