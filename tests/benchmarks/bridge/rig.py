"""Shared parts of the bridge's benchmarks: a simulated robot as a process of its own, configurations, and figures."""

import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "tests"))

from support.real_time import preferred  # noqa: E402  # found through the path above

WANDERER = Path(__file__).with_name("wanderer.rscd")
STOP_AT_OBSTACLE = Path(__file__).with_name("stop_at_obstacle.rscd")
LIMIT_S = 60.0

WANDERER_CHANNELS = """
  /scan: {channel: scanner}
  /rotate: {channel: rotate, unit: degrees, direction: left}
  /rotated: {channel: rotated}
  /cmd_vel: {channel: drive}
"""
STOP_CHANNELS = """
  /scan: {channel: scanner}
  /cmd_vel: {channel: drive}
"""


def environment() -> dict[str, str]:
    """Variables with which the sources are found."""
    paths = (ROOT, ROOT / "bridge", ROOT / "client", ROOT / "proto", ROOT / "tests")
    return {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, paths))}


class Simulator:
    """A simulated robot in a process of its own."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process
        self.base_path, self.scanner_path = (self._line().split()[1] for _ in range(2))

    def _line(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline()

    def send(self, command: str) -> None:
        """Have it do something that it does not answer."""
        assert self._process.stdin is not None
        self._process.stdin.write(command + "\n")
        self._process.stdin.flush()

    def ask(self, command: str) -> str:
        """Have it answer."""
        self.send(command)
        return self._line().strip()


@contextmanager
def simulated(*arguments: str) -> Iterator[Simulator]:
    """A robot, simulated until the block ends; arguments are those of `python -m robosc_simulated`."""
    command = [sys.executable, "-m", "robosc_simulated", *arguments]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment())
    try:
        yield Simulator(process)
    finally:
        process.terminate()
        process.communicate()


def configuration(robot: Simulator, base: str, lidar: str, period_s: float, channels: str) -> str:
    """A configuration for a simulated Burger, whose time-outs bear with a machine that has other work, too."""
    options = "answer_limit_s: 0.1" + (", watchdog_s: 2.5" if base == "dynamixel" else "")
    return f"""
robot: burger
drive: {{driver: {base}, port: {robot.base_path}, options: {{{options}}}}}
scanner: {{driver: {lidar}, port: {robot.scanner_path}}}
execution: {{period_s: {period_s}, every: event}}
safety: {{overrun_s: 1.0, motor_timeout_s: 1.0, scan_timeout_s: 2.0, command_timeout_s: 1.0}}
channels:{channels}"""


def percentile(samples: Sequence[float], percent: float) -> float:
    """The smallest sample that at least so many percent of all do not exceed."""
    return sorted(samples)[max(math.ceil(len(samples) * percent / 100) - 1, 0)]


def in_ms(seconds: float) -> str:
    """Milliseconds, for a table."""
    return f"{seconds * 1e3:.2f}"


def spread(samples_s: Sequence[float]) -> list[str]:
    """50th and 99th percentile and maximum in milliseconds."""
    return [in_ms(percentile(samples_s, percent)) for percent in (50, 99, 100)]


class Machine:
    """Other activity of the machine during a measurement: a figure says little without it."""

    def __init__(self) -> None:
        self._late_s: list[float] = []
        self._away_s: list[tuple[float, float]] = []
        self._stolen = 0.0

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Watch it during the block."""
        command = [sys.executable, str(Path(__file__).with_name("wakeups.py"))]
        with preferred():
            process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        stolen, total = _ticks()
        try:
            yield
        finally:
            now_stolen, now_total = _ticks()
            self._stolen = (now_stolen - stolen) / max(now_total - total, 1)
            found = json.loads(process.communicate()[0])
            self._late_s, self._away_s = found["late_s"], found["away_s"]

    def was_away(self, begin_s: float, end_s: float) -> bool:
        """Return True if a processor did nothing for anyone during a part of this time, by `time.monotonic`."""
        return any(since_s < end_s and until_s > begin_s for since_s, until_s in self._away_s)

    def __str__(self) -> str:
        """Load, what the host took away, and how late a program wakes that sleeps for a millisecond."""
        p50, p99, most = spread(self._late_s)
        return (
            f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors, {self._stolen:.1%} stolen; "
            f"a bare program wakes late by {p50}/{p99}/{most} ms (p50/p99/max)"
        )


def _ticks() -> tuple[int, int]:
    """Return the ticks of all processors: those taken away by the host, and the total."""
    fields = [int(word) for word in Path("/proc/stat").read_text().splitlines()[0].split()[1:9]]
    return fields[7], sum(fields)
