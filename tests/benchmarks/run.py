"""Prints every benchmark table of the project, measured side by side in one run.

Usage: run.py [NAME...]                       (all of them without an argument)
       run.py cif DIR [--against FILE]    (a folder of CIF models: see cif.py)

Names: cold-start, conditions, editor, execution, goal-checks, goals, gr1, language, strategies, synthesis; of the
service: service-load, call-cpu, isolation, task-cpu; of the bridge: decoders, drive-bases, live-view, live-view-pixels,
loop-period, maze, reaction, endurance, shipped, twin.
"""

import sys
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parent / "bridge"))

import decoders
import drive_bases
import endurance
import live_view
import live_view_pixels
import loop_period
import maze
import reaction
import shipped
import twin

import cif
import cold_start
import conditions
import editor
import execution
import goal_checks
import goals
import gr1
import language
import strategies
import synthesis
from service import call_cpu, isolation, load, task_cpu

TABLES: dict[str, Callable[[], str]] = {
    "call-cpu": call_cpu.table,
    "cold-start": cold_start.table,
    "conditions": conditions.table,
    "decoders": decoders.table,
    "drive-bases": drive_bases.table,
    "editor": editor.table,
    "endurance": endurance.table,
    "execution": execution.table,
    "goal-checks": goal_checks.table,
    "goals": goals.table,
    "gr1": gr1.table,
    "isolation": isolation.table,
    "language": language.table,
    "live-view": live_view.table,
    "live-view-pixels": live_view_pixels.table,
    "loop-period": loop_period.table,
    "maze": maze.table,
    "reaction": reaction.table,
    "service-load": load.table,
    "shipped": shipped.table,
    "strategies": strategies.table,
    "synthesis": synthesis.table,
    "task-cpu": task_cpu.table,
    "twin": twin.table,
}


def main() -> int:
    """Print the tables that were asked for."""
    if sys.argv[1:2] == ["cif"]:
        sys.stdout.write(cif.table(sys.argv[2:]) + "\n")
        return 0
    names = sys.argv[1:] or list(TABLES)
    unknown = [name for name in names if name not in TABLES]
    if unknown:
        sys.stderr.write(f"no benchmark {', '.join(unknown)}; there are cif DIR, {', '.join(TABLES)}\n")
        return 2
    for name in names:
        sys.stdout.write(TABLES[name]() + "\n\n")
        sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
