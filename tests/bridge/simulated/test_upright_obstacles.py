"""Walls and obstacles in the camera's picture, against a twin that follows each pixel's ray to the nearest thing."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from robosc.execution.runtime.clock import ManualClock
from robosc_bridge.skills.line import line_offset
from robosc_bridge.skills.settings import LineSettings
from robosc_simulated import (
    BODIES,
    Mount,
    Noise,
    Obstacle,
    PinholeCamera,
    Scene,
    SceneError,
    Timebase,
    Walls,
    World,
    load_scene,
    maze,
    room,
)
from robosc_simulated.pinhole_camera import DISTANCE
from robosc_simulated.scene import parse_scene
from robosc_simulated.textures import PLAIN, Shades

WALL, FLOOR = 130, PLAIN.shade
# Tolerance of the way to a thing and of its edges: within it, rounding decides.
_NEAR = 1e-7

Ray = tuple[float, float, float]


def pixel_rays(mount: Mount, heading_rad: float) -> Iterator[Ray]:
    """Yield the ray of each pixel, row by row: its direction in the world's x, y and z."""
    focal = mount.width / 2 / math.tan(mount.field_of_view_rad / 2)
    for row in range(mount.height):
        for column in range(mount.width):
            right = (column + 0.5 - mount.width / 2) / focal
            down = (row + 0.5 - mount.height / 2) / focal
            # The camera's axes are turned by the tilt around the left one, and then by the heading around the upright.
            forward = math.cos(mount.tilt_rad) - down * math.sin(mount.tilt_rad)
            up = -math.sin(mount.tilt_rad) - down * math.cos(mount.tilt_rad)
            yield (
                forward * math.cos(heading_rad) + right * math.sin(heading_rad),
                forward * math.sin(heading_rad) - right * math.cos(heading_rad),
                up,
            )


def slow_shade(scene: Scene, eye_m: Ray, ray: Ray, grow_m: float) -> int:
    """Return the first thing that one ray meets, with everything a little larger, or smaller."""
    (x, y, z), (dx, dy, dz) = eye_m, ray
    height = scene.wall_height_m + grow_m
    hits: list[tuple[float, int]] = []
    if dz < -1e-9:
        hits.append((-z / dz, FLOOR))
    for x1, y1, x2, y2 in scene.walls.segments:
        ex, ey = x2 - x1, y2 - y1
        determinant = ex * dy - ey * dx
        if determinant != 0.0:
            t = (ex * (y1 - y) - ey * (x1 - x)) / determinant
            along = (dx * (y1 - y) - dy * (x1 - x)) / determinant
            slack = grow_m / max(math.hypot(ex, ey), 1e-9)
            if t >= 0 and -slack <= along <= 1 + slack and -grow_m <= z + t * dz <= height:
                hits.append((t - _NEAR, WALL))
    for each in scene.obstacles:
        if each.is_there:
            hits += [(t - _NEAR, WALL) for t in slow_disc(each, eye_m, ray, height, grow_m)]
    return min(hits, default=(math.inf, DISTANCE))[1]


def slow_disc(disc: Obstacle, eye_m: Ray, ray: Ray, height: float, grow_m: float) -> Iterator[float]:
    """Yield the places of a ray on an upright cylinder's round side or flat top; at once if it begins within."""
    (x, y, z), (dx, dy, dz) = eye_m, ray
    radius = disc.radius_m + grow_m
    ax, ay = x - disc.x_m, y - disc.y_m
    if math.hypot(ax, ay) <= radius and z <= height:
        yield 0.0
    square, half, rest = dx * dx + dy * dy, ax * dx + ay * dy, ax * ax + ay * ay - radius * radius
    if square > 1e-12 and half * half >= square * rest:
        for sign in (-1, 1):
            t = (-half + sign * math.sqrt(half * half - square * rest)) / square
            if t >= 0 and -grow_m <= z + t * dz <= height:
                yield t
    if abs(dz) > 1e-12:
        t = (height - z) / dz
        if t >= 0 and math.hypot(ax + t * dx, ay + t * dy) <= radius:
            yield t


