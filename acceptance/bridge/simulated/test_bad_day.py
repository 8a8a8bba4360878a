"""The mazes of the package are solved on a bad day: whole bridges on virtual time, all drives and LiDARs."""

import pytest

from robosc_simulated import load_scene
from support.scenario_runs import maze_run


@pytest.mark.parametrize(
    ("scene", "base", "lidar", "seed"),
    [
        ("maze-rooms", "opencr", "lds01", 0),
        ("maze-rooms", "opencr", "lds01", 1),
        ("maze-rooms", "dynamixel", "lds03", 2),
        ("maze-spiral", "opencr", "lds02", 0),
        ("maze-random", "dynamixel", "lds01", 3),
    ],
)
def test_a_maze_is_solved_without_touching_a_wall(scene: str, base: str, lidar: str, seed: int) -> None:
    with maze_run(load_scene(scene, seed), profile="bad-day", base=base, lidar=lidar, seed=seed) as run:
        run.until_reached(600.0)
