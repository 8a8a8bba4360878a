"""The product at work without a robot: model -> synthesis server -> bridge -> serial bytes -> robot, out of a maze.

Starts the synthesis server, lets the client send it the maze solver, and has the bridge obtain its supervisor from
there and drive a simulated TurtleBot3 through its serial lines, in a world that passes faster than the clock. Then it
judges what happened, and draws it. Nothing runs on after it, also after Ctrl-C.

Usage: demo.py [--scene NAME|FILE] [--seed N] [--speed N] [--model FILE] [--output FOLDER]        (or: make demo)
"""

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

from robosc.event_logs import draw_sequence, read_log
from robosc_experiments.maze import MODEL, SCENES, run_maze
from robosc_experiments.processes import interruptible
from robosc_experiments.scenario import Outcome, ScenarioError
from robosc_simulated.map_picture import draw_map
from robosc_simulated.motion import read_motion
from robosc_simulated.values import option, seed

ROOT = Path(__file__).resolve().parents[2]
SPEED = 10.0


class Progress:
    """One line that changes, in a terminal; elsewhere a line each time that another step begins."""

    def __init__(self) -> None:
        self._is_terminal = sys.stdout.isatty()
        self._is_shown = False
        self._said = 0

    def say(self, text: str) -> None:
        """Show what is going on."""
        if self._is_terminal:
            sys.stdout.write(f"\r\x1b[K{text}")
            self._is_shown = True
        elif self._said % 20 == 0:
            sys.stdout.write(text + "\n")
        self._said += 1
        sys.stdout.flush()

    def end(self) -> None:
        """Leave the line."""
        if self._is_shown:
            sys.stdout.write("\n")
            self._is_shown = False


def main() -> int:
    """Run the demonstration; 0 if the robot came out of the maze and nothing was wrong."""
    arguments = _arguments()
    progress = Progress()
    try:
        with interruptible(), tempfile.TemporaryDirectory(prefix="robosc-demo-") as folder:
            outcome = run_maze(
                Path(folder) / "run",
                arguments.scene,
                speed=arguments.speed,
                say=progress.say,
                seed=arguments.seed,
                model=arguments.model,
            )
            progress.end()
            written = _keep(outcome, arguments.output)
    except KeyboardInterrupt:
        progress.end()
        sys.stderr.write("interrupted; everything is stopped\n")
        return 130
    except (ScenarioError, OSError) as error:
        progress.end()
        sys.stderr.write(f"demo: {error}\n")
        return 1
    _report(outcome, written)
    return 0 if outcome.has_passed else 1


def _keep(outcome: Outcome, folder: Path) -> list[Path]:
    """Draw what happened, and keep what it was drawn from."""
    folder.mkdir(parents=True, exist_ok=True)
    trajectory, sequence = folder / "trajectory.png", folder / "events.png"
    motion = read_motion(outcome.motion)
    draw_map(outcome.scene, motion, trajectory)
    # Marks that say nothing new would be a wall of strokes.
    draw_sequence(
        read_log(outcome.event_log), sequence, only_changes=True, motion=motion, title=f"{outcome.scene.name}: the run"
    )
    kept = [
        shutil.copy(outcome.event_log, folder / "events.jsonl"),
        shutil.copy(outcome.motion, folder / "motion.jsonl"),
        shutil.copy(outcome.supervisor, folder / outcome.supervisor.name),
    ]
    return [trajectory, sequence, *map(Path, kept)]


def _report(outcome: Outcome, written: list[Path]) -> None:
    figures = outcome.figures
    sys.stdout.write(
        f"\n{outcome.scene.name}: {figures.get('way_m', 0.0):.1f} m in {figures.get('world_s', 0.0):.0f} s of the world"
        f", {figures.get('wall_s', 0.0):.1f} s by the clock ({figures.get('speed', 0.0):.1f} times as fast)\n"
        f"collisions: {figures.get('collisions', 0.0):.0f}   "
        f"processor: bridge {figures['bridge_cpu_s']:.1f} s, simulator {figures['simulator_cpu_s']:.1f} s\n"
    )
    for path in written:
        sys.stdout.write(f"  {path}\n")
    for fault in outcome.faults:
        sys.stderr.write(f"FAULT: {fault}\n")
    if outcome.has_passed:
        sys.stdout.write("passed: out of the maze without touching a wall, every request allowed by the supervisor\n")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description="Lead a simulated TurtleBot3 out of a maze: synthesis server, client, bridge, serial lines, robot.",
        epilog="A model of your own needs the communications of examples/maze_solver/narrow_maze.rscd.",
    )
    parser.add_argument(
        "--scene", default=SCENES[0], metavar="NAME|FILE", help=f"{', '.join(SCENES)}, or a file; default: %(default)s"
    )
    parser.add_argument("--seed", type=option(seed), default=0, metavar="N", help="of maze-random, and of noise")
    parser.add_argument(
        "--speed", type=float, default=SPEED, metavar="N", help="the world passes N times as fast; default: %(default)g"
    )
    parser.add_argument("--model", type=Path, default=MODEL, metavar="FILE", help="the model (default: the example's)")
    parser.add_argument(
        "--output", type=Path, default=ROOT / "out", metavar="FOLDER", help="for pictures and records; default: out/"
    )
    arguments = parser.parse_args()
    if not arguments.model.is_file():
        parser.error(f"there is no file {arguments.model}")
    return arguments


if __name__ == "__main__":
    sys.exit(main())
