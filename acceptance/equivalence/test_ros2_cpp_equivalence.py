"""The generated ROS 2 node in C++, on a stand-in for rclcpp, does what the reference executor does, step by step."""

import math
from pathlib import Path
from random import Random

import pytest

from robosc.model.structure import Deployment
from support import porter
from support.equivalence.python_targets import observe
from support.equivalence.random_scenarios import (
    LAYER_KINDS,
    for_layer_node,
    for_node,
    layer_node_scenario,
    node_scenario,
)
from support.equivalence.rclcpp_target import rclcpp_target
from support.equivalence.recorded import read_recorded
from support.equivalence.scenario import Action, Scenario
from support.equivalence.targets import compare
from support.equivalence.worlds import robot_supervisor
from support.generated import example_supervisor
from support.rclcpp_nodes import SANITIZERS, compiled_once, courier, missing
from support.steward import LIMITED, REQUESTS, let_through, limited, steward

PACKAGES = ("geometry_msgs", "sensor_msgs", "std_srvs", "test_msgs")
pytestmark = pytest.mark.skipif(missing(*PACKAGES) is not None, reason=str(missing(*PACKAGES)))


# The navigation example asks for interfaces that no package index has.
@pytest.mark.parametrize("robot", ["line_follower", "maze_solver", "object_finder", "ball_pusher", "person_follower"])
def test_a_recorded_run(robot: str, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    supervisor = example_supervisor(f"{robot}/{robot}")
    scenario = for_node(supervisor, read_recorded(robot))
    program = compiled_once(supervisor, tmp_path_factory)
    compare(rclcpp_target(supervisor, program, tmp_path), scenario, observe(supervisor, scenario))


def test_scans_of_all_lengths_with_numbers_that_are_none(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    supervisor = example_supervisor("maze_solver/maze_solver")
    dice = Random(1)
    actions = [_scan(dice) if dice.random() < 0.7 else Action("message", "/rotate_done") for _ in range(400)]
    scenario = Scenario(tuple(actions), for_node(supervisor, Scenario(())).settings)
    program = compiled_once(supervisor, tmp_path_factory)
    seen = observe(supervisor, scenario)
    assert sum(bool(item.issued) for item in seen) > 100
    compare(rclcpp_target(supervisor, program, tmp_path), scenario, seen)


def _scan(dice: Random) -> Action:
    distances = [dice.choice([0.25, 0.5, 0.75, 1.5, 3.0]) for _ in range(dice.choice([0, 1, 271, 360, 360, 360, 400]))]
    for _ in range(dice.choice([0, 0, 3])):
        if distances:
            distances[dice.randrange(len(distances))] = dice.choice([math.nan, math.inf, -1.0])
    return Action("message", "/scan", {"ranges": distances})


@pytest.mark.parametrize("seed", [1, 2])
def test_a_layer(seed: int, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    supervisor = porter.porter_supervisor()
    scenario = layer_node_scenario(supervisor, seed, 150)
    seen = observe(supervisor, scenario)
    assert {kind for item in seen for kind, _, _ in item.issued} >= LAYER_KINDS
    program = compiled_once(supervisor, tmp_path_factory, *SANITIZERS)
    compare(rclcpp_target(supervisor, program, tmp_path), scenario, seen)


def test_a_recorded_run_of_a_layer(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    supervisor = robot_supervisor("line_follower_layer")
    scenario = for_layer_node(supervisor, read_recorded("line_follower_layer"))
    program = compiled_once(supervisor, tmp_path_factory)
    compare(rclcpp_target(supervisor, program, tmp_path), scenario, observe(supervisor, scenario))


def test_services_and_actions(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    supervisor = courier()
    scenario = node_scenario(supervisor, 1, 200)
    seen = observe(supervisor, scenario)
    asked = {(kind, name) for item in seen for kind, name, _ in item.issued}
    assert asked >= {("call", "power"), ("call", "wind"), ("goal", "count"), ("goal", "reach"), ("cancel", "count")}
    program = compiled_once(supervisor, tmp_path_factory, *SANITIZERS)
    compare(rclcpp_target(supervisor, program, tmp_path), scenario, seen)


def test_a_layer_with_shared_names_and_limits(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    supervisor = steward(Deployment.LAYER)
    scenario = layer_node_scenario(supervisor, 6, 300)
    seen = observe(supervisor, scenario)
    assert let_through(seen) == REQUESTS
    assert limited(seen) == LIMITED
    program = compiled_once(supervisor, tmp_path_factory)
    compare(rclcpp_target(supervisor, program, tmp_path), scenario, seen)


def test_a_controller_with_shared_names_and_limits(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    supervisor = steward(Deployment.CONTROLLER)
    scenario = node_scenario(supervisor, 8, 200)
    seen = observe(supervisor, scenario)
    assert let_through(seen) == REQUESTS
    assert limited(seen) == LIMITED
    program = compiled_once(supervisor, tmp_path_factory)
    compare(rclcpp_target(supervisor, program, tmp_path), scenario, seen)
