"""A generated ROS 1 node, run for real: what it publishes, and that the robot stands still whatever ends it."""

import json
import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from robosc.targets import generate, write_files
from support.generated import example_supervisor
from support.process import Process
from support.ros1 import PYTHON, Master, Peer, missing, start_node, until
from support.waiting import wait_until

pytestmark = [
    pytest.mark.ros1,
    pytest.mark.skipif(missing() is not None, reason=str(missing())),
]

PACKAGE = "line_follower_controller"
FOLLOWER = "line_follower/line_follower"
ZERO = {"linear": {"x": 0.0, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": 0.0}}
RECEIVED = {
    "/line/correction": "std_msgs/Float32",
    "/line/lost": "std_msgs/Empty",
    "/scan": "sensor_msgs/LaserScan",
    "/emergency_stop/stop": "std_msgs/Empty",
    "/emergency_stop/resume": "std_msgs/Empty",
}


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The generated package."""
    folder = tmp_path_factory.mktemp("package")
    write_files(generate(example_supervisor(FOLLOWER), "ros1"), folder)
    return folder


class Robot:
    """The test's side of the line follower."""

    def __init__(self, master: Master, package: Path, folder: Path) -> None:
        self.master = master
        self.package = package
        self.folder = folder
        self.ends = ExitStack()
        self.peer = self.ends.enter_context(Peer(master, folder))
        self.prefix = ""
        self.node: Process

    def run(self, *arguments: str, module: str = "start") -> Process:
        """Start the node alone."""
        self.node = self.ends.enter_context(
            start_node(self.master, self.folder / "run", self.package, f"{PACKAGE}.{module}", arguments)
        )
        return self.node

    def start(self, *arguments: str, prefix: str = "") -> None:
        """Start the node, connected with the peer both ways."""
        self.prefix = prefix
        self.run(*arguments)
        self.meet()

    def meet(self) -> None:
        """Wait until node and peer are connected."""
        self.peer.subscribe(f"{self.prefix}/cmd_vel", "geometry_msgs/Twist")
        self.peer.subscribe("/diagnostics", "diagnostic_msgs/DiagnosticArray")
        for topic, type_name in RECEIVED.items():
            self.peer.advertise(self.prefix + topic, type_name)
        topics = [f"{self.prefix}/cmd_vel", *(self.prefix + topic for topic in RECEIVED)]
        until(lambda: all(self.peer.ends(topic) for topic in topics), "the connections", self.node)

    @property
    def commands(self) -> list[Any]:
        return self.peer.values(f"{self.prefix}/cmd_vel")

    @property
    def speed(self) -> float | None:
        return self.commands[-1]["linear"]["x"] if self.commands else None

    def send(self, topic: str, **fields: Any) -> None:
        self.peer.publish(self.prefix + topic, RECEIVED[topic], **fields)

    def line(self, correction: float = 0.25) -> None:
        self.send("/line/correction", data=correction)

    def scan(self, distance: float, **fields: Any) -> None:
        self.send("/scan", ranges=[distance] * 360, **fields)

    def until(self, condition: Callable[[], bool], what: str, repeat: Callable[[], object] = lambda: None) -> None:
        until(condition, what, self.node, repeat)

    def drive(self) -> None:
        """Give it a line and a clear way until it moves."""

        def see() -> None:
            self.line()
            self.scan(2.0)

        self.until(lambda: self.speed == pytest.approx(0.15), "the robot to move", see)

    def next_commands(self, count: int) -> list[Any]:
        """The commands that come from now on."""
        before = len(self.commands)
        self.until(lambda: len(self.commands) >= before + count, "more commands")
        return self.commands[before:]

    def stands_still(self, status: int) -> None:
        """The node ends with a status, and its last command is the zero."""
        assert self.node.wait() == status, self.node.stderr
        wait_until(lambda: self.commands[-1] == ZERO, "the zero")
        count = len(self.commands)
        # No message is on its way any more: the connection is closed.
        wait_until(lambda: not self.peer.ends(f"{self.prefix}/cmd_vel"), "the end of the connection")
        assert self.commands[count:] == []

    def health(self) -> tuple[int, str, dict[str, str]] | None:
        """Level, message and values of the last report."""
        reports = self.peer.values("/diagnostics")
        if not reports:
            return None
        (status,) = reports[-1]["status"]
        return status["level"], status["message"], {item["key"]: item["value"] for item in status["values"]}


def entries(folder: Path) -> list[Any]:
    """Return the entries of the one event log in a folder."""
    (log,) = folder.iterdir()
    return [json.loads(line) for line in log.read_text().splitlines()]


@pytest.fixture
def robot(package: Path, tmp_path: Path) -> Iterator[Robot]:
    with Master(tmp_path) as master:
        made = Robot(master, package, tmp_path)
        with made.ends:
            yield made


@pytest.mark.smoke
def test_it_moves_only_while_everything_allows_it(robot: Robot) -> None:
    robot.start("_period:=0.02")
    robot.until(lambda: robot.speed is not None, "the first command")
    robot.until(lambda: len(robot.commands) > 10, "a line without a scan to change nothing", robot.line)
    assert {command["linear"]["x"] for command in robot.commands} == {0.0}

    robot.drive()
    assert robot.commands[-1]["angular"]["z"] == 0.25
    robot.line(-0.5)
    robot.until(lambda: bool(robot.commands[-1]["angular"]["z"] == -0.5), "the new correction")

    stops: list[tuple[str, Callable[[], object], Callable[[], object]]] = [
        ("an obstacle", lambda: robot.scan(0.2), lambda: robot.scan(2.0)),
        ("the stop button", lambda: robot.send("/emergency_stop/stop"), lambda: robot.send("/emergency_stop/resume")),
        ("a lost line", lambda: robot.send("/line/lost"), robot.line),
    ]
    for what, stop, resume in stops:
        stop()
        robot.until(lambda: robot.speed == 0.0, f"the robot to stop at {what}", stop)
        assert {command["linear"]["x"] for command in robot.next_commands(5)} == {0.0}, what
        robot.until(lambda: robot.speed == 0.15, f"the robot to move again after {what}", resume)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT])
