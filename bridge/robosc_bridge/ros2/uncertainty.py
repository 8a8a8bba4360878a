"""Covariances of a bridge's measurements: those that it sends, or else assumed ones, larger than a good robot's.

The covariance of the pose grows with the distance, as in dead reckoning. The step is that of R. Siegwart, I. Nourbakhsh
and D. Scaramuzza, "Introduction to Autonomous Mobile Robots", 2nd edition, 2011, section 5.2.4; that variances grow in
proportion to the distance is from K. S. Chong and L. Kleeman, "Accurate odometry and error modelling for a mobile
robot", ICRA 1997.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

WAY_M2_PER_M = 1e-4
"""Variance of the way, for each metre of it: 1 cm after 1 m, 3 cm after 10 m."""

HEADING_RAD2_PER_M = 1e-3
"""Variance of the heading, for each metre of way: 1.8 degrees after 1 m."""

HEADING_RAD2_PER_RAD = 1e-3
"""Variance of the heading, for each radian of rotation: 4.5 degrees after a full one."""

INITIAL = 1e-6
"""Variance of each part of the pose where the odometry begins, and least of a velocity: no filter takes zero."""

UNMEASURED = 1e6
"""Variance of what wheels say nothing about: height, roll and pitch."""

LINEAR_M2_S2, ANGULAR_RAD2_S2 = 1e-4, 1e-3
"""Variances of the velocity: 1 cm/s, sideways too, and 1.8 degrees a second."""

ANGULAR_VELOCITY_RAD2_S2, LINEAR_ACCELERATION_M2_S4, ORIENTATION_RAD2 = 0.02, 0.04, 0.0025
"""Variances of the inertial sensor, as ROBOTIS-GIT/OpenCR has them, `turtlebot3/turtlebot3_sensor.cpp` for ROS 1; its
node for ROS 2 sends none."""

UNKNOWN = (-1.0, *[0.0] * 8)
"""Covariance of sensor_msgs/Imu for what is not measured."""

_ROWS = (0, 1, 5)


def diagonal(variance: float) -> tuple[float, ...]:
    """Return the covariance of three numbers of the same variance that are independent of each other."""
    return (variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance)


@dataclass(frozen=True)
class PlanarPose:
    """A pose on the floor.

    Attributes:
        x_m: x of the odometry's frame.
        y_m: y of the same.
        heading_rad: Heading counter-clockwise.
    """

    x_m: float
    y_m: float
    heading_rad: float


class PoseUncertainty:
    """Covariance of a pose that is tracked from its first reading."""

    def __init__(self) -> None:
        self._pose: PlanarPose | None = None
        self._covariance: npt.NDArray[np.float64] = INITIAL * np.eye(3)

    def move(self, pose: PlanarPose) -> None:
        """Note the next pose; between two, the robot drives an arc."""
        before, self._pose = self._pose, pose
        if before is None:
            return
        rotation_rad = math.remainder(pose.heading_rad - before.heading_rad, math.tau)
        middle_rad = before.heading_rad + rotation_rad / 2
        cosine, sine = math.cos(middle_rad), math.sin(middle_rad)
        way_m = (pose.x_m - before.x_m) * cosine + (pose.y_m - before.y_m) * sine
        by_heading = np.array([-way_m * sine, way_m * cosine, 0.0])
        step = np.eye(3)
        step[:, 2] += by_heading
        along = np.array([cosine, sine, 0.0])
        # The step's own rotation shows by half in where the step leads.
        turned = by_heading / 2 + np.array([0.0, 0.0, 1.0])
        heading = HEADING_RAD2_PER_M * abs(way_m) + HEADING_RAD2_PER_RAD * abs(rotation_rad)
        added = WAY_M2_PER_M * abs(way_m) * np.outer(along, along) + heading * np.outer(turned, turned)
        self._covariance = step @ self._covariance @ step.T + added

    def covariance(self) -> tuple[float, ...]:
        """Return the covariance of x, y, z and rotations about them, row by row."""
        return _spatial(self._covariance)


def reported_pose(planar: Sequence[float]) -> tuple[float, ...] | None:
    """Return the covariance of x, y, z and rotations about them, row by row, as a bridge reports it.

    Args:
        planar: Covariance of x, y and heading, row by row, from zero where the odometry began.

    Returns:
        None: it sends none.
    """
    if len(planar) != 9 or not all(map(math.isfinite, planar)):
        return None
    return _spatial(np.reshape(planar, (3, 3)) + INITIAL * np.eye(3))


def twist(linear: float = LINEAR_M2_S2, angular: float = ANGULAR_RAD2_S2) -> tuple[float, ...]:
    """Return the covariance of the velocity along x, y, z and of rotations about them, row by row.

    Args:
        linear: Variance forward, in m²/s²; sideways it is the assumed one, of slip.
        angular: Variance of the rotation, in rad²/s².
    """
    diagonal = (max(linear, INITIAL), LINEAR_M2_S2, UNMEASURED, UNMEASURED, UNMEASURED, max(angular, INITIAL))
    return tuple(np.diag(diagonal).flatten().tolist())


def _spatial(planar: npt.NDArray[np.float64]) -> tuple[float, ...]:
    found = np.diag([0.0, 0.0, UNMEASURED, UNMEASURED, UNMEASURED, 0.0])
    found[np.ix_(_ROWS, _ROWS)] = planar
    return tuple(found.flatten().tolist())
