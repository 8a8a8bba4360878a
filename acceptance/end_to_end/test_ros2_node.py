"""The generated ROS 2 node as a process of its own on real topics, driven from this process."""

import itertools
import json
import shutil
import signal
import subprocess
import sys
from array import array
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc.targets import generate, write_files
from support.models import EXAMPLES, model_of
from support.other_rclpy import DISTRIBUTIONS, distribution_command
from support.random_supervisors import CERTIFICATE
from support.ros2 import Peer, RosProcess, environment, own_domain
from support.service import server_process

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")

pytestmark = pytest.mark.ros2

PACKAGE = "line_follower_controller"
TOPICS = ("/line/correction", "/line/lost", "/scan", "/emergency_stop/stop", "/emergency_stop/resume", "/cmd_vel")
LIMIT_S = 10.0

StartNode = Callable[..., RosProcess]


def complaints(node: RosProcess) -> list[str]:
    """Lines that a node has written to standard error, without those about its start."""
    return [line for line in node.stderr.splitlines() if not line.startswith("[INFO]")]


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package as a robot's engineer gets it: a client process asks a server process for it."""
    folder = tmp_path_factory.mktemp("workspace")
    client = str(Path(sys.executable).with_name("robosc-client"))
    model = str(EXAMPLES / "line_follower" / "line_follower.rscd")
    with server_process() as (_, address):
        command = [client, "generate", model, "--server", address, "--target", "ros2", "-o", str(folder)]
        result = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert result.returncode == 0, result.stderr
    return folder


@pytest.fixture
def domain() -> Iterator[int]:
    with own_domain() as number:
        yield number


@pytest.fixture(params=DISTRIBUTIONS)
def start(request: pytest.FixtureRequest, workspace: Path, domain: int, tmp_path: Path) -> Iterator[StartNode]:
    """Starts the node; every started one is killed at the end."""
    program, *words = distribution_command(request.param)
    nodes: list[RosProcess] = []

    def start_node(*parameters: str) -> RosProcess:
        arguments = itertools.chain.from_iterable(("-p", parameter) for parameter in parameters)
        file = workspace / "config/parameters.yaml"
        command = [*words, "-m", f"{PACKAGE}.node", "--ros-args", "--params-file", str(file), *arguments]
        variables, folder = environment(domain, tmp_path), tmp_path / str(len(nodes))
        nodes.append(RosProcess(command, variables, folder, [workspace], program=program))
        return nodes[-1]

    yield start_node
    for node in nodes:
        node.__exit__(None, None, None)


@pytest.fixture
def peer(domain: int, tmp_path: Path) -> Iterator[Peer]:
    with Peer(domain, environment(domain, tmp_path)) as made:
        yield made


class Robot:
    """The test's side of the line follower's topics."""

    def __init__(self, peer: Peer, node: RosProcess, prefix: str = "") -> None:
        from geometry_msgs.msg import Twist

        self.peer = peer
        self.node = node
        self.prefix = prefix
        self.commands = peer.receive(Twist, f"{prefix}/cmd_vel")
        peer.wait_for_peers([prefix + topic for topic in TOPICS])

    @property
    def speed(self) -> float | None:
        return float(self.commands[-1].linear.x) if self.commands else None

    def line(self, correction: float = 0.25) -> None:
        from std_msgs.msg import Float32

        self.peer.publish(Float32(data=correction), f"{self.prefix}/line/correction")

    def scan(self, distance: float) -> None:
        from rclpy.qos import qos_profile_sensor_data
        from sensor_msgs.msg import LaserScan

        message = LaserScan(ranges=array("f", [distance] * 360))
        self.peer.publish(message, f"{self.prefix}/scan", qos_profile_sensor_data)

    def empty(self, topic: str) -> None:
        from std_msgs.msg import Empty

        self.peer.publish(Empty(), self.prefix + topic)

    def until(self, condition: Callable[[], bool], what: str, repeat: Callable[[], object] = lambda: None) -> None:
        self.peer.spin_until(condition, LIMIT_S, what, self.node, repeat)

    def next_commands(self, count: int) -> list[Any]:
        """The commands that come from now on."""
        before = len(self.commands)
        self.until(lambda: len(self.commands) >= before + count, "more commands")
        return self.commands[before:]

    def drive(self) -> None:
        """Give it a line and a clear way until it moves."""

        def see() -> None:
            self.line()
            self.scan(2.0)

        self.until(lambda: self.speed == 0.15, "the robot to move", see)


