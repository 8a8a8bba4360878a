"""A bridge whose process is killed, or halted and let go on: what the devices do without it.

The wheels are watched at every step of the simulated world, whose time is the clock's.
"""

import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from robosc_simulated import SimulatedTurtleBot3
from robosc_simulated.world import WorldEvent
from support.bridge_process import LIMIT_S, START_LIMIT_S, bridge, running, wait_until

pytestmark = pytest.mark.real_time

# OpenCR's heartbeat and the servos' bus watchdog take 0.5 s from the last request that they have heard, a rover 3 s
# from the last target; the wheels have to be braked then.
PROMISED_S = {"opencr": 0.56, "dynamixel": 0.56, "mavlink-rover": 3.1}
LATER_S = 1.5


class Wheels:
    """The wheels of a robot, watched step by step.

    Args:
        robot: The robot.

    Attributes:
        moved_s: World time at which one of them turned last.
    """

    def __init__(self, robot: SimulatedTurtleBot3) -> None:
        self.moved_s = 0.0
        self._world = robot.world
        self._world.watch(self._on_step, self._on_event)

    def _on_step(self, time_s: float) -> None:
        if self.are_turning:
            self.moved_s = time_s

    def _on_event(self, time_s: float, event: WorldEvent) -> None:
        """Ignore what happens in the world."""

    @property
    def are_turning(self) -> bool:
        """True if one of them turns."""
        return bool(self._world.left.speed_rad_s or self._world.right.speed_rad_s)

    def signal(self, process: subprocess.Popen[str], number: signal.Signals) -> float:
        """Send a signal while they turn; the world's time then."""
        end_s = time.monotonic() + LIMIT_S
        while time.monotonic() < end_s:
            with self._world.time.lock:
                self._world.catch_up()
                if self.are_turning:
                    process.send_signal(number)
                    return self._world.lived_s
            time.sleep(0.01)
        raise AssertionError("the wheels do not turn")

    def check_that_they_stop(self, halted_s: float, promised_s: float) -> None:
        """They stand still within the time, and go on doing so for a while."""
        while self.lived_s() < halted_s + promised_s + LATER_S:
            time.sleep(0.02)
        assert 0.0 <= self.moved_s - halted_s <= promised_s

    def lived_s(self) -> float:
        """The world's time."""
        self._world.catch_up()
        return self._world.lived_s


@contextmanager
def halted(
    folder: Path, base: str, number: signal.Signals, address: str = "null"
) -> Iterator[tuple[subprocess.Popen[str], Wheels]]:
    """The bridge and the wheels, once these have stopped without it."""
    with SimulatedTurtleBot3("burger", base, "lds01") as robot, running(folder, robot, base, address) as process:
        wheels = Wheels(robot)
        wheels.check_that_they_stop(wheels.signal(process, number), PROMISED_S[base])
        yield process, wheels


@pytest.mark.parametrize("base", PROMISED_S)
def test_the_wheels_of_a_bridge_that_is_killed_stop_in_time(base: str, tmp_path: Path) -> None:
    with halted(tmp_path, base, signal.SIGKILL) as (process, _):
        assert process.wait(LIMIT_S) == -signal.SIGKILL


@pytest.mark.parametrize("base", PROMISED_S)
def test_a_bridge_that_was_halted_moves_nothing_when_it_goes_on(base: str, tmp_path: Path) -> None:
    with halted(tmp_path, base, signal.SIGSTOP) as (process, wheels):
        before_s = wheels.moved_s
        process.send_signal(signal.SIGCONT)
        # The operator cannot reach it to let it go on.
        _, errors = process.communicate(timeout=LIMIT_S)
        assert process.returncode == 1, errors
        assert "Traceback" not in errors
        assert wheels.lived_s() > before_s + LATER_S
        assert wheels.moved_s == before_s, errors


@pytest.mark.parametrize("base", PROMISED_S)
def test_a_bridge_that_was_halted_goes_on_when_an_operator_says_so(base: str, tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"127.0.0.1:{server.getsockname()[1]}"
    with halted(tmp_path, base, signal.SIGSTOP, address) as (process, wheels):
        before_s = wheels.moved_s
        process.send_signal(signal.SIGCONT)
        until_s = wheels.lived_s() + 2 * LATER_S
        while wheels.lived_s() < until_s:
            time.sleep(0.02)
        assert wheels.moved_s == before_s
        done = bridge("reset", "--address", address)
        assert (done.returncode, wheels.moved_s) == (0, before_s), done.stderr
        done = bridge("start", "--address", address)
        assert done.returncode == 0, done.stderr
        wait_until(lambda: wheels.lived_s() > 0 and wheels.moved_s > before_s, "it to move", process, START_LIMIT_S)
