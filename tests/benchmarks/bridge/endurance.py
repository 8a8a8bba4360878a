"""Hours of driving in minutes: what grows, whether the schedule drifts, and whether the robot meets a wall.

A robot wanders through a simulated room in a time of its own (`virtual_robot.py` says what is real in it). *Drift*: by
how much the schedule of the last decision is off the first one's and as many periods. *Memory* and what is behind it:
what has grown since a tenth of the time had passed: resident memory, Python objects, what waits in the loop's inbox,
open files. An hour takes some ten minutes.

Usage: endurance.py [--hours H] [--base NAME] [--json]
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(Path(__file__).parent), str(ROOT / "tests" / "benchmarks")]

from rig import WANDERER, WANDERER_CHANNELS, environment  # noqa: E402

from figures import text_table  # noqa: E402  # found through the path above

HOURS = 0.5
CASES = {"dynamixel": 0.010, "opencr": 0.020}
SCANNER = "lds03"
WARM_UP = 0.1
SAMPLES = 100

HEADER = [
    "base, period", "hours", "took, s", "decisions", "exchanges", "scans", "drift, us", "late max, ms", "overruns",
    "driven, m", "collisions", "memory, kB", "objects", "inbox", "files",
]  # fmt: skip


def measured(base: str, hours: float) -> dict[str, Any]:
    """Drive; in a process of its own, whose time is no longer the computer's."""
    command = [sys.executable, str(Path(__file__)), "--hours", str(hours), "--base", base, "--json"]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, env=environment())
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def _row(base: str, hours: float) -> list[str]:
    found = measured(base, hours)
    return [
        f"{base}, {CASES[base] * 1e3:.0f} ms",
        f"{found['hours']:.2f}",
        f"{found['took_s']:.0f}",
        *(str(found[name]) for name in ("decisions", "exchanges", "scans")),
        f"{found['drift_s'] * 1e6:.1f}",
        f"{found['late_s'] * 1e3:.2f}",
        str(found["overruns"]),
        f"{found['driven_m']:.0f}",
        str(found["collisions"]),
        *(f"{found[name]:+d}" for name in ("memory_kb", "objects", "inbox", "files")),
    ]


def table(hours: float = HOURS, bases: tuple[str, ...] = tuple(CASES)) -> str:
    """One row for each base."""
    return text_table("Endurance of the bridge, in virtual time", HEADER, [_row(base, hours) for base in bases])


def drive(base: str, hours: float) -> dict[str, Any]:
    """Drive, in this process.

    Raises:
        RuntimeError: Something has stopped the robot.
    """
    # Time is another one from here on.
    from endurance_watch import Watch
    from virtual_robot import CLOCK, VirtualRobot, real_monotonic

    from robosc_bridge.daemon.states import State
    from robosc_bridge.simulated.walls import room

    begin_s = real_monotonic()
    configuration = f"""
robot: burger
drive: {{driver: {base}, port: base}}
scanner: {{driver: {SCANNER}, port: scanner}}
execution: {{period_s: {CASES[base]}, every: event}}
channels:{WANDERER_CHANNELS}"""
    robot = VirtualRobot(WANDERER, configuration, base, SCANNER, room(4.0, 3.0))
    watch = Watch(robot)
    start_s, length_s = CLOCK.now_s, hours * 3600
    grown = watch.held()
    for sample in range(1, SAMPLES + 1):
        robot.live(start_s + length_s * sample / SAMPLES, watch.step)
        if sample == round(SAMPLES * WARM_UP):
            grown = watch.held()
        if robot.machine.daemon.state is not State.RUNNING:
            raise RuntimeError(f"{robot.machine.daemon.state}: {robot.machine.daemon.problem}")
    held = watch.held()
    return {
        "hours": (CLOCK.now_s - start_s) / 3600,
        "took_s": real_monotonic() - begin_s,
        **watch.counted(),
        **{name: held[name] - grown[name] for name in held},
    }


def main() -> int:
    """Print the table, or what one base has shown."""
    parser = argparse.ArgumentParser(description="Hours of driving in minutes.")
    parser.add_argument("--hours", type=float, default=HOURS)
    parser.add_argument("--base", choices=sorted(CASES))
    parser.add_argument("--json", action="store_true", help="for programs: one base, dynamixel if none is named")
    options = parser.parse_args()
    if options.json:
        found = drive(options.base or "dynamixel", options.hours)
        sys.stdout.write(json.dumps(found) + "\n")
    else:
        sys.stdout.write(table(options.hours, (options.base,) if options.base else tuple(CASES)) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
