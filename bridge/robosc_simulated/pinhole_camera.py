"""View of a camera on the robot: a pinhole without distortion or shadows.

Central projection (R. Hartley, A. Zisserman, "Multiple View Geometry in Computer Vision", 2nd ed., Cambridge
University
Press 2004, section 6.1), of the floor, and of what stands on it and hides it (`upright`).
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from robosc_simulated.scene import Obstacle, Scene
from robosc_simulated.textures import Shades
from robosc_simulated.upright_obstacles import Rays, UprightObstacles
from robosc_simulated.walls import Floats

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


class PinholeCamera:
    """Draws what a camera sees.

    Args:
        mount: The camera.
        scene: Around it: the floor, the line on it, walls and obstacles, and the noise of each pixel.
        seed: Of the noise.
    """

    def __init__(self, mount: Mount, scene: Scene, seed: int = 0) -> None:
        self._mount = mount
        self._scene = scene
        self._chance = np.random.default_rng(seed)
        self._upright = UprightObstacles(rays(mount), scene.walls, scene.wall_height_m)
        points = ground_points(mount)
        self._has_floor = ~np.isnan(points[:, 0])
        self._floor: Floats = points[self._has_floor]

    def picture(self, pose: tuple[float, float, float], obstacles: Iterable[Obstacle] | None = None) -> Shades:
        """Return the picture that is seen from a place.

        Args:
            pose: Pose of the robot: x, y in metres, heading in rad.
            obstacles: Obstacles as they are now; None: as at the start.

        Returns:
            Shape (height, width).
        """
        scene = self._scene
        x_m, y_m, heading_rad = pose
        cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
        rotation = np.array(((cosine, sine), (-sine, cosine)))
        is_there = [each for each in (scene.obstacles if obstacles is None else obstacles) if each.is_there]
        stands = self._upright.mask(
            x_m + cosine * self._mount.x_m,
            y_m + sine * self._mount.x_m,
            rotation.T,
            ((each.x_m, each.y_m, each.radius_m) for each in is_there),
        ).ravel()
        shades = np.where(stands, np.uint8(scene.wall_shade), np.uint8(DISTANCE))
        is_floor, floor = self._has_floor, self._floor
        if stands.any():
            # Hidden rays need no look at the floor.
            is_open = ~stands
            floor = floor[is_open[is_floor]]
            is_floor = is_floor & is_open
        points = floor @ rotation + np.array((x_m, y_m))
        seen = scene.floor.shades(points)
        if scene.line is not None:
            seen[scene.line.is_line(points)] = scene.line.shade
        shades[is_floor] = seen
        if scene.noise.camera_shades:
            noise = self._chance.normal(0.0, scene.noise.camera_shades, shades.shape)
            shades = np.clip(np.rint(shades + noise), 0, 255).astype(np.uint8)
        return shades.reshape(self._mount.height, self._mount.width)


def rays(mount: Mount) -> Rays:
    """Return the rays along which the middle of each pixel looks, in the robot's axes (x forward, y left)."""
    focal = mount.width / 2 / math.tan(mount.field_of_view_rad / 2)
    right: Floats = (np.arange(mount.width, dtype=np.float64) + 0.5 - mount.width / 2) / focal
    down: Floats = (np.arange(mount.height, dtype=np.float64) + 0.5 - mount.height / 2) / focal
    cosine, sine = math.cos(mount.tilt_rad), math.sin(mount.tilt_rad)
    return Rays(mount.height_m, focal, cosine - down * sine, sine + down * cosine, -right)


def ground_points(mount: Mount) -> Floats:
    """Return the point of the floor that each pixel shows, in the robot's axes.

    Returns:
        Shape (height * width, 2), row by row from above; NaN above the horizon.
    """
    seen = rays(mount)
    lengths = mount.height_m / np.where(seen.below > 1e-9, seen.below, np.nan)
    shape = (mount.height, mount.width)
    x_m = np.broadcast_to((mount.x_m + lengths * seen.forward)[:, None], shape)
    y_m = lengths[:, None] * seen.left
    return np.stack((x_m.ravel(), y_m.ravel()), axis=1)
