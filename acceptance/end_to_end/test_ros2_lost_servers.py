"""Servers of a generated ROS 2 node that are killed, doubled or silent, over real DDS; and what its health says.

A process that is killed stays visible to all others until its lease of 20 s is over.
"""

import json
import signal
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from robosc.certification import make_supervisor
from robosc.language import load_bundle
from robosc.targets import generate, write_files
from support.node_logs import Entry, entries_of
from support.ros2 import Peer, RosProcess, environment, own_domain

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
pytest.importorskip("test_msgs", reason="test_msgs, with the only actions in a package index, is not installed")

pytestmark = pytest.mark.ros2

TESTS = Path(__file__).parents[2] / "tests"
SERVER = TESTS / "support" / "ros2_process_server.py"
LIMIT_S = 20.0
LEASE_S = 20.0


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The generated package."""
    made = make_supervisor(load_bundle(TESTS / "models" / "driver" / "model.rscd"))
    assert made.supervisor is not None, made.reason
    folder = tmp_path_factory.mktemp("package")
    write_files(generate(made.supervisor, "ros2"), folder)
    return folder


class Driver:
    """A node, its buttons, its log and its health."""

    node: RosProcess

    def __init__(self, package: Path, domain: int, peer: Peer, folder: Path) -> None:
        from diagnostic_msgs.msg import DiagnosticArray

        self.peer = peer
        self.folder = folder
        self.variables = environment(domain, folder)
        self._package = package
        self._reports = peer.receive(DiagnosticArray, "/diagnostics")
        self._servers = 0

    def start(self, *parameters: str) -> None:
        """Start the node; it need not have found its servers when it begins."""
        given = (f"log_folder:={self.folder / 'log'}", "server_wait:=0.0", *parameters)
        words = [word for parameter in given for word in ("-p", parameter)]
        command = ["-m", "driver_controller.node", "--ros-args", *words]
        self.node = RosProcess(command, self.variables, self.folder / "node", [self._package], program=sys.executable)
        self.peer.wait_for_peers(["/pressed", "/wanted", "/diagnostics"])

    def server(self, name: str = "server", **options: Any) -> RosProcess:
        """Another process with both servers."""
        self._servers += 1
        folder = self.folder / f"server_{self._servers}"
        return RosProcess([str(SERVER), name, json.dumps(options)], self.variables, folder)

    def until(self, condition: Callable[[], bool], what: str, *, press: str = "", limit_s: float = LIMIT_S) -> None:
        """Wait for a condition, with a button down meanwhile."""
        from std_msgs.msg import Bool

        def repeat() -> None:
            if press:
                self.peer.publish(Bool(data=True), f"/{press}")

        self.peer.spin_until(condition, limit_s, what, self.node, repeat)

    @property
    def entries(self) -> list[Entry]:
        return entries_of(self.folder / "log")

    def events(self, name: str) -> list[Entry]:
        return [entry for entry in self.entries if entry.get("event") == name and entry["kind"] == "event"]

    def health(self) -> tuple[int, str]:
        """Level and message of the last report."""
        if not self._reports:
            return -1, ""
        (status,) = self._reports[-1].status
        return status.level[0], status.message

    def warns(self, text: str) -> bool:
        level, message = self.health()
        return level == 1 and text in message

    def drive(self, server: RosProcess) -> None:
        """Get it so far that a goal is under way."""
        self.until(lambda: "driving" in server.stdout, "a goal", press="pressed")


@pytest.fixture
def driver(package: Path, tmp_path: Path) -> Iterator[Driver]:
    with own_domain() as domain:
        variables = environment(domain, tmp_path)
        with Peer(domain, variables) as peer:
            made = Driver(package, domain, peer, tmp_path)
            yield made
            if hasattr(made, "node"):
                made.node.__exit__(None, None, None)


def kill(server: RosProcess) -> float:
    """End a process at once: the time of it."""
    server.signal(signal.SIGKILL)
    server.wait()
    return time.monotonic()


@pytest.mark.parametrize("name", ["server", "another"])
def test_a_killed_server_is_lost_when_another_one_takes_its_place_within_the_lease(driver: Driver, name: str) -> None:
    with driver.server() as server:
        driver.start()
        driver.drive(server)
        failed = len(driver.events("go.error"))
        killed_s = kill(server)
        with driver.server(name) as other:
            driver.until(lambda: len(driver.events("go.error")) > failed, "the loss")
            assert driver.events("go.error")[-1]["data"] == "lost"
            assert time.monotonic() < killed_s + LEASE_S - 5.0
            driver.until(lambda: driver.warns("2 servers of /go"), "a warning")
            # A later goal is the new one's, and is not lost although the old one is still shown. The first may not
            # have reached it.
            driver.drive(other)
            failed = len(driver.events("go.error"))
            driver.peer.spin_for(3.0)
            assert len(driver.events("go.error")) == failed


def test_a_call_of_a_killed_service_has_failed_when_its_name_is_taken(driver: Driver) -> None:
    with driver.server() as server:
        driver.start("service_timeout:=1000.0")
        driver.until(lambda: "called" in server.stdout, "a call", press="wanted")
        failed = len(driver.events("reach.error"))
        killed_s = kill(server)
        with driver.server() as other:
            driver.until(lambda: "called" in other.stdout, "a call of the new one", press="wanted")
            assert time.monotonic() < killed_s + LEASE_S - 5.0
            reasons = [entry["data"] for entry in driver.events("reach.error")[failed:]]
            assert reasons[0] == "the server of /reach is lost"


def test_two_servers_at_work_are_worth_a_warning_and_lose_no_goal(driver: Driver) -> None:
    with driver.server() as server:
        driver.start()
        driver.drive(server)
        failed = len(driver.events("go.error"))
        with driver.server("second") as second:
            driver.until(lambda: driver.warns("2 servers of /go: /second, /server"), "a warning")
            driver.peer.spin_for(5.0)
            assert len(driver.events("go.error")) == failed
            assert "cancel" not in server.stdout
            assert "goal" not in second.stdout


@pytest.mark.parametrize(
    ("result", "text"), [("none", "gives no result of a goal that ended"), ("unknown", "did not know a goal")]
)
def test_a_server_without_results_is_worth_a_warning(driver: Driver, result: str, text: str) -> None:
    with driver.server(result=result, ends_after_s=0.3) as server:
        driver.start()
        driver.until(lambda: "arrived" in server.stdout, "the end", press="pressed")
        driver.until(lambda: driver.warns(text), "a warning")
        driver.until(lambda: "lost" in [entry["data"] for entry in driver.events("go.error")], "the error")


def test_a_receiver_of_another_type_is_worth_a_warning(driver: Driver) -> None:
    from geometry_msgs.msg import TwistStamped
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from std_msgs.msg import Bool

    driver.peer.receive(TwistStamped, "/cmd_vel")
    careless = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    driver.start()
    text = "/cmd_vel: /test_peer takes geometry_msgs/msg/TwistStamped, this node sends geometry_msgs/msg/Twist"
    driver.until(lambda: driver.warns(text), "a warning")
    driver.peer.publisher(Bool, "/pressed", careless)
    driver.until(lambda: driver.warns("/pressed: /test_peer sends and this node takes in vain"), "a warning")


def test_simulated_time_that_does_not_come_is_worth_a_warning(driver: Driver) -> None:
    from rosgraph_msgs.msg import Clock

    driver.start("use_sim_time:=true")
    driver.until(lambda: driver.warns("no time has come on /clock"), "a warning")
    message = Clock()

    def pass_time() -> None:
        message.clock.sec += 1
        driver.peer.publish(message, "/clock")

    driver.peer.spin_until(lambda: driver.health() == (0, "running"), LIMIT_S, "all well", driver.node, pass_time)
    driver.until(lambda: driver.warns("the time of /clock stands still"), "a warning")


def test_a_killed_server_is_lost_also_while_simulated_time_stands_still(driver: Driver) -> None:
    from rosgraph_msgs.msg import Clock

    message = Clock()

    def pass_time() -> None:
        from std_msgs.msg import Bool

        message.clock.sec += 1
        driver.peer.publish(message, "/clock")
        driver.peer.publish(Bool(data=True), "/pressed")

    with driver.server() as server:
        driver.start("use_sim_time:=true")
        driving = lambda: "driving" in server.stdout  # noqa: E731
        driver.peer.spin_until(driving, LIMIT_S, "a goal", driver.node, pass_time)
        failed = len(driver.events("go.error"))
        kill(server)
        with driver.server():
            driver.until(lambda: len(driver.events("go.error")) > failed, "the loss")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_goal_that_is_accepted_after_a_signal_is_cancelled(driver: Driver, number: signal.Signals) -> None:
    with driver.server(accepts_after_s=2.0) as server:
        driver.start()
        driver.until(lambda: "goal" in server.stdout, "a goal", press="pressed")
        driver.node.signal(number)
        assert driver.node.wait() == 0, driver.node.stderr
        driver.peer.spin_until(lambda: "stands" in server.stdout, LIMIT_S, "the robot to stand")
        assert server.stdout.split().count("goal") == 1


def test_a_goal_that_is_not_accepted_in_time_is_named_and_a_failure(driver: Driver) -> None:
    with driver.server(accepts_after_s=8.0) as server:
        driver.start()
        driver.until(lambda: "goal" in server.stdout, "a goal", press="pressed")
        driver.node.signal(signal.SIGINT)
        assert driver.node.wait() == 1
        text = "a goal of /go may be running: its server has not answered it"
        assert text in driver.node.stderr.splitlines()[-1]


def test_a_goal_whose_server_was_killed_is_named_at_a_stop(driver: Driver) -> None:
    with driver.server() as server:
        driver.start()
        driver.drive(server)
        kill(server)
        driver.node.signal(signal.SIGINT)
        assert driver.node.wait() == 1
        text = "a goal of /go may be running: its server has not answered its cancel"
        assert text in driver.node.stderr.splitlines()[-1]


def test_a_goal_that_brakes_for_longer_than_is_waited_for_was_cancelled(driver: Driver) -> None:
    with driver.server(brakes_s=1.5) as server:
        driver.start()
        driver.drive(server)
        driver.node.signal(signal.SIGINT)
        assert driver.node.wait() == 0, driver.node.stderr
        driver.peer.spin_until(lambda: "stands" in server.stdout, LIMIT_S, "the robot to stand")
