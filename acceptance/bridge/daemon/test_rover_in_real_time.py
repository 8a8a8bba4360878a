"""A bridge as a process, and a rover at the other end of real serial lines: ends while it is armed, and obstacles."""

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from robosc_bridge.safety import Reason
from robosc_bridge.transport.system_host import SYSTEM_HOST
from robosc_simulated import Rover, SimulatedTurtleBot3
from robosc_simulated.rover import GUIDED
from support.bridge_process import LIMIT_S, MODEL, START_LIMIT_S, configured, wait_until
from support.driven import driven

pytestmark = pytest.mark.real_time

ARM = 400


def _rover(robot: SimulatedTurtleBot3) -> Rover:
    assert robot.rover is not None
    return robot.rover


def _orders(robot: SimulatedTurtleBot3) -> list[float]:
    """Return the orders to arm (1) and to disarm (0), as the rover has heard them."""
    return [parameters[0] for number, parameters in _rover(robot).commands if number == ARM]


@contextmanager
def _arming(folder: Path, robot: SimulatedTurtleBot3) -> Iterator[subprocess.Popen[str]]:
    """The bridge, once the rover has heard an order to arm, which it does not answer."""
    _rover(robot).answers_commands = False
    _rover(robot).mode = GUIDED
    configuration = configured(folder, robot, "mavlink-rover")
    command = [sys.executable, "-m", "robosc_bridge.main", "run", "--model", str(MODEL), "--config", str(configuration)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        wait_until(lambda: 1.0 in _orders(robot), "an order to arm", process, START_LIMIT_S)
        yield process
    finally:
        process.kill()
        process.communicate()


def test_a_bridge_that_is_interrupted_while_it_arms_leaves_no_armed_rover(tmp_path: Path) -> None:
    with (
        SimulatedTurtleBot3("burger", "mavlink-rover", "lds01") as robot,
        _arming(tmp_path, robot) as process,
    ):
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=LIMIT_S)
        assert process.returncode == 0, errors
        time.sleep(2.0)
        assert not _rover(robot).is_armed
        assert _orders(robot).count(1.0) == 1
        assert 0.0 in _orders(robot)


def test_a_bridge_that_cannot_undo_an_order_to_arm_says_so_and_ends_with_1(tmp_path: Path) -> None:
    with (
        SimulatedTurtleBot3("burger", "mavlink-rover", "lds01") as robot,
        _arming(tmp_path, robot) as process,
    ):
        robot.base_faults.drop_share = 1.0
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=LIMIT_S)
        assert process.returncode == 1, errors
        assert "the rover may be armed" in errors
        assert "Traceback" not in errors


@pytest.mark.parametrize("kind", ["ring", "sensors"])
def test_a_rover_does_not_go_on_to_what_it_touches(kind: str) -> None:
    def before(robot: SimulatedTurtleBot3) -> None:
        _rover(robot).obstacles = kind

    with driven("mavlink-rover", "mavlink-rover", (0.1, 0.0), host=SYSTEM_HOST, before=before) as bridge:
        bridge.stopped_after(lambda: _rover(bridge.robot).reported_cm.update({0: 0}), 0.4)
        snapshot = bridge.machine.operations.feed.snapshot
        assert snapshot is not None
        assert Reason.SCAN_TOUCHING in snapshot.reasons
        bridge.stays(0.5)
