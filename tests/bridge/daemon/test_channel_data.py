"""Data of the devices as the content of ROS messages."""

import math
from typing import Any

import pytest

from robosc_bridge.daemon.channel_data import odometry_data, scan_data
from robosc_bridge.devices.interface import BINS, DriveReading, Pose, RawScan, Scan, Velocity


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


def test_covariances_of_an_odometry_stand_where_ros_has_them() -> None:
    planar = tuple(float(value) for value in range(1, 10))
    reading = DriveReading(
        1.0, Pose(), Velocity(), (0.0, 0.0), True, pose_covariance=planar, velocity_variances=(0.5, 0.25)
    )
    data = odometry_data(reading)
    pose, twist = data["pose"]["covariance"], data["twist"]["covariance"]
    assert len(pose) == len(twist) == 36
    # Rows and columns: x, y, z, and the rotations about them.
    assert [pose[row * 6 + column] for row in (0, 1, 5) for column in (0, 1, 5)] == list(planar)
    assert sum(pose) == sum(planar)
    assert (twist[0], twist[35], sum(twist)) == (0.5, 0.25, 0.75)


def test_covariances_that_are_not_known_are_zero() -> None:
    data = odometry_data(DriveReading(1.0, Pose(), Velocity(), (0.0, 0.0), True))
    assert data["pose"]["covariance"] == data["twist"]["covariance"] == [0.0] * 36
