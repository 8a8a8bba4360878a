"""Obstacles, goals, slip and fast rays of the world, against hand-worked cases and slow, obvious twins."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.execution.runtime.clock import ManualClock
from robosc_bridge.skills.line import line_offset
from robosc_bridge.skills.settings import LineSettings
from robosc_simulated import (
    BODIES,
    Goal,
    Mount,
    Noise,
    Obstacle,
    PinholeCamera,
    Scene,
    SimulatedTurtleBot3,
    Texture,
    Timebase,
    Track,
    Walls,
    World,
    load_scene,
    maze_scene,
    room,
)
from robosc_simulated.commands import UnknownCommandError, execute
from robosc_simulated.discs import Discs
from robosc_simulated.world import STEP_S, WorldEvent
from support.effort import examples

SIZES = st.floats(-5, 5, allow_nan=False)
DISCS = st.lists(st.tuples(SIZES, SIZES, st.floats(0.01, 2.0)), max_size=5)
YARD = Scene("yard", room(4.0, 2.0), goal=Goal(1.0, 0.0, 0.2), obstacles=(Obstacle("box", 1.0, 0.5, 0.1),))


def world_of(scene: Scene, seed: int = 0) -> World:
    return World(BODIES["burger"], scene, Timebase(ManualClock()), seed=seed)


def drive(world: World, left_rad_s: float, right_rad_s: float, seconds: float) -> None:
    for wheel, goal_rad_s in ((world.left, left_rad_s), (world.right, right_rad_s)):
        wheel.is_driven, wheel.goal_rad_s = True, goal_rad_s
    world.time.advance(seconds)
    world.catch_up()


# Between two ends that are nearer to each other than a ray's hair, rounding decides.
MILLIMETRES = SIZES.map(lambda size: round(size, 3))


@given(
    st.lists(st.tuples(MILLIMETRES, MILLIMETRES, MILLIMETRES, MILLIMETRES), max_size=40),
    MILLIMETRES,
    MILLIMETRES,
    st.lists(st.floats(-7, 7), min_size=1, max_size=20),
)
def test_fast_rays_agree_with_slow_ones(
    segments: list[tuple[float, float, float, float]], x_m: float, y_m: float, angles: list[float]
) -> None:
    walls = Walls(segments)
    found = walls.cast_from(x_m, y_m, _directions(angles))
    origins = np.tile((x_m, y_m), (len(angles), 1))
    is_same = np.zeros(len(angles), dtype=np.bool_)
    # At a wall's very end, and along it, rounding decides: there a ray that is turned by a hair measures the other.
    for turn in (0.0, 1e-6, -1e-6):
        slow = walls.cast(origins, _directions(np.asarray(angles) + turn))
        is_same |= np.isclose(found, slow, rtol=1e-3, atol=1e-3)
    assert is_same.all()


def _directions(angles: object) -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
    turned = np.asarray(angles, dtype=np.float64)
    return np.stack((np.cos(turned), np.sin(turned)), axis=1)


def slow_disc(disc: tuple[float, float, float], x_m: float, y_m: float, angle: float) -> float:
    """Steps along the ray until the edge is crossed, then halves the last step."""

    def outside(length: float) -> bool:
        return math.hypot(x_m + length * math.cos(angle) - disc[0], y_m + length * math.sin(angle) - disc[1]) > disc[2]

    start = outside(0.0)
    low, step = 0.0, 0.002
    while low < 20.0 and outside(low + step) == start:
        low += step
    high = low + step
    if high >= 20.0:
        return math.inf
    for _ in range(30):
        middle = (low + high) / 2
        low, high = (middle, high) if outside(middle) == start else (low, middle)
    return low


@settings(max_examples=examples(10))
@given(st.lists(st.tuples(SIZES, SIZES, st.floats(0.1, 2.0)), max_size=2), SIZES, SIZES, st.floats(-7, 7))
def test_rays_meet_discs_as_a_slow_twin_does(
    discs: list[tuple[float, float, float]], x_m: float, y_m: float, angle: float
) -> None:
    (found,) = Discs(discs).cast(np.array([(x_m, y_m)]), _directions([angle])).tolist()
    expected = min((slow_disc(disc, x_m, y_m, angle) for disc in discs), default=math.inf)
    missed = [abs((disc[0] - x_m) * math.sin(angle) - (disc[1] - y_m) * math.cos(angle)) - disc[2] for disc in discs]
    # A ray that just grazes a disc is met or not by rounding.
    assert found == pytest.approx(expected, abs=1e-3) or any(abs(by) < 1e-3 for by in missed)


@given(DISCS, SIZES, SIZES, st.floats(0.1, 3.0))
def test_discs_do_not_mind_how_long_a_direction_is(
    discs: list[tuple[float, float, float]], x_m: float, y_m: float, length: float
) -> None:
    directions = _directions(np.arange(12.0))
    many = Discs(discs).cast(np.tile((x_m, y_m), (12, 1)), directions * length)
    one = Discs(discs).cast(np.array([(x_m, y_m)]), directions)
    aside = np.array([(disc[0] - x_m) * directions[:, 1] - (disc[1] - y_m) * directions[:, 0] for disc in discs])
    # A ray that just grazes a disc is met or not by rounding.
    radii = np.array([disc[2] for disc in discs]).reshape(-1, 1)
    grazes = (np.abs(np.abs(aside.reshape(-1, 12)) - radii) < 1e-6).any(axis=0)
    assert (np.isclose(many * length, one, rtol=1e-6, atol=1e-6) | grazes).all()


@settings(max_examples=examples(10))
@given(st.integers(0, 100), st.lists(st.tuples(st.floats(-8, 8), st.floats(-8, 8)), min_size=1, max_size=6))
def test_a_world_that_measures_seldom_goes_where_one_goes_that_always_does(
    seed: int, speeds: list[tuple[float, float]]
) -> None:
    scene = maze_scene(2, 2, cell_m=0.5, seed=seed)
    fast, slow = world_of(scene), world_of(scene)

    def measure(world_s: float) -> None:
        slow._clear_m = 0.0

    slow.watch(measure, lambda world_s, happening: None)
    for left_rad_s, right_rad_s in speeds:
        for world in (fast, slow):
            drive(world, left_rad_s, right_rad_s, 1.0)
        assert fast.pose == slow.pose
        assert fast.collisions == slow.collisions
        assert fast.is_touching == slow.is_touching
        assert scene.walls.distance_m(fast.x_m, fast.y_m) >= 0.105 - 1e-9


def test_obstacles_are_seen_and_met() -> None:
    world = world_of(YARD)
    assert world.ranges((0.0,))[0] == pytest.approx(2.032)
    seen: list[tuple[float, WorldEvent]] = []
    world.watch(lambda world_s: None, lambda world_s, happening: seen.append((world_s, happening)))
    world.move_obstacle("box", 0.6, 0.0)
    assert world.ranges((0.0, math.pi)) == pytest.approx((0.6 - 0.1 + 0.032, 2.0 - 0.032))
    drive(world, 6.0, 6.0, 4.0)
    assert world.pose[0] == pytest.approx(0.6 - 0.1 - 0.105, abs=0.002)
    assert (world.collisions, world.is_touching) == (1, True)
    world.put_obstacle("box", False)
    assert world.ranges((0.0,))[0] == pytest.approx(2.0 - world.x_m + 0.032)
    drive(world, 6.0, 6.0, 3.0)
    assert world.collisions == 1
    assert world.pose[0] > 0.9
    assert [(happening.kind, happening.name) for _, happening in seen] == [
        ("obstacle", "box"), ("collision", "box"), ("obstacle", "box"), ("goal", ""),
    ]  # fmt: skip
    world.put_obstacle("box", True)
    assert world.obstacles == (Obstacle("box", 0.6, 0.0, 0.1, True),)
    with pytest.raises(ValueError, match="there is no obstacle 'bin'; there is box"):
        world.put_obstacle("bin", True)
    with pytest.raises(ValueError, match="finite"):
        world.move_obstacle("box", math.nan, 0.0)


def test_the_goal_is_reached_once_and_for_all() -> None:
    world = world_of(YARD)
    assert world.reached_s is None
    drive(world, 0.2 / 0.033, 0.2 / 0.033, 5.0)
    reached_s = world.reached_s
    assert reached_s == pytest.approx(4.0, abs=0.05)
    drive(world, -6.0, -6.0, 3.0)
    assert world.reached_s == reached_s
    other = world_of(YARD)
    other.place(1.0, 0.1, 0.0)
    assert other.reached_s == 0.0
    with pytest.raises(ValueError, match="finite"):
        other.place(math.inf, 0.0, 0.0)


def test_wheels_that_slip_go_less_far_than_they_turn() -> None:
    slipping = world_of(Scene("ice", Walls(()), noise=Noise(slip_share=0.25)))
    drive(slipping, 5.0, 5.0, 4.0)
    turned_m = slipping.left.angle_rad * 0.033
    assert slipping.pose[0] == pytest.approx(0.75 * turned_m)
    assert slipping.pose[2] == 0.0


def test_slip_and_encoders_by_chance_are_the_same_for_the_same_seed() -> None:
    scene = Scene("floor", Walls(()), noise=Noise(slip_deviation=0.1, encoder_deviation=0.1))
    first, same, other = (world_of(scene, seed) for seed in (1, 1, 2))
    for world in (first, same, other):
        drive(world, 5.0, 5.0, 10.0)
    assert first.pose == same.pose != other.pose
    assert first.left.angle_rad == same.left.angle_rad != other.left.angle_rad
    # They go astray, but not far.
    assert first.pose[2] != 0.0
    assert first.pose[0] == pytest.approx(50 * 0.033, rel=0.1)
    assert first.left.angle_rad == pytest.approx(50, rel=0.1)
    assert first.left.angle_rad != first.right.angle_rad


def test_an_ideal_world_has_no_chance_in_it() -> None:
    worlds = [world_of(YARD, seed) for seed in (1, 2)]
    for world in worlds:
        drive(world, 4.0, 5.0, 3.0)
    assert worlds[0].pose == worlds[1].pose


@pytest.mark.parametrize("name", ["line-curves", "line-oval"])
def test_the_line_detector_sees_the_line_of_a_scene(name: str) -> None:
    scene = load_scene(name, seed=3)
    assert scene.line is not None
    camera = PinholeCamera(Mount(), scene, 3)
    settings_ = LineSettings()
    points = scene.line.points
    for place in range(0, len(points) - 30, 60):
        (x_m, y_m), (next_x_m, next_y_m) = points[place], points[place + 2]
        heading_rad = math.atan2(next_y_m - y_m, next_x_m - x_m)
        offset = line_offset(camera.picture((x_m, y_m, heading_rad)), settings_)
        assert offset is not None, (x_m, y_m)
        assert abs(offset) < 0.45
        # Beside it, to the right, it is seen more to the left.
        aside = (x_m + 0.05 * math.sin(heading_rad), y_m - 0.05 * math.cos(heading_rad), heading_rad)
        moved = line_offset(camera.picture(aside), settings_)
        assert moved is not None
        assert moved > offset


@pytest.mark.parametrize("kind", ["tiles", "checkerboard", "speckle"])
def test_a_textured_floor_without_a_line_shows_none(kind: str) -> None:
    texture = Texture(kind, 215, 150, 0.1)  # type: ignore[arg-type]
    scene = Scene("floor", Walls(()), floor=texture, noise=Noise(camera_shades=5.0))
    picture = PinholeCamera(Mount(), scene, 1).picture((0.3, 0.2, 0.1))
    assert len(np.unique(picture)) > 10
    assert line_offset(picture, LineSettings()) is None


def test_noise_of_the_camera_is_as_large_as_set_and_seeded() -> None:
    scene = Scene("noisy", Walls(()), noise=Noise(camera_shades=6.0))
    first, same, other = (PinholeCamera(Mount(), scene, seed).picture((0.0, 0.0, 0.0)) for seed in (1, 1, 2))
    assert (first == same).all()
    assert (first != other).any()
    assert float(first.std()) == pytest.approx(6.0, rel=0.05)


def test_a_robot_in_a_scene_learns_of_goal_and_obstacles() -> None:
    scene = load_scene("room")
    with SimulatedTurtleBot3(scene=scene, clock=ManualClock()) as robot:
        assert execute(robot, "obstacle box 0.5 0") == ""
        assert robot.world.obstacles[0].x_m == 0.5
        assert execute(robot, "obstacle box away") == ""
        assert not robot.world.obstacles[0].is_there
        assert execute(robot, "obstacle box back") == ""
        assert robot.world.obstacles[0].is_there
        for line in ("goal", "obstacle bin 1 1", "obstacle box", "obstacle box 1 x", "obstacle box inf 0"):
            with pytest.raises(UnknownCommandError):
                execute(robot, line)
        assert "obstacle NAME" in execute(robot, "help")
        assert robot.camera is None
    with SimulatedTurtleBot3(scene=YARD, clock=ManualClock()) as robot:
        assert execute(robot, "goal") == "not yet"
        robot.advance(0.5)
        robot.world.place(1.0, 0.0, 0.0)
        assert execute(robot, "goal") == "reached 0.500"
    with pytest.raises(ValueError, match="its own walls"):
        SimulatedTurtleBot3(scene=scene, walls=room(1.0, 1.0))


def test_a_robot_starts_where_its_scene_says() -> None:
    scene = Scene("far", Walls(()), start=(1.0, 2.0, 0.5), line=Track([(0.0, 0.0), (1.0, 0.0)]))
    with SimulatedTurtleBot3(scene=scene, clock=ManualClock()) as robot:
        assert robot.world.pose == (1.0, 2.0, 0.5)
        assert robot.camera is not None
    with SimulatedTurtleBot3(scene=scene, pose=(0.0, 0.0, 0.0), clock=ManualClock()) as robot:
        assert robot.world.pose == (0.0, 0.0, 0.0)


def test_the_noise_of_the_lidar_comes_from_the_scene() -> None:
    def spread(scene: Scene, noise_m: float | None) -> float:
        with SimulatedTurtleBot3(scene=scene, noise_m=noise_m, clock=ManualClock()) as robot:
            return float(np.std([robot.scanner._distances_mm([0.0])[0] for _ in range(200)]))

    noisy = Scene("noisy", room(4.0, 2.0), noise=Noise(lidar_m=0.02))
    assert spread(noisy, None) == pytest.approx(20, rel=0.3)
    assert spread(noisy, 0.0) == 0.0
    assert spread(YARD, None) == 0.0


def test_a_scan_of_the_world_is_what_its_rays_measure() -> None:
    world = world_of(load_scene("maze-rooms"))
    scan = world.scan()
    assert scan.shape == (360,)
    assert scan.tolist() == pytest.approx(list(world.ranges([math.radians(degree) for degree in range(360)])))
    assert STEP_S == 0.005
