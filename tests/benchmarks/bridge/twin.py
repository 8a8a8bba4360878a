"""Benchmark of the steps of the simulated world that a core executes in a second, each with a scan of 360 rays.

The robot drives through mazes of growing size, its wheels reversed where it comes to a wall. *Steps alone*: without a
scan. A step is 5 ms of the world; time is that of the processor.
"""

import time

from figures import text_table
from robosc.execution.runtime.clock import ManualClock
from robosc_simulated import BODIES, Scene, Timebase, World, load_scene, maze_scene
from robosc_simulated.world import STEP_S

RUNS = 5
STEPS = 2_000
AIM = 5_000
REVERSE_AFTER = 300

HEADER = ["scene", "walls", "steps and scans/s", "steps alone/s", f"aim ({AIM:,})"]


def _steps_per_s(scene: Scene, has_scan: bool) -> float:
    best_s = float("inf")
    for _ in range(RUNS):
        clock = ManualClock()
        world = World(BODIES["burger"], scene, Timebase(clock))
        for wheel, goal_rad_s in ((world.left, 6.0), (world.right, 5.5)):
            wheel.is_driven, wheel.goal_rad_s = True, goal_rad_s
        begin_s = time.process_time()
        for step in range(STEPS):
            if step % REVERSE_AFTER == REVERSE_AFTER - 1:
                world.left.goal_rad_s, world.right.goal_rad_s = -world.right.goal_rad_s, -world.left.goal_rad_s
            clock.advance(STEP_S)
            world.catch_up()
            if has_scan:
                world.scan()
        best_s = min(best_s, time.process_time() - begin_s)
        if round(world.lived_s / STEP_S) != STEPS:
            raise RuntimeError(f"{scene.name}: {world.lived_s} s were lived")
    return STEPS / best_s


def table() -> str:
    """The table."""
    scenes = [load_scene(name) for name in ("room", "maze-spiral", "maze-rooms", "maze-random")]
    scenes += [maze_scene(8, 8), maze_scene(15, 15)]
    rows = []
    for scene in scenes:
        speed = _steps_per_s(scene, True)
        verdict = "met" if speed >= AIM else "missed"
        alone = f"{_steps_per_s(scene, False):,.0f}"
        rows.append([scene.name, str(len(scene.walls.segments)), f"{speed:,.0f}", alone, verdict])
    return text_table(f"The simulated world, best of {RUNS} runs", HEADER, rows)
