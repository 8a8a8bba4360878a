"""`robosc-bridge run` as a program, on a simulated TurtleBot3 at the other end of real serial lines."""

import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from robosc.cli.main import main as robosc
from robosc_simulated import SimulatedTurtleBot3
from support.models import EXAMPLES

pytestmark = pytest.mark.real_time

MODEL = EXAMPLES / "maze_solver" / "maze_solver.rscd"
START_LIMIT_S, LIMIT_S = 90.0, 30.0


def wait_until(condition: Callable[[], bool], what: str, process: subprocess.Popen[str], limit_s: float) -> None:
    end_s = time.monotonic() + limit_s
    while not condition():
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < end_s, f"waited {limit_s} s in vain for {what}"
        time.sleep(0.01)


def bridge(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "robosc_bridge.main", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def configured(folder: Path, robot: SimulatedTurtleBot3, base: str) -> Path:
    """A configuration as `init` writes it, with the ports of a simulated robot."""
    made = bridge("init", "--model", str(MODEL), "--drive", base, "--scanner", "lds01")
    assert made.returncode == 0, made.stderr
    ports = iter((robot.base_path, robot.scanner_path))
    text = re.sub(r"^  port: .*$", lambda _: f"  port: {next(ports)}", made.stdout, flags=re.MULTILINE)
    # A machine on which tests run is not one for robots.
    text = text.replace("\nscanner:\n", "  options: {answer_limit_s: 0.3}\n\nscanner:\n", 1)
    text = re.sub(r"^  (overrun_s|motor_timeout_s|scan_timeout_s): .*$", r"  \1: 1.0", text, flags=re.MULTILINE)
    file = folder / "bridge.yaml"
    file.write_text(text)
    return file


@contextmanager
def running(folder: Path, robot: SimulatedTurtleBot3, base: str) -> Iterator[subprocess.Popen[str]]:
    """The bridge, until the robot has moved."""
    configuration = configured(folder, robot, base)
    command = [sys.executable, "-m", "robosc_bridge.main", "run", "--model", str(MODEL), "--config", str(configuration)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        start = robot.world.pose
        wait_until(lambda: robot.world.pose != start, "the robot to move", process, START_LIMIT_S)
        yield process
    finally:
        process.kill()
        process.communicate()


def stands_still(robot: SimulatedTurtleBot3) -> bool:
    robot.world.catch_up()
    return robot.world.left.speed_rad_s == 0.0 == robot.world.right.speed_rad_s


@pytest.mark.parametrize("base", ["opencr", "dynamixel"])
def test_the_maze_solver_drives_and_a_signal_ends_it_at_rest(base: str, tmp_path: Path) -> None:
    with SimulatedTurtleBot3("burger", base, "lds01") as robot, running(tmp_path, robot, base) as process:
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=LIMIT_S)
        assert process.returncode == 0, errors
        assert stands_still(robot)
        assert robot.left.table["torque enable"] == robot.right.table["torque enable"] == 0
        assert "Traceback" not in errors


def test_a_base_that_is_unplugged_is_one_clear_message_and_the_wheels_stop(tmp_path: Path) -> None:
    with SimulatedTurtleBot3("burger", "opencr", "lds01") as robot, running(tmp_path, robot, "opencr") as process:
        robot.base_line.disconnect()
        _, errors = process.communicate(timeout=LIMIT_S)
        assert process.returncode == 1, errors
        assert "the drive base is lost" in errors
        assert "Traceback" not in errors
        end_s = time.monotonic() + LIMIT_S
        while not stands_still(robot):
            assert time.monotonic() < end_s, "the wheels still rotate"
            time.sleep(0.01)


def test_a_bridge_that_is_killed_leaves_wheels_that_stop(tmp_path: Path) -> None:
    """The devices' own watchdogs are the last line."""
    with SimulatedTurtleBot3("burger", "dynamixel", "lds01") as robot, running(tmp_path, robot, "dynamixel") as process:
        process.kill()
        process.wait()
        end_s = time.monotonic() + LIMIT_S
        while not stands_still(robot):
            assert time.monotonic() < end_s, "the wheels still rotate"
            time.sleep(0.01)


def test_a_signed_supervisor_is_run_without_its_model(tmp_path: Path) -> None:
    supervisor = tmp_path / "maze.rsup"
    for command in (
        ("synth", str(MODEL), "-o", str(supervisor)),
        ("key", str(tmp_path / "ours")),
        ("sign", str(supervisor), "--key", str(tmp_path / "ours.key")),
    ):
        assert robosc(list(command)) == 0
    with SimulatedTurtleBot3("burger", "opencr", "lds01") as robot:
        file = configured(tmp_path, robot, "opencr")
        text = file.read_text()
        assert "  trusted_keys: []\n" in text
        file.write_text(text.replace("  trusted_keys: []\n", f"  trusted_keys: [{tmp_path / 'ours.pub'}]\n"))
        command_line = ["run", "--model", str(supervisor), "--config", str(file)]
        process = subprocess.Popen(
            [sys.executable, "-m", "robosc_bridge.main", *command_line], stderr=subprocess.PIPE, text=True
        )
        try:
            start = robot.world.pose
            wait_until(lambda: robot.world.pose != start, "the robot to move", process, START_LIMIT_S)
            process.send_signal(signal.SIGTERM)
            _, errors = process.communicate(timeout=LIMIT_S)
        finally:
            process.kill()
            process.communicate()
        assert process.returncode == 0, errors
        assert "maze.rsup: signed by SHA256:" in errors
        supervisor.write_bytes(supervisor.read_bytes() + b" ")
        refused = bridge(*command_line)
        assert (refused.returncode, "has been changed" in refused.stderr) == (2, True)
