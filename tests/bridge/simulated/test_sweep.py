"""A whole revolution of the laser against the same rays one by one, among any walls and round things."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.execution.runtime.clock import ManualClock
from robosc_simulated import BODIES, Timebase, Walls, World, load_scene, maze, maze_scene, room
from robosc_simulated.discs import Discs
from robosc_simulated.sweep import BEAMS, Sweep
from robosc_simulated.walls import Floats
from support.effort import examples

NOTHING = Discs(())
_DEGREES = np.radians(np.arange(float(BEAMS)))
# So far a ray may be turned where it passes the very end of something; rounding decides there.
_TURN_RAD = 1e-10
# Nearer to a wall, or nearly in line with one (square metres), there is no such bound.
_NEAR_M, _NEARLY = 1e-4, 1e-6


def one_by_one(walls: Walls, discs: Discs, place: tuple[float, float], angles_rad: Floats) -> Floats:
    directions = np.stack((np.cos(angles_rad), np.sin(angles_rad)), axis=1)
    origins = np.broadcast_to(np.array(place), directions.shape)
    return np.minimum(walls.cast(origins, directions), discs.cast(origins, directions))


def require_agreement(walls: Walls, discs: Discs, x_m: float, y_m: float, heading_rad: float) -> Floats:
    found = Sweep(walls).lengths_m(x_m, y_m, heading_rad, discs)
    assert found.shape == (BEAMS,)
    assert (found >= 0.0).all()
    rays = heading_rad + _DEGREES
    around = [one_by_one(walls, discs, (x_m, y_m), rays + turn) for turn in (-_TURN_RAD, 0.0, _TURN_RAD)]
    shortest, longest = np.minimum.reduce(around), np.maximum.reduce(around)
    # Change of a ray's length with its direction, on the most slanted of the walls.
    slants = [apart / seen for apart, seen in _seen(walls, x_m, y_m) if seen > _NEARLY]
    seen_m = np.where(np.isinf(found), 0.0, found)
    slack_m = 1e-9 + (1e-9 + 2 * _TURN_RAD * max(slants, default=0.0) * seen_m) * seen_m
    is_right = (found >= shortest - slack_m) & (found <= longest + slack_m)
    assert is_right.all(), [(int(ray), found[ray], shortest[ray], longest[ray]) for ray in np.flatnonzero(~is_right)]
    return found


def _seen(walls: Walls, x_m: float, y_m: float) -> list[tuple[float, float]]:
    """The length of each wall, and twice the area between it and a point."""
    return [
        (math.dist((x1, y1), (x2, y2)), abs((x1 - x_m) * (y2 - y_m) - (y1 - y_m) * (x2 - x_m)))
        for x1, y1, x2, y2 in walls.segments
    ]


def is_apart(walls: Walls, discs: Discs, x_m: float, y_m: float) -> bool:
    if any(1e-13 < seen < _NEARLY for _, seen in _seen(walls, x_m, y_m)):
        return False
    return walls.distance_m(x_m, y_m) > _NEAR_M and abs(discs.nearest(x_m, y_m)[0]) > _NEAR_M


SIZES = st.floats(-5.0, 5.0, allow_nan=False)
# On a grid, walls meet, lie on each other and are in line with each other, with the laser and with its rays.
PLACES = st.one_of(SIZES, st.integers(-3, 3).map(float))
WALLS = st.lists(st.tuples(PLACES, PLACES, PLACES, PLACES), max_size=12)
DISCS = st.lists(st.tuples(PLACES, PLACES, st.floats(0.005, 4.0)), max_size=3)
HEADINGS = st.one_of(st.floats(-10.0, 10.0), st.integers(-8, 8).map(lambda eighths: eighths * math.pi / 4))


@settings(max_examples=examples(60))
@given(WALLS, DISCS, PLACES, PLACES, HEADINGS)
def test_a_turn_is_its_rays(
    segments: list[tuple[float, float, float, float]],
    discs: list[tuple[float, float, float]],
    x_m: float,
    y_m: float,
    heading_rad: float,
) -> None:
    walls, seen = Walls(segments), Discs(discs)
    if is_apart(walls, seen, x_m, y_m):
        require_agreement(walls, seen, x_m, y_m, heading_rad)
    else:
        found = Sweep(walls).lengths_m(x_m, y_m, heading_rad, seen)
        assert (found >= 0.0).all()


@given(st.integers(1, 7), st.integers(1, 7), st.integers(0, 99), SIZES, SIZES, HEADINGS)
def test_a_turn_in_a_maze_is_its_rays(
    columns: int, rows: int, seed: int, x_m: float, y_m: float, heading_rad: float
) -> None:
    walls = maze(columns, rows, seed=seed)
    if is_apart(walls, NOTHING, x_m, y_m):
        require_agreement(walls, NOTHING, x_m, y_m, heading_rad)


@given(st.integers(1, 6), st.integers(0, 99), st.integers(0, 5), st.integers(0, 5), HEADINGS)
def test_no_ray_leaves_a_closed_maze_where_its_walls_meet(
    size: int, seed: int, column: int, row: int, heading_rad: float
) -> None:
    """Seen from the middle of a cell, corners are in whole degrees."""
    found = Sweep(maze(size, size, seed=seed)).lengths_m(column % size, row % size, heading_rad, NOTHING)
    assert found.max() < size * math.sqrt(2)


@pytest.mark.parametrize("aside_m", [1e-3, 1e-6, 1e-9])
def test_a_laser_close_to_a_wall_sees_it_on_half_of_its_turn(aside_m: float) -> None:
    found = Sweep(Walls([(-1.0, 0.0, 1.0, 0.0)])).lengths_m(0.0, aside_m, math.pi / 4, NOTHING)
    # 45 degrees to the left of the x axis is straight ahead: the wall is from 135 to 315.
    assert np.isinf(found[:135]).all()
    assert np.isinf(found[316:]).all()
    assert found[225] == pytest.approx(aside_m)
    assert np.isfinite(found[137:314]).all()


def test_who_is_on_a_wall_sees_nothing_else() -> None:
    walls = Walls([(-1.0, -1.0, 2.0, 2.0), (3.0, -1.0, 3.0, 1.0)])
    for place in ((0.5, 0.5), (-1.0, -1.0), (2.0, 2.0)):
        assert (Sweep(walls).lengths_m(*place, 0.3, Discs([(1.0, 0.0, 0.2)])) == 0.0).all()


@pytest.mark.parametrize("heading_rad", [0.0, 1.0, -2.0, math.pi])
def test_who_is_in_line_with_a_wall_sees_its_near_end(heading_rad: float) -> None:
    """And not through it, whichever of its ends is named first."""
    cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
    turned = [
        (cosine * x1 - sine * y1, sine * x1 + cosine * y1, cosine * x2 - sine * y2, sine * x2 + cosine * y2)
        for x1, y1, x2, y2 in (
            (2.0, 0.0, 1.0, 0.0),
            (1.5, 0.0, 2.5, 0.0),
            (-4.0, 0.0, -3.0, 0.0),
            (5.0, -1.0, 5.0, 1.0),
        )
    ]
    walls = Walls(turned)
    directions = np.array([(cosine, sine), (-2 * cosine, -2 * sine), (-sine, cosine)])
    expected = pytest.approx([1.0, 1.5, math.inf])
    assert walls.cast(np.zeros((3, 2)), directions).tolist() == expected
    assert walls.cast_from(0.0, 0.0, directions).tolist() == expected
    assert Sweep(walls).lengths_m(0.0, 0.0, heading_rad, NOTHING)[[0, 180, 90]].tolist() == pytest.approx(
        [1.0, 3.0, math.inf]
    )
    # A ray beside the line by a hair meets the wall behind.
    aside = walls.cast_from(-1e-6 * sine, 1e-6 * cosine, directions[:1])
    assert aside.tolist() == pytest.approx([5.0])


WHOLE = st.integers(-4, 4)
_WAYS = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)]


def exact_ray(segments: list[tuple[int, int, int, int]], place: tuple[int, int], way: tuple[int, int]) -> float:
    """One wall after the other, in fractions."""
    found: list[Fraction] = []
    for x1, y1, x2, y2 in segments:
        edge, apart = (x2 - x1, y2 - y1), (x1 - place[0], y1 - place[1])
        cross = way[0] * edge[1] - way[1] * edge[0]
        beside = apart[0] * way[1] - apart[1] * way[0]
        if cross:
            length = Fraction(apart[0] * edge[1] - apart[1] * edge[0], cross)
            found += [length] * (length >= 0 and 0 <= Fraction(beside, cross) <= 1)
        elif beside == 0:
            square = way[0] ** 2 + way[1] ** 2
            ends = [
                Fraction((x - place[0]) * way[0] + (y - place[1]) * way[1], square) for x, y in ((x1, y1), (x2, y2))
            ]
            if max(ends) >= 0:
                found.append(max(min(ends), Fraction(0)))
    return float(min(found)) if found else math.inf


@settings(max_examples=examples(60))
@given(st.lists(st.tuples(WHOLE, WHOLE, WHOLE, WHOLE), max_size=8), WHOLE, WHOLE)
def test_rays_on_a_grid_are_as_computed_with_fractions(
    segments: list[tuple[int, int, int, int]], x: int, y: int
) -> None:
    walls = Walls(segments)
    expected = pytest.approx([exact_ray(segments, (x, y), way) for way in _WAYS])
    ways = np.array(_WAYS, dtype=np.float64)
    assert walls.cast(np.tile((float(x), float(y)), (8, 1)), ways).tolist() == expected
    assert walls.cast_from(x, y, ways).tolist() == expected
    turn = Sweep(walls).lengths_m(x, y, 0.0, NOTHING)[::45] / np.hypot(*ways.T)
    assert turn.tolist() == expected


def test_a_robot_comes_to_the_end_of_a_wall_and_its_laser_sees_that() -> None:
    walls = Walls([(1.0, 0.0, 2.0, 0.0), (3.0, -1.0, 3.0, 1.0)])
    world = World(BODIES["burger"], walls, Timebase(ManualClock()))
    assert world.scan()[0] == pytest.approx(1.032)
    assert world.ranges((0.0,))[0] == pytest.approx(1.032)
    for wheel in (world.left, world.right):
        wheel.is_driven, wheel.goal_rad_s = True, 6.0
    world.time.advance(10.0)
    world.catch_up()
    assert world.x_m == pytest.approx(1.0 - 0.105, abs=0.002)
    assert world.collisions == 1
    assert world.scan()[0] == pytest.approx(0.105 + 0.032, abs=0.002)


def test_open_space_is_without_end_and_a_disc_is_seen_from_within() -> None:
    open_space = Sweep(Walls(()))
    assert np.isinf(open_space.lengths_m(1.0, 2.0, 3.0, NOTHING)).all()
    within = open_space.lengths_m(1.0, 0.0, 0.0, Discs([(0.0, 0.0, 3.0)]))
    assert (within[0], within[180]) == (pytest.approx(2.0), pytest.approx(4.0))


@pytest.mark.parametrize("name", ["room", "line-curves", "maze-rooms"])
def test_a_scan_of_a_world_is_that_of_its_rays_while_it_drives(name: str) -> None:
    world = World(BODIES["burger"], load_scene(name, 2), Timebase(ManualClock()), seed=2)
    for wheel, speed_rad_s in ((world.left, 5.0), (world.right, 4.0)):
        wheel.is_driven, wheel.goal_rad_s = True, speed_rad_s
    for _ in range(40):
        world.time.advance(0.25)
        expected = world.ranges(_DEGREES.tolist())
        is_same = np.isclose(world.scan(), expected, rtol=1e-9)
        # But for a ray that passes an end by a hair.
        assert is_same.sum() >= BEAMS - 1


def test_a_turn_in_the_largest_maze_is_its_rays() -> None:
    walls = Walls((*room(90.0, 90.0).segments, *maze_scene(30, 30).walls.segments))
    found = require_agreement(walls, NOTHING, 0.1, 0.2, 0.3)
    assert np.isfinite(found).all()
