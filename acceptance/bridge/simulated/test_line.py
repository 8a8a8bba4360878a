"""A line that waits takes none of the processor's time."""

import time

import pytest

from robosc_simulated import SimulatedTurtleBot3


@pytest.mark.real_time
def test_a_line_that_has_nothing_to_do_takes_no_time() -> None:
    with SimulatedTurtleBot3(base="dynamixel", lidar="lds03"):
        before_s = time.process_time()
        time.sleep(0.5)
        assert time.process_time() - before_s < 0.05
