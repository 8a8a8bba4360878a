"""Benchmark of the duration of an exchange with a drive base, and of the cost of waiting.

The simulated robot is a process of its own, at the far end of a real pseudo-terminal, and moves; exchanges follow one
another by their period. *Command*: from the call to the first byte of the command on the line. *CPU*: of the thread
that exchanges. *Waiting*: the same while an answer does not come for a second.
"""

import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from figures import text_table
from robosc_bridge.devices.dynamixel_bus import DynamixelBus
from robosc_bridge.devices.interface import Velocity
from robosc_bridge.devices.robots import BURGER
from robosc_bridge.driver_registry import make_drive_base
from robosc_bridge.errors import DeviceSilentError
from robosc_bridge.transport.serial_line import SerialLine

ROOT = Path(__file__).parents[3]
EXCHANGES = 1000
PERIODS_S = {"opencr": 0.020, "dynamixel": 0.010}
WAIT_S = 1.0

HEADER = ["base, period", "p50, ms", "p99, ms", "max, ms", "command p50, ms", "p99, ms", "CPU", "waiting, CPU"]


@contextmanager
def _simulated(base: str) -> Iterator[str]:
    """The port of a robot's base."""
    command = [sys.executable, "-m", "robosc_simulated", "--base", base]
    paths = f"{ROOT}:{ROOT / 'bridge'}"
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env={"PYTHONPATH": paths}
    )
    assert process.stdout is not None
    try:
        yield process.stdout.readline().split()[1]
    finally:
        process.terminate()
        process.communicate()


def _percentile(samples_s: list[float], percent: int) -> str:
    return f"{statistics.quantiles(samples_s, n=100)[percent - 1] * 1e3:.2f}"


def _waiting_share(path: str) -> float:
    """Share of a processor that waiting for an answer takes; no device has the id of the request."""
    with SerialLine(path, 1_000_000) as line:
        bus = DynamixelBus(line, str, WAIT_S)
        bus.begin(WAIT_S, repeats=0)
        begin_s = time.thread_time()
        try:
            bus.ping(250)
        except DeviceSilentError:
            return (time.thread_time() - begin_s) / WAIT_S
    raise AssertionError("somebody answers as device 250")


def _row(name: str) -> list[str]:
    period_s = PERIODS_S[name]
    with _simulated(name) as path:
        waiting = _waiting_share(path)
        base = make_drive_base(name, path=path, robot=BURGER)
        base.open()
        base.set_torque(True)
        commanded_s: list[float] = []
        line = base._line  # type: ignore[attr-defined]
        write = line.write

        def watched_write(data: bytes, limit_s: float = 0.1) -> None:
            commanded_s.append(time.perf_counter())
            write(data, limit_s)

        line.write = watched_write
        exchanges_s, commands_s = [], []
        begin_cpu_s, begin_s = time.thread_time(), time.perf_counter()
        for index in range(EXCHANGES):
            commanded_s.clear()
            # The robot turns to and fro on the spot: walls would change nothing, but it should not meet one.
            before_s = time.perf_counter()
            base.exchange(Velocity(0.0, 0.5 if index % 100 < 50 else -0.5))
            exchanges_s.append(time.perf_counter() - before_s)
            commands_s.append(commanded_s[0] - before_s)
            time.sleep(max(begin_s + (index + 1) * period_s - time.perf_counter(), 0.0))
        share = (time.thread_time() - begin_cpu_s) / (time.perf_counter() - begin_s)
        base.close()
    return [
        f"{name}, {period_s * 1e3:.0f} ms",
        _percentile(exchanges_s, 50),
        _percentile(exchanges_s, 99),
        f"{max(exchanges_s) * 1e3:.2f}",
        _percentile(commands_s, 50),
        _percentile(commands_s, 99),
        f"{share:.1%}",
        f"{waiting:.1%}",
    ]


def table() -> str:
    """One row for each drive base."""
    return text_table(f"Drive bases, {EXCHANGES} exchanges", HEADER, [_row(name) for name in PERIODS_S])
