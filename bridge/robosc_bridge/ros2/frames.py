"""Frames of a robot and their positions, by REP 105 (ros.org/reps/rep-0105.html), with a TurtleBot3's names.

Source of the places: ROBOTIS-GIT/turtlebot3, `turtlebot3_description/urdf`.
"""

from collections.abc import Mapping
from dataclasses import dataclass

BASE_LINK = "base_link"


@dataclass(frozen=True)
class Place:
    """Place of a frame in another one, whose axes are parallel to its own.

    Attributes:
        x_m: Forward.
        y_m: To the left.
        z_m: Up.
    """

    x_m: float = 0.0
    y_m: float = 0.0
    z_m: float = 0.0


@dataclass(frozen=True)
class Places:
    """Places of a robot's parts.

    Attributes:
        base: Place of `base_link` above the floor.
        scan: Place of the LiDAR in `base_link`.
        imu: Place of the inertial sensor in `base_link`; None: not known.
    """

    base: Place
    scan: Place
    imu: Place | None = None


_BASE = Place(z_m=0.010)
_WAFFLE = Places(_BASE, Place(-0.064, 0.0, 0.122), Place(0.0, 0.0, 0.068))
TURTLEBOTS: Mapping[str, Places] = {
    "burger": Places(_BASE, Place(-0.032, 0.0, 0.172), Place(-0.032, 0.0, 0.068)),
    "waffle": _WAFFLE,
    "waffle_pi": _WAFFLE,
}
"""Places on the robots that the bridge knows by name."""


@dataclass(frozen=True)
class Frames:
    """Names of frames, without the prefix.

    Attributes:
        odom: Frame of the odometry.
        base: Frame of the robot in it, on the floor between the wheels or `base_link`.
        scan: Frame of the LiDAR.
        imu: Frame of the inertial sensor.
        prefix: Text before each name, such as `robot1/`.
    """

    odom: str = "odom"
    base: str = "base_footprint"
    scan: str = "base_scan"
    imu: str = "imu_link"
    prefix: str = ""

    def of(self, name: str) -> str:
        """Return a name with the prefix."""
        return self.prefix + name


@dataclass(frozen=True)
class Mounting:
    """A frame that is fixed in another one.

    Attributes:
        parent: The other one, with the prefix.
        child: Its own name, with the prefix.
        place: Its place there.
    """

    parent: str
    child: str
    place: Place


def places_of(turtlebot: str, scan: Place | None, configured: tuple[float, float] | None = None) -> Places | None:
    """Return the places on a robot.

    Args:
        turtlebot: TurtleBot3 as its bridge names it; empty: another robot.
        scan: Place of its LiDAR, if that is reported; None: as its configuration or the TurtleBot3 has it.
        configured: Place of its LiDAR as its configuration has it, forward and to the left, at the height that the
            TurtleBot3 has, or that of `base_link`; None: not there.

    Returns:
        None: it is not known where the LiDAR is.
    """
    known = TURTLEBOTS.get(turtlebot)
    if scan is None and configured is not None:
        scan = Place(*configured, 0.0 if known is None else known.scan.z_m)
    if known is None:
        return None if scan is None else Places(Place(), scan)
    return known if scan is None else Places(known.base, scan, known.imu)


def mountings(frames: Frames, places: Places) -> tuple[Mounting, ...]:
    """Return what does not move on a robot."""
    base_link = frames.of(BASE_LINK)
    found = [Mounting(base_link, frames.of(frames.scan), places.scan)]
    if places.imu is not None:
        found.append(Mounting(base_link, frames.of(frames.imu), places.imu))
    if frames.base != BASE_LINK:
        found.insert(0, Mounting(frames.of(frames.base), base_link, places.base))
    return tuple(found)
