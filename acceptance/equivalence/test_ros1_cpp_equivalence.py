"""The generated ROS 1 node in C++ does what the reference executor does, on a real rosmaster, step by step."""

from dataclasses import replace
from pathlib import Path

import pytest

from robosc.certification import make_supervisor
from robosc.model.structure import Deployment
from support import porter_ros1
from support.equivalence.python_targets import observe
from support.equivalence.random_scenarios import (
    LAYER_KINDS,
    ODD_MESSAGES,
    for_layer_node,
    for_node,
    layer_node_scenario,
    layer_node_settings,
    node_scenario,
)
from support.equivalence.recorded import read_recorded
from support.equivalence.ros1_target import ros1_cpp_target
from support.equivalence.scenario import Action, Scenario
from support.equivalence.targets import compare
from support.equivalence.worlds import robot_supervisor
from support.generated import example_supervisor
from support.models import bundle_of
from support.ros1_cpp import built_once, missing, supervisor_of
from support.steward import LIMITED, REQUESTS, let_through, limited, steward

pytestmark = [
    pytest.mark.ros1,
    pytest.mark.skipif(missing() is not None, reason=str(missing())),
]

_PLANNERS = """
robot Planners {
    interface get_plan use GetPlan from nav_msgs
    datatype object Search { tolerance: double }
    component Planner {
        service near with identifier: "/plan", request: Search, response: none, when: value.tolerance < 1.0
            links get_plan
        service far with identifier: "/plan", request: Search, response: none links get_plan
    }
}
"""
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


def test_a_layer_with_shared_names_and_limits(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    supervisor = steward(Deployment.LAYER, on_ros1=True)
    scenario = layer_node_scenario(supervisor, 6, 300)
    seen = observe(supervisor, scenario)
    assert let_through(seen) == REQUESTS
    assert limited(seen) == LIMITED
    workspace = built_once(supervisor, tmp_path_factory)
    compare(ros1_cpp_target(supervisor, workspace, tmp_path), scenario, seen)


def test_a_controller_with_shared_names_and_limits(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    supervisor = steward(Deployment.CONTROLLER, on_ros1=True)
    scenario = node_scenario(supervisor, 8, 200)
    seen = observe(supervisor, scenario)
    assert let_through(seen) == REQUESTS
    assert limited(seen) == LIMITED
    workspace = built_once(supervisor, tmp_path_factory)
    compare(ros1_cpp_target(supervisor, workspace, tmp_path), scenario, seen)


def test_calls_of_services_that_share_a_name_wait_beside_each_other(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Each call waits in a thread of roscpp; one more is refused at once."""
    made = make_supervisor(bundle_of(_PLANNERS), deployment=Deployment.LAYER)
    assert made.supervisor is not None, made.reason
    calls = [Action("ask_call", name, {"tolerance": far}) for name, far in (("near", 0.5), ("far", 2.0), ("near", 0.5))]
    replies = [Action("reply", name) for name in ("near", "far")]
    scenario = Scenario((*calls, *replies), layer_node_settings(made.supervisor.model))
    seen = observe(made.supervisor, scenario)
    kinds = [[kind for kind, _, _ in item.issued] for item in seen]
    assert kinds == [[], ["call"], ["call"], ["no answer", "blocked"], ["answer"], ["answer"]]
    workspace = built_once(made.supervisor, tmp_path_factory)
    compare(ros1_cpp_target(made.supervisor, workspace, tmp_path), scenario, seen)