@pytest.mark.smoke
def test_it_moves_only_while_everything_allows_it(start: StartNode, peer: Peer) -> None:
    robot = Robot(peer, start("period:=0.02"))
    robot.until(lambda: robot.speed is not None, "the first command")
    assert robot.speed == 0.0
    robot.until(lambda: len(robot.commands) > 10, "a line without a scan to change nothing", robot.line)
    assert {command.linear.x for command in robot.commands} == {0.0}

    robot.drive()
    assert robot.commands[-1].angular.z == 0.25
    robot.line(-0.5)
    robot.until(lambda: robot.commands[-1].angular.z == -0.5, "the new correction")

    stops: list[tuple[str, Callable[[], object], Callable[[], object]]] = [
        ("an obstacle", lambda: robot.scan(0.2), lambda: robot.scan(2.0)),
        ("the stop button", lambda: robot.empty("/emergency_stop/stop"), lambda: robot.empty("/emergency_stop/resume")),
        ("a lost line", lambda: robot.empty("/line/lost"), robot.line),
    ]
    for what, stop, resume in stops:
        stop()
        robot.until(lambda: robot.speed == 0.0, f"the robot to stop at {what}", stop)
        assert {command.linear.x for command in robot.next_commands(5)} == {0.0}, what
        robot.until(lambda: robot.speed == 0.15, f"the robot to move again after {what}", resume)


def test_a_misspelt_parameter_is_reported_once(start: StartNode, peer: Peer) -> None:
    node = start("perod:=0.02")
    robot = Robot(peer, node)
    robot.until(lambda: robot.speed is not None, "the first command")
    assert node.stderr.count("there is no parameter 'perod'; did you mean 'period'?") == 1


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_stops_the_robot_first(start: StartNode, peer: Peer, number: signal.Signals, tmp_path: Path) -> None:
    from geometry_msgs.msg import Twist

    # Decisions are so rare that the zero can only come from the stop.
    node = start("period:=0.5", f"log_folder:={tmp_path / 'events'}")
    robot = Robot(peer, node)
    robot.drive()
    robot.node.signal(number)
    peer.spin_until(lambda: robot.commands[-1] == Twist() and not node.is_running, LIMIT_S, "a zero and the end")
    assert node.wait() == 0
    assert complaints(node) == []
    (log,) = (tmp_path / "events").iterdir()
    entries = [json.loads(line) for line in log.read_text().splitlines()]
    assert {"kind": "stop", "what": number.name}.items() <= entries[-1].items()
    moves = [entry for entry in entries if entry.get("event") == "move.request"]
    assert moves
    for entry in moves:
        assert entry["controllable"] is True
        assert entry["data"] == {"linear": {"x": 0.15}, "angular": {"z": 0.25}}
        states = {name: part["state"] for name, part in entry["state"].items()}
        assert (states["LineDetector"], states["LidarSensor"]) == ("line_found", "safe")


def test_hostile_numbers_neither_reach_the_motor_nor_stop_the_node(start: StartNode, peer: Peer) -> None:
    robot = Robot(peer, start("period:=0.02"))
    robot.drive()
    for correction in (float("nan"), float("inf"), -float("inf")):
        robot.line(correction)
    robot.scan(float("nan"))
    robot.until(lambda: robot.speed == 0.0, "a scan of NaN to count as an obstacle", lambda: robot.scan(float("nan")))
    robot.line(0.75)
    robot.until(lambda: robot.commands[-1].angular.z == 0.75, "the node to go on", lambda: robot.scan(2.0))
    assert all(abs(command.angular.z) <= 1.0 for command in robot.commands)


