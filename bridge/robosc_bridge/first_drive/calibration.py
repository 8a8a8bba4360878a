"""Calibration of wheels and LiDAR: torque is off all the time, and a person moves the robot by hand.

*Wheel radius*: the robot is pushed straight ahead along a tape measure. *Wheel separation*: it is turned on the spot by
whole revolutions, back to a mark on the floor; a straight way knows nothing of the separation (J. Borenstein, L. Feng,
"Measurement and Correction of Systematic Odometry Errors in Mobile Robots", 1996, separate the two errors likewise).
*Front of the LiDAR*: the robot faces a wall squarely; a line is fitted to the points ahead by total least squares.
"""

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from robosc_bridge.devices.interface import BINS, STANDSTILL, DriveBase, RangeScanner
from robosc_bridge.errors import BridgeError, DeviceSilentError
from robosc_bridge.host import Host

LEAST_WAY_M = 0.3
LEAST_ROTATION_RAD = math.radians(300.0)
MOST_CHANGE = 0.25
"""Share by which a measured figure may differ from the one that the robot is configured with; more is a slip."""

_PERIOD_S = 0.02
_STRAIGHT_RAD = math.radians(10.0)
_AHEAD_DEG = 25
_LEAST_POINTS = 20
_ROUGH_M = 0.02
_SCANS = 10
_LIMIT_S = 5.0
_SILENT_S = 1.0


class CalibrationError(BridgeError):
    """A figure cannot be computed from the measurements; the message says what to repeat."""


@dataclass(frozen=True)
class RolledMotion:
    """A motion as measured by the wheels alone, without an inertial sensor.

    Attributes:
        forward_m: Distance, backward below zero.
        rotation_rad: Rotation, counter-clockwise above zero, not wrapped.
    """

    forward_m: float = 0.0
    rotation_rad: float = 0.0


def read_wheels(base: DriveBase, host: Host) -> tuple[float, float]:
    """Return the ways of the wheels; a base that misses a request, as on a bad line, is asked again for a while.

    Raises:
        BridgeError: The drive base is lost, does not report the ways of its wheels, or its torque is on.
    """
    end_s = host.monotonic() + _SILENT_S
    while True:
        try:
            reading = base.exchange(STANDSTILL)
        except DeviceSilentError:
            if host.monotonic() >= end_s:
                raise
            continue
        if reading.is_torque_on:
            raise CalibrationError("the motors hold: torque must be off")
        if reading.wheels_m is None:
            raise CalibrationError("the drive base does not report the distances of its wheels")
        return reading.wheels_m


def follow(base: DriveBase, host: Host, is_over: Callable[[], bool], separation_m: float) -> RolledMotion:
    """Return the way on which a robot is moved by hand until something is over; its torque is off.

    Args:
        base: Drive base of the robot, open.
        host: Host whose time is used.
        is_over: Function that returns whether the way is over.
        separation_m: Distance between the wheels that rotations go by.

    Raises:
        BridgeError: The drive base is lost, does not report the ways of its wheels, or its torque is on.
    """
    begin: tuple[float, float] | None = None
    while True:
        wheels_m = read_wheels(base, host)
        begin = begin or wheels_m
        if is_over():
            left_m, right_m = (now_m - before_m for now_m, before_m in zip(wheels_m, begin, strict=True))
            return RolledMotion((left_m + right_m) / 2, (right_m - left_m) / separation_m)
        host.sleep(_PERIOD_S)


def wheel_radius_m(way: RolledMotion, measured_m: float, radius_m: float) -> float:
    """Return the radius of the wheels.

    Args:
        way: Motion as the wheels have rolled it, with the radius below.
        measured_m: The same as it was measured.
        radius_m: Radius that the odometry went by.

    Raises:
        CalibrationError: The way was too short or not straight, or the two are too far apart.
    """
    if measured_m < LEAST_WAY_M or abs(way.forward_m) < LEAST_WAY_M:
        raise CalibrationError(f"the distance is too short: push the robot {LEAST_WAY_M:g} m or more, better 2 m")
    if abs(way.rotation_rad) > _STRAIGHT_RAD:
        degrees = math.degrees(way.rotation_rad)
        raise CalibrationError(f"the robot has turned by {degrees:.0f} degrees on the way: push it straight ahead")
    return _plausible(radius_m * measured_m / abs(way.forward_m), radius_m, "wheel radius")