def test_a_signal_stops_the_robot_first(robot: Robot, number: signal.Signals) -> None:
    # Decisions are so rare that the zero can only come from the stop.
    robot.start("_period:=0.5", f"_log_folder:={robot.folder / 'events'}")
    robot.drive()
    robot.node.signal(number)
    robot.stands_still(0)
    assert robot.node.stderr == ""
    health = robot.health()
    assert health is not None and health[:2] == (2, f"stopped: {number.name}")
    logged = entries(robot.folder / "events")
    assert {"kind": "stop", "what": number.name}.items() <= logged[-1].items()
    moves = [entry for entry in logged if entry.get("event") == "move.request"]
    assert moves
    for entry in moves:
        assert entry["data"] == {"linear": {"x": 0.15}, "angular": {"z": 0.25}}
        states = {name: part["state"] for name, part in entry["state"].items()}
        assert (states["LineDetector"], states["LidarSensor"]) == ("line_found", "safe")


def test_commands_that_come_fast_do_not_follow_the_zero(robot: Robot) -> None:
    """Rospy goes on calling back while it shuts down: nothing may be decided then."""
    robot.start("_period:=0.001", "_every:=event")
    robot.drive()
    for _ in range(200):
        robot.scan(2.0)
    robot.node.signal(signal.SIGTERM)
    for _ in range(200):
        robot.scan(2.0)
    robot.stands_still(0)


def test_a_node_that_is_killed_over_ros_stops_the_robot_first(robot: Robot) -> None:
    robot.start("_period:=0.5")
    robot.drive()
    kill = Process(["/usr/bin/python3", "-c", KILL, PACKAGE], robot.master.variables, robot.folder / "kill")
    with kill:
        robot.stands_still(0)
    health = robot.health()
    assert health is not None and health[:2] == (2, "stopped: shut down from outside")


KILL = """
import sys, xmlrpc.client, rosgraph
uri = rosgraph.Master('/killer').lookupNode(sys.argv[1])
xmlrpc.client.ServerProxy(uri).shutdown('/killer', 'as rosnode does')
"""


@pytest.mark.parametrize("is_anew", [False, True])
def test_a_lost_master_is_a_fault(robot: Robot, is_anew: bool) -> None:
    robot.start("_period:=0.5")
    robot.drive()
    if is_anew:
        robot.master.start_anew(robot.folder / "again")
    else:
        robot.master.process.__exit__(None, None, None)
    robot.stands_still(1)
    assert robot.node.stderr.splitlines()[-1] == f"{PACKAGE}: the ROS master is lost"


def test_a_signal_without_a_master_stops_the_robot(robot: Robot) -> None:
    robot.start("_period:=0.5")
    robot.drive()
    robot.master.process.__exit__(None, None, None)
    robot.node.signal(signal.SIGINT)
    robot.stands_still(0)