def test_a_stale_sensor_stops_the_robot_until_it_is_back(start: StartNode, peer: Peer) -> None:
    robot = Robot(peer, start("period:=0.02", "max_age:=['/scan=0.3']", "release_identifiers:=['/cmd_vel']"))
    robot.drive()
    robot.until(lambda: robot.speed == 0.0, "the robot to stop without scans")
    seen = len(robot.commands)
    peer.spin_for(0.2)
    assert len(robot.commands) == seen
    robot.drive()


def test_a_fault_stops_the_robot_and_ends_the_node(start: StartNode, peer: Peer) -> None:
    from geometry_msgs.msg import Twist

    node = start("period:=0.5", "on_unknown:=fault")
    robot = Robot(peer, node)
    robot.drive()
    robot.scan(float("nan"))
    peer.spin_until(lambda: robot.commands[-1] == Twist() and not node.is_running, LIMIT_S, "a zero and the end")
    assert node.wait() == 1
    (line,) = complaints(node)
    assert line.startswith(f"{PACKAGE}: ")
    assert "unknown at scan.response" in line


def test_the_state_is_published_as_semantics_says(start: StartNode, peer: Peer) -> None:
    from std_msgs.msg import String

    states = peer.receive(String, "/state")
    robot = Robot(peer, start("period:=0.02", "publish_state:=true"))
    robot.drive()

    def content() -> Any:
        return json.loads(states[-1].data)

    def heard() -> bool:
        """Return True if the node has heard both topics, of which either may reach it first."""
        if not states:
            return False
        current = content()["current"]
        return (current["LidarSensor"]["state"], current["LineDetector"]["state"]) == ("safe", "line_found")

    robot.until(heard, "the state topic")
    state = content()
    assert state["current"]["LineDetector"] == {"state": "line_found", "variables": {"current_correction": "0.25"}}
    assert state["current"]["LidarSensor"] == {"state": "safe", "variables": {"ahead": "clear"}}
    assert state["communications"] == {}
    definition = state["definition"]
    assert definition["name"] == "LineFollower"
    names = [component["name"] for component in definition["components"]]
    assert names == ["LineDetector", "LidarSensor", "EmergencyStop", "Platform"]
    detector = definition["components"][0]
    assert detector["messages"] == ["correction", "line_lost"]
    assert detector["services"] == detector["actions"] == []
    (initial, other) = detector["behaviour"]["states"]
    assert initial["initial"] and not other["initial"]
    (first,) = (item for item in initial["transitions"] if item["communication"] == "correction")
    assert {key: first[key] for key in ("next", "type", "communication")} == {
        "next": "line_found",
        "type": "response",
        "communication": "correction",
    }
    taken = {number for message in states for number in json.loads(message.data)["transitions"]}
    assert first["id"] in taken
    known = {
        item["id"]
        for component in definition["components"]
        for place in component["behaviour"]["states"]
        for item in place["transitions"]
    }
    assert taken <= known


def test_a_prefix_moves_every_topic(start: StartNode, peer: Peer) -> None:
    robot = Robot(peer, start("period:=0.02", "topic_prefix:=/robot_1"), prefix="/robot_1")
    robot.drive()
    names = {name for name, _ in peer.node.get_topic_names_and_types()}
    assert not names & set(TOPICS)


@pytest.mark.parametrize(
    ("parameter", "complaint"),
    [
        ("period:=-1.0", "parameter 'period' is -1.0; it must be"),
        ("policy:=2", "parameter 'policy' is 2; it must be one of fair, priority, random"),
        ("log_folder:=/dev/null/x", "parameter 'log_folder': "),
        ("period", "cannot start: "),
    ],
)
def test_a_wrong_parameter_is_one_line_and_exit_status_2(start: StartNode, parameter: str, complaint: str) -> None:
    node = start(parameter)
    assert node.wait() == 2
    # Lines of rcl itself about its arguments come before.
    *others, line = complaints(node)
    assert line.startswith(f"{PACKAGE}: {complaint}")
    assert all(other.startswith("[ERROR]") for other in others)


