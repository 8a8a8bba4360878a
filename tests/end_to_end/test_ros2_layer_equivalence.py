"""The layer over DDS writes the same log as the reference layer that is told the same."""

import json
import random
from array import array
from pathlib import Path
from typing import Any

import pytest

from robosc.execution.event_log import json_line
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.protocol import Match, Reading
from robosc.targets import generate, write_files
from support.layers import LayerBench
from support.porter import Porter, porter_robot, porter_supervisor
from support.ros2_servers import End, HeldAction, HeldService

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
pytest.importorskip("test_msgs", reason="test_msgs, with the only actions in a package index, is not installed")

pytestmark = pytest.mark.ros2

STEPS = 60
MARK = 0.125
BASIC = {"allowed.response", "loud.request", "quiet.request"}


class Reference(InterpretedSystem):
    """Takes the field of a ROS message where the model speaks of a basic type."""

    def read(self, event: str, data: Any) -> Reading:
        return super().read(event, data.data if event in BASIC else data)

    def matches(self, communication: str, data: Any) -> Match:
        return super().matches(communication, data.data if f"{communication}.request" in BASIC else data)


class Both:
    """The layer over DDS and the reference: what is done to one is done to the other."""

    def __init__(self, porter: Porter) -> None:
        from sensor_msgs.msg import LaserScan
        from std_msgs.msg import Bool
        from std_srvs.srv import SetBool
        from test_msgs.action import Fibonacci

        self.porter = porter
        self.service = HeldService(porter.host, SetBool, "/power")
        self.action = HeldAction(porter.host, Fibonacci, "/count", ends_on_cancel=False)
        self.bench = LayerBench(Reference(porter_supervisor()), command_timeout_s=0.0)
        self._passed = [
            porter.peer.receive(Bool, "/supervised/allowed"),
            porter.peer.receive(LaserScan, "/supervised/scan"),
        ]
        self._calls = 0
        self._goals = 0

    def _seen(self) -> int:
        """How much of what was sent has had its effect."""
        porter = self.porter
        return sum(map(len, (*self._passed, porter.blocked, porter.volumes, porter.commands)))

    def _passed_on(self) -> int:
        return sum(map(len, self._passed))

    def sense(self, message: Any, topic: str) -> None:
        """The robot sends a message."""
        from rclpy.qos import qos_profile_sensor_data

        before = self._passed_on()
        self.porter.peer.publish(message, topic, qos_profile_sensor_data if topic == "/scan" else 10)
        self.porter.until(lambda: self._passed_on() > before, f"{message} to be passed on")
        self.bench.receive(topic, message)

    def request(self, message: Any, identifier: str) -> None:
        """The existing controller sends a message."""
        before = self._seen()
        self.porter.peer.publish(message, "/supervised/" + identifier.lstrip("/"))
        self.porter.until(lambda: self._seen() > before, f"{message} to be let through or held back")
        self.bench.request(identifier, message)

    def call(self, success: bool) -> None:
        """It calls the service."""
        from std_srvs.srv import SetBool

        self._calls += 1
        before, blocked = len(self.service.requests), len(self.porter.blocked)
        future = self.porter.call()
        sent = self.bench.call("power", self._calls, SetBool.Request(data=True))
        if sent[0][0] == "call":
            self.porter.until(lambda: len(self.service.requests) > before, "the call")
            self.service.answer(success=success)
            self.bench.reply(sent[0][2], SetBool.Response(success=success))
            assert self.porter.wait_for(future, "the reply").success is success
        else:
            assert self.porter.wait_for(future, "the default reply").success is False
            self.porter.until(lambda: len(self.porter.blocked) > blocked, "a call held back")

    def goal(self, end: End, turns: bool) -> None:
        """It sends a goal, which may turn against its requirement under way."""
        from std_msgs.msg import Bool
        from test_msgs.action import Fibonacci

        self._goals += 1
        heard: list[Any] = []
        blocked, reached = len(self.porter.blocked), len(self.action.handles)
        handle = self.porter.send_goal(heard.append)
        sent = self.bench.goal("count", self._goals, Fibonacci.Goal(order=5))
        assert handle.accepted is (sent[0][0] == "goal")
        if not handle.accepted:
            self.porter.until(lambda: len(self.porter.blocked) > blocked, "a goal held back")
            return
        number = sent[0][2]
        result = handle.get_result_async()
        self.porter.until(lambda: len(self.action.handles) > reached, "the goal to reach the robot")
        self.bench.executor.on_goal_accepted(number)
        self.action.feedback(sequence=[self._goals])
        self.porter.until(lambda: bool(heard), "feedback")
        self.bench.feedback(number, Fibonacci.Feedback(sequence=[self._goals]))
        if turns:
            cancels = self.action.cancels
            self.sense(Bool(data=False), "/allowed")
            self.porter.until(lambda: self.action.cancels > cancels, "the cancel")
            end = End.CANCEL
        self.action.end(end, sequence=[1, 2])
        outcome = {End.SUCCEED: "succeeded", End.ABORT: "aborted", End.CANCEL: "cancelled"}[end]
        self.bench.end(number, outcome, Fibonacci.Result(sequence=[1, 2]))
        self.porter.wait_for(result, "the end")
        # Only when the layer knows of the end itself is another goal let through.
        self.porter.until(lambda: self.porter.state("Counter") == "idle", "the end")
        self.porter.peer.spin_for(0.1)


