"""A whole lap along each line of the package, by the pictures of the twin's camera alone, stepped by the test."""

import math

import pytest

from robosc.execution.runtime.clock import ManualClock
from robosc_bridge.skills.line import LineDetector
from robosc_bridge.skills.settings import LineSettings
from robosc_simulated import BODIES, Mount, PinholeCamera, Timebase, World, load_scene

PICTURES_HZ = 10.0
SPEED_M_S = 0.15
# Its middle stays above the line.
BOUND_M = 0.025


@pytest.mark.parametrize(("name", "seed"), [("line-oval", 0), ("line-curves", 1), ("line-curves", 2)])
def test_a_lap_is_driven_on_the_line(name: str, seed: int) -> None:
    scene = load_scene(name, seed)
    line = scene.line
    assert line is not None
    body = BODIES["burger"]
    time = Timebase(ManualClock())
    world = World(body, scene, time, seed=seed)
    camera = PinholeCamera(Mount(), scene, seed)
    detector = LineDetector(LineSettings(), 0.0)
    length_m = sum(math.dist(*pair) for pair in zip(line.points, line.points[1:], strict=False))
    world.left.is_driven = world.right.is_driven = True
    driven_m = farthest_m = aside_most_m = 0.0
    while driven_m < length_m:
        seen = detector.update(camera.picture(world.pose, world.obstacles), time.world_s())
        assert seen is not None
        assert seen.correction_rad_s is not None, f"the line is lost at {world.pose}"
        aside_m_s = seen.correction_rad_s * body.wheel_separation_m / 2
        world.left.goal_rad_s = (SPEED_M_S - aside_m_s) / body.wheel_radius_m
        world.right.goal_rad_s = (SPEED_M_S + aside_m_s) / body.wheel_radius_m
        before = world.pose[:2]
        time.advance(1.0 / PICTURES_HZ)
        x_m, y_m, _ = world.pose
        driven_m += math.dist(before, (x_m, y_m))
        aside_most_m = max(aside_most_m, line.distance_m(x_m, y_m))
        farthest_m = max(farthest_m, math.hypot(x_m - scene.start[0], y_m - scene.start[1]))
        assert time.world_s() < 2 * length_m / SPEED_M_S
    assert aside_most_m < BOUND_M
    # Around, and back to where it began.
    assert farthest_m > 0.9
    assert math.dist((x_m, y_m), scene.start[:2]) < 0.15
    assert world.collisions == 0
