"""What a camera on the robot sees of the floor: a pinhole without distortion or shadows.

Central projection (R. Hartley, A. Zisserman, "Multiple View Geometry in Computer Vision", 2nd ed., Cambridge University
Press 2004, section 6.1), of the one plane that is drawn: walls are not seen.
"""

import math
from dataclasses import dataclass

import numpy as np

from robosc_bridge.simulated.floor import Track
from robosc_bridge.simulated.textures import PLAIN, Shades, Texture
from robosc_bridge.simulated.walls import Floats

DISTANCE, DARKNESS = 160, 0
"""Shades of what is above the horizon, and of a covered camera; 255 is white."""


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
        floor: What the floor looks like.
        deviation: Of the noise of each pixel, of 255.
        seed: Of the noise.
    """

    def __init__(
        self, mount: Mount, track: Track | None, floor: Texture = PLAIN, deviation: float = 0.0, seed: int = 0
    ) -> None:
        self._mount = mount
        self._track = track
        self._texture = floor
        self._deviation = deviation
        self._chance = np.random.default_rng(seed)
        points = ground_points(mount)
        self._is_floor = ~np.isnan(points[:, 0])
        self._floor: Floats = points[self._is_floor]

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
        seen = self._texture.shades(points)
        if self._track is not None:
            seen[self._track.is_line(points)] = self._track.shade
        shades = np.full(self._is_floor.shape, DISTANCE, dtype=np.uint8)
        shades[self._is_floor] = seen
        if self._deviation:
            noise = self._chance.normal(0.0, self._deviation, shades.shape)
            shades = np.clip(np.rint(shades + noise), 0, 255).astype(np.uint8)
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
