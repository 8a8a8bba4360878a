"""Compares the navigation robot's ROS 2 node with the reference executor, in the recorded run.

Usage: python tests/equivalence/compare_navigation.py FOLDER

It needs an environment with the built interfaces of the example robots, which the test run has not: so it is a program.
"""

import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.equivalence.python_targets import observe
from support.equivalence.random_scenarios import for_node
from support.equivalence.recorded import read_recorded
from support.equivalence.ros2_target import ros2_target
from support.equivalence.targets import compare
from support.equivalence.worlds import robot_supervisor


def main() -> int:
    """Compare; say how often what was asked for."""
    supervisor = robot_supervisor("navigation")
    scenario = for_node(supervisor, read_recorded("navigation"))
    seen = observe(supervisor, scenario)
    compare(ros2_target(supervisor, Path(sys.argv[1])), scenario, seen)
    counts = Counter(kind for item in seen for kind, _, _ in item.issued)
    sys.stdout.write(
        f"the same: {len(seen)} steps, {counts['call']} calls, {counts['goal']} goals, {counts['cancel']} cancels\n"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
