"""The example of a maze solver comes out of every maze without touching a wall."""

import pytest

from robosc_simulated import Scene, load_scene, maze_scene
from support.maze_solver import MazeSolver

# A way through a maze of n cells is at most 2 n cells long: 10 s each, and as much for turns.
_LONGEST_S = 700.0
# The robot's middle from a wall, at least: its radius is 0.105 m.
_NEAREST_M = 0.2


def solved(scene: Scene, latency_s: float) -> MazeSolver:
    found = MazeSolver(scene, latency_s)
    nearest_m = []
    found.world.watch(
        lambda world_s: (
            nearest_m.append(scene.walls.distance_m(found.world.x_m, found.world.y_m))
            if round(world_s / 0.005) % 20 == 0
            else None
        ),
        lambda world_s, happening: None,
    )
    found.run(_LONGEST_S)
    assert found.world.collisions == 0, f"it has touched a wall at {found.world.pose}"
    assert found.world.reached_s is not None, f"it is still inside, at {found.world.pose}"
    assert min(nearest_m) > _NEAREST_M
    return found


@pytest.mark.parametrize("latency_s", [0.05, 0.5])
@pytest.mark.parametrize("name", ["maze-rooms", "maze-spiral"])
def test_every_maze_of_the_package_is_solved(name: str, latency_s: float) -> None:
    solved(load_scene(name), latency_s)


@pytest.mark.parametrize("seed", range(6))
def test_mazes_by_chance_are_solved(seed: int) -> None:
    solved(load_scene("maze-random", seed), latency_s=0.2)


def test_a_larger_maze_is_solved() -> None:
    solved(maze_scene(5, 4, seed=11), latency_s=0.3)


def test_in_ways_that_are_too_narrow_it_is_not() -> None:
    """The check above can fail: the thresholds of the model are for ways of 1 m."""
    found = MazeSolver(maze_scene(4, 4, cell_m=0.45, seed=1))
    found.run(150.0)
    assert found.world.collisions or found.world.reached_s is None
