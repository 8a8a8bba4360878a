"""The generated ROS 2 node in C++ tells how far its strategy is as the reference executor does."""

import json
import time
from pathlib import Path
from typing import Any

import pytest

from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.progress import mission_texts
from robosc.supervisor import Supervisor
from robosc_view.ros2_topic import StateReader
from support.equivalence.node_target import LIMIT_S
from support.equivalence.python_targets import observe
from support.equivalence.rclcpp_target import StandInSurroundings, rclcpp_target
from support.equivalence.scenario import PERIOD_S, Action, Scenario
from support.equivalence.targets import compare
from support.execution import Bench
from support.goal_porter import porter_supervisor
from support.rclcpp_nodes import compiled_once, missing
from support.rounds import rounds_supervisor

yaml: Any = pytest.importorskip("yaml", reason="PyYAML, which reads what the stand-in prints, is not installed")
pytestmark = pytest.mark.skipif(missing() is not None, reason=str(missing()))

CALLS = ("/call", "/door/opened", "/door/closed", "/call", "/door/opened", "/door/opened", "/call", "/door/closed")
CALLED = Scenario(
    tuple(Action("message", name) for name in CALLS), {"every": "event", "period_s": 3600.0, "policy": "strategy"}
)


def test_its_event_log_tells_of_goals(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    seen = observe(porter_supervisor(), CALLED)
    assert {line["kind"] for item in seen for line in item.log} >= {"reached", "approach"}
    compare(
        rclcpp_target(porter_supervisor(), compiled_once(porter_supervisor(), tmp_path_factory), tmp_path), CALLED, seen
    )


class Stepped(StandInSurroundings):
    """A node on simulated time that publishes its state as JSON, and its health."""

    def __init__(self, program: Path, folder: Path, supervisor: Supervisor) -> None:
        parameters = {"use_sim_time": "true", "publish_state": "true", "assumption_timeout": "0.5"}
        super().__init__(supervisor, program, folder, parameters)
        self._periods = 0
        self.health: list[dict[str, Any]] = []

    def next_state(self) -> str:
        """Let a period pass, and return the text on the topic state."""
        self._periods += 1
        self._order("clock", str(1.0 + self._periods * PERIOD_S))
        return self._awaited("publish /state ")["data"]  # type: ignore[no-any-return]

    def next_health(self) -> dict[str, Any]:
        """Return the next report on /diagnostics."""
        return self._awaited("publish /diagnostics ")["status"][0]  # type: ignore[no-any-return]

    def _awaited(self, beginning: str) -> Any:
        began = time.monotonic()
        while time.monotonic() < began + LIMIT_S:
            for line in reversed(self._new_lines()):
                if line.startswith(beginning):
                    return yaml.safe_load(line.removeprefix(beginning))
            self.spin()
        raise AssertionError(f"the node does not {beginning}")


def test_its_state_and_its_diagnostics_have_the_progress(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    node = Stepped(compiled_once(porter_supervisor(), tmp_path_factory), tmp_path, porter_supervisor())
    node.start(Scenario((), {"period_s": PERIOD_S, "policy": "strategy"}), tmp_path / "events")
    twin = Bench(InterpretedSystem(porter_supervisor()), assumption_timeout_s=0.5, period_s=PERIOD_S)
    reader = StateReader(porter_supervisor())
    try:
        node._order("clock", "1.0")
        for _ in range(3):
            node.next_state()
        node.send("/call", {})
        twin.receive("/call")
        for number in range(8):
            _, status, _ = reader.read(node.next_state(), 1.0)
            twin.tick()
            assert status.progress is not None and twin.executor.progress is not None
            expected = twin.executor.progress
            assert status.progress._replace(aims=(), assumptions=()) == expected._replace(aims=(), assumptions=())
            if number:
                assert [item[:4] for item in (*status.progress.aims, *status.progress.assumptions)] == [
                    item[:4] for item in (*expected.aims, *expected.assumptions)
                ]
                owed_s = status.progress.assumptions[0].unmet_s
                assert owed_s == pytest.approx(expected.assumptions[0].unmet_s, abs=0.001)
        assert json.loads(node.next_state())["progress"]["overdue"] == ["assumption 1"]
        health = node.next_health()
        assert health["message"].startswith("assumption 1 has been owed for 1 s: Door.opening leads to Door.ajar")
        values = {item["key"]: item["value"] for item in health["values"]}
        assert values["approached"] == "goal 1"
        assert values["assumption 2"] == "true, reached 0 times: Door.closing leads to Door.shut"
        node.stop()
    finally:
        node.close()


def test_its_state_and_its_diagnostics_have_the_missions(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    supervisor = rounds_supervisor()
    node = Stepped(compiled_once(supervisor, tmp_path_factory), tmp_path, supervisor)
    node.start(Scenario((), {"period_s": PERIOD_S, "policy": "strategy"}), tmp_path / "events")
    twin = Bench(InterpretedSystem(supervisor), period_s=PERIOD_S)
    reader = StateReader(supervisor)
    try:
        node._order("clock", "1.0")
        for _ in range(3):
            node.next_state()
        seen = set[str]()
        for identifier in ("/begin", "/call", "/end"):
            node.send(identifier, {})
            twin.receive(identifier)
            for _ in range(3):
                _, status, _ = reader.read(node.next_state(), 1.0)
                twin.tick()
                assert status.progress is not None and twin.executor.progress is not None
                expected = twin.executor.progress
                assert status.progress.missions == expected.missions
                assert [(*item[:4], item.mission) for item in status.progress.aims] == [
                    (*item[:4], item.mission) for item in expected.aims
                ]
                seen.add(mission_texts(expected)["mission rounds"])
        assert len(seen) > 4
        values = {item["key"]: item["value"] for item in node.next_health()["values"]}
        assert values["mission rounds"] == "not asked for; rounds made: 2"
        assert values["visit 1 of mission rounds"] == "not wanted now, reached 3 times: Base.kitchen"
        node.stop()
    finally:
        node.close()
