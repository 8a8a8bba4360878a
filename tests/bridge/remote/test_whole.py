"""`robosc-bridge run` with a remote face on a simulated TurtleBot3, commanded from a terminal: all as programs."""

import json
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from robosc_bridge.simulated import SimulatedTurtleBot3
from support.models import EXAMPLES
from support.remote import eventually

MODEL = EXAMPLES / "maze_solver" / "maze_solver.rscd"
START_LIMIT_S, LIMIT_S = 90.0, 30.0


def command(*arguments: str) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-m", "robosc_bridge.command", *arguments]
    return subprocess.run(line, capture_output=True, text=True, check=False, timeout=LIMIT_S)


def configured(folder: Path, robot: SimulatedTurtleBot3) -> Path:
    made = command("init", "--model", str(MODEL), "--drive", "opencr", "--scanner", "lds01")
    assert made.returncode == 0, made.stderr
    ports = iter((robot.base_path, robot.scanner_path))
    text = re.sub(r"^  port: .*$", lambda _: f"  port: {next(ports)}", made.stdout, flags=re.MULTILINE)
    text = re.sub(r"^  (overrun_s|motor_timeout_s|scan_timeout_s): .*$", r"  \1: 1.0", text, flags=re.MULTILINE)
    text = re.sub(r"^  grpc_address: .*$", "  grpc_address: 127.0.0.1:0", text, flags=re.MULTILINE)
    file = folder / "bridge.yaml"
    file.write_text(text)
    return file


class Running:
    """The program, and what it has written."""

    def __init__(self, configuration: Path) -> None:
        line = [sys.executable, "-m", "robosc_bridge.main", "run", "--standby"]
        line += ["--model", str(MODEL), "--config", str(configuration)]
        self.process = subprocess.Popen(line, stderr=subprocess.PIPE, text=True)
        self.written = ""
        self._thread = threading.Thread(target=self._read)
        self._thread.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.written += line

    def address(self) -> str:
        """Where its face listens."""
        found = eventually(lambda: re.search(r"the remote face listens on (\S+)\n", self.written), START_LIMIT_S)
        return found[1]

    def end(self) -> None:
        self.process.kill()
        self.process.wait()
        self._thread.join(LIMIT_S)
        assert self.process.stderr is not None
        self.process.stderr.close()


@contextmanager
def running(folder: Path, robot: SimulatedTurtleBot3) -> Iterator[Running]:
    bridge = Running(configured(folder, robot))
    try:
        yield bridge
    finally:
        bridge.end()


def speeds(robot: SimulatedTurtleBot3) -> tuple[float, float]:
    robot.world.catch_up()
    return robot.world.left.speed_rad_s, robot.world.right.speed_rad_s


def becomes(look: Callable[[], bool]) -> None:
    eventually(look, LIMIT_S)


def state(address: str) -> str:
    return str(json.loads(command("status", "--json", "--address", address).stdout)["state"])


@pytest.fixture
def robot() -> Iterator[SimulatedTurtleBot3]:
    with SimulatedTurtleBot3("burger", "opencr", "lds01") as made:
        yield made


def test_a_robot_is_started_watched_stopped_and_let_go_on_from_elsewhere(
    robot: SimulatedTurtleBot3, tmp_path: Path
) -> None:
    with running(tmp_path, robot) as bridge:
        address = bridge.address()
        eventually(lambda: state(address) == "BRIDGE_STATE_STANDBY", START_LIMIT_S)
        assert speeds(robot) == (0.0, 0.0)
        line = [sys.executable, "-m", "robosc_bridge.command", "watch", "--address", address]
        with subprocess.Popen(line, stdout=subprocess.PIPE, text=True) as watcher:
            assert watcher.stdout is not None
            assert "= standby" in watcher.stdout.readline()
            started = command("start", "--address", address)
            assert (started.returncode, started.stdout) == (0, "start: done\n"), started.stderr
            becomes(lambda: speeds(robot) != (0.0, 0.0))

            stopped = command("stop", "--address", address)
            assert (stopped.returncode, stopped.stderr) == (0, "")
            becomes(lambda: speeds(robot) == (0.0, 0.0))
            told = command("status", "--address", address)
            assert "nothing moves: An operator has stopped the robot. (until reset)" in told.stdout

            resumed = command("resume", "--address", address)
            assert (resumed.returncode, resumed.stderr) == (0, "")
            becomes(lambda: speeds(robot) != (0.0, 0.0))

            assert command("standby", "--address", address).returncode == 0
            assert state(address) == "BRIDGE_STATE_STANDBY"
            assert robot.left.table["torque enable"] == robot.right.table["torque enable"] == 0
            watcher.send_signal(signal.SIGINT)
            shown = watcher.stdout.read()
        assert " event      " in shown
        assert "An operator has stopped the robot." in shown
        bridge.process.send_signal(signal.SIGTERM)
        assert bridge.process.wait(LIMIT_S) == 0
        assert "Traceback" not in bridge.written


def test_a_stop_reaches_the_motors_at_once(
    robot: SimulatedTurtleBot3, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    from robosc_api.security import Credentials
    from robosc_bridge.terminal.client import BridgeClient, Wish

    with running(tmp_path, robot) as bridge:
        address = bridge.address()
        eventually(lambda: state(address) == "BRIDGE_STATE_STANDBY", START_LIMIT_S)
        with BridgeClient(address, Credentials()) as client:
            client.want(Wish.START)
            becomes(lambda: speeds(robot) != (0.0, 0.0))
            client.status()
            begin_s = time.monotonic()
            client.stop()
            answered_s = time.monotonic() - begin_s
            with robot.time.lock:
                world = robot.world
            while world.left.goal_rad_s != 0.0 or world.right.goal_rad_s != 0.0:
                assert time.monotonic() - begin_s < 5.0
                time.sleep(0.0005)
            record_property("stop over gRPC, answered (ms)", round(1000.0 * answered_s, 1))
            record_property("stop over gRPC, motors told (ms)", round(1000.0 * (time.monotonic() - begin_s), 1))

        line = [sys.executable, "-m", "robosc_bridge.command", "watch", "--address", address]
        with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as watcher:
            assert watcher.stdout is not None
            assert watcher.stderr is not None
            watcher.stdout.readline()
            # A bridge that hangs is told to whoever relies on it.
            bridge.process.send_signal(signal.SIGSTOP)
            stopped = command("stop", "--address", address)
            assert stopped.returncode == 2
            assert stopped.stderr.startswith("robosc-bridge: ")
            assert watcher.wait(LIMIT_S) == 2
            assert "no bridge answers at" in watcher.stderr.read()


def test_an_address_that_cannot_be_used_is_one_line(robot: SimulatedTurtleBot3, tmp_path: Path) -> None:
    file = configured(tmp_path, robot)
    file.write_text(file.read_text().replace("127.0.0.1:0", "0.0.0.0:0"))
    bridge = Running(file)
    try:
        assert bridge.process.wait(START_LIMIT_S) == 2
        eventually(lambda: "can be reached from other machines" in bridge.written)
        assert "Traceback" not in bridge.written
    finally:
        bridge.end()
