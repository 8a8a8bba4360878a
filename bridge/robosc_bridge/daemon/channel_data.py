"""Data of devices as contents of ROS messages, and wheel commands in the messages of a model."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

from robosc.execution.runtime.protocol import DataDoesNotFit
from robosc.expressions import NoneType, ObjectType
from robosc.model.structure import Communication
from robosc_bridge.devices.interface import BINS, DriveReading, Pose, Scan, Velocity

_STEP_RAD = math.tau / BINS
# Axes of a covariance of ROS, and those of a robot on a floor among them.
_AXES, _PLANAR = 6, (0, 1, 5)
_PRESENT_V = 7.0
"""Below this voltage there is no battery, but only a cable."""


def scan_data(scan: Scan) -> dict[str, Any]:
    """Return the data of a sensor_msgs/LaserScan: 360 ranges, counter-clockwise from the front."""
    return {
        "ranges": list(scan.ranges_m),
        "angle_min": 0.0,
        "angle_max": math.tau - _STEP_RAD,
        "angle_increment": _STEP_RAD,
        "scan_time": 1.0 / scan.revolutions_per_s if scan.revolutions_per_s > 0.0 else math.nan,
        "range_min": scan.min_m,
        "range_max": scan.max_m,
    }


def odometry_data(reading: DriveReading) -> dict[str, Any]:
    """Return the data of a nav_msgs/Odometry."""
    pose, velocity = reading.pose, reading.velocity
    position = {"x": pose.x_m, "y": pose.y_m, "z": 0.0}
    return {
        "pose": {
            "pose": {"position": position, "orientation": _orientation(pose)},
            "covariance": _covariance(reading.pose_covariance),
        },
        "twist": {
            "twist": {
                "linear": {"x": velocity.linear_m_s, "y": 0.0, "z": 0.0},
                "angular": {"x": 0.0, "y": 0.0, "z": velocity.angular_rad_s},
            },
            "covariance": _covariance(_velocity_covariance(reading)),
        },
    }


def _velocity_covariance(reading: DriveReading) -> tuple[float, ...]:
    if reading.velocity_variances is None:
        return ()
    linear, angular = reading.velocity_variances
    return linear, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, angular


def _covariance(planar: Sequence[float]) -> list[float]:
    """Return a covariance of x, y, z and the rotations about them, row by row, as ROS has it.

    Args:
        planar: Covariance of x, y and the rotation about z; empty: it is not known, which ROS says with zeros.
    """
    found = [0.0] * _AXES**2
    for index, value in enumerate(planar):
        row, column = divmod(index, len(_PLANAR))
        found[_PLANAR[row] * _AXES + _PLANAR[column]] = value
    return found


def _orientation(pose: Pose) -> dict[str, float]:
    half = pose.heading_rad / 2.0
    return {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)}


def imu_data(reading: DriveReading) -> dict[str, Any]:
    """Return the data of a sensor_msgs/Imu; what the drive base does not measure is NaN."""
    found = {
        name: {axis: reading.imu.get(f"{name}_{axis}", math.nan) for axis in "xyz"}
        for name in ("angular_velocity", "linear_acceleration")
    }
    found["orientation"] = {axis: reading.imu.get(f"orientation_{axis}", math.nan) for axis in "xyzw"}
    return found


def battery_data(reading: DriveReading, *, is_percent: bool) -> dict[str, Any]:
    """Return the data of a sensor_msgs/BatteryState; unknown parts are NaN."""
    share = math.nan if reading.battery_share is None else reading.battery_share
    volts = math.nan if reading.battery_v is None else reading.battery_v
    return {"voltage": volts, "percentage": share * 100.0 if is_percent else share, "present": volts > _PRESENT_V}


def shaped(communication: Communication, value: Any) -> Any:
    """Return a value in the form that the model reads: alone, as the field `data` of a message, or None for no data."""
    match communication.response:
        case ObjectType():
            return {"data": value}
        case None | NoneType():
            return None
    return value


def velocity_of(message: Any) -> Velocity:
    """Return the velocity that a message of the channel `drive` requests; parts that are left out are 0."""
    twist = message if isinstance(message, dict) else {}
    twist = twist.get("twist", twist) or {}
    linear, angular = twist.get("linear") or {}, twist.get("angular") or {}
    return Velocity(float(linear.get("x") or 0.0), float(angular.get("z") or 0.0))


def angle_of(message: Any) -> float:
    """Return the angle that a message, call or goal of the channel `rotate` requests, in the unit of the channel."""
    if isinstance(message, dict):
        message = message.get("data", message.get("angle"))
    return float(message or 0.0)


def finite(communication: str, data: Any) -> Any:
    """Return the data, if all of its numbers are finite.

    Raises:
        DataDoesNotFit: A number is not finite.
    """
    for number in _numbers(data):
        if not math.isfinite(number):
            raise DataDoesNotFit(f"'{communication}' has a number that is not finite")
    return data


def _numbers(data: Any) -> Iterator[float]:
    if isinstance(data, dict):
        for part in data.values():
            yield from _numbers(part)
    elif isinstance(data, list | tuple):
        for part in data:
            yield from _numbers(part)
    elif isinstance(data, float):
        yield data


def is_default(data: Any) -> bool:
    """Return True if every part is zero, empty or left out."""
    if isinstance(data, dict):
        return all(is_default(part) for part in data.values())
    return not data
