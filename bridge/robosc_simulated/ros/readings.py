"""Readings that the robot shows to other nodes, before they are messages of either ROS."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Clock:
    """The world's time.

    Attributes:
        stamp_s: Seconds since the simulation began.
    """

    stamp_s: float


@dataclass(frozen=True)
class Scan:
    """A revolution of the LiDAR.

    Attributes:
        stamp_s: World time.
        ranges_m: Ranges evenly over a revolution, counter-clockwise from straight ahead; infinity where nothing is near
            enough, minus infinity where something is too near (REP 117, ros.org/reps/rep-0117.html).
        nearest_m: Shortest distance that can be measured.
        farthest_m: Longest distance that can be measured.
        revolution_s: World time from scan to scan.
    """

    stamp_s: float
    ranges_m: npt.NDArray[np.float32]
    nearest_m: float
    farthest_m: float
    revolution_s: float


@dataclass(frozen=True)
class Odometry:
    """Place where the robot takes itself to be, by its wheels.

    Attributes:
        stamp_s: World time.
        x_m: x from where it began.
        y_m: y from the same.
        heading_rad: Heading counter-clockwise from how it stood.
        linear_m_s: Forward speed.
        angular_rad_s: Yaw rate, counter-clockwise.
    """

    stamp_s: float
    x_m: float
    y_m: float
    heading_rad: float
    linear_m_s: float
    angular_rad_s: float


@dataclass(frozen=True)
class Picture:
    """Picture that the camera sees.

    Attributes:
        stamp_s: World time.
        encoding: `mono8` or `rgb8`.
        width: Width in pixels.
        height: Height in pixels.
        data: Pixels row by row from above, without padding.
    """

    stamp_s: float
    encoding: str
    width: int
    height: int
    data: bytes


@dataclass(frozen=True)
class Battery:
    """The supply.

    Attributes:
        stamp_s: World time.
        voltage_v: As measured.
    """

    stamp_s: float
    voltage_v: float


Reading = Clock | Scan | Odometry | Picture | Battery


@dataclass(frozen=True)
class Mounted:
    """Place of one frame of the robot in another; it never moves there.

    Attributes:
        parent: Name of the frame in which it sits.
        child: Its name.
        x_m: Distance forward.
        z_m: Distance up.
        pitch_rad: Pitch downwards.
        y_m: Distance to the left.
    """

    parent: str
    child: str
    x_m: float
    z_m: float
    pitch_rad: float = 0.0
    y_m: float = 0.0


ODOM, FOOTPRINT, BASE, SCANNER, CAMERA = "odom", "base_footprint", "base_link", "base_scan", "camera_link"
"""Frames, called as a TurtleBot3's are."""
