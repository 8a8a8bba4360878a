"""Benchmark of `robosc-bridge run` with the configuration that `init` writes, in a maze in real time.

The bridge is a process as its unit of systemd runs it, and so is the simulated robot at the other end of real
pseudo-terminals; both have priority over other programs where that is permitted. *Ready*: from the start of the process
until it reports ready to systemd, and until the robot moves; the supervisor is made in between. *CPU*: user and
system time of the whole process over the time that passed, in a maze. *Scan to wheel byte* (until the bytes of the
velocity have been written to the port), *to decision* and *exchange*: as the bridge itself reports them (`robosc-bridge
status --json`), with and without a neighbour that keeps each processor busy.

In a maze few scans have another velocity, which is what *scan to wheel byte* counts. So there are rows with a model
that steers the other way at each scan.

Usage: shipped.py [SECONDS] [--busy]
"""

import argparse
import json
import os
import re
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(Path(__file__).parent), str(ROOT / "tests" / "benchmarks")]

from rig import LIMIT_S, Machine, Simulator, environment, simulated  # noqa: E402

from figures import text_table  # noqa: E402  # found through the path above
from support.real_time import preferred  # noqa: E402  # rig adds its folder to the path

SECONDS = 60.0
MAZE = ROOT / "examples" / "maze_solver" / "maze_solver.rscd"
STEERING = Path(__file__).with_name("steer_each_scan.rscd")
CASES = (
    (MAZE, "opencr", "lds02", False),
    (MAZE, "dynamixel", "lds03", False),
    (MAZE, "opencr", "lds02", True),
    (STEERING, "opencr", "lds02", False),
    (STEERING, "opencr", "lds02", True),
    (STEERING, "dynamixel", "lds03", True),
)
"""Model, base, LiDAR, and whether there is a busy neighbour."""

TIMES = {"scan_to_wheel": "scan to wheel byte", "scan_to_decision": "to decision", "exchange": "exchange"}
HEADER = ["model, base, LiDAR, neighbour", "READY s", "moves s", "CPU", *(f"{title} ms" for title in TIMES.values())]


@dataclass
class Measured:
    """Figures of one bridge, and its state at the end."""

    state: str
    ready_s: float
    moves_s: float
    cpu: float
    latencies: dict[str, Any]


def _command(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "robosc_bridge.command", *arguments]


def _configured(folder: Path, robot: Simulator, model: Path, base: str, lidar: str, address: str) -> Path:
    """The file of `init`, with the robot's ports and a remote endpoint."""
    file = folder / "maze.yaml"
    arguments = ["init", "--model", str(model), "--drive", base, "--scanner", lidar, "-o", str(file)]
    arguments += ["--drive-port", robot.base_path, "--scanner-port", robot.scanner_path]
    subprocess.run(_command(*arguments), env=environment(), check=True, stdout=subprocess.DEVNULL)
    text = file.read_text().replace("  grpc_address: null", f"  grpc_address: {address}")
    file.write_text(text)
    return file


def _cpu_s(process: int) -> float:
    """User and system time of a process."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _status(address: str) -> dict[str, Any] | None:
    done = subprocess.run(
        _command("status", "--json", "--address", address),
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    found: dict[str, Any] | None = json.loads(done.stdout) if done.stdout else None
    return found


@contextmanager
def _neighbours(count: int) -> Iterator[None]:
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def _measure(model: Path, base: str, lidar: str, is_busy: bool, seconds: float) -> Measured:
    with tempfile.TemporaryDirectory() as name, socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        folder = Path(name)
        manager.bind(str(folder / "notify"))
        manager.settimeout(LIMIT_S)
        with socket.create_server(("127.0.0.1", 0)) as server:
            address = f"127.0.0.1:{server.getsockname()[1]}"
        with preferred(), simulated("--base", base, "--lidar", lidar, "--scene", "maze-rooms") as robot:
            file = _configured(folder, robot, model, base, lidar, address)
            begin_s = time.monotonic()
            with preferred():
                bridge = subprocess.Popen(
                    _command("run", "--model", str(model), "--config", str(file)),
                    env={**environment(), "NOTIFY_SOCKET": str(folder / "notify")},
                    stderr=subprocess.DEVNULL,
                )
            try:
                ready_s = moves_s = 0.0
                while not moves_s:
                    notice = manager.recv(4096).decode()
                    ready_s = time.monotonic() - begin_s if notice == "READY=1" else ready_s
                    moves_s = time.monotonic() - begin_s if notice == "STATUS=running" else moves_s
                with _neighbours((os.cpu_count() or 1) if is_busy else 0):
                    before_cpu_s, before_s = _cpu_s(bridge.pid), time.monotonic()
                    time.sleep(seconds)
                    cpu = (_cpu_s(bridge.pid) - before_cpu_s) / (time.monotonic() - before_s)
                snapshot = _status(address) or {}
            finally:
                bridge.terminate()
                bridge.wait()
    latencies = {item["name"]: item for item in snapshot.get("latencies", [])}
    state = snapshot.get("state", "gone").lower().removeprefix("bridge_state_")
    return Measured(state, ready_s, moves_s, cpu, latencies)


def _spread(latency: dict[str, Any] | None) -> str:
    if latency is None or "count" not in latency:
        return "-"
    times = "/".join(f"{1e3 * latency[name]:.2f}" for name in ("p50_s", "p99_s", "max_s"))
    return f"{times} ({latency['count']})"


def _unlike_running(state: str) -> str:
    """Return the state of a bridge that did not run to the end: its figures are those of a part of the time."""
    return "" if state == "running" else f" ({state})"


def table(seconds: float = SECONDS, *, is_busy_only: bool = False) -> str:
    """A row for each case, or for those with a busy neighbour alone."""
    rows = []
    machine = Machine()
    with machine.watched():
        for model, base, lidar, is_busy in CASES:
            if is_busy_only and not is_busy:
                continue
            found = _measure(model, base, lidar, is_busy, seconds)
            rows.append(
                [
                    f"{model.stem}, {base}, {lidar}, {'busy' if is_busy else 'idle'}" + _unlike_running(found.state),
                    f"{found.ready_s:.2f}",
                    f"{found.moves_s:.2f}",
                    f"{found.cpu:.1%}",
                    *(_spread(found.latencies.get(name)) for name in TIMES),
                ]
            )
    exact = "p50 and p99 at most a tenth too long, and never below 0.25; max is exact"
    title = f"The configuration of `init` in a maze for {seconds:g} s, p50/p99/max (count); {exact}; {machine}"
    return text_table(re.sub(r"\s+", " ", title), HEADER, rows)


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seconds", nargs="?", type=float, default=SECONDS)
    parser.add_argument("--busy", action="store_true", help="only beside a busy neighbour")
    chosen = parser.parse_args()
    sys.stdout.write(table(chosen.seconds, is_busy_only=chosen.busy) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
