"""A generated ROS 2 node in Python tells how far its strategy is, over real DDS."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from robosc.targets import generate, write_files
from support.goal_porter import porter_supervisor
from support.ros2 import Peer, RosProcess, environment, own_domain

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
pytestmark = pytest.mark.ros2

LIMIT_S = 15.0
OWED = "Door.opening leads to Door.ajar"


@pytest.fixture
def domain() -> Iterator[int]:
    with own_domain() as number:
        yield number


def test_a_door_that_does_not_open_is_told(domain: int, tmp_path: Path) -> None:
    from diagnostic_msgs.msg import DiagnosticArray
    from std_msgs.msg import Empty, String

    write_files(generate(porter_supervisor(), "ros2"), tmp_path / "package")
    parameters = [
        word
        for text in ("publish_state:=true", "assumption_timeout:=0.5", f"log_folder:={tmp_path / 'log'}")
        for word in ("-p", text)
    ]
    variables = environment(domain, tmp_path)
    command = ["-m", "porter_controller.node", "--ros-args", *parameters]
    with (
        Peer(domain, variables) as peer,
        RosProcess(command, variables, tmp_path / "node", [tmp_path / "package"], program=sys.executable) as node,
    ):
        states = peer.receive(String, "/state")
        reports = peer.receive(DiagnosticArray, "/diagnostics")
        peer.wait_for_peers(["/call"])

        def is_owed() -> bool:
            return bool(states) and json.loads(states[-1].data)["progress"]["overdue"] == ["assumption 1"]

        peer.spin_until(is_owed, LIMIT_S, "the assumption", node, lambda: peer.publish(Empty(), "/call"))
        progress = json.loads(states[-1].data)["progress"]
        assert (progress["approached"], progress["is_followed"]) == ("goal 1", True)
        assert progress["assumptions"][0]["words"] == OWED
        assert progress["assumptions"][0]["unmet_s"] >= 0.5

        def warns() -> bool:
            return any(OWED in report.status[0].message for report in reports)

        peer.spin_until(warns, LIMIT_S, "a warning on /diagnostics", node)

        def is_reached() -> bool:
            return any(json.loads(state.data)["progress"]["aims"][0]["times"] for state in states)

        peer.spin_until(is_reached, LIMIT_S, "the goal", node, lambda: peer.publish(Empty(), "/door/opened"))
    (log,) = (tmp_path / "log").glob("*.jsonl")
    kinds = [json.loads(line)["kind"] for line in log.read_text(encoding="utf-8").splitlines()]
    assert {"approach", "owed", "met", "reached"} <= set(kinds)
