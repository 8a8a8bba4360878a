"""The generated ROS 1 node in C++ as a process of its own on a real master, with peers on rospy."""

import contextlib
import json
import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from support.models import EXAMPLES
from support.process import Process
from support.ros1_cpp import LIMIT_S, Master, Peer, built_once, missing, node_command, plain_environment, supervisor_of
from support.waiting import wait_until

pytestmark = [
    pytest.mark.skipif(missing() is not None, reason=str(missing())),
]

PACKAGE = "line_follower_controller"
STOPPED = dict.fromkeys("xyz", 0.0)


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    supervisor = supervisor_of(EXAMPLES / "line_follower" / "line_follower.rscd")
    return built_once(supervisor, tmp_path_factory)


@pytest.fixture
def master(tmp_path: Path) -> Iterator[Master]:
    # Parameters outlive their node: each test has a parameter server of its own.
    with Master(tmp_path / "ros1") as made:
        yield made


Start = Callable[..., Process]


@pytest.fixture
def start(workspace: Path, master: Master, tmp_path: Path) -> Iterator[Start]:
    nodes: list[Process] = []

    def start_node(*parameters: str) -> Process:
        nodes.append(Process(node_command(workspace, *parameters), master.variables, tmp_path / str(len(nodes))))
        return nodes[-1]

    yield start_node
    for node in nodes:
        node.__exit__(None, None, None)


@pytest.fixture
def peer(master: Master, tmp_path: Path) -> Iterator[Peer]:
    with Peer(master, tmp_path) as made:
        yield made


class Robot:
    """The test's side of the line follower's topics."""

    def __init__(self, peer: Peer, prefix: str = "") -> None:
        self.peer = peer
        self.prefix = prefix
        peer.order("subscribe", f"{prefix}/cmd_vel", "geometry_msgs/Twist")

    @property
    def commands(self) -> list[Any]:
        return self.peer.messages(f"{self.prefix}/cmd_vel")

    @property
    def speed(self) -> float | None:
        commands = self.commands
        return float(commands[-1]["linear"]["x"]) if commands else None

    def line(self, correction: float = 0.25) -> None:
        self.peer.publish(f"{self.prefix}/line/correction", "std_msgs/Float32", data=correction)

    def scan(self, distance: float, count: int = 360) -> None:
        fields = {"ranges": [distance] * count, "range_max": 10.0, "angle_increment": 6.283185307179586 / count}
        self.peer.publish(f"{self.prefix}/scan", "sensor_msgs/LaserScan", **fields)

    def empty(self, topic: str) -> None:
        self.peer.publish(self.prefix + topic, "std_msgs/Empty")

    def drive(self) -> None:
        def see() -> None:
            self.line()
            self.scan(2.0)

        wait_until(lambda: self.speed == 0.15, "the robot to move", repeat=see)


@pytest.mark.smoke
def test_it_moves_only_while_everything_allows_it(start: Start, peer: Peer) -> None:
    start("period:=0.02")
    robot = Robot(peer)
    wait_until(lambda: robot.speed is not None, "the first command")
    wait_until(lambda: len(robot.commands) > 10, "a line without a scan to change nothing", repeat=robot.line)
    assert {command["linear"]["x"] for command in robot.commands} == {0.0}

    robot.drive()
    assert robot.commands[-1]["angular"]["z"] == 0.25
    wait_until(
        lambda: robot.commands[-1]["angular"]["z"] == -0.5, "the new correction", repeat=lambda: robot.line(-0.5)
    )

    stops: list[tuple[str, Callable[[], object], Callable[[], object]]] = [
        ("an obstacle", lambda: robot.scan(0.2), lambda: robot.scan(2.0)),
        ("the stop button", lambda: robot.empty("/emergency_stop/stop"), lambda: robot.empty("/emergency_stop/resume")),
        ("a lost line", lambda: robot.empty("/line/lost"), robot.line),
    ]
    for what, stop, resume in stops:
        wait_until(lambda: robot.speed == 0.0, f"the robot to stop at {what}", repeat=stop)
        before = len(robot.commands)
        wait_until(lambda before=before: len(robot.commands) > before + 5, "more commands")  # type: ignore[misc]
        assert {command["linear"]["x"] for command in robot.commands[before:]} == {0.0}, what
        wait_until(lambda: robot.speed == 0.15, f"the robot to move again after {what}", repeat=resume)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_stops_the_robot_first(start: Start, peer: Peer, number: signal.Signals, tmp_path: Path) -> None:
    # Decisions are so rare that the zero can only come from the stop.
    node = start("period:=0.5", f"log_folder:={tmp_path / 'new' / 'events'}")
    robot = Robot(peer)
    robot.drive()
    node.signal(number)
    assert node.wait() == 0
    wait_until(lambda: robot.speed == 0.0, "a zero")
    assert robot.commands[-1] == {"linear": STOPPED, "angular": STOPPED}
    assert node.stderr == ""
    (log,) = (tmp_path / "new" / "events").iterdir()
    entries = [json.loads(line) for line in log.read_text().splitlines()]
    assert {"kind": "stop", "what": number.name}.items() <= entries[-1].items()
    moves = [entry for entry in entries if entry.get("event") == "move.request"]
    assert moves
    assert all(entry["controllable"] is True for entry in moves)
    assert moves[-1]["data"] == {"linear": {"x": 0.15}, "angular": {"z": 0.25}}
    assert moves[-1]["state"]["LineDetector"] == {"state": "line_found", "variables": {"current_correction": 0.25}}


