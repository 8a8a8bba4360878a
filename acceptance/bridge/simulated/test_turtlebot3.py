"""A whole robot that lives by itself."""

import time

import pytest

from robosc_simulated import SimulatedTurtleBot3, Walls
from support.waiting import wait_until
from support.wire import Host


@pytest.mark.real_time
def test_opencr_lives_by_the_computers_clock() -> None:
    with SimulatedTurtleBot3(walls=Walls(())) as robot, Host(robot.base_path) as host:
        assert robot.opencr is not None
        opencr = robot.opencr
        host.ask("ff ff fd 00 c8 06 00 03 13 00 01 37 a7")
        assert opencr.is_connected
        began_s = time.monotonic()
        wait_until(lambda: not opencr.is_connected)
        assert 0.45 < time.monotonic() - began_s < 2.0
