"""Place of the LiDAR on the robot, from scans of a wall while a person turns the robot on the spot; torque is off.

The LiDAR sits at l = (x, y) from the middle between the wheels, so that it moves on a circle while the robot rotates.
Where it sees the wall at a distance r in the direction b, counter-clockwise from the robot's front, the middle is

    r + x cos b + y sin b = d

away from the wall. All scans together are a linear least-squares problem in x, y and d. What the middle moves meanwhile
is measured by the wheels: its way along the wall's normal is added to r. Distance and direction come from the same
points, so that neither the speed of the rotation nor the wheels' separation matters, apart from that small correction.

This is the part of the problem of A. Censi, A. Franchi, L. Marchionni, G. Oriolo, "Simultaneous Calibration of Odometry
and Sensor Parameters for Mobile Robots", IEEE Transactions on Robotics 29(2), 2013, pages 475-492, that is about the
place of the sensor, with a wall instead of a match of scans. The wall is a line by total least squares.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from robosc_bridge.devices.interface import DriveBase, RangeScanner, RawScan
from robosc_bridge.first_drive.calibration import LEAST_ROTATION_RAD, CalibrationError, read_wheels
from robosc_bridge.host import Host

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MOST_M = 1.0
"""Longest distance of a LiDAR from the middle between the wheels, in each direction; more is a mistake."""

LEAST_SIGHTINGS = 40
"""Scans of the wall that are needed; a LiDAR makes 5 to 10 a second."""

_HALF_RAD = math.radians(25.0)
_LEAST_POINTS = 20
_OUTLIER = 3.0
_NORMAL_QUARTILE = 0.6745
# A revolution ends later than it began: at that seam, a robot that turns sees a wall broken.
_KEPT_SHARE = 0.6
_LEAST_ROUGH_M = 0.005
_ROUGH_M, _ROUGH_SHARE = 0.02, 0.03
_STRAY_M = 0.015
_ASIDE_M = 0.15
_LISTEN_S = 0.02
_SCAN_LIMIT_S = 5.0
_LOST_S = 2.0
_STEP_RAD = math.radians(20.0)


@dataclass(frozen=True)
class Sighting:
    """A wall as one scan shows it.

    Attributes:
        direction_rad: Direction of the nearest point of the wall, from the robot's front, counter-clockwise.
        distance_m: Distance of the LiDAR from the wall.
        x_m: Place of the middle between the wheels by the wheels alone, along the first heading.
        y_m: The same to the left of it.
        heading_rad: Heading by the wheels alone, not wrapped.
    """

    direction_rad: float
    distance_m: float
    x_m: float = 0.0
    y_m: float = 0.0
    heading_rad: float = 0.0


@dataclass(frozen=True)
class LidarPlace:
    """Place of a LiDAR.

    Attributes:
        x_m: Distance forward of the middle between the wheels.
        y_m: Distance to the left of it.
        deviation_m: Standard deviation of these two figures, the larger one.
        stray_m: Root mean square of what the scans are off.
        rotation_rad: Angle by which the robot was turned, as the LiDAR saw it.
        sightings: Number of scans.
    """

    x_m: float
    y_m: float
    deviation_m: float
    stray_m: float
    rotation_rad: float
    sightings: int


@dataclass
class WallFollower:
    """A wall that is followed from scan to scan while the robot turns.

    Attributes:
        direction_rad: Direction in which it was last seen; the front before the first scan.
        rotation_rad: Angle by which the robot has turned since the first scan, not wrapped.
        sightings: Sightings so far.
        missed: Number of scans that did not show it.
    """

    direction_rad: float = 0.0
    rotation_rad: float = 0.0
    sightings: list[Sighting] = field(default_factory=list)
    missed: int = 0

    def look(self, raw: RawScan, x_m: float = 0.0, y_m: float = 0.0, heading_rad: float = 0.0) -> bool:
        """Take a scan, and the pose of the robot by its wheels; return whether the wall was seen."""
        seen = wall_of(raw, self.direction_rad)
        turned_rad = 0.0 if seen is None else math.remainder(self.direction_rad - seen[0], math.tau)
        if seen is None or (self.sightings and abs(turned_rad) > _STEP_RAD):
            self.missed += 1
            return False
        if self.sightings:
            self.rotation_rad += turned_rad
        self.direction_rad = seen[0]
        self.sightings.append(Sighting(*seen, x_m, y_m, heading_rad))
        return True


def wall_of(raw: RawScan, direction_rad: float) -> tuple[float, float] | None:
    """Return direction and distance of the wall that is seen around a direction.

    Args:
        raw: The scan.
        direction_rad: Middle of the sector that is looked at, 25 degrees to both sides.

    Returns:
        None: Too little is seen there, or it is no plain wall.
    """
    import numpy as np

    angles, ranges = np.array(raw.angles_rad), np.array(raw.ranges_m)
    asides = (angles - direction_rad + math.pi) % math.tau - math.pi
    chosen = np.flatnonzero(np.isfinite(ranges) & (np.abs(asides) <= _HALF_RAD))
    chosen = chosen[np.argsort(asides[chosen])]
    points = np.stack((ranges[chosen] * np.cos(angles[chosen]), ranges[chosen] * np.sin(angles[chosen])), axis=1)
    if len(points) < _LEAST_POINTS:
        return None
    # Points that lie off, such as those of a leg before the wall, would tilt a fit to all of them.
    normal, distance_m = _rough_line(points)
    off_m = np.abs(points @ normal - distance_m)
    kept = points[off_m <= max(_OUTLIER * float(np.median(off_m)) / _NORMAL_QUARTILE, _LEAST_ROUGH_M)]
    if len(kept) < max(_LEAST_POINTS, _KEPT_SHARE * len(points)):
        return None
    normal, distance_m = _line(kept)
    off_m = kept @ normal - distance_m
    if math.sqrt(float(np.mean(off_m**2))) > max(_ROUGH_M, _ROUGH_SHARE * distance_m):
        return None
    return math.atan2(float(normal[1]), float(normal[0])), distance_m


def _rough_line(points: "NDArray[np.float64]") -> "tuple[NDArray[np.float64], float]":
    """Return the normal of the line through most of the points, and its distance.

    Its direction is the median of those between points that are half of them apart, as the estimator of H. Theil (1950)
    and P. K. Sen (1968) has the median of slopes.
    """
    import numpy as np

    half = len(points) // 2
    steps = points[half:] - points[: len(points) - half]
    along = points[-1] - points[0]
    angles = (np.arctan2(steps[:, 1], steps[:, 0]) - math.atan2(along[1], along[0]) + math.pi) % math.tau - math.pi
    angle = float(np.median(angles)) + math.atan2(along[1], along[0])
    normal = np.array((math.sin(angle), -math.cos(angle)))
    distance_m = float(np.median(points @ normal))
    return normal * math.copysign(1.0, distance_m), abs(distance_m)


def _line(points: "NDArray[np.float64]") -> "tuple[NDArray[np.float64], float]":
    """Return the normal of the line through points, and its distance."""
    import numpy as np

    middle = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - middle, full_matrices=False)
    normal = axes[1] * math.copysign(1.0, float(axes[1] @ middle))
    return normal, float(normal @ middle)


def place_of(sightings: Sequence[Sighting], rotation_rad: float) -> LidarPlace:
    """Return the place of the LiDAR.

    Args:
        sightings: Sightings of one wall, from the robot's whole rotation.
        rotation_rad: Angle by which it was turned, as the LiDAR saw it.

    Raises:
        CalibrationError: The scans do not determine the place: too few, of a part of a rotation, or too far apart.
    """
    import numpy as np

    if abs(rotation_rad) < LEAST_ROTATION_RAD:
        degrees = abs(math.degrees(rotation_rad))
        raise CalibrationError(
            f"the LiDAR has seen the robot turn by {degrees:.0f} degrees alone: turn it on the spot by a whole "
            "revolution"
        )
    if len(sightings) < LEAST_SIGHTINGS:
        raise CalibrationError(
            f"only {len(sightings)} scans show the wall, and {LEAST_SIGHTINGS} are needed: turn the robot more slowly, "
            "a revolution in 20 seconds or more"
        )
    directions = np.array([each.direction_rad for each in sightings])
    headings = np.array([each.heading_rad for each in sightings])
    places = np.array([(each.x_m, each.y_m) for each in sightings])
    # The wheels know the heading less well than the LiDAR, which is why it serves for the correction alone.
    wall_rad = float(np.angle(np.mean(np.exp(1j * (directions + headings)))))
    ways_m = places @ np.array((math.cos(wall_rad), math.sin(wall_rad)))
    if float(np.abs(places - places[0]).max()) > _ASIDE_M:
        raise CalibrationError("the robot was moved away from its place: turn it on the spot")
    matrix = np.stack((-np.cos(directions), -np.sin(directions), np.ones(len(sightings))), axis=1)
    measured = np.array([each.distance_m for each in sightings]) + ways_m
    solution, _, _, _ = np.linalg.lstsq(matrix, measured, rcond=None)
    off_m = measured - matrix @ solution
    stray_m = math.sqrt(float(off_m @ off_m) / (len(sightings) - 3))
    if stray_m > _STRAY_M:
        raise CalibrationError(
            f"the distances from the wall are off by {stray_m * 1000:.0f} mm: choose a plain wall without corners, "
            "legs or glass, and turn the robot on the spot without lifting it"
        )
    x_m, y_m = float(solution[0]), float(solution[1])
    if max(abs(x_m), abs(y_m)) > MOST_M:
        raise CalibrationError(f"the LiDAR would be at x {x_m:.2f} m, y {y_m:.2f} m: measure again")
    spread = np.linalg.inv(matrix.T @ matrix)
    deviation_m = stray_m * math.sqrt(max(float(spread[0, 0]), float(spread[1, 1])))
    return LidarPlace(x_m, y_m, deviation_m, stray_m, rotation_rad, len(sightings))


def lidar_place(
    base: DriveBase, scanner: RangeScanner, host: Host, is_over: Callable[[], bool], separation_m: float
) -> LidarPlace:
    """Return the place of the LiDAR of a robot that is turned by hand until something is over.

    Args:
        base: Drive base of the robot, open.
        scanner: The LiDAR, open.
        host: Host whose time is used.
        is_over: Function that returns whether the robot has been turned.
        separation_m: Distance between the wheels that rotations go by.

    Raises:
        BridgeError: A device is lost, does not report what is needed, the torque is on, or the scans do not suffice.
    """
    follower = WallFollower()
    x_m = y_m = heading_rad = 0.0
    before: tuple[float, float] | None = None
    scan_s = seen_s = host.monotonic()
    while not is_over():
        wheels_m = read_wheels(base, host)
        if before is not None:
            left_m, right_m = wheels_m[0] - before[0], wheels_m[1] - before[1]
            way_m, rotation_rad = (left_m + right_m) / 2, (right_m - left_m) / separation_m
            x_m += way_m * math.cos(heading_rad + rotation_rad / 2)
            y_m += way_m * math.sin(heading_rad + rotation_rad / 2)
            heading_rad += rotation_rad
        before = wheels_m
        scan = scanner.receive(_LISTEN_S)
        now_s = host.monotonic()
        if scan is not None:
            scan_s = now_s
            if follower.look(scan.raw, x_m, y_m, heading_rad):
                seen_s = now_s
        if now_s - scan_s > _SCAN_LIMIT_S:
            raise CalibrationError(f"the LiDAR has made no revolution in {_SCAN_LIMIT_S:g} s: does it rotate?")
        if follower.sightings and scan_s - seen_s > _LOST_S:
            raise CalibrationError(
                "the wall is lost: nothing may stand between it and the robot; turn the robot more slowly, a "
                "revolution in 20 seconds or more"
            )
    if not follower.sightings:
        raise CalibrationError(
            "no plain wall is seen ahead: put the robot in front of one, half a metre to a metre away, without "
            "corners, legs or glass"
        )
    return place_of(follower.sightings, follower.rotation_rad)
