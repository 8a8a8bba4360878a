"""What a camera on the robot sees of the floor: a pinhole without distortion, noise or shadows.

Central projection (R. Hartley, A. Zisserman, "Multiple View Geometry in Computer Vision", 2nd ed., Cambridge University
Press 2004, section 6.1), of the one plane that is drawn: walls are not seen.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from robosc_bridge.simulated.floor import Track
from robosc_bridge.simulated.walls import Floats

Shades = npt.NDArray[np.uint8]

FLOOR, LINE, DISTANCE, DARKNESS = 200, 30, 160, 0
"""Shades of the floor, the line, what is above the horizon, and of a covered camera; 255 is white."""


@dataclass(frozen=True)
class Mount:
    """A camera and where it sits, in the middle of the robot and looking forward and down.

    Its field of view is that of a Raspberry Pi Camera Module 2 (raspberrypi.com/documentation/accessories/camera.html);
    where it sits is as one that looks for lines is put on a Burger.

    Attributes:
        x_m: Forward of the wheels' axis.
        height_m: Above the floor.
        tilt_rad: Of its axis, below the horizon.
        field_of_view_rad: Between the left and the right edge of the picture.
        width: Of a picture, in pixels.
        height: Of a picture, in pixels.
        rate_hz: Pictures a second.
    """

    x_m: float = 0.06
    height_m: float = 0.15
    tilt_rad: float = math.radians(35.0)
    field_of_view_rad: float = math.radians(62.2)
    width: int = 160
    height: int = 120
    rate_hz: float = 20.0


class Eye:
    """Draws what a camera sees.

    Args:
        mount: The camera.
        track: The line on the floor; None: there is none.
    """

    def __init__(self, mount: Mount, track: Track | None) -> None:
        self._mount = mount
        self._track = track
        self._floor = ground_points(mount)

    def picture(self, pose: tuple[float, float, float]) -> Shades:
        """What is seen from a place.

        Args:
            pose: Of the robot: x, y in metres, heading in rad.

        Returns:
            Shape (height, width).
        """
        x_m, y_m, heading_rad = pose
        cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
        points = self._floor @ np.array(((cosine, sine), (-sine, cosine))) + np.array((x_m, y_m))
        shades = np.where(np.isnan(self._floor[:, 0]), DISTANCE, FLOOR).astype(np.uint8)
        if self._track is not None:
            shades[self._track.is_line(points)] = LINE
        return shades.reshape(self._mount.height, self._mount.width)


def ground_points(mount: Mount) -> Floats:
    """Where the floor is that each pixel shows, in the robot's axes (x forward, y left).

    Returns:
        Shape (height * width, 2), row by row from above; NaN above the horizon.
    """
    focal = mount.width / 2 / math.tan(mount.field_of_view_rad / 2)
    right = (np.arange(mount.width) + 0.5 - mount.width / 2) / focal
    down = ((np.arange(mount.height) + 0.5 - mount.height / 2) / focal)[:, None]
    cosine, sine = math.cos(mount.tilt_rad), math.sin(mount.tilt_rad)
    # Of a ray of length 1 along the axis.
    forward = cosine - down * sine
    below = sine + down * cosine
    lengths = mount.height_m / np.where(below > 1e-9, below, np.nan)
    x_m = mount.x_m + np.broadcast_to(lengths * forward, (mount.height, mount.width))
    y_m = -lengths * right
    return np.stack((x_m.ravel(), y_m.ravel()), axis=1)
