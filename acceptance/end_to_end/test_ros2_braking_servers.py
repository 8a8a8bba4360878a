"""A real action server that brakes, succeeds, refuses, never ends or dies when its goal is cancelled, over DDS.

In none of these cases does the arm move while the wheels turn. What node and robot did is printed side by side (`-s`).
"""

import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from robosc.certification import make_supervisor
from robosc.language import load_bundle
from robosc.targets import generate, write_files
from support.loaders import EXPECTED, MODEL, SERVERS, Moment, check, of_node, side_by_side
from support.node_logs import entries_of
from support.ros2 import Peer, RosProcess, environment, own_domain

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
pytest.importorskip("test_msgs", reason="test_msgs, with the only actions in a package index, is not installed")

pytestmark = pytest.mark.ros2

SERVER = Path(__file__).parents[2] / "tests" / "support" / "ros2_braking_server.py"
LIMIT_S = 20.0
LEASE_S = 40.0
"""A killed process may be seen until the lease of the middleware is over."""


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The generated package, of a synthesized and verified supervisor."""
    made = make_supervisor(load_bundle(MODEL))
    assert made.supervisor is not None, made.reason
    folder = tmp_path_factory.mktemp("workspace")
    write_files(generate(made.supervisor, "ros2"), folder)
    return folder


class Loading:
    """Node, robot, and a peer that presses the button and watches."""

    def __init__(self, server: str, workspace: Path, peer: Peer, variables: dict[str, str], folder: Path) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from std_msgs.msg import String

        self.peer = peer
        self.file = folder / "robot.jsonl"
        self.events = folder / "events"
        self.states = peer.receive(String, "/state")
        self.reports = peer.receive(DiagnosticArray, "/diagnostics")
        self.server = RosProcess([str(SERVER), server, str(self.file)], variables, folder / "server")
        settings = {
            "period": "0.02",
            "publish_state": "true",
            "policy": "priority",
            "priority": "['travel']",
            "cancel_timeout": "2.5",
            "log_folder": str(self.events),
        }
        arguments = [part for name, value in settings.items() for part in ("-p", f"{name}:={value}")]
        self.node = RosProcess(
            ["-m", "loader_controller.start", "--ros-args", *arguments], variables, folder / "run", [workspace]
        )

    def robot(self) -> list[Moment]:
        """Return what the robot did so far."""
        lines = self.file.read_text().splitlines() if self.file.exists() else []
        found = [json.loads(line) for line in lines if line.endswith("}")]
        return [Moment(item["time"], item["what"], True) for item in found]

    def did(self, what: str) -> bool:
        """Return True if the robot did something."""
        return any(moment.what == what for moment in self.robot())

    def said(self, words: str) -> bool:
        """Return True if the node has noted something."""
        return any(moment.what.startswith(words) for moment in of_node(entries_of(self.events)))

    def press(self) -> None:
        """Press the button."""
        from std_msgs.msg import Bool

        self.peer.publish(Bool(data=True), "/stop")

    def health(self) -> tuple[int, str]:
        """Level and message of the last report."""
        (status,) = self.reports[-1].status
        return status.level[0], status.message


@pytest.fixture
def surroundings(tmp_path: Path) -> Iterator[tuple[Peer, dict[str, str]]]:
    with own_domain() as domain:
        variables = environment(domain, tmp_path)
        with Peer(domain, variables) as peer:
            yield peer, variables


@pytest.mark.parametrize("server", SERVERS)
def test_the_arm_moves_only_while_the_wheels_stand(
    server: str, workspace: Path, surroundings: tuple[Peer, dict[str, str]], tmp_path: Path
) -> None:
    from std_srvs.srv import SetBool

    peer, variables = surroundings
    arm: list[Moment] = []
    if server == "dies":

        def reach(request: Any, response: Any) -> Any:
            arm.append(Moment(time.time(), "arm moves", True))
            return response

        peer.node.create_service(SetBool, "/arm/reach", reach)
    loading = Loading(server, workspace, peer, variables, tmp_path)
    with loading.server, loading.node:
        peer.spin_until(lambda: loading.did("wheels turn"), LIMIT_S, "the wheels to turn", loading.node)
        peer.spin_until(lambda: loading.did("cancel received"), LIMIT_S, "the cancel", loading.node, loading.press)
        if server != "refuses":
            peer.spin_until(lambda: loading.said(EXPECTED[server]), LEASE_S, EXPECTED[server], loading.node)
        if server == "never":
            overdue = "the goal of travel has not ended although its cancel was asked for"
            peer.spin_until(lambda: loading.health() == (2, overdue), LIMIT_S, "the error", loading.node)
            peer.spin_for(1.0)
        if server == "refuses":
            peer.spin_until(lambda: not loading.node.is_running, LIMIT_S, "the fault")
            assert loading.node.wait() == 1
            peer.spin_until(lambda: loading.did("wheels stand"), LIMIT_S, "the end of the goal")
        if server in ("brakes", "succeeds", "dies"):
            peer.spin_until(lambda: bool(arm) or loading.did("arm moves"), LIMIT_S, "the arm", loading.node)
        moments = [*of_node(entries_of(loading.events)), *loading.robot(), *arm]
    print(f"\n{server}:\n{side_by_side(moments, min(moment.time_s for moment in moments))}")
    check(moments, server, EXPECTED[server])
    if server in ("brakes", "succeeds", "never"):
        assert any(json.loads(state.data)["cancelling"] == ["travel"] for state in loading.states)