def test_the_starter_needs_no_launch_and_reads_the_parameter_file(workspace: Path, domain: int, tmp_path: Path) -> None:
    package = tmp_path / "package"
    shutil.copytree(workspace, package)
    file = package / "config/parameters.yaml"
    file.write_text(file.read_text().replace("period: 0.1", "period: -1.0"))
    command = ["-m", f"{PACKAGE}.start"]
    for arguments, complaint in (
        ([], "parameter 'period' is -1.0; it must be"),
        (["--ros-args", "-p", "period:=-2.0"], "parameter 'period' is -2.0; it must be"),
    ):
        run = tmp_path / str(len(arguments))
        with RosProcess([*command, *arguments], environment(domain, tmp_path), run, [package]) as node:
            assert node.wait() == 2
            assert complaints(node)[0].startswith(f"{PACKAGE}: {complaint}")


MISFITS = {
    "a type that is not installed": (
        "interface i use Pose from no_such_msgs component C { outgoing message m with type: none links i }",
        "the message type no_such_msgs/msg/Pose is not installed; build no_such_msgs and source its workspace",
    ),
    "a property that a received message does not have": (
        "interface i use LaserScan from sensor_msgs datatype object S { rages: array(double) }"
        "component C { outgoing message m with type: S links i"
        " behaviour { variable n: integer initial marked state s { on response from m do n := length(value.rages) }}}",
        "message m: sensor_msgs/msg/LaserScan has no field 'rages'; it has header, angle_min,",
    ),
    "a basic type for a message of many fields": (
        "interface i use BasicTypes from test_msgs component C { outgoing message m with type: double links i }",
        "the message test_msgs/msg/BasicTypes has the fields bool_value, byte_value,",
    ),
    "a service type that is not installed": (
        "interface i use Fly from no_such_srvs component C { service s with request: none, response: none links i }",
        "the service type no_such_srvs/srv/Fly is not installed; build no_such_srvs and source its workspace",
    ),
    "an action type that is not installed": (
        "interface i use Trigger from std_srvs component C {"
        "  action a with request: none, response: none, feedback: none links i }",
        "the action type std_srvs/action/Trigger is not installed; build std_srvs and source its workspace",
    ),
    "a property that a service's response does not have": (
        "interface i use SetBool from std_srvs datatype object S { succes: boolean }"
        "component C { service s with request: none, response: S links i"
        "  behaviour { variable b: boolean on response from s do b := value.succes initial marked state t { } } }",
        "response of service s: std_srvs/srv/SetBool_Response has no field 'succes'; it has success, message",
    ),
    "a stamped goal without a header": (
        "interface i use Fibonacci from test_msgs component C {"
        '  action a with request: none, response: none, feedback: none, stamped: "map" links i }',
        "action a: it is stamped, but neither test_msgs/action/Fibonacci_Goal nor a field has a header",
    ),
    "a property of another type in a request": (
        "interface i use SetBool from std_srvs datatype object S { data: integer }"
        "component C { service s with request: S, response: none links i }",
        "request of service s: the field 'data' of std_srvs/srv/SetBool_Request is boolean, in the model it is integer",
    ),
}


@pytest.mark.parametrize("what", MISFITS)
def test_a_message_that_does_not_fit_the_model_is_a_start_up_error(what: str, domain: int, tmp_path: Path) -> None:
    body, complaint = MISFITS[what]
    supervisor = Supervisor(model_of(f"robot Misfit {{ {body} }}"), Deployment.CONTROLLER, (), CERTIFICATE)
    write_files(generate(supervisor, "ros2"), tmp_path / "package")
    command = ["-m", "misfit_controller.node"]
    with RosProcess(command, environment(domain, tmp_path), tmp_path / "run", [tmp_path / "package"]) as node:
        assert node.wait() == 2
        (line,) = complaints(node)
    assert line.startswith(f"misfit_controller: {complaint}")
