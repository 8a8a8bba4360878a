"""Tests of the surroundings of a robot, as its odometry sees them."""

import json
import math
from pathlib import Path

import pytest

from robosc_simulated import World, load_scene
from robosc_simulated.robots import BODIES
from robosc_simulated.timebase import Timebase
from robosc_view.scene_map import scene_map
from robosc_view.sources import ViewError

SCENE = """
start: {x_m: 1.0, y_m: 2.0, heading_deg: 90}
walls: {segments: [[1.0, 3.0, 2.0, 3.0]]}
line: {points: [[1.0, 2.0], [1.0, 2.5]]}
"""


def test_walls_and_line_are_seen_from_where_the_robot_began(tmp_path: Path) -> None:
    file = tmp_path / "place.yaml"
    file.write_text(SCENE)
    # The wall is a metre ahead, and goes to the right.
    assert scene_map(str(file)) == {"walls": [[1.0, 0.0, 1.0, -1.0]], "line": [[0.0, 0.0], [0.5, 0.0]]}


@pytest.mark.parametrize("name", ["maze-random", "line-curves"])
def test_distances_are_those_of_the_simulator(name: str) -> None:
    scene = load_scene(name, 3)
    result = scene_map(name, 3)
    assert result is not None
    json.dumps(result, allow_nan=False)
    world = World(BODIES["burger"], scene.walls, Timebase(), scene.start)
    nearest_m = min(math.dist((0, 0), (x1, y1)) for x1, y1, _, _ in result["walls"])
    begin_x_m, begin_y_m, _ = scene.start
    assert nearest_m == pytest.approx(
        min(math.dist((begin_x_m, begin_y_m), segment[:2]) for segment in world.walls.segments), abs=1e-3
    )


def test_without_a_scene_there_is_no_map() -> None:
    assert scene_map(None) is None


def test_a_scene_that_is_not_there_is_reported() -> None:
    with pytest.raises(ViewError, match="the scene: there is no scene and no file 'nowhere'"):
        scene_map("nowhere")
