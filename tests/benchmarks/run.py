"""Prints every benchmark table of the project, measured side by side in one run.

Usage: run.py [cold-start] [conditions] [execution] [language] [ros2] [synthesis]      (all of them without an argument)
"""

import sys
from collections.abc import Callable

import cold_start
import conditions
import execution
import language
import ros2_cycle
import synthesis

TABLES: dict[str, Callable[[], str]] = {
    "cold-start": cold_start.table,
    "conditions": conditions.table,
    "execution": execution.table,
    "language": language.table,
    "ros2": ros2_cycle.table,
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
