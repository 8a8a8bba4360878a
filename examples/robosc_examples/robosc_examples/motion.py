"""Poses, angles and speeds on a plane: the arithmetic of the nodes that drive, without ROS."""

import math
from typing import NamedTuple

SHARPEST_RAD = 0.5
"""A goal further to the side than this is turned to before anything drives."""

SMALLEST_NORM = 0.1


class Pose(NamedTuple):
    """Position of a robot, and its heading, counter-clockwise from the x axis."""

    x_m: float
    y_m: float
    yaw_rad: float


class Speed(NamedTuple):
    """Metres a second ahead, radians a second to the left."""

    ahead_m_s: float
    turn_rad_s: float


def clamped(value: float, limit: float) -> float:
    """The nearest value from -limit to limit."""
    return max(-limit, min(limit, value))


def wrapped(angle_rad: float) -> float:
    """The same direction as an angle from -pi to pi."""
    return math.remainder(angle_rad, math.tau)


def yaw_of(x: float, y: float, z: float, w: float) -> float | None:
    """The yaw of a quaternion of any length; None for one without a direction (zero, NaN, infinite)."""
    norm = math.hypot(x, y, z, w)
    if not SMALLEST_NORM < norm < math.inf:
        return None
    x, y, z, w = (part / norm for part in (x, y, z, w))
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def pose_of(message: object) -> Pose | None:
    """The pose of a `geometry_msgs/Pose`; None for one that is not finite or looks nowhere."""
    position, orientation = message.position, message.orientation  # type: ignore[attr-defined]
    yaw_rad = yaw_of(orientation.x, orientation.y, orientation.z, orientation.w)
    if yaw_rad is None or not (math.isfinite(position.x) and math.isfinite(position.y)):
        return None
    return Pose(position.x, position.y, yaw_rad)


class Turn:
    """Turn by an angle, of any size and either way, followed from yaw to yaw.

    Each yaw is taken as less than half a turn away from the one before: where the yaw jumps from pi to -pi, the turn
    goes on.

    Args:
        angle_rad: Angle to turn by, to the left above zero.
        yaw_rad: Heading at the begin.
    """

    def __init__(self, angle_rad: float, yaw_rad: float) -> None:
        self.remaining_rad = angle_rad
        self._last_rad = yaw_rad

    def update(self, yaw_rad: float) -> float:
        """Return the angle that is still to be turned, to the left above zero."""
        self.remaining_rad -= wrapped(yaw_rad - self._last_rad)
        self._last_rad = yaw_rad
        return self.remaining_rad


def turning_speed(remaining_rad: float, limit_rad_s: float) -> float:
    """Return the turn rate: as fast as may be, slower towards the end, never so slow that wheels stand still."""
    size = min(limit_rad_s, max(3.0 * abs(remaining_rad), 0.1 * limit_rad_s))
    return math.copysign(size, remaining_rad)


def steered(distance_m: float, aside_rad: float, ahead_limit_m_s: float, turn_limit_rad_s: float) -> Speed:
    """Return the velocity towards a point so far away, and so far to the left.

    The robot turns on the spot until the point is about ahead, and drives there then.
    """
    if abs(aside_rad) > SHARPEST_RAD:
        return Speed(0.0, turning_speed(aside_rad, turn_limit_rad_s))
    ahead_m_s = min(ahead_limit_m_s, max(2.0 * distance_m, 0.1 * ahead_limit_m_s))
    return Speed(ahead_m_s * math.cos(aside_rad), clamped(2.0 * aside_rad, turn_limit_rad_s))
