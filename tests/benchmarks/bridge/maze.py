"""Benchmark of the speed of solving a maze through serial lines.

Server, client, bridge and robot take part, in a world in which time passes faster.

Usage: maze.py [SPEED...]      (default: 5 10 20)
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[3]
sys.path[:0] = [
    str(Path(__file__).parent), str(ROOT), str(ROOT / "bridge"), str(ROOT / "tests" / "benchmarks")
]  # fmt: skip

from rig import Machine  # noqa: E402

from figures import text_table  # noqa: E402  # found through the path above
from robosc_experiments.maze import SCENES, run_maze  # noqa: E402
from robosc_experiments.scenario import Outcome  # noqa: E402

SPEEDS = (5.0, 10.0, 20.0)
SEED = 3

HEADER = [
    "scene, speed", "reached", "world s", "wall s", "way m", "collisions", "faults", "CPU bridge", "simulator",
]  # fmt: skip


def _run(scene: str, speed: float) -> Outcome:
    with tempfile.TemporaryDirectory() as folder:
        return run_maze(Path(folder) / "run", scene, speed=speed, say=lambda text: None, seed=SEED)


def _row(scene: str, speed: float) -> list[str]:
    outcome = _run(scene, speed)
    found = outcome.figures
    wall_s = found["wall_s"]
    return [
        f"{scene}, {speed:g}",
        f"{found['speed']:.1f}",
        f"{found['world_s']:.1f}",
        f"{wall_s:.1f}",
        f"{found['way_m']:.1f}",
        f"{found['collisions']:.0f}",
        str(len(outcome.faults)),
        f"{found['bridge_cpu_s'] / wall_s:.0%}",
        f"{found['simulator_cpu_s'] / wall_s:.0%}",
    ]


def table(speeds: Sequence[float] = SPEEDS) -> str:
    """One row for each maze and speed."""
    machine = Machine()
    with machine.watched():
        rows = [_row(scene, speed) for scene in SCENES for speed in speeds]
    return text_table(f"Mazes through serial lines, faster than real time ({machine})", HEADER, rows)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="How fast mazes are solved through serial lines.")
    parser.add_argument("speeds", type=float, nargs="*", default=SPEEDS, help="default: 5 10 20")
    sys.stdout.write(table(parser.parse_args().speeds) + "\n")
