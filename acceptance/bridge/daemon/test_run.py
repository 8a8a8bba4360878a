"""`robosc-bridge run` as a program, on a simulated TurtleBot3 at the other end of real serial lines."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from robosc.cli.main import main as robosc
from robosc_simulated import SimulatedTurtleBot3
from support.bridge_process import LIMIT_S, MODEL, START_LIMIT_S, bridge, configured, running, stands_still, wait_until

pytestmark = pytest.mark.real_time


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
