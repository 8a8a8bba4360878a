"""Data of the devices as the content of ROS messages."""

import math
from typing import Any

import pytest

from robosc_bridge.daemon.channel_data import scan_data
from robosc_bridge.devices.interface import BINS, RawScan, Scan


def told(range_m: float, **limits: float) -> dict[str, Any]:
    """Return the data of a scan that has measured this everywhere."""
    return scan_data(Scan(1.0, (range_m,) * BINS, RawScan((0.0,), (range_m,), (1.0,)), 5.0, **limits))


@pytest.mark.parametrize("range_m", [1.0, math.nan])
def test_the_limits_of_a_scan_are_those_of_its_sensor(range_m: float) -> None:
    data = told(range_m, min_m=0.12, max_m=3.5)
    assert (data["range_min"], data["range_max"]) == (0.12, 3.5)


def test_a_sensor_without_known_limits_measures_any_distance() -> None:
    data = told(1.0)
    assert (data["range_min"], data["range_max"]) == (0.0, math.inf)
