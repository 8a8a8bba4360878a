"""Prints every benchmark table of the project, measured side by side in one run.

Usage: run.py [NAME...]                       (all of them without an argument; a wrong name lists them)
       run.py cif DIR [--against FILE]    (a folder of CIF models: see cif.py)
       run.py families DIR                (a folder of CIF models in shuffled orders: see families.py)
       run.py engines DIR                 (a folder of CIF models, whole processes by engine: see engines.py)
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
import engines
import execution
import execution.large_cycles
import families
import goal_checks
import goals
import gr1
import language
import large_robots
import strategies
import synthesis
from service import call_cpu, isolation, load, task_cpu

_MODULES = (
    *(
        cold_start,
        conditions,
        editor,
        engines,
        execution,
        execution.large_cycles,
        families,
        goal_checks,
        goals,
        gr1,
        language,
        large_robots,
        strategies,
        synthesis,
    ),
    *(call_cpu, isolation, task_cpu),
    *(decoders, drive_bases, endurance, live_view, live_view_pixels, loop_period, maze, reaction, shipped, twin),
)
TABLES: dict[str, Callable[[], str]] = {
    **{module.__name__.rpartition(".")[2].replace("_", "-"): module.table for module in _MODULES},
    "service-load": load.table,
}


def main() -> int:
    """Print the tables that were asked for."""
    if sys.argv[1:2] == ["cif"]:
        sys.stdout.write(cif.table(sys.argv[2:]) + "\n")
        return 0
    for name, module in (("families", families), ("engines", engines)):
        if sys.argv[1:2] == [name] and sys.argv[2:]:
            sys.stdout.write(module.table(sys.argv[2:]) + "\n")
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
