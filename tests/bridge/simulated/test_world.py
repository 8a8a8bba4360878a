"""The planar world against hand-worked motion, and its rays against a slow, obvious twin."""

import math
from collections import deque

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc.execution.runtime.clock import ManualClock, SystemClock
from robosc_simulated import BODIES, Timebase, Walls, World, maze, parse_walls, room
from robosc_simulated.world import STEP_S

SIZES = st.floats(-5, 5, allow_nan=False)
MILLIMETRES = SIZES.map(lambda size: round(size, 3))
# Also along the axes, where walls often are.
ANGLES = st.one_of(st.floats(-7, 7), st.integers(-4, 4).map(lambda quarters: quarters * math.pi / 2))
SEGMENTS = st.lists(st.tuples(SIZES, SIZES, SIZES, SIZES), max_size=6)


def world_of(
    walls: Walls, pose: tuple[float, float, float] = (0.0, 0.0, 0.0), factor: float = 1.0, body: str = "burger"
) -> World:
    return World(BODIES[body], walls, Timebase(ManualClock(), factor), pose)


def drive(world: World, left_rad_s: float, right_rad_s: float, seconds: float) -> None:
    for wheel, goal_rad_s in ((world.left, left_rad_s), (world.right, right_rad_s)):
        wheel.is_driven = True
        wheel.goal_rad_s = goal_rad_s
    world.time.advance(seconds)
    world.catch_up()


def slow_range(walls: Walls, x: float, y: float, angle: float) -> float:
    """One ray, one wall at a time, from the lines' equations."""
    best = math.inf
    dx, dy = math.cos(angle), math.sin(angle)
    for x1, y1, x2, y2 in walls.segments:
        # x + t dx = x1 + u (x2 - x1), and so for y: Cramer's rule.
        ex, ey = x2 - x1, y2 - y1
        determinant = ex * dy - ey * dx
        if abs(determinant) < 1e-12:
            if abs(dx * (y1 - y) - dy * (x1 - x)) < 1e-12:
                # Along the wall: to its near end, or it stands on it.
                ends = [dx * (end_x - x) + dy * (end_y - y) for end_x, end_y in ((x1, y1), (x2, y2))]
                if max(ends) >= 0:
                    best = min(best, max(min(ends), 0.0))
            continue
        t = (ex * (y1 - y) - ey * (x1 - x)) / determinant
        u = (dx * (y1 - y) - dy * (x1 - x)) / determinant
        if t >= 0 and 0 <= u <= 1:
            best = min(best, t)
    return best


@given(st.lists(st.tuples(*[MILLIMETRES] * 4), max_size=6), MILLIMETRES, MILLIMETRES, ANGLES)
def test_rays_agree_with_a_slow_twin(segments: list[tuple[float, float, float, float]], x: float, y: float,
                                     angle: float) -> None:  # fmt: skip
    walls = Walls(segments)
    found = float(walls.cast(np.array([(x, y)]), np.array([(math.cos(angle), math.sin(angle))]))[0])
    expected = slow_range(walls, x, y, angle)
    # At a wall's very end, rounding decides.
    ends = [slow_range(walls, x, y, angle + turn) for turn in (-1e-6, 1e-6)]
    assert any(found == pytest.approx(value, rel=1e-3, abs=1e-3) for value in (expected, *ends))


@given(SEGMENTS, SIZES, SIZES)
def test_no_point_of_a_wall_is_nearer_than_its_distance(
    segments: list[tuple[float, float, float, float]], x: float, y: float
) -> None:
    distance_m = Walls(segments).distance_m(x, y)
    points = [
        math.hypot(x1 + share * (x2 - x1) - x, y1 + share * (y2 - y1) - y)
        for x1, y1, x2, y2 in segments
        for share in (index / 200 for index in range(201))
    ]
    assert distance_m == pytest.approx(min(points, default=math.inf), abs=0.08)
    assert all(distance_m <= point + 1e-9 for point in points)


def test_a_laser_in_a_room() -> None:
    # The Burger's laser is 32 mm behind the wheels.
    world = world_of(room(4.0, 2.0), (0.032, 0.0, 0.0))
    assert world.ranges((0.0, math.pi / 2, math.pi, -math.pi / 2)) == pytest.approx((2.0, 1.0, 2.0, 1.0))
    world.place(0.0, 0.032, math.pi / 2)
    assert world.ranges((0.0, math.pi / 2)) == pytest.approx((1.0, 2.0))