def wheel_separation_m(way: RolledMotion, revolutions: int, separation_m: float, radius_factor: float = 1.0) -> float:
    """Return the distance between the wheels.

    Args:
        way: Motion as the wheels have rolled it.
        revolutions: Number of revolutions that it was turned by, back to the mark.
        separation_m: Distance that the odometry went by.
        radius_factor: Measured radius of the wheels by the one that the odometry went by.

    Raises:
        CalibrationError: It was not turned by so much, or not on the spot.
    """
    if abs(way.rotation_rad) < LEAST_ROTATION_RAD:
        raise CalibrationError("the robot was not turned by a whole revolution: turn it on the spot, back to the mark")
    if abs(way.forward_m) > abs(way.rotation_rad) * separation_m / 2:
        raise CalibrationError("the robot was moved away from its place: turn it on the spot")
    found_m = separation_m * radius_factor * abs(way.rotation_rad) / (2 * math.pi * revolutions)
    return _plausible(found_m, separation_m, "wheel separation")


def _plausible(found_m: float, usual_m: float, name: str) -> float:
    if abs(found_m / usual_m - 1) > MOST_CHANGE:
        raise CalibrationError(
            f"the {name} would be {found_m:.4f} m, and is {usual_m:.4f} m by its configuration: measure again, and "
            "check whether both wheels were turned"
        )
    return found_m


def wall_angle_rad(ranges_m: Sequence[float]) -> float:
    """Return the direction of the wall ahead, counter-clockwise from the front: 0 where it is looked at squarely.

    Args:
        ranges_m: Ranges of a scan, one a degree.

    Raises:
        CalibrationError: No wall is ahead.
    """
    # A bridge that runs has no use for it, and is to start soon.
    import numpy as np

    angles_deg = range(-_AHEAD_DEG, _AHEAD_DEG + 1)
    ahead = [(math.radians(angle), ranges_m[angle % BINS]) for angle in angles_deg]
    seen = [(angle, range_m) for angle, range_m in ahead if math.isfinite(range_m)]
    if len(seen) < _LEAST_POINTS:
        raise CalibrationError(
            "no wall is seen ahead: put the robot in front of a plain wall, half a metre to a metre away"
        )
    points = np.array([(range_m * math.cos(angle), range_m * math.sin(angle)) for angle, range_m in seen])
    middle = points.mean(axis=0)
    _, sizes, axes = np.linalg.svd(points - middle, full_matrices=False)
    if sizes[1] / math.sqrt(len(points)) > _ROUGH_M:
        raise CalibrationError("the points ahead are not a plain wall: choose one without corners, legs or glass")
    normal = axes[1] * math.copysign(1.0, float(axes[1] @ middle))
    return math.atan2(float(normal[1]), float(normal[0]))


def lidar_front_rad(scanner: RangeScanner, host: Host, front_rad: float) -> float:
    """Return the direction of the LiDAR's front, from several scans of a wall that the robot faces squarely.

    Args:
        scanner: The LiDAR, open.
        host: Host whose time is used.
        front_rad: Direction that it is configured with.

    Raises:
        LineError: The line is gone.
        CalibrationError: It does not rotate, or sees no wall.
    """
    found: list[float] = []
    end_s = host.monotonic() + _LIMIT_S
    while len(found) < _SCANS and host.monotonic() < end_s:
        scan = scanner.receive(0.5)
        if scan is not None:
            found.append(wall_angle_rad(scan.ranges_m))
    if len(found) < _SCANS:
        raise CalibrationError(f"the LiDAR has made {len(found)} revolutions in {_LIMIT_S:g} s: does it rotate?")
    return math.remainder(front_rad - statistics.median(found), 2 * math.pi)