def require_agreement(scene: Scene, mount: Mount, pose: tuple[float, float, float]) -> Shades:
    picture = PinholeCamera(mount, scene).picture(pose)
    x, y, heading_rad = pose
    eye_m = (x + mount.x_m * math.cos(heading_rad), y + mount.x_m * math.sin(heading_rad), mount.height_m)
    for found, ray in zip(picture.ravel().tolist(), pixel_rays(mount, heading_rad), strict=True):
        expected = {slow_shade(scene, eye_m, ray, grow_m) for grow_m in (-_NEAR, 0.0, _NEAR)}
        assert found in expected, (ray, expected)
    return picture


SIZES = st.floats(-2.0, 2.0, allow_nan=False)
# Also such as are in line with each other, with the camera and with the columns of its picture.
PLACES = st.one_of(SIZES, st.sampled_from([-1.0, -0.5, 0.0, 0.5, 1.0]))
WALLS = st.lists(st.tuples(PLACES, PLACES, PLACES, PLACES), max_size=5)
DISCS = st.lists(st.tuples(PLACES, PLACES, st.floats(0.02, 0.6)), max_size=2)
MOUNTS = st.builds(
    Mount,
    x_m=st.sampled_from([0.0, 0.06]),
    height_m=st.floats(0.05, 1.0),
    tilt_rad=st.one_of(st.floats(0.0, math.pi / 2), st.sampled_from([0.0, math.pi / 4])),
    field_of_view_rad=st.floats(0.3, 2.0),
    width=st.integers(1, 14),
    height=st.integers(1, 11),
)


@given(WALLS, DISCS, MOUNTS, st.floats(0.02, 1.5), PLACES, PLACES, st.one_of(st.floats(-4, 4), st.just(0.0)))
def test_a_picture_is_what_each_ray_meets_first(
    walls: list[tuple[float, float, float, float]],
    discs: list[tuple[float, float, float]],
    mount: Mount,
    height_m: float,
    x_m: float,
    y_m: float,
    heading_rad: float,
) -> None:
    obstacles = tuple(Obstacle(f"disc_{place}", *disc) for place, disc in enumerate(discs))
    scene = Scene("random", Walls(walls), obstacles=obstacles, wall_height_m=height_m)
    eye_x_m, eye_y_m = x_m + mount.x_m * math.cos(heading_rad), y_m + mount.x_m * math.sin(heading_rad)
    # From within a wall, or from beside its edge, rounding decides.
    assume(scene.walls.distance_m(eye_x_m, eye_y_m) > 1e-4)
    for x1, y1, x2, y2 in walls:
        area = abs((x1 - eye_x_m) * (y2 - eye_y_m) - (y1 - eye_y_m) * (x2 - eye_x_m))
        assume(area < 1e-13 or area > 1e-5)
    require_agreement(scene, mount, (x_m, y_m, heading_rad))


@pytest.mark.parametrize("seed", range(3))
def test_a_maze_is_seen_as_by_its_twin(seed: int) -> None:
    scene = Scene("maze", maze(3, 3, seed=seed), wall_height_m=0.1 + 0.1 * seed)
    mount = replace(Mount(), width=40, height=30, tilt_rad=0.3)
    shown = require_agreement(scene, mount, (0.1 * seed, 0.05, 0.7 * seed))
    assert {WALL, FLOOR} <= set(shown.ravel().tolist())


LEVEL = Mount(x_m=0.0, height_m=0.2, tilt_rad=0.0, field_of_view_rad=math.pi / 2, width=100, height=100)


def test_a_wall_ahead_has_its_foot_and_its_top_by_hand() -> None:
    """A focal length of 50 pixels: 0.2 m down at 1 m is 10 pixels below the middle, 0.3 m up are 15 above."""
    scene = Scene("wall", Walls([(1.0, -0.5, 1.0, 0.5)]), wall_height_m=0.5)
    picture = PinholeCamera(LEVEL, scene).picture((0.0, 0.0, 0.0))
    rows, columns = np.nonzero(picture == WALL)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (35, 59, 25, 74)
    assert len(rows) == 25 * 50
    assert (picture[:35] == DISTANCE).all()
    assert (picture[60:] == FLOOR).all()
    # From behind, and turned away.
    assert (PinholeCamera(LEVEL, scene).picture((2.0, 0.0, math.pi)) == picture).all()
    assert not (PinholeCamera(LEVEL, scene).picture((0.0, 0.0, math.pi)) == WALL).any()