def test_nothing_is_met_in_open_space() -> None:
    world = world_of(Walls(()))
    assert world.ranges((0.0, 1.0)) == (math.inf, math.inf)
    assert world.walls.distance_m(0, 0) == math.inf


def test_straight_on_and_on_the_spot() -> None:
    world = world_of(Walls(()))
    drive(world, 4.0, 4.0, 2.0)
    assert world.pose == pytest.approx((2.0 * 4.0 * 0.033, 0.0, 0.0), abs=0.005)
    assert world.speed_m_s == pytest.approx(0.132)
    x_m, y_m, _ = world.pose
    drive(world, -4.0, 4.0, 2.0)
    assert world.pose[:2] == pytest.approx((x_m, y_m), abs=0.005)
    assert world.pose[2] == pytest.approx(2.0 * 8.0 * 0.033 / 0.160, abs=0.1)
    assert world.yaw_rate_rad_s == pytest.approx(8.0 * 0.033 / 0.160)


def test_an_arc_comes_back_to_where_it_began() -> None:
    world = world_of(Walls(()))
    drive(world, 2.0, 4.0, 0.5)
    start = world.pose
    # v = 0.099 m/s, w = 0.4125 rad/s: a circle of radius 0.24 m.
    drive(world, 2.0, 4.0, 2 * math.pi / 0.4125)
    assert world.pose[:2] == pytest.approx(start[:2], abs=0.002)
    assert world.pose[2] - start[2] == pytest.approx(2 * math.pi, abs=0.01)


def test_a_quarter_of_an_arc() -> None:
    world = world_of(Walls(()))
    drive(world, 2.0, 4.0, 0.5)
    world.place(0.0, 0.0, 0.0)
    # 0.4125 rad/s: in whole steps of the world.
    drive(world, 2.0, 4.0, 3.805)
    assert world.pose == pytest.approx((0.24, 0.24, math.pi / 2), abs=0.002)


def test_a_waffle_turns_slower() -> None:
    world = world_of(Walls(()), body="waffle")
    drive(world, -4.0, 4.0, 0.5)
    assert world.yaw_rate_rad_s == pytest.approx(8.0 * 0.033 / 0.287)


def test_a_wall_stops_the_body_and_is_counted_once() -> None:
    world = world_of(room(2.0, 2.0))
    drive(world, 5.0, 5.0, 10.0)
    assert world.pose[0] == pytest.approx(1.0 - 0.105, abs=0.002)
    assert (world.collisions, world.is_touching) == (1, True)
    # The wheels slip.
    assert world.left.angle_rad == pytest.approx(50.0, abs=0.5)
    # It can turn there, and leave.
    drive(world, -4.0, 4.0, 1.0)
    assert world.pose[2] > 1.0
    drive(world, 0.0, 0.0, 0.5)
    world.place(*world.pose[:2], 0.0)
    drive(world, -5.0, -5.0, 1.0)
    assert world.pose[0] < 0.8
    assert not world.is_touching
    drive(world, 5.0, 5.0, 3.0)
    assert world.collisions == 2


def test_a_wheel_without_torque_runs_out_and_a_blocked_one_stands() -> None:
    world = world_of(Walls(()))
    drive(world, 5.0, 5.0, 1.0)
    world.left.is_driven = False
    world.right.is_blocked = True
    world.time.advance(0.5)
    world.catch_up()
    assert (world.left.speed_rad_s, world.right.speed_rad_s) == (0.0, 0.0)


@pytest.mark.parametrize(("body", "rpm"), [("burger", 61.0), ("waffle", 77.0)])
def test_a_wheel_turns_no_faster_than_its_motor_without_a_load(body: str, rpm: float) -> None:
    world = world_of(Walls(()), body=body)
    drive(world, 1000.0, -1000.0, 5.0)
    assert world.left.speed_rad_s == pytest.approx(rpm * math.tau / 60)
    assert world.right.speed_rad_s == pytest.approx(-rpm * math.tau / 60)
    assert abs(world.left.angle_rad) < 5.0 * rpm * math.tau / 60


