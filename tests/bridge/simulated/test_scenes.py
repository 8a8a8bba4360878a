"""Scenes from files: what they say is what is there; mistakes are reported in one sentence with their place."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc_simulated import Goal, Noise, Obstacle, Scene, SceneError, load_scene, maze_scene, scene_names, spline
from robosc_simulated.scene import parse_scene
from robosc_simulated.scene_file import (
    FloorPart,
    GoalPart,
    LinePart,
    MazePart,
    NoisePart,
    ObstaclePart,
    PosePart,
    WallsPart,
)
from robosc_simulated.textures import Texture
from support.effort import examples

WHOLE = """\
walls:
  segments: [[0, 0, 1, 0]]
  polylines: [[[0, 0], [0, 1], [1, 1]]]
  rectangles: [[-1, -2, 3, 4]]
start: {x_m: 0.5, y_m: 0.25, heading_deg: 90}
goal: {x_m: 2, y_m: 1.5, radius_m: 0.3}
line: {points: [[0, 0], [1, 0]], width_m: 0.04, shade: 10}
floor: {texture: checkerboard, shade: 220, other_shade: 180, size_m: 0.1}
obstacles:
  box: {x_m: 1, y_m: 0.5, radius_m: 0.1}
  ball-2: {x_m: 0, y_m: 0, radius_m: 0.05, is_there: false}
