"""Some faults of each kind on real pseudo-terminals and threads, by the computer's clock.

They are the witness that what `tests/bridge/daemon/test_faults.py` shows on a virtual host is so in real time.
"""

import errno
import os

import pytest

from robosc_bridge.daemon.states import OperatorCommand, State
from robosc_bridge.transport.system_host import SYSTEM_HOST
from robosc_simulated import SimulatedTurtleBot3
from support.driven import PATIENT, driven
from support.robot_faults import GRAVE, STATED_S

pytestmark = pytest.mark.real_time

WITNESSES = (
    ("opencr", "a motor is overloaded"),
    ("dynamixel", "the base is unplugged"),
    ("opencr", "its answers are lost"),
)
WHILE_S = 0.3


@pytest.mark.parametrize(("base", "row"), WITNESSES)
def test_a_grave_fault_stops_the_wheels_in_time_and_ends_the_run(base: str, row: str) -> None:
    fault = next(fault for fault in GRAVE if fault.row == row)
    with driven(base, host=SYSTEM_HOST, options="{}" if fault.is_line else PATIENT) as bridge:
        bridge.stopped_after(lambda: fault.cause(bridge), STATED_S[fault.row])
        assert fault.problem in bridge.ended()
        bridge.stays(WHILE_S)


def test_a_loop_that_hangs_stops_the_wheels_until_it_turns_again() -> None:
    with driven("dynamixel", host=SYSTEM_HOST) as bridge:
        bridge.stopped_after(lambda: setattr(bridge.log, "hangs", True), STATED_S["the loop hangs"])
        bridge.stays(WHILE_S)
        bridge.log.hangs = False
        bridge.moves()


def test_an_operators_stop_holds() -> None:
    with driven("opencr", host=SYSTEM_HOST) as bridge:
        bridge.stopped_after(lambda: bridge.machine.daemon.post(OperatorCommand.STOP), STATED_S["an operator stops it"])
        bridge.stays(WHILE_S)


def test_a_lidar_that_is_silent_stops_the_wheels_until_it_is_not() -> None:
    lidar = "lds03"
    with driven("dynamixel", lidar, host=SYSTEM_HOST) as bridge:
        scanner = bridge.robot.scanner
        bridge.stopped_after(lambda: setattr(scanner, "is_stalled", True), STATED_S[f"{lidar} is silent"])
        bridge.stays(WHILE_S)
        scanner.is_stalled = False
        bridge.moves()


def test_a_port_that_may_not_be_opened_is_reported_once_and_tried_until_it_may(monkeypatch: pytest.MonkeyPatch) -> None:
    # Root may open everything: the system's answer is what is played.
    opened = os.open

    def forbid(robot: SimulatedTurtleBot3) -> None:
        def refused(path: str, *arguments: int) -> int:
            if str(path) == robot.base_path:
                raise PermissionError(errno.EACCES, "Permission denied", path)
            return opened(path, *arguments)

        monkeypatch.setattr("serial.serialposix.os.open", refused)

    with driven("opencr", host=SYSTEM_HOST, before=forbid) as bridge:
        bridge.reports("no permission; is this user in the group dialout?")
        bridge.stays(2.5 * WHILE_S)
        assert bridge.state is State.STARTING
        monkeypatch.undo()
        bridge.moves()
