"""Scans brought to degrees, against a twin that looks at every beam for every degree."""

import math
import time
from array import array

import pytest

from robosc.targets.ros.runtime.scans import Resampler


@pytest.mark.real_time
def test_a_scan_takes_a_small_part_of_a_period_of_10_hz() -> None:
    resampler = Resampler()
    ranges = array("f", [1.0 + index % 7 for index in range(3600)])
    resampler.ranges(0.0, math.radians(0.1), ranges, 0.1, 10.0)
    began = time.process_time()
    for _ in range(10):
        resampler.ranges(0.0, math.radians(0.1), ranges, 0.1, 10.0)
    assert (time.process_time() - began) / 10 < 0.02