def test_it_waits_for_a_master_and_hears_signals(robot: Robot) -> None:
    robot.master.process.__exit__(None, None, None)
    node = robot.run()
    wait_until(lambda: "waiting for the ROS master at http://127.0.0.1:" in node.stderr, "the node to wait")
    node.signal(signal.SIGINT)
    assert node.wait() == 0


def test_a_stuck_receiver_neither_delays_nor_keeps_the_node(robot: Robot, tmp_path: Path) -> None:
    # The texts on /state are long: they fill the connection's buffers within seconds.
    robot.start("_period:=0.001", "_publish_state:=true")
    with Peer(robot.master, tmp_path / "stuck", "stuck_peer") as stuck:
        stuck.subscribe("/state", "std_msgs/String")
        robot.until(lambda: bool(stuck.received["/state"]), "the second receiver")
        stuck.stop()
        robot.drive()
        robot.next_commands(4000)
        robot.node.signal(signal.SIGTERM)
        robot.stands_still(0)


def test_hostile_numbers_neither_reach_the_motor_nor_stop_the_node(robot: Robot) -> None:
    robot.start("_period:=0.02")
    robot.drive()
    for correction in (float("nan"), float("inf"), -float("inf")):
        robot.line(correction)
    nothing = float("nan")
    robot.until(lambda: robot.speed == 0.0, "a scan of NaN to count as an obstacle", lambda: robot.scan(nothing))
    robot.line(0.75)
    robot.until(lambda: bool(robot.commands[-1]["angular"]["z"] == 0.75), "it to go on", lambda: robot.scan(2.0))
    assert all(abs(command["angular"]["z"]) <= 1.0 for command in robot.commands)


def test_a_stale_sensor_stops_the_robot_until_it_is_back(robot: Robot) -> None:
    robot.start("_period:=0.5", "_max_age:=['/scan=0.4']")
    robot.drive()
    robot.until(lambda: robot.speed == 0.0, "the robot to stop without scans")
    robot.until(lambda: "is stale" in robot.node.stderr, "the reason")
    robot.drive()


def test_a_fault_stops_the_robot_and_ends_the_node(robot: Robot) -> None:
    robot.start("_period:=0.5", "_on_unknown:=fault")
    robot.drive()
    robot.scan(float("nan"))
    robot.stands_still(1)
    (line,) = robot.node.stderr.splitlines()
    assert line.startswith(f"{PACKAGE}: ")
    assert "unknown at scan.response" in line


def test_an_exception_stops_the_robot_and_ends_the_node(robot: Robot, tmp_path: Path) -> None:
    copy = tmp_path / "broken"
    write_files(generate(example_supervisor(FOLLOWER), "ros1"), copy)
    node = copy / PACKAGE / "host.py"
    start = "    def _receive(self, identifier, message):\n"
    broken = start + "        if identifier == '/line/lost': raise KeyError('x')\n"
    node.write_text(node.read_text().replace(start, broken))
    robot.package = copy
    robot.start("_period:=0.5")
    robot.drive()
    robot.send("/line/lost")
    robot.stands_still(1)
    (line,) = robot.node.stderr.splitlines()
    assert line == f"{PACKAGE}: KeyError: 'x'"


def test_the_state_is_published_as_semantics_says(robot: Robot) -> None:
    robot.peer.subscribe("/state", "std_msgs/String")
    robot.start("_period:=0.02", "_publish_state:=true")
    robot.drive()

    def content() -> Any:
        return json.loads(robot.peer.values("/state")[-1]["data"])

    robot.until(
        lambda: bool(robot.peer.values("/state")) and content()["current"]["LidarSensor"]["state"] == "safe",
        "the state",
    )
    state = content()
    assert state["current"]["LineDetector"] == {"state": "line_found", "variables": {"current_correction": "0.25"}}
    assert state["communications"] == {}
    assert state["definition"]["name"] == "LineFollower"
    taken = {number for message in robot.peer.values("/state") for number in json.loads(message["data"])["transitions"]}
    assert taken


def test_diagnostics_report_the_state(robot: Robot) -> None:
    robot.start("_period:=0.02")
    robot.drive()

    def is_running() -> bool:
        health = robot.health()
        return health is not None and health[:2] == (0, "running")

    robot.until(is_running, "the diagnostics")
    health = robot.health()
    assert health is not None
    assert health[2]["status"] == "running" and float(health[2]["last decision (us)"]) > 0.0
    assert health[2]["messages dropped"] == "0"
    (status,) = robot.peer.values("/diagnostics")[-1]["status"]
    assert (status["name"], status["hardware_id"]) == (f"/{PACKAGE}: controller", "LineFollower")


