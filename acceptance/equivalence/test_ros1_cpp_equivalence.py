"""The generated ROS 1 node in C++ does what the reference executor does, on a real rosmaster, step by step."""

from dataclasses import replace
from pathlib import Path

import pytest

from support import porter_ros1
from support.equivalence.python_targets import observe
from support.equivalence.random_scenarios import (
    LAYER_KINDS,
    ODD_MESSAGES,
    for_layer_node,
    for_node,
    layer_node_scenario,
    node_scenario,
)
from support.equivalence.recorded import read_recorded
from support.equivalence.ros1_target import ros1_cpp_target
from support.equivalence.targets import compare
from support.equivalence.worlds import robot_supervisor
from support.generated import example_supervisor
from support.ros1_cpp import built_once, missing, supervisor_of

pytestmark = [
    pytest.mark.ros1,
    pytest.mark.skipif(missing() is not None, reason=str(missing())),
]

CARRIER = Path(__file__).parents[2] / "tests" / "models" / "carrier" / "carrier.rscd"


# The navigation example asks for interfaces that no index of packages has.
@pytest.mark.parametrize("robot", ["line_follower", "maze_solver", "object_finder", "ball_pusher", "person_follower"])
def test_a_recorded_run(robot: str, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    supervisor = example_supervisor(f"{robot}/{robot}")
    scenario = for_node(supervisor, read_recorded(robot))
    if robot == "line_follower":
        scenario = replace(scenario, actions=scenario.actions + ODD_MESSAGES)
    workspace = built_once(supervisor, tmp_path_factory)
    compare(ros1_cpp_target(supervisor, workspace, tmp_path), scenario, observe(supervisor, scenario))


@pytest.mark.parametrize("seed", [3, 4])
def test_a_layer(seed: int, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    supervisor = porter_ros1.porter_supervisor()
    scenario = layer_node_scenario(supervisor, seed, 200)
    seen = observe(supervisor, scenario)
    assert {kind for item in seen for kind, _, _ in item.issued} >= LAYER_KINDS
    workspace = built_once(supervisor, tmp_path_factory)
    compare(ros1_cpp_target(supervisor, workspace, tmp_path), scenario, seen)


def test_a_recorded_run_of_a_layer(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    supervisor = robot_supervisor("line_follower_layer")
    scenario = for_layer_node(supervisor, read_recorded("line_follower_layer"))
    workspace = built_once(supervisor, tmp_path_factory)
    compare(ros1_cpp_target(supervisor, workspace, tmp_path), scenario, observe(supervisor, scenario))


def test_services_and_actions(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    supervisor = supervisor_of(CARRIER)
    scenario = node_scenario(supervisor, 1, 200)
    seen = observe(supervisor, scenario)
    asked = {(kind, name) for item in seen for kind, name, _ in item.issued}
    assert asked >= {("call", "calibrate"), ("goal", "carry"), ("cancel", "carry"), ("publish", "said")}
    workspace = built_once(supervisor, tmp_path_factory)
    compare(ros1_cpp_target(supervisor, workspace, tmp_path), scenario, seen)
