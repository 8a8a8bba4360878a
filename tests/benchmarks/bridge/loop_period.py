"""Benchmark of the punctuality of the bridge's decisions, and of its share of a processor in standby and driving.

A robot wanders through a simulated room. It is a process of its own at the far end of real pseudo-terminals, the
bridge another one; both have priority over other programs where that is permitted. *Watchers* take all that the
bridge shows; *pages* of its live view are open in processes of their own, which receive the messages and draw
nothing. *Late*: delay of a decision against the schedule. *CPU*: user and system time of the whole bridge process
over the time that passed.

Usage: loop_period.py [SECONDS]
"""

import argparse
import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(Path(__file__).parent), str(ROOT / "tests" / "benchmarks")]

from rig import (  # noqa: E402
    LIMIT_S,
    WANDERER,
    WANDERER_CHANNELS,
    Machine,
    configuration,
    environment,
    simulated,
    spread,
)

from figures import text_table  # noqa: E402  # found through the path above
from support.real_time import preferred  # noqa: E402  # rig adds its folder to the path

SECONDS = 30.0
STANDBY_S = 5.0
CASES = (
    ("dynamixel", 0.010, 0, 0),
    ("dynamixel", 0.010, 1, 0),
    ("dynamixel", 0.010, 0, 1),
    ("dynamixel", 0.020, 0, 0),
    ("opencr", 0.020, 0, 0),
    ("opencr", 0.020, 1, 0),
    ("opencr", 0.020, 0, 1),
)
"""Base, period, how many watch, and how many pages of the live view are open."""

LIDAR = "lds02"

HEADER = [
    "base, period, watchers, pages", "decisions", "late p50, ms", "p99, ms", "max, ms", "overruns", "CPU standby",
    "running",
]  # fmt: skip


@dataclass(frozen=True)
class Measured:
    """Results of one run.

    Attributes:
        late_s: Lateness of each decision, in seconds.
        overruns: Decisions that were left out.
        standby: Share of a processor in standby.
        running: Share of a processor while driving.
        messages: Number of messages that each page got.
    """

    late_s: tuple[float, ...]
    overruns: int
    standby: float
    running: float
    messages: tuple[int, ...]


def measured(
    base: str, period_s: float, watchers: int, pages: int, seconds: float, standby_s: float = STANDBY_S
) -> Measured:
    """Measure one base at one period."""
    with preferred(), simulated("--base", base, "--lidar", LIDAR) as robot, tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bridge.yaml"
        file.write_text(configuration(robot, base, LIDAR, period_s, WANDERER_CHANNELS))
        command = [
            sys.executable, str(Path(__file__).with_name("bridge_process.py")), str(WANDERER), str(file),
            str(standby_s), str(seconds), str(watchers), str(pages),
        ]  # fmt: skip
        done = subprocess.run(
            command, stdout=subprocess.PIPE, text=True, check=True, env=environment(), timeout=seconds + 3 * LIMIT_S
        )
    found = json.loads(done.stdout)
    if found["problem"]:
        raise RuntimeError(f"the robot was stopped: {found['problem']}")
    if any(count < seconds for count in found["messages"]):
        raise RuntimeError(f"a page received next to nothing: {found['messages']} messages")
    return Measured(
        tuple(found["late_s"]), found["overruns"], found["standby"], found["running"], tuple(found["messages"])
    )


def _row(base: str, period_s: float, watchers: int, pages: int, seconds: float) -> list[str]:
    found = measured(base, period_s, watchers, pages, seconds)
    label = f"{base}, {period_s * 1e3:.0f} ms, {watchers}, {pages}"
    shares = [f"{found.standby:.1%}", f"{found.running:.1%}"]
    return [label, str(len(found.late_s)), *spread(found.late_s), str(found.overruns), *shares]


def table(seconds: float = SECONDS) -> str:
    """One row for each base and period."""
    machine = Machine()
    with machine.watched():
        rows = [_row(*case, seconds) for case in CASES]
    return text_table(f"Loop of the bridge, {seconds:g} s each ({machine})", HEADER, rows)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="How punctually the bridge decides.")
    parser.add_argument("seconds", type=float, nargs="?", default=SECONDS, help="of each drive (default: %(default)s)")
    sys.stdout.write(table(parser.parse_args().seconds) + "\n")