def test_scans_of_another_lidar_are_resampled(robot: Robot) -> None:
    """Ten beams, each of 36 degrees: only resampled do they say what is at 340 degrees."""
    robot.start("_period:=0.02", "_resample_scans:=true")
    step = 0.017453292519943295

    def see(front: float) -> None:
        robot.line()
        # From -30 to 30 degrees: the model's front is the middle of the scan.
        ranges = [front if index == 30 else 3.0 for index in range(61)]
        fields = {"angle_min": -30 * step, "angle_increment": step, "range_min": 0.1, "range_max": 10.0}
        robot.send("/scan", ranges=ranges, **fields)

    robot.until(lambda: robot.speed == 0.15, "the robot to move", lambda: see(3.0))
    robot.until(lambda: robot.speed == 0.0, "the robot to stop", lambda: see(0.2))


def test_a_prefix_moves_every_topic(robot: Robot) -> None:
    robot.start("_period:=0.02", "_topic_prefix:=/robot_1", prefix="/robot_1")
    robot.drive()
    names = robot.peer.names()
    mine = {
        topic
        for kind in ("publishers", "subscribers")
        for topic, nodes in names[kind].items()
        if f"/{PACKAGE}" in nodes and topic not in ("/rosout", "/diagnostics")
    }
    assert mine == {"/robot_1/cmd_vel", *("/robot_1" + topic for topic in RECEIVED)}


def test_the_arguments_of_ros_are_heard(robot: Robot) -> None:
    robot.prefix = "/left"
    remap = [f"{topic}:=/left{topic}" for topic in ("/cmd_vel", *RECEIVED)]
    robot.run("__name:=left", "_period:=0.02", *remap)
    robot.meet()
    robot.drive()
    assert robot.peer.names()["publishers"]["/left/cmd_vel"] == ["/left"]


def test_parameters_come_from_the_server_the_file_or_the_defaults(robot: Robot, tmp_path: Path) -> None:
    package = tmp_path / "copy"
    write_files(generate(example_supervisor(FOLLOWER), "ros1"), package)
    file = package / "config/parameters.yaml"
    file.write_text(file.read_text().replace("period: 0.1", "period: -1.0"))
    robot.package = package
    assert robot.run(module="start").wait() == 2
    assert robot.node.stderr.startswith(f"{PACKAGE}: parameter 'period' is -1.0; it must be")
    robot.master.set_parameter(f"/{PACKAGE}/period", -2.0)
    assert robot.run(module="start").wait() == 2
    assert robot.node.stderr.startswith(f"{PACKAGE}: parameter 'period' is -2.0; it must be")
    assert robot.run("_period:=-3.0", module="node").wait() == 2
    assert robot.node.stderr.startswith(f"{PACKAGE}: parameter 'period' is -3.0; it must be")
    robot.master.set_parameter(f"/{PACKAGE}", {"perod": 0.02})
    robot.run(module="node")
    robot.until(lambda: "there is no parameter 'perod'; did you mean 'period'?" in robot.node.stderr, "the warning")


@pytest.mark.parametrize(
    ("parameter", "complaint"),
    [
        ("_period:=-1.0", "parameter 'period' is -1.0; it must be"),
        ("_period:=fast", "parameter 'period' is 'fast'; it must be"),
        ("_policy:=2", "parameter 'policy' is 2; it must be one of fair, priority, random"),
        ("_topic_prefix:={a: 1}", "parameter 'topic_prefix' is {'a': 1}; it must be"),
        ("_log_folder:=/dev/null/x", "parameter 'log_folder': "),
        ("_period:=[", "cannot start: invalid command-line parameters"),
    ],
)
def test_a_wrong_parameter_is_one_line_and_exit_status_2(robot: Robot, parameter: str, complaint: str) -> None:
    node = robot.run(parameter)
    assert node.wait() == 2
    (line,) = node.stderr.splitlines()
    assert line.startswith(f"{PACKAGE}: {complaint}")


def test_the_scripts_run_where_they_stand(robot: Robot) -> None:
    for script in ("controller", "start_line_follower"):
        with Process(
            [str(robot.package / "scripts" / script), "_period:=-1.0"], robot.master.variables, robot.folder / script
        ) as node:
            assert node.wait() == 2
            assert node.stderr.startswith(f"{PACKAGE}: parameter 'period' is -1.0; it must be")
    assert (robot.package / "scripts/controller").read_text().startswith(f"#!{PYTHON}\n")