noise: {slip_share: 0.02, slip_deviation: 0.01, encoder_deviation: 0.005, lidar_m: 0.01, camera_shades: 4}
"""


def parsed(text: str, seed: int = 0) -> Scene:
    return parse_scene(text.encode(), "a", "a.yaml", seed)


def test_everything_that_a_file_says_is_there(tmp_path: Path) -> None:
    path = tmp_path / "yard.yaml"
    path.write_text(WHOLE)
    scene = load_scene(path)
    assert scene.name == "yard"
    assert scene.walls.segments == (
        (0, 0, 1, 0),
        (0, 0, 0, 1), (0, 1, 1, 1),
        (-1, -2, 2, -2), (2, -2, 2, 2), (2, 2, -1, 2), (-1, 2, -1, -2),
    )  # fmt: skip
    assert scene.start == pytest.approx((0.5, 0.25, math.pi / 2))
    assert scene.goal == Goal(2, 1.5, 0.3)
    assert scene.line is not None
    assert (scene.line.points, scene.line.width_m, scene.line.shade) == (((0, 0), (1, 0)), 0.04, 10)
    assert scene.floor == Texture("checkerboard", 220, 180, 0.1)
    assert scene.obstacles == (Obstacle("box", 1, 0.5, 0.1), Obstacle("ball-2", 0, 0, 0.05, False))
    assert scene.noise == Noise(0.02, 0.01, 0.005, 0.01, 4)
    assert load_scene(str(path)).goal == scene.goal


def test_an_empty_file_is_open_space(tmp_path: Path) -> None:
    path = tmp_path / "nothing.yaml"
    path.write_text("")
    scene = load_scene(path)
    assert (scene.walls.segments, scene.line, scene.goal, scene.start) == ((), None, None, (0, 0, 0))


def test_the_scenes_of_the_package() -> None:
    assert scene_names() == ("line-curves", "line-oval", "maze-random", "maze-rooms", "maze-spiral", "room", "rooms")
    for name in scene_names():
        scene = load_scene(name)
        assert scene.name == name
        assert scene.walls.distance_m(*scene.start[:2]) > 0.2
        if name.startswith("maze"):
            assert scene.goal is not None
            assert not scene.goal.is_reached(*scene.start[:2])
        if name.startswith("line"):
            assert scene.line is not None
            assert scene.line.distance_m(*scene.start[:2]) < 0.001
            # It begins along the line.
            assert scene.line.distance_m(scene.start[0] + 0.2, scene.start[1]) < 0.05
            assert min(scene.walls.distance_m(*point) for point in scene.line.points) > 0.15


def test_a_maze_by_chance_is_another_one_for_each_seed() -> None:
    first, same, other = (load_scene("maze-random", seed).walls.segments for seed in (1, 1, 2))
    assert first == same != other
    fixed = "maze: {columns: 3, rows: 3, seed: 5}"
    assert parsed(fixed, 1).walls.segments == parsed(fixed, 2).walls.segments


def test_who_turns_round_the_mouth_of_the_spiral_is_at_its_goal() -> None:
    goal = load_scene("maze-spiral").goal
    assert goal is not None
    assert goal.is_reached(1.8, 2.7)
    assert goal.is_reached(2.2, 2.7)
    assert not goal.is_reached(2.0, 2.5)


@settings(max_examples=examples(15))
@given(st.integers(1, 6), st.integers(1, 6), st.integers(0, 1000))
def test_a_maze_has_one_exit_and_its_goal_is_outside(columns: int, rows: int, seed: int) -> None:
    scene = maze_scene(columns, rows, seed=seed)
    goal = scene.goal
    assert goal is not None
    closed = sum(math.dist(wall[:2], wall[2:]) for wall in scene.walls.segments)
    # The length of all walls of a tree's maze less the gap.
    assert closed == pytest.approx(columns * (rows + 1) + rows * (columns + 1) - (columns * rows - 1) - 1)
    assert goal.y_m - goal.radius_m > rows - 0.5
    # A robot 0.3 m from the corner of the way out turns around it.
    assert all(goal.is_reached(goal.x_m + aside_m, rows - 0.5 + 0.2) for aside_m in (-0.2, 0.2))
    inside = scene.walls.cast(np.array([(goal.x_m, goal.y_m)]), np.array([(0.0, -1.0)]))
    assert inside[0] > 0.9


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("wals: {}", "a.yaml:1: wals: there is no such key; did you mean 'walls'?"),
        ("goal: {x_m: 1, y_m: 2}", "a.yaml:1: goal: 'radius_m' is missing"),
        ("start:\n  x_m: far", 'a.yaml:2: start.x_m: is "far"; it must be a number from -1000 to 1000'),
        ("start: {x_m: .inf}", "it must be a number"),
        ("start: {x_m: 1e400}", "too large a number"),
        ("walls: {segments: [[0, 0, 1]]}", "walls.segments[0]: has 3 numbers; it must be [x1, y1, x2, y2]"),
        ("walls: {polylines: [[[0, 0]]]}", "walls.polylines[0]: has fewer than two points"),
        ("walls: {polylines: [[[0, 0], [1]]]}", "walls.polylines[0][1]: has 1 numbers; it must be [x, y]"),
        ("walls: {rectangles: [[0, 0, 1, 0]]}", "walls.rectangles[0]: the width and the height"),
        ("maze: {columns: 31, rows: 2}", "maze.columns: is 31; it must be a whole number from 1 to 30"),
        ("line: {points: []}", "line.points: has fewer than two points"),
        ("line: {points: [[0, 0], [900, 900]]}", "line: the line on the floor is spread over"),
        ("line: {kind: spline, points: [[0, 0], [0, 0], [1, 0]]}", "line: point 2 of the spline is the same"),
        ("line: {kind: curve, points: [[0, 0], [1, 0]]}", "line.kind: "),
        ("floor: {texture: grass}", 'floor.texture: is "grass"; it must be one of plain, tiles'),
        ("obstacles: {Box!: {x_m: 0, y_m: 0, radius_m: 1}}", 'obstacles["Box!"]'),
        ("obstacles: {box: {x_m: 0, y_m: 0, radius_m: -1}}", "obstacles.box.radius_m: is -1"),
        ("noise: {slip_share: 2}", "noise.slip_share: is 2"),
        ("walls: [", "is not YAML"),
        ("start: &a {x_m: 1}", "aliases and anchors are not allowed"),
        ("start: !!python/object/apply:os.system [ls]", "tags are not allowed"),
        ("- 1", "must be a mapping"),
        ("x: " + "[" * 40 + "]" * 40, "nested deeper"),
    ],
)
def test_what_is_wrong_is_reported_in_one_sentence_with_its_place(text: str, problem: str) -> None:
    with pytest.raises(SceneError) as caught:
        parsed(text)
    assert problem in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_is_no_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="there is no scene and no file 'maze-spirral'; there are line-curves"):
        load_scene("maze-spirral")
    with pytest.raises(SceneError, match="is not a regular file"):
        load_scene(tmp_path)
    large = tmp_path / "large.yaml"
    large.write_text("#" * 300_000)
    with pytest.raises(SceneError, match="is larger than"):
        load_scene(large)


def test_the_most_that_a_file_may_say_is_soon_read() -> None:
    zigzag = ", ".join(f"[{x % 2 * 10}, {x / 100}]" for x in range(100))
    with pytest.raises(SceneError, match="long"):
        parsed(f"line: {{points: [{', '.join(['[0, 0], [20, 20]'] * 400)}]}}")
    parsed(f"line: {{points: [{zigzag}]}}")
    # The widest line, through as many points as a list may have, all over the place where it may be.
    rows = [(column, row / 2) for row in range(40) for column in (range(23) if row % 2 else range(22, -1, -1))]
    meander = ", ".join(f"[{x_m * 0.99:.2f}, {y_m}]" for x_m, y_m in rows)
    for kind in ("straight", "spline"):
        line = parsed(f"line: {{kind: {kind}, width_m: 1, points: [{meander}]}}").line
        assert line is not None
        assert line.is_line(np.array([(5.0, 5.25), (-0.9, 5.0)])).tolist() == [True, False]
    walls = ", ".join(f"[0, {y}, 1, {y}]" for y in range(1000))
    assert len(parsed(f"walls: {{segments: [{walls}]}}").walls.segments) == 1000
    parsed("maze: {columns: 30, rows: 30}")
    with pytest.raises(SceneError, match="there may be 5000"):
        lines = ", ".join("[" + ", ".join(f"[{x % 7}, {x % 5}]" for x in range(900)) + "]" for _ in range(6))
        parsed(f"walls: {{polylines: [{lines}]}}")


def test_a_spline_goes_through_its_points_and_has_no_corners() -> None:
    points = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)]
    curve = np.array(spline(points))
    for point in points:
        assert np.hypot(*(curve - point).T).min() < 1e-9
    steps = np.diff(curve, axis=0)
    assert np.hypot(*steps.T).max() < 0.06
    turns = np.angle(np.exp(1j * np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])))))
    assert np.abs(turns).max() < 0.2
    # Also where it closes.
    ends = np.arctan2(steps[[0, -1], 1], steps[[0, -1], 0])
    assert abs(math.remainder(ends[0] - ends[1], math.tau)) < 0.2
    assert spline([(0.0, 0.0), (1.0, 0.0)])[-1] == (1.0, 0.0)
    with pytest.raises(ValueError, match="three points"):
        spline([(0.0, 0.0), (1.0, 0.0), (0.0, 0.0)])


POINTS = np.array([(0.05, 0.05), (0.15, 0.05), (0.15, 0.15), (-0.05, 0.05), (0.001, 0.05), (123.456, -98.7)])


def test_textures_are_what_they_are_called() -> None:
    assert set(Texture("plain", 210).shades(POINTS).tolist()) == {210}
    board = Texture("checkerboard", 220, 180, 0.1).shades(POINTS)
    assert board[:5].tolist() == [220, 180, 220, 180, 220]
    tiles = Texture("tiles", 200, 90, 0.1, 0.01).shades(POINTS)
    assert tiles[:5].tolist() == [200, 200, 200, 200, 90]


def test_speckle_takes_any_seed() -> None:
    far = Texture("speckle", 200, 100, 0.1, seed=10**15).shades(POINTS)
    assert (far == Texture("speckle", 200, 100, 0.1, seed=10**15).shades(POINTS)).all()
    assert (far != Texture("speckle", 200, 100, 0.1, seed=-1).shades(POINTS)).any()


def test_speckle_is_random_within_its_shades_and_the_same_for_the_same_seed() -> None:
    grid = (
        np.stack(np.meshgrid(np.arange(-50, 50), np.arange(-50, 50)), axis=-1).reshape(-1, 2).astype(np.float64) * 0.01
        + 0.005
    )
    first, same, other = (Texture("speckle", 200, 100, 0.01, seed=seed).shades(grid) for seed in (1, 1, 2))
    assert (first == same).all()
    assert (first != other).mean() > 0.9
    assert [int(first.min()), int(first.max())] == [100, 200]
    assert first.mean() == pytest.approx(150, abs=2)
    rows = first.reshape(100, 100).astype(float)
    assert abs(np.corrcoef(rows[:, :-1].ravel(), rows[:, 1:].ravel())[0, 1]) < 0.05


PAGE = Path(__file__).parents[3] / "docs" / "twin.md"


def test_the_scene_on_the_page_can_be_read() -> None:
    (text,) = re.findall(r"```yaml\n(.*?)```", PAGE.read_text(), re.DOTALL)
    scene = parsed(text)
    assert scene.goal is not None
    assert scene.line is not None
    assert [obstacle.name for obstacle in scene.obstacles] == ["box"]


def test_the_page_lists_every_key() -> None:
    page = PAGE.read_text()
    for name, section in (
        ("walls", WallsPart), ("maze", MazePart), ("start", PosePart), ("goal", GoalPart), ("line", LinePart),
        ("floor", FloorPart), ("noise", NoisePart),
    ):  # fmt: skip
        for key in section.__struct_fields__:
            assert f"`{name}.{key}`" in page
    for key in ObstaclePart.__struct_fields__:
        assert f".{key}`" in page
    for name in scene_names():
        assert f"`{name}`" in page