def test_who_looks_over_a_low_wall_sees_the_floor_behind_it() -> None:
    scene = Scene("wall", Walls([(1.0, -3.0, 1.0, 3.0)]), wall_height_m=0.1)
    column = PinholeCamera(LEVEL, scene).picture((0.0, 0.0, 0.0))[:, 50].tolist()
    assert column == [DISTANCE] * 50 + [FLOOR] * 5 + [WALL] * 5 + [FLOOR] * 40


def test_who_stands_in_line_with_a_wall_sees_none_of_its_sides() -> None:
    scene = Scene("edge", Walls([(1.0, 0.0, 2.0, 0.0), (3.0, 3.0, 3.0, 3.0)]))
    assert not (PinholeCamera(LEVEL, scene).picture((0.0, 0.0, 0.0)) == WALL).any()


def test_obstacles_are_seen_as_they_are_now() -> None:
    scene = replace(load_scene("line-oval"), start=(0.0, 0.0, 0.0))
    camera = PinholeCamera(Mount(), scene)
    world = World(BODIES["burger"], scene, Timebase(ManualClock()))
    assert not (camera.picture(world.pose, world.obstacles) == WALL).any()
    world.move_obstacle("box", 0.5, 0.0)
    picture = camera.picture(world.pose, world.obstacles)
    # It hides the line behind it, and not the one before it.
    assert (picture[:30, 80] == WALL).all()
    assert (picture[60:, 80] == 30).all()
    world.put_obstacle("box", False)
    assert not (camera.picture(world.pose, world.obstacles) == WALL).any()


def test_no_wall_is_taken_for_a_line() -> None:
    """From so near that it fills the picture, and in pieces that would be as wide as a line."""
    post = [(0.3, -0.02, 0.3, 0.02), (0.5, 0.2, 0.5, 0.23)]
    scene = Scene("room", Walls((*room(1.2, 1.0).segments, *post)), noise=Noise(camera_shades=6.0))
    camera = PinholeCamera(Mount(), scene, 1)
    seen = 0
    for turn in range(36):
        picture = camera.picture((0.0, 0.0, math.tau * turn / 36))
        seen += bool((abs(picture.astype(int) - WALL) < 15).mean() > 0.05)
        assert line_offset(picture, LineSettings()) is None
    assert seen > 30


@pytest.mark.parametrize("name", ["line-curves", "line-oval"])
def test_walls_beside_a_line_do_not_change_where_it_is_seen(name: str) -> None:
    scene = load_scene(name)
    assert scene.line is not None
    points = scene.line.points
    eyes = [PinholeCamera(Mount(), replace(scene, walls=walls)) for walls in (scene.walls, Walls(()))]
    for place in range(0, len(points) - 30, 60):
        (x_m, y_m), (next_x_m, next_y_m) = points[place], points[place + 2]
        pose = (x_m, y_m, math.atan2(next_y_m - y_m, next_x_m - x_m))
        found = [line_offset(camera.picture(pose), LineSettings()) for camera in eyes]
        assert found[0] is not None
        assert found[0] == pytest.approx(found[1], abs=0.02)


def test_height_and_shade_are_what_a_file_says() -> None:
    def parsed(text: str) -> Scene:
        return parse_scene(text.encode(), "a", "a.yaml")

    assert (parsed("").wall_height_m, parsed("").wall_shade) == (0.3, WALL)
    scene = parsed("walls: {segments: [[1, -1, 1, 1]], height_m: 0.5, shade: 90}")
    assert (scene.wall_height_m, scene.wall_shade) == (0.5, 90)
    assert (PinholeCamera(LEVEL, scene).picture((0.0, 0.0, 0.0))[:, 50] == 90).sum() == 25
    for text, problem in (
        ("walls: {height_m: 0}", r"a.yaml:1: walls.height_m: is 0; it must be a number from 0.01 to 10"),
        ("walls: {height_m: .nan}", r"walls.height_m"),
        ("walls: {shade: 256}", r"a.yaml:1: walls.shade: is 256; it must be a whole number from 0 to 255"),
    ):
        with pytest.raises(SceneError, match=problem):
            parsed(text)
