"""What the robot shows to other nodes, before it is a message of either ROS."""

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
    """A turn of the LiDAR.

    Attributes:
        stamp_s: World time.
        ranges_m: Evenly over a turn, counter-clockwise from straight ahead; infinity where nothing is near enough,
            minus infinity where something is too near (REP 117, ros.org/reps/rep-0117.html).
        nearest_m: That can be measured.
        farthest_m: That can be measured.
        turn_s: Of the world, from scan to scan.
    """

    stamp_s: float
    ranges_m: npt.NDArray[np.float32]
    nearest_m: float
    farthest_m: float
    turn_s: float


@dataclass(frozen=True)
class Odometry:
    """Where the robot takes itself to be, by its wheels.

    Attributes:
        stamp_s: World time.
        x_m: From where it began.
        y_m: The same.
        heading_rad: Counter-clockwise from how it stood.
        linear_m_s: Forward.
        angular_rad_s: Counter-clockwise.
    """

    stamp_s: float
    x_m: float
    y_m: float
    heading_rad: float
    linear_m_s: float
    angular_rad_s: float


@dataclass(frozen=True)
class Picture:
    """What the camera sees.

    Attributes:
        stamp_s: World time.
        encoding: `mono8` or `rgb8`.
        width: In pixels.
        height: In pixels.
        data: Row by row from above, without padding.
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
    """How one frame of the robot sits in another; it never moves there.

    Attributes:
        parent: Name of the frame in which it sits.
        child: Its name.
        x_m: Forward.
        z_m: Up.
        pitch_rad: Downwards.
    """

    parent: str
    child: str
    x_m: float
    z_m: float
    pitch_rad: float = 0.0


ODOM, FOOTPRINT, BASE, SCANNER, CAMERA = "odom", "base_footprint", "base_link", "base_scan", "camera_link"
"""Frames, called as a TurtleBot3's are."""
