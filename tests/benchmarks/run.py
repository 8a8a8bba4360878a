"""Prints every benchmark table of the project, measured side by side in one run.

Usage: run.py [NAME...]      (all of them without an argument)

Names: cold-start, conditions, execution, language, synthesis; of the bridge: decoders, drive-bases, live-view,
loop-period, reaction, endurance.
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
import loop_period
import reaction

import cold_start
import conditions
import execution
import language
import synthesis

TABLES: dict[str, Callable[[], str]] = {
    "cold-start": cold_start.table,
    "conditions": conditions.table,
    "decoders": decoders.table,
    "drive-bases": drive_bases.table,
    "endurance": endurance.table,
    "execution": execution.table,
    "language": language.table,
    "live-view": live_view.table,
    "loop-period": loop_period.table,
    "reaction": reaction.table,
    "synthesis": synthesis.table,
}


def main() -> int:
    """Print the tables that were asked for."""
    names = sys.argv[1:] or list(TABLES)
    unknown = [name for name in names if name not in TABLES]
    if unknown:
        sys.stderr.write(f"no benchmark {', '.join(unknown)}; there are {', '.join(TABLES)}\n")
        return 2
    for name in names:
        sys.stdout.write(TABLES[name]() + "\n\n")
        sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
