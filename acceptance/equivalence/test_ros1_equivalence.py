"""The generated ROS 1 node in Python does what the reference executor does, on a real rosmaster, step by step."""

from dataclasses import replace
from pathlib import Path

import pytest

from robosc.certification import make_supervisor
from robosc.language import load_bundle
from support.equivalence.python_targets import observe
from support.equivalence.random_scenarios import ODD_MESSAGES, for_node, node_scenario
from support.equivalence.recorded import read_recorded
from support.equivalence.ros1_target import ros1_target
from support.equivalence.targets import compare
from support.generated import example_supervisor
from support.hostile import hostile_supervisor
from support.ros1 import missing

pytestmark = [
    pytest.mark.ros1,
    pytest.mark.skipif(missing() is not None, reason=str(missing())),
]

# The navigation example asks for interfaces that no index of packages has.
ROBOTS = ["line_follower", "maze_solver", "object_finder", "ball_pusher", "person_follower"]
COURIER = Path(__file__).parents[2] / "tests" / "models" / "courier_ros1" / "model.rscd"


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_recorded_run(robot: str, tmp_path: Path) -> None:
    supervisor = example_supervisor(f"{robot}/{robot}")
    scenario = for_node(supervisor, read_recorded(robot))
    if robot == "line_follower":
        scenario = replace(scenario, actions=scenario.actions + ODD_MESSAGES)
    compare(ros1_target(supervisor, tmp_path), scenario, observe(supervisor, scenario))


def test_services_and_actions(tmp_path: Path) -> None:
    supervisor = make_supervisor(load_bundle(COURIER)).supervisor
    assert supervisor is not None
    scenario = node_scenario(supervisor, 1, 200)
    seen = observe(supervisor, scenario)
    asked = {(kind, name) for item in seen for kind, name, _ in item.issued}
    assert asked >= {("call", "power"), ("call", "wind"), ("goal", "count"), ("goal", "move"), ("cancel", "count")}
    compare(ros1_target(supervisor, tmp_path), scenario, seen)


def test_a_hostile_robot(tmp_path: Path) -> None:
    canary = tmp_path / "canary"
    supervisor = hostile_supervisor(1, canary)
    scenario = node_scenario(supervisor, 1, 60)
    compare(ros1_target(supervisor, tmp_path), scenario, observe(supervisor, scenario))
    assert not canary.exists()
