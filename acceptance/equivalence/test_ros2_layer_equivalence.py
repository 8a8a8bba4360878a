"""The generated ROS 2 layer does what the reference layer does, over DDS, step by step."""

from pathlib import Path

import pytest

from support.equivalence.python_targets import observe
from support.equivalence.random_scenarios import LAYER_KINDS, for_layer_node, layer_node_scenario
from support.equivalence.recorded import read_recorded
from support.equivalence.ros2_target import ros2_target
from support.equivalence.targets import compare
from support.equivalence.worlds import robot_supervisor
from support.porter import porter_supervisor

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
pytest.importorskip("test_msgs", reason="test_msgs, with the only actions in a package index, is not installed")

pytestmark = pytest.mark.ros2


@pytest.mark.parametrize("seed", [1, 2])
def test_every_kind_of_request(seed: int, tmp_path: Path) -> None:
    supervisor = porter_supervisor()
    scenario = layer_node_scenario(supervisor, seed, 150)
    seen = observe(supervisor, scenario)
    assert {kind for item in seen for kind, _, _ in item.issued} >= LAYER_KINDS
    compare(ros2_target(supervisor, tmp_path), scenario, seen)


def test_a_recorded_run(tmp_path: Path) -> None:
    supervisor = robot_supervisor("line_follower_layer")
    scenario = for_layer_node(supervisor, read_recorded("line_follower_layer"))
    seen = observe(supervisor, scenario)
    assert {kind for item in seen for kind, _, _ in item.issued} == {"publish", "default", "pass", "blocked"}
    compare(ros2_target(supervisor, tmp_path), scenario, seen)
