"""Things on the floor as a camera sees them: upright walls and round obstacles, all of one height and one grey.

A pixel shows something that stands there where its ray meets one upright plane between the floor and the upper edge.
Behind the eye's own plane nothing needs to be cut off: with the wall's ends a and b in the camera's axes, seen
counter-clockwise, c = a x b > 0 and e = b - a, the ray along (d, -g), which sinks by g, meets it if and only if

    a x d >= 0,  d x b >= 0,  H (d x e) - c g >= 0  and  (h - H) (d x e) + c g >= 0

where H is the camera's height and h the wall's: between its ends, not below its foot, not above its top (the ray is
there after c / (d x e) of its length). All four are linear in the column of a pixel, so that each row of the picture
has one interval for each wall, which is exact to the pixel's middle and needs no loop over pixels. As all has the
same
grey and hides the floor behind it, no order of depth is needed.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from robosc_simulated.walls import Floats, Walls

_EDGEWAYS = 1e-12
"""Area of a wall in line with the camera, in square metres: it shows no side."""

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Rays:
    """The rays of a picture, each of length 1 along the camera's axis, in the robot's axes.

    Attributes:
        height_m: Height of the camera.
        focal: Pixels between two columns' rays that are 1 apart.
        forward: Distance that those of each row go forward, shape (height,).
        below: Distance that they sink.
        left: Distance that those of each column go to the left, shape (width,).
    """

    height_m: float
    focal: float
    forward: Floats
    below: Floats
    left: Floats


class UprightObstacles:
    """Finds the pixels that show a wall or an obstacle.

    Args:
        rays: Of the camera.
        walls: All of them.
        height_m: Of walls and obstacles.
    """

    def __init__(self, rays: Rays, walls: Walls, height_m: float) -> None:
        self._rays = rays
        self._height_m = height_m
        table: Floats = np.array(walls.segments, dtype=np.float64).reshape(-1, 2, 2)
        self._ends = table
        self._squares = rays.forward[:, None] ** 2 + rays.left**2
        # The part of each row's rays that is between the floor and the height of what stands there.
        sinking = np.where(np.abs(rays.below) < _EDGEWAYS, _EDGEWAYS, rays.below)
        to_floor, to_top = rays.height_m / sinking, (rays.height_m - height_m) / sinking
        self._first = np.maximum(np.where(sinking > 0, to_top, to_floor), 0.0)
        self._last = np.where(sinking > 0, to_floor, to_top)

    def mask(self, x_m: float, y_m: float, rotation: Floats, discs: Iterable[tuple[float, float, float]]) -> Mask:
        """Return a mask of the pixels that show something that stands there.

        Args:
            x_m: x of the camera.
            y_m: y of the camera.
            rotation: Shape (2, 2): turns what is in the world's axes into the robot's, from the right.
            discs: Round things, (x, y, radius) in metres each.

        Returns:
            Shape (height, width).
        """
        place = np.array((x_m, y_m))
        found = self._walls((self._ends - place) @ rotation)
        for disc_x_m, disc_y_m, radius_m in discs:
            middle = (np.array((disc_x_m, disc_y_m)) - place) @ rotation
            found |= self._disc(float(middle[0]), float(middle[1]), radius_m)
        return found

    def _walls(self, ends: Floats) -> Mask:
        rays = self._rays
        height, width = len(rays.forward), len(rays.left)
        crosses = ends[:, 0, 0] * ends[:, 1, 1] - ends[:, 0, 1] * ends[:, 1, 0]
        ends = np.where(crosses[:, None, None] < 0.0, ends[:, ::-1], ends)
        is_broad = np.abs(crosses) > _EDGEWAYS
        starts, ends, crosses = ends[is_broad, 0], ends[is_broad, 1], np.abs(crosses[is_broad])
        edges = ends - starts
        over_m = self._height_m - rays.height_m
        # Each condition as slope * left + rest >= 0: slopes by wall, rests by wall and row.
        slopes = np.stack((starts[:, 0], -ends[:, 0], -rays.height_m * edges[:, 0], -over_m * edges[:, 0]))
        by_forward = np.stack((-starts[:, 1], ends[:, 1], rays.height_m * edges[:, 1], over_m * edges[:, 1]))
        by_below = np.stack((np.zeros_like(crosses), np.zeros_like(crosses), -crosses, crosses))
        rests = by_forward[..., None] * rays.forward + by_below[..., None] * rays.below
        slopes = slopes[..., None]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            bounds = -rests / slopes
        never = np.where(rests >= 0.0, -np.inf, np.inf)
        lowest = np.where(slopes > 0.0, bounds, np.where(slopes < 0.0, -np.inf, never)).max(axis=0)
        highest = np.where(slopes < 0.0, bounds, np.inf).min(axis=0)
        # Columns go to the right.
        middle = width / 2 - 0.5
        first = np.clip(np.ceil(middle - rays.focal * highest), 0, width)
        end = np.clip(np.floor(middle - rays.focal * lowest) + 1, 0, width)
        found, rows = np.nonzero(first < end)
        if not found.size:
            return np.zeros((height, width), dtype=np.bool_)
        changes = np.zeros(height * (width + 1), dtype=np.int32)
        row_begins = rows * (width + 1)
        np.add.at(changes, row_begins + first[found, rows].astype(np.int64), 1)
        np.add.at(changes, row_begins + end[found, rows].astype(np.int64), -1)
        is_wall: Mask = changes.reshape(height, width + 1).cumsum(axis=1)[:, :width] > 0
        return is_wall

    def _disc(self, ahead_m: float, left_m: float, radius_m: float) -> Mask:
        """A ray is above a disc between two lengths of it; it is to be low enough and not in the floor there."""
        rays = self._rays
        along = ahead_m * rays.forward[:, None] + left_m * rays.left
        under = along**2 - self._squares * (ahead_m**2 + left_m**2 - radius_m**2)
        found = under >= 0.0
        rows, columns = np.nonzero(found)
        along, root, squares = along[found], np.sqrt(under[found]), self._squares[found]
        # A ray straight down is above one point only.
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            enters, leaves = (along - root) / squares, (along + root) / squares
        is_point = squares < _EDGEWAYS
        enters[is_point], leaves[is_point] = 0.0, np.inf
        found[rows, columns] = np.maximum(enters, self._first[rows]) <= np.minimum(leaves, self._last[rows])
        return found
