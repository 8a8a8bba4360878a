"""Generated ROS 2 nodes under Kilted, the distribution after Jazzy, do what the reference does, over DDS.

What talks to them is under Jazzy. More of a node is tried under both in acceptance/end_to_end/test_ros2_node.py and
test_ros2_lifecycle.py.
"""

import subprocess
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
from support.other_rclpy import distribution_command
from support.rclcpp_nodes import COURIER

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
pytest.importorskip("test_msgs", reason="test_msgs, with the only actions in a package index, is not installed")

# The first run makes an environment.
pytestmark = [pytest.mark.ros2, pytest.mark.timeout(1500)]


@pytest.fixture(scope="module")
def kilted() -> list[str]:
    return distribution_command("kilted")


def test_it_is_the_rclpy_of_kilted(kilted: list[str]) -> None:
    program = "import importlib.metadata, rclpy; print(importlib.metadata.version('ros-rclpy'), rclpy.__file__)"
    done = subprocess.run([*kilted, "-c", program], capture_output=True, text=True, check=True)
    version, file = done.stdout.split()
    assert version.startswith("9.")
    assert Path(kilted[-1]).parents[1] in Path(file).parents


@pytest.mark.parametrize("robot", ["maze_solver", "line_follower_layer"])
def test_a_recorded_run(robot: str, kilted: list[str], tmp_path: Path) -> None:
    supervisor = robot_supervisor(robot)
    bounded = for_layer_node if supervisor.deployment is Deployment.LAYER else for_node
    scenario = bounded(supervisor, read_recorded(robot))
    compare(ros2_target(supervisor, tmp_path, kilted), scenario, observe(supervisor, scenario))


def test_services_and_actions(kilted: list[str], tmp_path: Path) -> None:
    supervisor = make_supervisor(load_bundle(COURIER)).supervisor
    assert supervisor is not None
    scenario = node_scenario(supervisor, 1, 100)
    compare(ros2_target(supervisor, tmp_path, kilted), scenario, observe(supervisor, scenario))
