"""The generated ROS 1 layer does what the reference layer does, on a real rosmaster, step by step."""

from pathlib import Path

import pytest

from support.equivalence.python_targets import observe
from support.equivalence.random_scenarios import LAYER_KINDS, for_layer_node, layer_node_scenario
from support.equivalence.recorded import read_recorded
from support.equivalence.ros1_target import ros1_target
from support.equivalence.targets import compare
from support.equivalence.worlds import robot_supervisor
from support.porter_ros1 import porter_supervisor
from support.ros1 import missing

pytestmark = [
    pytest.mark.ros1,
    pytest.mark.skipif(missing() is not None, reason=str(missing())),
]


@pytest.mark.parametrize("seed", [3, 4])
def test_every_kind_of_request(seed: int, tmp_path: Path) -> None:
    supervisor = porter_supervisor()
    scenario = layer_node_scenario(supervisor, seed, 200)
    seen = observe(supervisor, scenario)
    assert {kind for item in seen for kind, _, _ in item.issued} >= LAYER_KINDS
    compare(ros1_target(supervisor, tmp_path), scenario, seen)


def test_a_recorded_run(tmp_path: Path) -> None:
    supervisor = robot_supervisor("line_follower_layer")
    scenario = for_layer_node(supervisor, read_recorded("line_follower_layer"))
    seen = observe(supervisor, scenario)
    assert {kind for item in seen for kind, _, _ in item.issued} == {"publish", "default", "pass", "blocked"}
    compare(ros1_target(supervisor, tmp_path), scenario, seen)