def comparable(entries: list[Any]) -> list[Any]:
    """Entries after the mark, without times; the reasons of a server's replies are the middleware's."""
    marks = [index for index, entry in enumerate(entries) if is_mark(entry)]
    return [
        {key: value for key, value in entry.items() if key not in ("time", "decision_us")}
        for entry in entries[marks[-1] + 1 :]
        if entry["kind"] != "stop"
    ]


def is_mark(entry: Any) -> bool:
    return bool(entry.get("event") == "quiet.request" and entry["data"] in (MARK, {"data": MARK}))


def test_the_logs_are_the_same(tmp_path: Path) -> None:
    from geometry_msgs.msg import Twist
    from sensor_msgs.msg import LaserScan
    from std_msgs.msg import Bool, Float32

    workspace = tmp_path / "workspace"
    write_files(generate(porter_supervisor(), "ros2"), workspace)
    with porter_robot(workspace, tmp_path) as porter:
        both = Both(porter)
        porter.start("command_timeout:=0.0")
        warm_up(both)
        source = random.Random(1)
        for _ in range(STEPS):
            match source.randrange(8):
                case 0 | 1:
                    both.sense(Bool(data=source.random() < 0.7), "/allowed")
                case 2:
                    both.sense(LaserScan(ranges=array("f", [source.choice([0.25, 2.0, float("nan")])])), "/scan")
                case 3 | 4:
                    message = Twist()
                    message.linear.x = source.choice([0.0, 0.5, -0.5, float("inf")])
                    message.angular.z = source.choice([0.0, 0.25, float("nan")])
                    both.request(message, "/cmd_vel")
                case 5:
                    both.request(Float32(data=source.choice([0.5, 2.0, float("nan")])), "volume")
                case 6:
                    both.call(source.random() < 0.5)
                case _:
                    both.goal(source.choice([End.SUCCEED, End.ABORT]), turns=source.random() < 0.3)
        logged = comparable(porter.end())
    expected = comparable([json.loads(json_line(entry)) for entry in both.bench.log.entries])
    assert logged == expected
    kinds = {entry["kind"] for entry in logged}
    assert {"event", "blocked", "release"} <= kinds
    assert len(logged) > STEPS


def warm_up(both: Both) -> None:
    """Until everybody has heard of everybody: the first messages of a new connection may be lost."""
    from geometry_msgs.msg import Twist
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import LaserScan
    from std_msgs.msg import Bool, Float32

    porter, peer = both.porter, both.porter.peer
    scan, volumes = LaserScan(ranges=array("f", [0.25])), porter.volumes

    def send_all() -> None:
        peer.publish(Bool(data=False), "/allowed")
        peer.publish(scan, "/scan", qos_profile_sensor_data)
        peer.publish(Twist(), "/supervised/cmd_vel")
        porter.send(0.5)
        peer.publish(Float32(data=0.5), "/supervised/volume")

    porter.until(
        lambda: all(both._passed) and bool(porter.commands) and bool(volumes) and porter.is_blocked("/cmd_vel"),
        "everything to be passed on",
        send_all,
    )
    peer.spin_for(0.5)
    both.bench.receive("/allowed", Bool(data=False))
    both.bench.receive("/scan", scan)
    both.request(Float32(data=MARK), "volume")
