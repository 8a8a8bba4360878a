"""Generated ROS 2 nodes under other Pythons do what the reference does, over DDS: with the rclpy of Jazzy.

The files alone are tried in tests/robosc/targets/test_python_versions.py.
"""

from pathlib import Path

import pytest

from robosc.certification import make_supervisor
from robosc.language import load_bundle
from robosc.model.structure import Deployment
from support.equivalence.python_targets import observe
from support.equivalence.random_scenarios import for_layer_node, for_node, node_scenario
from support.equivalence.recorded import read_recorded
from support.equivalence.ros2_target import ros2_target
from support.equivalence.targets import compare
from support.equivalence.worlds import robot_supervisor
from support.other_rclpy import rclpy_command
from support.rclcpp_nodes import COURIER

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
pytest.importorskip("test_msgs", reason="test_msgs, with the only actions in a package index, is not installed")

# The first run makes an environment for each Python.
pytestmark = [pytest.mark.ros2, pytest.mark.timeout(1500)]

MINORS = (10, 13)
"""Python of Humble and of Ubuntu 22.04, and the newest one that there is an rclpy for."""


@pytest.mark.parametrize("minor", MINORS)
@pytest.mark.parametrize("robot", ["maze_solver", "line_follower_layer"])
def test_a_recorded_run(robot: str, minor: int, tmp_path: Path) -> None:
    supervisor = robot_supervisor(robot)
    bounded = for_layer_node if supervisor.deployment is Deployment.LAYER else for_node
    scenario = bounded(supervisor, read_recorded(robot))
    compare(ros2_target(supervisor, tmp_path, rclpy_command(minor)), scenario, observe(supervisor, scenario))


@pytest.mark.parametrize("minor", MINORS)
def test_services_and_actions(minor: int, tmp_path: Path) -> None:
    supervisor = make_supervisor(load_bundle(COURIER)).supervisor
    assert supervisor is not None
    scenario = node_scenario(supervisor, 1, 100)
    compare(ros2_target(supervisor, tmp_path, rclpy_command(minor)), scenario, observe(supervisor, scenario))