def test_rosnode_kill_stops_the_robot_first(start: Start, peer: Peer, master: Master) -> None:
    node = start("period:=0.5")
    robot = Robot(peer)
    robot.drive()
    done = subprocess.run(
        ["/usr/bin/rosnode", "kill", f"/{PACKAGE}"],
        env=master.variables,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert node.wait() == 0
    wait_until(lambda: robot.speed == 0.0, "a zero")


def test_without_its_master_the_robot_is_stopped(workspace: Path, tmp_path: Path) -> None:
    # It has ended, it hangs, or another has taken its place: side by side, for it takes seconds to notice.
    lost: list[tuple[Process, Robot]] = []
    with contextlib.ExitStack() as stack:
        for what in ("dead", "hung", "new"):
            folder = tmp_path / what
            master = stack.enter_context(Master(folder))
            robot = Robot(stack.enter_context(Peer(master, folder)))
            command = node_command(workspace, "period:=0.5")
            node = stack.enter_context(Process(command, master.variables, folder / "node"))
            robot.drive()
            master.signal(signal.SIGSTOP if what == "hung" else signal.SIGKILL)
            if what == "new":
                master.wait()
                stack.enter_context(master.another(folder / "another"))
            lost.append((node, robot))
        for node, robot in lost:
            assert node.wait() == 1
            wait_until(lambda robot=robot: robot.speed == 0.0, "a zero")  # type: ignore[misc]
            assert node.stderr == f"{PACKAGE}: the ROS master is lost\n"


def test_a_fault_stops_the_robot_and_is_reported_at_the_end(start: Start, peer: Peer) -> None:
    node = start("period:=0.5", "on_unknown:=fault")
    robot = Robot(peer)
    robot.drive()
    wait_until(lambda: not node.is_running, "the end", repeat=lambda: robot.scan(float("nan")))
    assert node.wait() == 1
    wait_until(lambda: robot.speed == 0.0, "a zero")
    assert node.stderr.splitlines()[-1] == f"{PACKAGE}: something was unknown"


@pytest.mark.parametrize(
    ("parameter", "expected"),
    [
        ("period:=0", "parameter 'period' is 0; it must be 0.0001 seconds or more"),
        ("period:=fast", "parameter 'period' is 'fast'; it must be"),
        ("policy:=quick", "parameter 'policy' is 'quick'; it must be one of fair, priority, random"),
        ("priority:=[jump]", "parameter 'priority': 'jump' is not a request; there is "),
        ("max_age:=[/scan]", "parameter 'max_age' is '/scan'; it must be topic=seconds, such as /scan=0.5"),
        ("max_age:=[/scam=1]", "parameter 'max_age': '/scam' is not the identifier of an outgoing message"),
        ("topic_prefix:=robot1", "parameter 'topic_prefix' is 'robot1'; it must be empty or the beginning"),
        ("publish_state:=1", "parameter 'publish_state' is 1; it must be true or false"),
        ("log_folder:=/proc/none", "parameter 'log_folder': /proc/none: "),
    ],
)
def test_a_wrong_parameter_is_one_clear_error(
    workspace: Path, master: Master, tmp_path: Path, parameter: str, expected: str
) -> None:
    name, _, value = parameter.partition(":=")
    set_value = f"import rospy, yaml, sys; rospy.set_param('/{PACKAGE}/{name}', yaml.safe_load(sys.argv[1]))"
    subprocess.run(["/usr/bin/python3", "-c", set_value, value], env=master.variables, check=True, timeout=LIMIT_S)
    with Process(node_command(workspace), master.variables, tmp_path / "node") as node:
        assert node.wait() == 2
        assert node.stderr.startswith(f"{PACKAGE}: {expected}")
        assert node.stderr.count("\n") == 1


def test_state_prefix_stale_sensors_and_other_scans(start: Start, peer: Peer) -> None:
    node = start("period:=0.02", "topic_prefix:=/robot1", "publish_state:=true", "resample_scans:=true", "perod:=1")
    robot = Robot(peer, "/robot1")
    peer.order("subscribe", "/robot1/state", "std_msgs/String")
    peer.order("subscribe", "/diagnostics", "diagnostic_msgs/DiagnosticArray")

    def see() -> None:
        robot.line()
        # The model's 360 beams are made from 720.
        robot.scan(2.0, count=720)

    wait_until(lambda: robot.speed == 0.15, "the robot to move", repeat=see)
    assert "there is no parameter 'perod'" in node.stdout + node.stderr
    wait_until(lambda: bool(peer.messages("/robot1/state")), "a state")
    state = json.loads(peer.messages("/robot1/state")[-1]["data"])
    assert state["communications"] == {}
    assert state["definition"]["name"] == "LineFollower"
    numbers = {
        transition["id"]
        for component in state["definition"]["components"]
        for item in component.get("behaviour", {}).get("states", ())
        for transition in item["transitions"]
    }
    taken = [number for item in peer.messages("/robot1/state") for number in json.loads(item["data"])["transitions"]]
    assert taken
    assert set(taken) <= numbers
    wait_until(lambda: bool(peer.messages("/diagnostics")), "diagnostics")
    (status,) = peer.messages("/diagnostics")[-1]["status"]
    assert status["name"] == f"/{PACKAGE}: controller"
    assert status["hardware_id"] == "LineFollower"
    assert {item["key"] for item in status["values"]} >= {"status", "reason", "unknown", "last decision (us)"}


def test_a_stale_sensor_stops_the_robot_until_it_is_back(
    workspace: Path, master: Master, peer: Peer, tmp_path: Path
) -> None:
    parameters = tmp_path / "parameters.yaml"
    parameters.write_text("period: 0.02\nmax_age: ['/scan=0.3']\n")
    # By roslaunch, with the file of parameters that its argument names.
    environment = {
        **master.variables,
        "ROS_PACKAGE_PATH": str(workspace / "src"),
        "CMAKE_PREFIX_PATH": f"{workspace / 'build' / 'devel'}:/usr",
        "PYTHONPATH": "/usr/lib/python3/dist-packages",
    }
    command = ["/usr/bin/roslaunch", str(workspace / "src/launch/controller.launch"), f"parameters:={parameters}"]
    with Process(command, environment, tmp_path / "launch") as launch:
        robot = Robot(peer)

        def see() -> None:
            assert launch.is_running, launch.stderr + launch.stdout
            robot.line()
            robot.scan(2.0)

        wait_until(lambda: robot.speed == 0.15, "the robot to move", repeat=see)
        wait_until(lambda: robot.speed == 0.0, "the robot to stop without scans", repeat=robot.line)
        wait_until(lambda: robot.speed == 0.15, "the robot to move again", repeat=see)
        launch.signal(signal.SIGINT)
        assert launch.wait() == 0
    wait_until(lambda: robot.speed == 0.0, "a zero at the end")


def test_it_ends_on_a_signal_while_there_is_no_master(workspace: Path, tmp_path: Path) -> None:
    variables = plain_environment(ROS_MASTER_URI="http://127.0.0.1:9", ROS_IP="127.0.0.1", ROS_HOME=str(tmp_path))
    with Process(node_command(workspace), variables, tmp_path / "node") as node:
        wait_until(lambda: "waiting for the master" in node.stdout + node.stderr, "the warning")
        node.signal(signal.SIGTERM)
        assert node.wait() == 0


def test_the_package_is_as_catkin_wants_it(workspace: Path) -> None:
    check = f"from catkin_pkg.package import parse_package; print(parse_package('{workspace / 'src'}').name)"
    done = subprocess.run(
        ["/usr/bin/python3", "-c", check], env=plain_environment(), capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == PACKAGE
    assert os.access(workspace / "src" / "launch" / "controller.launch", os.R_OK)