def test_the_world_passes_faster_by_its_factor() -> None:
    slow, fast = world_of(Walls(())), world_of(Walls(()), factor=10.0)
    drive(slow, 4.0, 4.0, 10.0)
    drive(fast, 4.0, 4.0, 1.0)
    assert fast.pose == pytest.approx(slow.pose)


@pytest.mark.parametrize("factor", [0.0, -1.0, 100.1, 1e300, math.inf, math.nan])
def test_a_factor_is_positive_and_no_more_than_can_be_lived(factor: float) -> None:
    with pytest.raises(ValueError, match="speed factor must be a positive number up to 100"):
        Timebase(factor=factor)
    assert Timebase(factor=100.0).factor == 100.0


class ReadClock(SystemClock):
    """A clock that goes when it is set; the devices take it for the computer's."""

    def __init__(self) -> None:
        super().__init__()
        self.now_s = 0.0

    def monotonic(self) -> float:
        return self.now_s


def test_a_world_that_takes_too_long_to_live_passes_more_slowly() -> None:
    clock = ReadClock()
    time = Timebase(clock, factor=10.0)
    world = World(BODIES["burger"], Walls(()), time)

    def dawdle(world_s: float) -> None:
        # Three times as long as the step is by the clock.
        clock.now_s += 3 * STEP_S / 10.0

    world.watch(dawdle, lambda world_s, happening: None)
    clock.now_s = 1.0
    for _ in range(3):
        # Time that it takes to live a part is no more than that part again.
        before_s = world.lived_s
        world.catch_up()
        assert world.lived_s - before_s == pytest.approx(10.0)
        assert time.world_s() - world.lived_s == pytest.approx(10.0)

    # A short delay is made up for.
    clock.now_s = 0.0
    time = Timebase(clock, factor=10.0)
    world = World(BODIES["burger"], Walls(()), time)
    world.watch(dawdle, lambda world_s, happening: None)
    clock.now_s = 0.01
    world.catch_up()
    assert time.world_s() - world.lived_s == pytest.approx(0.3)


def test_only_a_manual_clock_is_advanced() -> None:
    with pytest.raises(TypeError, match="by itself"):
        Timebase(SystemClock()).advance(1.0)
    with pytest.raises(ValueError, match="back"):
        Timebase(ManualClock()).advance(-1.0)


@given(st.integers(1, 6), st.integers(1, 6), st.integers(0, 50))
def test_in_a_maze_there_is_one_way_between_any_two_cells(columns: int, rows: int, seed: int) -> None:
    walls = maze(columns, rows, 1.0, seed)

    def is_open(x: int, y: int, dx: int, dy: int) -> bool:
        return slow_range(walls, x, y, math.atan2(dy, dx)) > 0.75

    ways = 0
    reached = {(0, 0)}
    queue = deque(reached)
    while queue:
        x, y = queue.popleft()
        for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            if is_open(x, y, dx, dy):
                ways += 1
                if (x + dx, y + dy) not in reached:
                    reached.add((x + dx, y + dy))
                    queue.append((x + dx, y + dy))
    # All cells and no more, and as many openings (seen from both sides) as a tree has.
    assert reached == {(column, row) for column in range(columns) for row in range(rows)}
    assert ways == 2 * (columns * rows - 1)


def test_a_maze_has_a_cell() -> None:
    with pytest.raises(ValueError, match="one cell"):
        maze(0, 3)


def test_a_wall_map_as_text() -> None:
    walls = parse_walls("# a corner\n0 0 1 0\n\n1 0 1 1.5  # up\n")
    assert walls.segments == ((0, 0, 1, 0), (1, 0, 1, 1.5))


@pytest.mark.parametrize("text", ["0 0 1", "0 0 1 x", "0 0 1 inf", "1 2 3 4 5"])
def test_a_wall_map_names_its_wrong_line(text: str) -> None:
    with pytest.raises(ValueError, match=r"line 2 of the wall map"):
        parse_walls(f"0 0 1 1\n{text}\n")


def test_walls_are_finite() -> None:
    with pytest.raises(ValueError, match="finite"):
        Walls([(0, 0, math.nan, 1)])
