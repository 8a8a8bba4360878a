"""The generated ROS layers do what the reference layer does, on a real rosmaster and over DDS, step by step."""

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pytest

from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from support import porter, porter_ros1
from support.equivalence.python_targets import observe
from support.equivalence.random_scenarios import LAYER_KINDS, for_layer_node, layer_node_scenario
from support.equivalence.recorded import read_recorded
from support.equivalence.ros1_target import ros1_target
from support.equivalence.ros2_target import ros2_target
from support.equivalence.targets import Target, compare
from support.equivalence.worlds import robot_supervisor
from support.ros1 import missing
from support.steward import LIMITED, REQUESTS, let_through, limited, steward

# test_msgs has the only actions in a package index.
HAS_ROS2 = all(find_spec(name) is not None for name in ("rclpy", "test_msgs"))
ROS1 = [pytest.mark.ros1, pytest.mark.skipif(missing() is not None, reason=str(missing()))]
ROS2 = [pytest.mark.ros2, pytest.mark.skipif(not HAS_ROS2, reason="ROS 2 (rclpy, test_msgs) is not installed")]

MakeTarget = Callable[[Supervisor, Path], Target]


@pytest.mark.parametrize(
    ("target", "robot", "seed", "steps"),
    [
        pytest.param(ros1_target, porter_ros1.porter_supervisor, 3, 200, marks=ROS1),
        pytest.param(ros1_target, porter_ros1.porter_supervisor, 4, 200, marks=ROS1),
        pytest.param(ros2_target, porter.porter_supervisor, 1, 150, marks=ROS2),
        pytest.param(ros2_target, porter.porter_supervisor, 2, 150, marks=ROS2),
    ],
)
def test_every_kind_of_request(
    target: MakeTarget, robot: Callable[[], Supervisor], seed: int, steps: int, tmp_path: Path
) -> None:
    supervisor = robot()
    scenario = layer_node_scenario(supervisor, seed, steps)
    seen = observe(supervisor, scenario)
    assert {kind for item in seen for kind, _, _ in item.issued} >= LAYER_KINDS
    compare(target(supervisor, tmp_path), scenario, seen)


@pytest.mark.parametrize(
    ("target", "on_ros1", "seed"),
    [pytest.param(ros1_target, True, 32, marks=ROS1), pytest.param(ros2_target, False, 6, marks=ROS2)],
)
def test_calls_and_goals_that_share_a_name_and_are_refused(
    target: MakeTarget, on_ros1: bool, seed: int, tmp_path: Path
) -> None:
    """Data decide which request of the model a call or goal is, and if it is let through."""
    supervisor = steward(Deployment.LAYER, on_ros1=on_ros1)
    scenario = layer_node_scenario(supervisor, seed, 180)
    seen = observe(supervisor, scenario)
    assert let_through(seen) == REQUESTS
    assert limited(seen) == LIMITED
    refused = {(kind, name) for item in seen for kind, name, _ in item.issued if kind in ("no answer", "reject")}
    assert refused >= {("no answer", "up"), ("no answer", "far"), ("reject", "long")}
    compare(target(supervisor, tmp_path), scenario, seen)


@pytest.mark.parametrize("target", [pytest.param(ros1_target, marks=ROS1), pytest.param(ros2_target, marks=ROS2)])
def test_a_recorded_run(target: MakeTarget, tmp_path: Path) -> None:
    supervisor = robot_supervisor("line_follower_layer")
    scenario = for_layer_node(supervisor, read_recorded("line_follower_layer"))
    seen = observe(supervisor, scenario)
    assert {kind for item in seen for kind, _, _ in item.issued} == {"publish", "default", "pass", "blocked"}
    compare(target(supervisor, tmp_path), scenario, seen)
