"""Hours of driving in minutes: growth of what is held, drift of the schedule, and collisions.

A robot wanders through a simulated room on virtual time (`robosc_simulated.VirtualHost`): the bridge and the
simulated devices are the real ones. *Drift*: difference between the schedule of the last decision and that of the
first one and as many periods. *Memory* and what is behind it: growth since a tenth of the time had passed, of resident
memory, Python objects, items in the loop's inbox, open files.

Usage: endurance.py [--hours H] [--base NAME] [--json]
"""

import argparse
import gc
import json
import math
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(Path(__file__).parent), str(ROOT / "tests" / "benchmarks")]

from rig import WANDERER, WANDERER_CHANNELS, environment  # noqa: E402

from figures import text_table  # noqa: E402  # found through the path above
from robosc.execution.runtime.event_log import NullLog  # noqa: E402
from robosc.execution.runtime.executor import Executor  # noqa: E402
from robosc.model.structure import Deployment  # noqa: E402
from robosc_bridge.assembly import Machine, assemble  # noqa: E402
from robosc_bridge.configuration import map_channels, parse  # noqa: E402
from robosc_bridge.daemon.states import State  # noqa: E402
from robosc_bridge.daemon.supervisors import Source, obtain  # noqa: E402
from robosc_bridge.safety import SafetyLayer  # noqa: E402
from robosc_simulated import SimulatedTurtleBot3, VirtualHost  # noqa: E402
from robosc_simulated.walls import room  # noqa: E402

HOURS = 0.5
CASES = {"dynamixel": 0.010, "opencr": 0.020}
SCANNER = "lds03"
WARM_UP = 0.1
SAMPLES = 100
END_S = 10.0
LOOK_S = 0.1
"""Time between two looks at the robot's place, from which its way is summed up."""

HEADER = [
    "base, period", "hours", "took, s", "decisions", "exchanges", "scans", "drift, us", "late max, ms", "overruns",
    "driven, m", "collisions", "memory, kB", "objects", "inbox", "files",
]  # fmt: skip

_PAGE_KB = os.sysconf("SC_PAGE_SIZE") // 1024


def measured(base: str, hours: float) -> dict[str, Any]:
    """Drive in a process of its own, which holds nothing else."""
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
    """Return one row for each base."""
    return text_table("Endurance of the bridge, in virtual time", HEADER, [_row(base, hours) for base in bases])


class BridgeWatch:
    """Counts of what a bridge does.

    Args:
        machine: The bridge, which has not begun yet.
        host: The host that it runs on.
        period_s: Period of its decisions, in seconds.
    """

    def __init__(self, machine: Machine, host: VirtualHost, period_s: float) -> None:
        self._daemon = machine.daemon
        self._clock = host.monotonic
        self._period_s = period_s
        self._decisions = self._exchanges = self._scans = 0
        self._first_due_s = self._last_due_s = math.nan
        self._late_s = 0.0
        watch = self
        tick, on_scan, step = Executor.tick, SafetyLayer.on_scan, machine.drive._worker.step

        def counted_tick(self: Executor) -> None:
            watch._decided()
            tick(self)

        def counted_scan(self: SafetyLayer, *arguments: Any) -> None:
            watch._scans += 1
            on_scan(self, *arguments)

        def counted_step(now_s: float) -> float:
            watch._exchanges += 1
            return step(now_s)

        Executor.tick = counted_tick  # type: ignore[method-assign]
        SafetyLayer.on_scan = counted_scan  # type: ignore[method-assign,assignment]
        machine.drive._worker.step = counted_step  # type: ignore[method-assign]

    def _decided(self) -> None:
        # Only the loop knows its schedule.
        self._last_due_s = self._daemon._execution.due_s
        if not self._decisions:
            self._first_due_s = self._last_due_s
        self._decisions += 1
        self._late_s = max(self._late_s, self._clock() - self._last_due_s)

    def counted(self) -> dict[str, Any]:
        """Return what was done so far."""
        periods = self._decisions - 1 + self._daemon.overruns
        return {
            "decisions": self._decisions,
            "exchanges": self._exchanges,
            "scans": self._scans,
            "drift_s": self._last_due_s - self._first_due_s - periods * self._period_s,
            "late_s": self._late_s,
            "overruns": self._daemon.overruns,
        }

    def held(self) -> dict[str, int]:
        """Return what is held now."""
        gc.collect()
        return {
            "memory_kb": int(Path("/proc/self/statm").read_text().split()[1]) * _PAGE_KB,
            "objects": len(gc.get_objects()),
            "inbox": self._daemon._inbox.qsize(),
            "files": len(list(Path("/proc/self/fd").iterdir())),
        }


def drive(base: str, hours: float) -> dict[str, Any]:
    """Drive, in this process.

    Raises:
        RuntimeError: Something has stopped the robot.
    """
    begin_s = time.monotonic()
    with (
        VirtualHost() as host,
        SimulatedTurtleBot3("burger", base, SCANNER, walls=room(4.0, 3.0), clock=host) as robot,
    ):
        configuration = f"""
robot: burger
drive: {{driver: {base}, port: {robot.base_path}}}
scanner: {{driver: {SCANNER}, port: {robot.scanner_path}}}
execution: {{period_s: {CASES[base]}, every: event}}
channels:{WANDERER_CHANNELS}"""
        loaded = parse(configuration.encode(), "virtual.yaml")
        supervisor = obtain(Source(WANDERER, Deployment.CONTROLLER, None, None), lambda text: None)
        mapping = map_channels(supervisor.model, loaded.configuration, loaded.document)
        machine = assemble(loaded.configuration, mapping, supervisor, NullLog(), starts_itself=True, host=host)
        watch = BridgeWatch(machine, host, CASES[base])
        # Its place is known at any time, only its distance has to be summed up.
        start_s, place_m, driven_m = host.monotonic(), robot.world.pose[:2], 0.0
        loop = host.thread(lambda: _run(machine), "loop")
        loop.start()
        try:
            grown = watch.held()
            for sample in range(1, SAMPLES + 1):
                end_s = start_s + hours * 3600 * sample / SAMPLES
                while (left_s := end_s - host.monotonic()) > 0:
                    host.sleep(min(left_s, LOOK_S))
                    driven_m += math.dist(place_m, place_m := robot.world.pose[:2])
                if sample == round(SAMPLES * WARM_UP):
                    grown = watch.held()
                if machine.daemon.state is not State.RUNNING:
                    raise RuntimeError(f"{machine.daemon.state}: {machine.daemon.problem}")
            held = watch.held()
            return {
                "hours": (host.monotonic() - start_s) / 3600,
                "took_s": time.monotonic() - begin_s,
                **watch.counted(),
                "driven_m": driven_m,
                "collisions": robot.world.collisions,
                **{name: held[name] - grown[name] for name in held},
            }
        finally:
            machine.quit()
            loop.join(END_S)


def _run(machine: Machine) -> None:
    machine.run()


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
