"""`robosc-bridge run` as a process, on a simulated TurtleBot3 at the other end of real serial lines."""

import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from robosc_simulated import SimulatedTurtleBot3
from support.models import EXAMPLES

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


def configured(folder: Path, robot: SimulatedTurtleBot3, base: str, address: str = "null", model: Path = MODEL) -> Path:
    """A configuration as `init` writes it, with the ports of a simulated robot.

    Args:
        folder: Folder for it.
        robot: The robot.
        base: Driver of its drive base.
        address: Address of its remote endpoint; null: there is none.
        model: Its model.
    """
    first = "opencr" if base == "mavlink-rover" else base
    made = bridge("init", "--model", str(model), "--drive", first, "--scanner", "lds01")
    assert made.returncode == 0, made.stderr
    ports = iter((robot.base_path, robot.scanner_path))
    text = re.sub(r"^  port: .*$", lambda _: f"  port: {next(ports)}", made.stdout, flags=re.MULTILINE)
    # A machine on which tests run is not one for robots.
    if base == "mavlink-rover":
        # A rover is described by its numbers, and has no buttons.
        text = text.replace("  driver: opencr\n", "  driver: mavlink-rover\n", 1)
    else:
        text = text.replace("\nscanner:\n", "  options: {answer_limit_s: 0.3}\n\nscanner:\n", 1)
    text = re.sub(
        r"^  (overrun_s|motor_timeout_s|command_timeout_s|scan_timeout_s): .*$", r"  \1: 1.0", text, flags=re.MULTILINE
    )
    text = text.replace("  grpc_address: null\n", f"  grpc_address: {address}\n", 1)
    file = folder / "bridge.yaml"
    file.write_text(text)
    return file


@contextmanager
def running(
    folder: Path, robot: SimulatedTurtleBot3, base: str, address: str = "null", *arguments: str
) -> Iterator[subprocess.Popen[str]]:
    """The bridge, once the robot has moved; arguments are those of `configured`, and further ones of `run`."""
    configuration = configured(folder, robot, base, address)
    command = [sys.executable, "-m", "robosc_bridge.main", "run", "--model", str(MODEL), "--config", str(configuration)]
    command += arguments
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        start = robot.world.pose
        wait_until(lambda: robot.world.pose != start, "the robot to move", process, START_LIMIT_S)
        yield process
    finally:
        process.kill()
        process.communicate()


def speeds(robot: SimulatedTurtleBot3) -> tuple[float, float]:
    """Return the speeds of the wheels now, in rad/s."""
    robot.world.catch_up()
    return robot.world.left.speed_rad_s, robot.world.right.speed_rad_s


def stands_still(robot: SimulatedTurtleBot3) -> bool:
    """Return True if no wheel turns."""
    return speeds(robot) == (0.0, 0.0)
