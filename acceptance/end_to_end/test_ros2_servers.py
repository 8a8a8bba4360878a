"""Services and actions of a generated ROS 2 node: every way in which they end, with real servers over DDS."""

import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from robosc.certification import make_supervisor
from robosc.language import load_bundle
from robosc.targets import generate, write_files
from support.courier import CourierSide
from support.ros2 import Peer, RosProcess, environment, own_domain
from support.ros2_servers import End, HeldAction, HeldService, ServerHost, cancel_all

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
pytest.importorskip("test_msgs", reason="test_msgs, with the only actions in a package index, is not installed")

pytestmark = pytest.mark.ros2

MODEL = Path(__file__).parents[2] / "tests" / "models" / "courier" / "model.rscd"
LIMIT_S = 15.0


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The generated package, of a synthesized and verified supervisor."""
    made = make_supervisor(load_bundle(MODEL))
    assert made.supervisor is not None, made.reason
    folder = tmp_path_factory.mktemp("workspace")
    write_files(generate(made.supervisor, "ros2"), folder)
    return folder


class Courier(CourierSide):
    """A peer that sees and orders, and a host of servers."""

    node: RosProcess

    def __init__(self, workspace: Path, peer: Peer, host: ServerHost, variables: dict[str, str], folder: Path) -> None:
        super().__init__(folder)
        self._workspace = workspace
        self.variables = variables
        self.peer = peer
        self.host = host

    def start(self, *parameters: str) -> None:
        """Start the node with its parameter file, deciding every 20 ms."""
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import Twist
        from std_msgs.msg import String

        self._states = self.peer.receive(String, "/state")
        self._reports = self.peer.receive(DiagnosticArray, "/diagnostics")
        self.commands = self.peer.receive(Twist, "/cmd_vel")
        arguments = [
            item
            for parameter in (
                "period:=0.02",
                "publish_state:=true",
                "policy:=priority",
                f"log_folder:={self.folder / 'events'}",
                *parameters,
            )
            for item in ("-p", parameter)
        ]
        command = ["-m", "courier_controller.start", "--ros-args", *arguments]
        self.node = RosProcess(command, self.variables, self.folder / "run", [self._workspace])
        orders = [f"/order/{name}" for name in ("power", "wind", "count", "reach")]
        self.peer.wait_for_peers(["/cmd_vel", "/allowed", "/state", *orders])

    def until(self, condition: Callable[[], bool], what: str, repeat: Callable[[], object] = lambda: None) -> None:
        self.peer.spin_until(condition, LIMIT_S, what, self.node, repeat)

    def publish_order(self, what: str) -> None:
        from std_msgs.msg import Empty

        self.peer.publish(Empty(), f"/order/{what}")

    def publish_allowed(self, is_allowed: bool) -> None:
        from std_msgs.msg import Bool

        self.peer.publish(Bool(data=is_allowed), "/allowed")

    def last_state(self) -> str | None:
        return str(self._states[-1].data) if self._states else None

    def health(self) -> tuple[int, str, dict[str, str]] | None:
        """Level, message and values of the last report."""
        if not self._reports:
            return None
        (status,) = self._reports[-1].status
        return status.level[0], status.message, {item.key: item.value for item in status.values}

    def dying_server(self) -> RosProcess:
        """A process that ends when it is asked for something."""
        file = Path(__file__).parents[2] / "tests" / "support" / "ros2_dying_server.py"
        return RosProcess([str(file)], self.variables, self.folder / "server")


@pytest.fixture
def courier(workspace: Path, tmp_path: Path) -> Iterator[Courier]:
    with own_domain() as domain:
        variables = environment(domain, tmp_path)
        with Peer(domain, variables) as peer, ServerHost(domain) as host:
            made = Courier(workspace, peer, host, variables, tmp_path)
            yield made
            if hasattr(made, "node"):
                made.node.__exit__(None, None, None)


def power_server(courier: Courier) -> HeldService:
    from std_srvs.srv import SetBool

    return HeldService(courier.host, SetBool, "/power")


def counter_server(courier: Courier, **options: bool) -> HeldAction:
    from test_msgs.action import Fibonacci

    return HeldAction(courier.host, Fibonacci, "/count", **options)


def start_counting(courier: Courier, server: HeldAction, *parameters: str) -> None:
    """Bring it to where its goal runs and its wheels turn."""
    courier.start("server_wait:=0.0", *parameters)
    courier.until(server_is_seen(courier, "/count"), "the node to see the server", lambda: None)
    courier.allow(True)
    courier.order("count", lambda: bool(server.handles))
    courier.reaches("Counter", "counting")
    courier.until(lambda: bool(courier.commands) and courier.commands[-1].linear.x == 0.25, "the wheels to turn")


def server_is_seen(courier: Courier, action: str) -> Callable[[], bool]:
    """Return the condition that the node's client of an action and its server here know of each other.

    It holds as far as can be seen here.
    """
    return lambda: courier.peer.node.count_subscribers(f"{action}/_action/feedback") > 0


# Services.


def test_a_service_that_answers(courier: Courier) -> None:
    server = power_server(courier)
    courier.start("server_wait:=0.0")
    # Until its server is found, every request is an error, and may be ordered again.
    courier.order("power", lambda: bool(server.requests))
    assert server.requests[0].data is True
    courier.reaches("Power", "asked")
    server.answer(success=True, message="é on")
    courier.reaches("Power", "powered")
    assert courier.value("Power", "text") == "é on"
    assert len(server.requests) == 1


def test_a_trigger_without_data(courier: Courier) -> None:
    from std_srvs.srv import Trigger

    server = HeldService(courier.host, Trigger, "/wind")
    courier.start("server_wait:=0.0")
    courier.order("wind", lambda: bool(server.requests))
    server.answer(success=True)
    courier.reaches("Clock", "wound")
    assert courier.value("Clock", "well") == "true"


def test_a_missing_service_is_an_error_at_once(courier: Courier) -> None:
    courier.start("server_wait:=0.0", "service_timeout:=1000.0")
    courier.reaches("Power", "off")
    courier.order("power", lambda: courier.value("Power", "failures") != "0")
    assert courier.reasons_of("power.error")[0] == "there is no server of /power"


def test_a_late_reply_is_unexpected(courier: Courier) -> None:
    server = power_server(courier)
    courier.start("server_wait:=0.0", "service_timeout:=0.3")
    courier.order("power", lambda: bool(server.requests))
    courier.has("Power", "failures", "1")
    courier.count_reaches("unexpected", 0)
    server.answer(success=True, message="late")
    courier.count_reaches("unexpected", 1)
    assert courier.state("Power") == "off"
    assert courier.value("Power", "text") == ""
    # The next call is a call of its own.
    courier.order("power", lambda: len(server.requests) == 2)
    server.answer(success=True, message="in time")
    courier.reaches("Power", "powered")
    assert courier.value("Power", "text") == "in time"


def test_a_service_that_is_lost_is_an_error_before_the_timeout(courier: Courier) -> None:
    with courier.dying_server() as server:
        courier.start("server_wait:=0.0", "service_timeout:=1000.0")
        courier.order("power", lambda: not server.is_running)
    # Orders that came before the server was found have failed as well.
    courier.until(lambda: "the server of /power is lost" in courier.reasons_so_far("power.error"), "the loss")


# Actions.


def test_a_goal_that_succeeds(courier: Courier) -> None:
    server = counter_server(courier)
    start_counting(courier, server)
    assert server.requests[0].order == 5
    server.feedback(sequence=[7])
    courier.has("Counter", "seen", "7")
    server.end(End.SUCCEED, sequence=[0, 1, 1])
    courier.reaches("Counter", "counted")
    assert courier.value("Counter", "total") == "3"
    courier.until(lambda: courier.commands[-1].linear.x == 0.0, "the wheels to stop")
    # The action may be requested again.
    courier.order("count", lambda: len(server.handles) == 2)
    courier.reaches("Counter", "counting")


def test_nested_data_there_and_back(courier: Courier) -> None:
    from builtin_interfaces.msg import Time
    from test_msgs.action import NestedMessage
    from test_msgs.msg import BasicTypes

    server = HeldAction(courier.host, NestedMessage, "/arm/reach")
    courier.start("server_wait:=0.0")
    courier.order("reach", lambda: bool(server.handles))
    (goal,) = server.requests
    assert goal.nested_field == BasicTypes(bool_value=True, uint8_value=255, float32_value=0.5)
    assert goal.nested_different_pkg == Time(sec=-7)
    assert goal.nested_field_no_pkg == NestedMessage.Goal().nested_field_no_pkg
    server.feedback(nested_field=BasicTypes(bool_value=True))
    courier.has("Arm", "is_near", "true")
    server.end(
        End.SUCCEED, nested_field=BasicTypes(uint8_value=9, float32_value=-1.5), nested_different_pkg=Time(sec=3)
    )
    courier.has("Arm", "seconds", "3")
    assert (courier.value("Arm", "number"), courier.value("Arm", "share")) == ("9", "-1.5")


def test_a_goal_that_is_rejected(courier: Courier) -> None:
    server = counter_server(courier, accepts=False)
    courier.start("server_wait:=0.0")
    courier.allow(True)
    courier.order("count", lambda: bool(server.requests))
    courier.reaches("Counter", "failed")
    assert "rejected" in courier.reasons_of("count.error")


def test_a_goal_that_is_aborted(courier: Courier) -> None:
    server = counter_server(courier)
    start_counting(courier, server)
    server.end(End.ABORT)
    courier.reaches("Counter", "failed")
    courier.until(lambda: courier.commands[-1].linear.x == 0.0, "the wheels to stop")


def test_the_supervisor_cancels_a_goal_that_is_no_longer_allowed(courier: Courier) -> None:
    server = counter_server(courier, ends_on_cancel=False)
    start_counting(courier, server)
    courier.allow(False)
    courier.until(lambda: server.cancels == 1, "the cancel")
    # Asking for the cancel ends nothing.
    courier.until(lambda: courier.cancelling() == ["count"], "the state")
    assert courier.state("Counter") == "counting"
    courier.peer.spin_for(0.3)
    server.end(End.CANCEL)
    courier.reaches("Counter", "cancelled")
    assert courier.cancelling() == []
    courier.allow(True)
    courier.order("count", lambda: len(server.handles) == 2)


def test_a_goal_that_does_not_end_after_its_cancel_is_an_error_until_it_does(courier: Courier) -> None:
    server = counter_server(courier, ends_on_cancel=False)
    start_counting(courier, server, "cancel_timeout:=0.5")
    courier.allow(False)
    overdue = "the goal of count has not ended although its cancel was asked for"
    courier.until(lambda: (courier.health() or ())[:2] == (2, overdue), "the error")
    assert courier.state("Counter") == "counting"
    server.end(End.SUCCEED)
    courier.until(lambda: courier.state("Counter") != "counting", "the end")
    courier.until(lambda: (courier.health() or ())[:2] == (0, "running"), "no error")


def test_a_goal_that_somebody_else_cancels(courier: Courier) -> None:
    server = counter_server(courier)
    cancel = cancel_all(courier.peer, "/count")
    start_counting(courier, server)
    courier.until(lambda: server.cancels > 0, "the cancel", cancel)
    courier.reaches("Counter", "failed")
    # A goal that was asked for before the server was found may have ended earlier.
    assert courier.reasons_of("count.error")[-1] == "cancelled"


def test_a_missing_action_is_an_error_at_once(courier: Courier) -> None:
    courier.start("server_wait:=0.0")
    courier.allow(True)
    courier.order("count", lambda: courier.state("Counter") == "failed")


def test_an_action_that_is_lost_is_an_error(courier: Courier) -> None:
    with courier.dying_server() as server:
        courier.start("server_wait:=0.0")
        courier.allow(True)
        courier.order("count", lambda: not server.is_running)
    courier.reaches("Counter", "failed")
    assert courier.reasons_of("count.error")[-1] == "lost"


def test_a_goal_that_takes_too_long_is_an_error_and_cancelled(courier: Courier) -> None:
    server = counter_server(courier)
    start_counting(courier, server, "action_timeout:=0.5")
    courier.reaches("Counter", "failed")
    courier.until(lambda: server.cancels == 1, "the cancel")


def test_a_refused_cancel_of_a_running_goal_is_a_fault(courier: Courier) -> None:
    from geometry_msgs.msg import Twist
    from std_msgs.msg import Bool

    server = counter_server(courier, cancels=False)
    start_counting(courier, server)
    courier.peer.publish(Bool(data=False), "/allowed")
    courier.peer.spin_until(lambda: not courier.node.is_running, LIMIT_S, "the end")
    assert courier.node.wait() == 1
    assert "the cancel of a running goal of count was refused" in courier.node.stderr
    assert courier.commands[-1] == Twist()
    health = courier.health()
    assert health is not None and health[0] == 2 and "refused" in health[1]


# Start and end.


def test_the_start_waits_for_the_servers(courier: Courier) -> None:
    from std_srvs.srv import Trigger
    from test_msgs.action import Fibonacci, NestedMessage

    courier.start("server_wait:=1000.0")

    def is_waiting() -> bool:
        health = courier.health()
        return health is not None and health[:2] == (1, "waiting for servers: /power, /wind, /count, /arm/reach")

    courier.until(is_waiting, "the diagnostics to name the servers")
    power = power_server(courier)
    HeldService(courier.host, Trigger, "/wind")
    servers = [
        HeldAction(courier.host, type_, name) for type_, name in ((Fibonacci, "/count"), (NestedMessage, "/arm/reach"))
    ]
    courier.order("power", lambda: bool(power.requests))
    power.answer(success=True)
    courier.reaches("Power", "powered")
    assert courier.value("Power", "failures") == "0"
    assert not any(server.requests for server in servers)


def test_a_prefix_moves_services_and_actions(workspace: Path, courier: Courier, tmp_path: Path) -> None:
    command = ["-m", "courier_controller.node", "--ros-args", "-p", "topic_prefix:=/robot_1"]
    with RosProcess(command, courier.variables, tmp_path / "run", [workspace]) as node:
        wanted = {"/robot_1/power", "/robot_1/wind"} | {
            f"/robot_1/{action}/_action/send_goal" for action in ("count", "arm/reach")
        }

        def names() -> set[str]:
            found = courier.peer.node.get_node_names_and_namespaces()
            if ("courier_controller", "/") not in found:
                return set()
            clients = courier.peer.node.get_client_names_and_types_by_node("courier_controller", "/")
            return {name for name, _ in clients}

        courier.peer.spin_until(lambda: wanted <= names(), LIMIT_S, "the clients", node)
        assert all(name.startswith("/robot_1/") for name in names())
        # It is still waiting for servers.
        node.signal(signal.SIGTERM)
        assert node.wait() == 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("ends", [True, False])
def test_a_signal_stops_wheels_and_goals(courier: Courier, number: signal.Signals, ends: bool) -> None:
    from geometry_msgs.msg import Twist

    server = counter_server(courier, ends_on_cancel=ends)
    start_counting(courier, server)
    courier.node.signal(number)
    courier.peer.spin_until(lambda: not courier.node.is_running, LIMIT_S, "the end")
    courier.peer.spin_until(lambda: courier.commands[-1] == Twist(), LIMIT_S, "a zero")
    assert courier.node.wait() == 0
    assert server.cancels == 1
    events = courier.events()
    stop = next(index for index, item in enumerate(events) if item["kind"] == "stop")
    assert events[stop]["what"] == number.name
    assert not [item for item in events[stop:] if str(item.get("event")).endswith(".request")]
    errors = [item["data"] for item in events[stop:] if item.get("event") == "count.error"]
    assert errors == (["cancelled"] if ends else [])
    health = courier.health()
    assert health is not None and health[:2] == (2, f"stopped: {number.name}")


def test_a_goal_that_cannot_be_cancelled_at_a_stop_is_a_fault(courier: Courier) -> None:
    from geometry_msgs.msg import Twist

    server = counter_server(courier, cancels=False)
    start_counting(courier, server)
    courier.node.signal(signal.SIGTERM)
    courier.peer.spin_until(lambda: not courier.node.is_running, LIMIT_S, "the end")
    assert courier.node.wait() == 1
    assert "the cancel of a running goal of count was refused" in courier.node.stderr
    assert courier.commands[-1] == Twist()
