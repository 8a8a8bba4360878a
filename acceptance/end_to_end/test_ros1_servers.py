"""Services and actions of a generated ROS 1 node: every way in which they end, with real servers."""

import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from robosc.certification import make_supervisor
from robosc.language import load_bundle
from robosc.targets import generate, write_files
from support.courier import CourierSide
from support.ros1 import Master, Peer, missing, start_node, until
from support.waiting import wait_until

pytestmark = [
    pytest.mark.ros1,
    pytest.mark.skipif(missing() is not None, reason=str(missing())),
]

MODEL = Path(__file__).parents[2] / "tests" / "models" / "courier_ros1" / "model.rscd"
PACKAGE = "courier_controller"
ORDERS = ("power", "wind", "count", "move")
ZERO = {"linear": {"x": 0.0, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": 0.0}}
SPEED = {**ZERO, "linear": {"x": 0.25, "y": 0.0, "z": 0.0}}
MOVE = f"/{PACKAGE}/move_base"


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The generated package, of a synthesized and verified supervisor."""
    made = make_supervisor(load_bundle(MODEL))
    assert made.supervisor is not None, made.reason
    folder = tmp_path_factory.mktemp("package")
    write_files(generate(made.supervisor, "ros1"), folder)
    return folder


class Courier(CourierSide):
    """One peer sees and orders, another one has the servers."""

    def __init__(self, master: Master, package: Path, folder: Path) -> None:
        super().__init__(folder)
        self.master = master
        self.package = package
        self.ends = ExitStack()
        self.peer = self.ends.enter_context(Peer(master, folder))

    def host(self) -> Peer:
        """A process for servers."""
        return self.ends.enter_context(Peer(self.master, self.folder / "host", "test_servers"))

    def start(self, *parameters: str) -> None:
        """Start the node with its parameter file, deciding every 20 ms."""
        arguments = (
            "_period:=0.02",
            "_publish_state:=true",
            "_policy:=priority",
            "_server_wait:=0.0",
            f"_log_folder:={self.folder / 'events'}",
            *parameters,
        )
        self.node = self.ends.enter_context(
            start_node(self.master, self.folder / "run", self.package, f"{PACKAGE}.start", arguments)
        )
        self.peer.subscribe("/cmd_vel", "geometry_msgs/Twist")
        self.peer.subscribe("/state", "std_msgs/String")
        self.peer.subscribe("/diagnostics", "diagnostic_msgs/DiagnosticArray")
        self.peer.advertise("/allowed", "std_msgs/Bool")
        for name in ORDERS:
            self.peer.advertise(f"/order/{name}", "std_msgs/Empty")
        topics = ["/cmd_vel", "/state", "/diagnostics", "/allowed", *(f"/order/{name}" for name in ORDERS)]
        self.until(lambda: all(self.peer.ends(topic) for topic in topics), "the connections")

    def until(self, condition: Callable[[], bool], what: str, repeat: Callable[[], object] = lambda: None) -> None:
        until(condition, what, self.node, repeat)

    def publish_order(self, what: str) -> None:
        self.peer.publish(f"/order/{what}", "std_msgs/Empty")

    def publish_allowed(self, is_allowed: bool) -> None:
        self.peer.publish("/allowed", "std_msgs/Bool", data=is_allowed)

    def last_state(self) -> str | None:
        states = self.peer.values("/state")
        return states[-1]["data"] if states else None

    def speeds(self, command: Any) -> None:
        """Wait for a last command."""
        self.until(lambda: self.peer.values("/cmd_vel")[-1:] == [command], f"the command {command}")

    def health(self) -> tuple[int, str, dict[str, str]] | None:
        """Level, message and values of the last report."""
        reports = self.peer.values("/diagnostics")
        if not reports:
            return None
        (status,) = reports[-1]["status"]
        return status["level"], status["message"], {item["key"]: item["value"] for item in status["values"]}

    def stands_still(self, status: int) -> None:
        """The node ends with a status, and its last command is the zero."""
        assert self.node.wait() == status, self.node.stderr
        wait_until(lambda: self.peer.values("/cmd_vel")[-1:] == [ZERO], "the zero")


@pytest.fixture
def courier(package: Path, tmp_path: Path) -> Iterator[Courier]:
    with Master(tmp_path) as master:
        made = Courier(master, package, tmp_path)
        with made.ends:
            yield made


def start_counting(courier: Courier, *parameters: str, **options: Any) -> Peer:
    """Bring it to where its goal runs and its wheels turn: the process of the server."""
    host = courier.host()
    host.act("/count", "actionlib/Test", **options)
    courier.start(*parameters)
    courier.allow(True)
    # Until the server is connected, every request is an error, and may be ordered again.
    courier.order("count", lambda: bool(host.goals["/count"]))
    courier.reaches("Counter", "counting")
    courier.speeds(SPEED)
    return host


# Services.


def test_a_service_that_answers(courier: Courier) -> None:
    host = courier.host()
    host.serve("/power", "std_srvs/SetBool")
    courier.start()
    courier.order("power", lambda: bool(host.requests["/power"]))
    assert host.requests["/power"] == [{"data": True}]
    courier.reaches("Power", "asked")
    # The executor goes on meanwhile.
    courier.allow(True)
    host.do("answer", name="/power", message={"success": True, "message": "é on"})
    courier.reaches("Power", "powered")
    assert courier.value("Power", "text") == "é on"
    assert len(host.requests["/power"]) == 1


def test_a_trigger_without_data(courier: Courier) -> None:
    host = courier.host()
    host.serve("/wind", "std_srvs/Trigger")
    courier.start()
    courier.order("wind", lambda: bool(host.requests["/wind"]))
    host.do("answer", name="/wind", message={"success": True})
    courier.reaches("Clock", "wound")
    assert courier.value("Clock", "well") == "true"


def test_a_missing_service_is_an_error_at_once(courier: Courier) -> None:
    courier.start("_service_timeout:=1000.0")
    courier.reaches("Power", "off")
    courier.order("power", lambda: courier.value("Power", "failures") != "0")
    assert "service [/power] unavailable" in courier.reasons_of("power.error")[0]


def test_a_service_that_refuses_is_an_error(courier: Courier) -> None:
    host = courier.host()
    host.serve("/power", "std_srvs/SetBool")
    courier.start("_service_timeout:=1000.0")
    courier.order("power", lambda: bool(host.requests["/power"]))
    host.do("refuse", name="/power")
    courier.has("Power", "failures", "1")
    assert "refused" in courier.reasons_of("power.error")[0]


def test_a_service_of_another_type_is_an_error(courier: Courier) -> None:
    host = courier.host()
    host.serve("/power", "std_srvs/Trigger")
    courier.start("_service_timeout:=1000.0")
    courier.reaches("Power", "off")
    courier.order("power", lambda: courier.value("Power", "failures") != "0")
    assert host.requests["/power"] == []


def test_a_late_reply_is_unexpected(courier: Courier) -> None:
    host = courier.host()
    host.serve("/power", "std_srvs/SetBool")
    courier.start("_service_timeout:=0.4")
    courier.order("power", lambda: bool(host.requests["/power"]))
    courier.has("Power", "failures", "1")
    before = courier.health()
    host.do("answer", name="/power", message={"success": True, "message": "late"})
    courier.count_reaches("unexpected", 1)
    assert before is None or before[2]["unexpected"] == "0"
    assert courier.state("Power") == "off"
    assert courier.value("Power", "text") == ""
    # The next call is a call of its own.
    courier.order("power", lambda: len(host.requests["/power"]) == 2)
    host.do("answer", name="/power", message={"success": True, "message": "in time"})
    courier.has("Power", "text", "in time")


def test_a_service_that_is_lost_is_an_error_before_the_timeout(courier: Courier) -> None:
    host = courier.host()
    host.serve("/power", "std_srvs/SetBool")
    courier.start("_service_timeout:=1000.0")
    courier.order("power", lambda: bool(host.requests["/power"]))
    host.die()
    courier.has("Power", "failures", "1")
    # The master still knows it: it was not taken back.
    courier.order("power", lambda: courier.value("Power", "failures") not in ("0", "1"))
    first, *others = courier.reasons_of("power.error")
    assert "the call of /power failed" in first
    # Others are those that were ordered until the first of them was seen.
    assert others
    assert all("unable to connect" in reason for reason in others)


# Actions.


def test_a_goal_that_succeeds(courier: Courier) -> None:
    host = start_counting(courier)
    assert host.goals["/count"] == [{"goal": 5}]
    host.do("feedback", name="/count", message={"feedback": 7})
    courier.has("Counter", "seen", "7")
    host.do("end", name="/count", how="succeeded", message={"result": 3})
    courier.reaches("Counter", "counted")
    assert courier.value("Counter", "total") == "3"
    courier.speeds(ZERO)
    # The action may be requested again.
    courier.order("count", lambda: len(host.goals["/count"]) == 2)
    courier.reaches("Counter", "counting")


def test_nested_data_headers_and_private_names(courier: Courier) -> None:
    host = courier.host()
    host.act(MOVE, "move_base_msgs/MoveBase")
    courier.start()
    courier.order("move", lambda: bool(host.goals[MOVE]))
    (goal,) = host.goals[MOVE]
    header = goal["target_pose"]["header"]
    assert header["frame_id"] == "map" and header["stamp"]["secs"] > 0
    assert goal["target_pose"]["pose"]["position"] == {"x": 1.5, "y": 0.0, "z": 0.0}
    where = {
        "header": {"seq": 1, "stamp": {"secs": 7, "nsecs": 5}, "frame_id": "odom"},
        "pose": {
            "position": {"x": -2.5, "y": 0.0, "z": 0.0},
            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        },
    }
    courier.reaches("Base", "moving")
    host.do("feedback", name=MOVE, message={"base_position": where})
    courier.has("Base", "x", "-2.5")
    assert (courier.value("Base", "seconds"), courier.value("Base", "frame")) == ("7", "odom")
    host.do("end", name=MOVE, how="succeeded")
    courier.reaches("Base", "idle")


def test_a_goal_that_is_rejected(courier: Courier) -> None:
    host = courier.host()
    host.act("/count", "actionlib/Test", accepts=False)
    courier.start()
    courier.allow(True)
    courier.order("count", lambda: bool(host.goals["/count"]))
    courier.reaches("Counter", "failed")
    assert courier.reasons_of("count.error")[-1] == "rejected"


@pytest.mark.parametrize(
    ("options", "how"),
    [({"accepts": "later"}, "rejected"), ({}, "aborted"), ({}, "lost")],
    ids=lambda value: str(value),
)
def test_a_goal_that_runs_and_does_not_succeed(courier: Courier, options: dict[str, Any], how: str) -> None:
    host = start_counting(courier, **options)
    if how == "lost":
        host.die()
    else:
        host.do("end", name="/count", how=how)
    courier.reaches("Counter", "failed")
    courier.speeds(ZERO)
    assert courier.reasons_of("count.error")[-1] == how


def test_the_supervisor_cancels_a_goal_that_is_no_longer_allowed(courier: Courier) -> None:
    host = start_counting(courier, ends_on_cancel=False)
    courier.allow(False)
    courier.until(lambda: host.cancels["/count"] == 1, "the cancel")
    # Asking for the cancel ends nothing.
    courier.until(lambda: courier.cancelling() == ["count"], "the state")
    count = len(courier.peer.values("/state"))
    courier.until(lambda: len(courier.peer.values("/state")) > count + 20, "some decisions")
    assert courier.state("Counter") == "counting"
    host.do("end", name="/count", how="canceled")
    courier.reaches("Counter", "cancelled")
    courier.until(lambda: courier.cancelling() == [], "the state")
    courier.allow(True)
    courier.order("count", lambda: len(host.goals["/count"]) == 2)


def test_a_goal_is_cancelled_before_its_server_accepts_it(courier: Courier) -> None:
    """Cancel a goal so that it is what actionlib calls recalled: the server has the goal, but has not begun."""
    host = start_counting(courier, accepts="later")
    courier.allow(False)
    courier.reaches("Counter", "cancelled")
    courier.until(lambda: host.cancels["/count"] == 1, "the cancel")
    courier.allow(True)
    courier.order("count", lambda: len(host.goals["/count"]) == 2)


def test_a_goal_that_somebody_else_cancels(courier: Courier) -> None:
    host = start_counting(courier)
    courier.until(lambda: host.cancels["/count"] > 0, "the cancel", lambda: courier.peer.do("cancel", name="/count"))
    courier.reaches("Counter", "failed")
    assert courier.reasons_of("count.error")[-1] == "cancelled"


def test_a_missing_action_is_an_error_at_once(courier: Courier) -> None:
    courier.start()
    courier.allow(True)
    courier.order("count", lambda: courier.state("Counter") == "failed")
    assert set(courier.reasons_of("count.error")) == {"lost"}


def test_an_action_whose_server_starts_anew_is_an_error(courier: Courier) -> None:
    host = start_counting(courier)
    host.die()
    again = courier.host()
    again.act("/count", "actionlib/Test")
    courier.reaches("Counter", "failed")
    courier.order("count", lambda: bool(again.goals["/count"]))
    courier.reaches("Counter", "counting")


def test_a_goal_that_takes_too_long_is_an_error_and_cancelled(courier: Courier) -> None:
    host = start_counting(courier, "_action_timeout:=0.5")
    courier.reaches("Counter", "failed")
    courier.until(lambda: host.cancels["/count"] == 1, "the cancel")


def test_an_ignored_cancel_of_a_running_goal_is_a_fault(courier: Courier) -> None:
    host = start_counting(courier, cancels=False)
    courier.peer.publish("/allowed", "std_msgs/Bool", data=False)
    courier.stands_still(1)
    assert host.cancels["/count"] >= 1
    assert courier.node.stderr.splitlines()[-1].endswith("the cancel of a running goal of count was refused; fault")
    health = courier.health()
    assert health is not None and health[0] == 2 and "refused" in health[1]


# Start and end.


def test_the_start_waits_for_the_servers(courier: Courier) -> None:
    courier.start("_server_wait:=1000.0")

    def is_waiting() -> bool:
        health = courier.health()
        return health is not None and health[:2] == (1, "waiting for servers: /power, /wind, /count, ~move_base")

    courier.until(is_waiting, "the diagnostics to name the servers")
    host = courier.host()
    host.serve("/power", "std_srvs/SetBool")
    # It is held, not lost, while the others are missing.
    for _ in range(3):
        courier.peer.publish("/order/power", "std_msgs/Empty")
    host.serve("/wind", "std_srvs/Trigger")
    for name, type_name in (("/count", "actionlib/Test"), (MOVE, "move_base_msgs/MoveBase")):
        host.act(name, type_name)
    courier.until(lambda: bool(host.requests["/power"]), "the call that was ordered before")
    host.do("answer", name="/power", message={"success": True})
    courier.reaches("Power", "powered")
    assert courier.value("Power", "failures") == "0"
    assert not host.goals["/count"]


def test_a_prefix_moves_services_and_actions(courier: Courier) -> None:
    courier.node = courier.ends.enter_context(
        start_node(
            courier.master, courier.folder / "run", courier.package, f"{PACKAGE}.node", ["_topic_prefix:=/robot_1"]
        )
    )
    goal = "/robot_1/count/goal"
    courier.until(lambda: f"/{PACKAGE}" in courier.peer.names()["publishers"].get(goal, ()), "the client")
    # Private names belong to the node. It is still waiting for servers.
    courier.until(lambda: f"{MOVE}/goal" in courier.peer.names()["publishers"], "the client of a private name")
    courier.node.signal(signal.SIGTERM)
    assert courier.node.wait() == 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("ends", [True, False])
def test_a_signal_stops_wheels_and_goals(courier: Courier, number: signal.Signals, ends: bool) -> None:
    host = start_counting(courier, ends_on_cancel=ends)
    courier.node.signal(number)
    courier.stands_still(0)
    wait_until(lambda: host.cancels["/count"] == 1, "the cancel")
    events = courier.events()
    stop = next(index for index, item in enumerate(events) if item["kind"] == "stop")
    assert events[stop]["what"] == number.name
    assert not [item for item in events[stop:] if str(item.get("event")).endswith(".request")]
    errors = [item["data"] for item in events[stop:] if item.get("event") == "count.error"]
    assert errors == (["cancelled"] if ends else [])
    health = courier.health()
    assert health is not None and health[:2] == (2, f"stopped: {number.name}")


def test_a_signal_while_a_call_waits_ends_the_node(courier: Courier) -> None:
    host = courier.host()
    host.serve("/power", "std_srvs/SetBool")
    courier.start("_service_timeout:=0.0")
    courier.order("power", lambda: bool(host.requests["/power"]))
    courier.node.signal(signal.SIGTERM)
    courier.stands_still(0)
