"""The wire: faults, plugs, and a thread that waits."""

import time
from collections.abc import Iterator

import pytest

from robosc.execution.clock import ManualClock
from robosc_bridge.simulated import SimulatedTurtleBot3
from support.wire import Host

PING = "ff ff fd 00 01 03 00 01 19 4e"

PONG = "ff ff fd 00 01 07 00 55 00 24 04 2d f4 df"


@pytest.fixture
def robot() -> Iterator[SimulatedTurtleBot3]:
    with SimulatedTurtleBot3(base="dynamixel", clock=ManualClock(), seed=3) as found:
        yield found


@pytest.fixture
def host(robot: SimulatedTurtleBot3) -> Iterator[Host]:
    with Host(robot.base_path) as found:
        yield found


@pytest.mark.real_time
def test_an_answer_can_be_late(robot: SimulatedTurtleBot3, host: Host) -> None:
    robot.base_faults.delay_s = 0.15
    began_s = time.monotonic()
    assert host.ask(PING) == PONG
    assert 0.14 < time.monotonic() - began_s < 2.0


@pytest.mark.real_time
def test_a_line_that_has_nothing_to_do_takes_no_time() -> None:
    with SimulatedTurtleBot3(base="dynamixel", lidar="lds03"):
        before_s = time.process_time()
        time.sleep(0.5)
        assert time.process_time() - before_s < 0.05
