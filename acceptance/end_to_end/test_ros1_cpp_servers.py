"""Services and actions of a generated ROS 1 node in C++: every way in which they end, with real servers on rospy."""

import json
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from robosc.supervisor import Supervisor
from support.node_logs import Entry, entries_of
from support.process import Process
from support.ros1_cpp import Master, Peer, built_once, missing, node_command, supervisor_of
from support.waiting import wait_until

pytestmark = [
    pytest.mark.skipif(missing() is not None, reason=str(missing())),
]

MODEL = Path(__file__).parents[2] / "tests" / "models" / "carrier" / "carrier.rscd"


@pytest.fixture(scope="module")
def supervisor() -> Supervisor:
    return supervisor_of(MODEL)


@pytest.fixture(scope="module")
def workspace(supervisor: Supervisor, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built_once(supervisor, tmp_path_factory)


class Carrier:
    """The test's side of the model: a peer, and the node's log."""

    def __init__(self, workspace: Path, master: Master, peer: Peer, folder: Path) -> None:
        self._workspace = workspace
        self._master = master
        self._folder = folder
        self.peer = peer
        self.node: Process

    def start(self, *parameters: str) -> None:
        """Start the node, deciding every 20 ms."""
        given = ("period:=0.02", f"log_folder:={self._folder / 'events'}", *parameters)
        self.node = Process(node_command(self._workspace, *given), self._master.variables, self._folder / "node")

    @property
    def entries(self) -> list[Entry]:
        return entries_of(self._folder / "events")

    def events(self, event: str) -> list[Entry]:
        return [entry for entry in self.entries if entry.get("event") == event and entry["kind"] == "event"]

    def until(self, event: str, count: int = 1, repeat: Callable[[], object] = lambda: None) -> None:
        """Wait until the node has logged an event so often."""

        def is_there() -> bool:
            assert self.node.is_running, self.node.stderr
            return len(self.events(event)) >= count

        wait_until(is_there, f"{event}, {count} times", repeat=repeat)

    def say(self, word: str) -> None:
        self.peer.publish("/word", "std_msgs/String", data=word)

    def scan(self, distance: float) -> None:
        self.peer.publish("/scan", "sensor_msgs/LaserScan", ranges=[distance] * 360, range_max=10.0)

    def calibrate(self) -> None:
        """Answer the calibration as it should be."""
        wait_until(lambda: bool(self.peer.of("called", "/calibrate")), "a call")
        self.peer.order("answer", "/calibrate", data={"success": True, "message": "fine"})
        self.until("calibrate.response")

    def drive(self) -> None:
        """Get it so far that a goal is under way."""
        before = len(self.peer.of("goal", "/move_base"))
        self.until("word.response", repeat=lambda: self.say("go"))
        wait_until(lambda: len(self.peer.of("goal", "/move_base")) > before, "a goal")


@pytest.fixture
def carrier(workspace: Path, tmp_path: Path) -> Iterator[Carrier]:
    with Master(tmp_path / "ros1") as master, Peer(master, tmp_path) as peer:
        made = Carrier(workspace, master, peer, tmp_path)
        yield made
        made.node.__exit__(None, None, None)


@pytest.fixture
def ready(carrier: Carrier) -> Carrier:
    """A node with both servers, calibrated."""
    carrier.peer.order("service", "/calibrate", "std_srvs/Trigger")
    carrier.peer.order("action", "/move_base", "move_base_msgs/MoveBase")
    carrier.start()
    carrier.calibrate()
    return carrier


def test_what_is_sent_is_as_the_model_says_and_stamped(ready: Carrier, supervisor: Supervisor) -> None:
    peer = ready.peer
    for topic, type_ in (
        ("/creep", "geometry_msgs/TwistStamped"),
        ("/said", "std_msgs/String"),
        ("/count", "std_msgs/Int16"),
    ):
        peer.order("subscribe", topic, type_)
    ready.until("level.response", repeat=lambda: peer.publish("/level", "std_msgs/Float32", data=0.25))
    wait_until(lambda: any(m["twist"]["angular"]["z"] == 0.25 for m in peer.messages("/creep")), "the charge")
    wait_until(lambda: bool(peer.messages("/said") and peer.messages("/count")), "texts and numbers")
    message = peer.messages("/creep")[-1]
    assert message["header"]["frame_id"] == "base_link"
    assert message["header"]["stamp"] > 1e9
    assert message["twist"]["linear"] == {"x": 0.1, "y": 0.0, "z": 0.0}
    assert peer.messages("/said")[0] == {"data": 'known; "and" said'}
    assert peer.messages("/count")[0] == {"data": 32}

    ready.drive()
    goal = peer.of("goal", "/move_base")[-1]["target_pose"]
    assert goal["header"]["frame_id"] == "map"
    assert goal["header"]["stamp"] > 1e9
    assert goal["pose"]["position"] == {"x": 2.0, "y": 0.5, "z": 0.0}
    assert goal["pose"]["orientation"] == {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    peer.order("accept", "/move_base")
    pose = {"base_position": {"pose": {"position": {"x": 1.5}}}}
    peer.order("feedback", "/move_base", data=pose)
    ready.until("carry.feedback")
    assert ready.events("carry.feedback")[-1]["state"]["Base"]["variables"]["progress"] == "far"
    peer.order("succeed", "/move_base", data={})
    ready.until("carry.response")
    ready.node.signal(signal.SIGINT)
    assert ready.node.wait() == 0
    # The effects of all data, in any order, are those in the reference executor.
    entries = ready.entries
    kinds = {entry["event"] for entry in entries if entry["kind"] == "event"}
    assert {"calibrate.response", "carry.feedback", "carry.response", "creep.request", "said.request"} <= kinds
    _assert_states_follow(supervisor, entries)


def _assert_states_follow(supervisor: Supervisor, entries: list[Entry]) -> None:
    """Every state that the log has is what the model says comes of its events."""
    from robosc.execution.interpreter import InterpretedSystem

    system = InterpretedSystem(supervisor)
    for entry in entries:
        if entry["kind"] == "event":
            if entry["controllable"]:
                assert system.enabled(entry["event"]), entry
                system.step(entry["event"])
            else:
                system.step(entry["event"], system.read(entry["event"], entry["data"]))
            assert system.state() == entry["state"], entry


def test_missing_servers_are_errors_and_never_block(carrier: Carrier) -> None:
    carrier.peer.order("subscribe", "/creep", "geometry_msgs/TwistStamped")
    carrier.start("server_wait:=0.2")
    carrier.until("calibrate.error", 3)
    # The wheels go on turning between the failing calls.
    wait_until(lambda: len(carrier.peer.messages("/creep")) > 5, "commands")
    assert "starting without a server of /calibrate, /move_base" in carrier.node.stdout + carrier.node.stderr
    carrier.peer.order("service", "/calibrate", "std_srvs/Trigger")
    carrier.calibrate()
    carrier.until("word.response", repeat=lambda: carrier.say("go"))
    carrier.until("carry.error", 2)


def test_a_service_that_does_not_answer_times_out_and_its_late_answer_changes_nothing(carrier: Carrier) -> None:
    carrier.peer.order("service", "/calibrate", "std_srvs/Trigger")
    carrier.peer.order("action", "/move_base", "move_base_msgs/MoveBase")
    carrier.start("service_timeout:=0.3")
    carrier.until("calibrate.error", 2)
    wait_until(lambda: len(carrier.peer.of("called", "/calibrate")) >= 2, "another call")
    carrier.peer.order("answer", "/calibrate", data="fail")
    carrier.until("calibrate.error", 3)
    # It ends at once, although calls wait for their replies.
    carrier.node.signal(signal.SIGTERM)
    assert carrier.node.wait() == 0


def test_goals_end_in_every_way(ready: Carrier) -> None:
    peer = ready.peer
    ready.drive()
    peer.order("reject", "/move_base")
    ready.until("carry.error", 1)
    wait_until(lambda: len(peer.of("goal", "/move_base")) >= 2, "another goal")
    peer.order("accept", "/move_base")
    peer.order("abort", "/move_base")
    ready.until("carry.error", 2)
    wait_until(lambda: len(peer.of("goal", "/move_base")) >= 3, "another goal")
    peer.order("accept", "/move_base")
    # An obstacle is in the way: the goal is cancelled.
    wait_until(lambda: bool(peer.of("cancel", "/move_base")), "the cancel", repeat=lambda: ready.scan(0.2))
    peer.order("canceled", "/move_base")
    ready.until("carry.cancel")
    goals = len(peer.of("goal", "/move_base"))
    ready.until("scan.response", len(ready.events("scan.response")) + 1, repeat=lambda: ready.scan(5.0))
    wait_until(lambda: len(peer.of("goal", "/move_base")) > goals, "a goal with a clear way")


def test_a_goal_is_cancelled_when_the_node_is_stopped(ready: Carrier) -> None:
    ready.drive()
    ready.peer.order("accept", "/move_base")
    ready.peer.order("feedback", "/move_base", data={})
    ready.until("carry.feedback")
    ready.peer.order("subscribe", "/creep", "geometry_msgs/TwistStamped")
    ready.node.signal(signal.SIGINT)
    wait_until(lambda: bool(ready.peer.of("cancel", "/move_base")), "the cancel")
    assert ready.node.wait() == 0
    assert ready.node.stderr == ""


def test_a_server_that_vanishes_is_an_error(workspace: Path, tmp_path: Path) -> None:
    with Master(tmp_path / "ros1") as master, Peer(master, tmp_path) as peer, Peer(master, tmp_path, "mover") as mover:
        carrier = Carrier(workspace, master, peer, tmp_path)
        peer.order("service", "/calibrate", "std_srvs/Trigger")
        mover.order("action", "/move_base", "move_base_msgs/MoveBase")
        carrier.start()
        with carrier.node:
            carrier.calibrate()
            carrier.until("word.response", repeat=lambda: carrier.say("go"))
            wait_until(lambda: bool(mover.of("goal", "/move_base")), "a goal")
            mover.order("accept", "/move_base")
            mover.order("feedback", "/move_base", data={})
            carrier.until("carry.feedback")
            mover.kill()
            carrier.until("carry.error")
            carrier.node.signal(signal.SIGTERM)
            assert carrier.node.wait() == 0


def test_a_cancel_that_is_ignored_is_a_fault(carrier: Carrier) -> None:
    carrier.peer.order("service", "/calibrate", "std_srvs/Trigger")
    carrier.peer.order("action", "/move_base", "move_base_msgs/MoveBase", data="cancel")
    carrier.start()
    carrier.calibrate()
    carrier.drive()
    carrier.peer.order("accept", "/move_base")
    carrier.peer.order("feedback", "/move_base", data={})
    carrier.until("carry.feedback")
    wait_until(lambda: not carrier.node.is_running, "the fault", repeat=lambda: carrier.scan(0.2))
    assert carrier.node.wait() == 1
    assert carrier.node.stderr.splitlines()[-1] == "carrier_controller: the cancel of a running goal was refused"
    assert carrier.peer.of("cancel", "/move_base")


@pytest.mark.parametrize(
    ("end", "event"), [("canceled", "carry.cancel"), ("succeed", "carry.response"), ("abort", "carry.error")]
)
def test_a_cancelled_goal_is_executed_until_its_server_ends_it(carrier: Carrier, end: str, event: str) -> None:
    """A robot brakes for longer than the parameter allows, and then ends in one way or another."""
    peer = carrier.peer
    peer.order("service", "/calibrate", "std_srvs/Trigger")
    peer.order("action", "/move_base", "move_base_msgs/MoveBase")
    peer.order("subscribe", "/creep", "geometry_msgs/TwistStamped")
    peer.order("subscribe", "/diagnostics", "diagnostic_msgs/DiagnosticArray")
    peer.order("subscribe", "/state", "std_msgs/String")
    carrier.start("cancel_timeout:=0.5", "publish_state:=true")
    carrier.calibrate()
    carrier.drive()
    peer.order("accept", "/move_base")
    # The goal alone is in the way of `creep` now.
    wait_until(lambda: bool(peer.of("cancel", "/move_base")), "the cancel", repeat=lambda: carrier.say("stay"))
    creeps = len(peer.messages("/creep"))

    def is_error() -> bool:
        last = [status for message in peer.messages("/diagnostics")[-1:] for status in message["status"]]
        return any(status["level"] == 2 and "carry" in status["message"] for status in last)

    wait_until(is_error, "an error in the diagnostics")
    peer.order("feedback", "/move_base", data={})
    carrier.until("carry.feedback")
    assert json.loads(peer.messages("/state")[-1]["data"])["cancelling"] == ["carry"]
    noted = [entry for entry in carrier.entries if entry["kind"] in ("cancelling", "cancel_overdue")]
    assert [(entry["kind"], entry["action"]) for entry in noted] == [
        ("cancelling", "carry"),
        ("cancel_overdue", "carry"),
    ]
    assert noted[0]["why"] == "requirement 1 no longer holds"
    assert noted[1]["asked_s"] >= 0.5
    assert len(peer.messages("/creep")) == creeps
    peer.order(end, "/move_base", data={})
    carrier.until(event)
    wait_until(lambda: not is_error(), "diagnostics without an error")
    assert json.loads(peer.messages("/state")[-1]["data"])["cancelling"] == []
    if end != "succeed":
        wait_until(lambda: len(peer.messages("/creep")) > creeps, "a command that had to wait")
    others = {"carry.cancel", "carry.response", "carry.error"} - {event}
    assert not [name for name in others if carrier.events(name)]


def test_a_goal_that_nothing_is_heard_of_is_an_error(carrier: Carrier) -> None:
    carrier.peer.order("service", "/calibrate", "std_srvs/Trigger")
    carrier.peer.order("action", "/move_base", "move_base_msgs/MoveBase", data="goal")
    carrier.start()
    carrier.calibrate()
    carrier.until("carry.request", repeat=lambda: carrier.say("go"))
    wait_until(lambda: bool(carrier.peer.of("goal", "/move_base")), "a goal")
    carrier.until("carry.error")


def test_calls_that_never_end_do_not_keep_others_from_being_made(carrier: Carrier) -> None:
    carrier.peer.order("service", "/calibrate", "std_srvs/Trigger")
    carrier.peer.order("action", "/move_base", "move_base_msgs/MoveBase")
    carrier.start("service_timeout:=0.01")
    # More than may wait, and more than threads of one service may be.
    wait_until(lambda: len(carrier.peer.of("called", "/calibrate")) > 40, "another call")
    carrier.node.signal(signal.SIGTERM)
    assert carrier.node.wait() == 0
