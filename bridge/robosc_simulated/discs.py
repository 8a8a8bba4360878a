"""Round things, seen by rays and touched by a round body."""

import math
from collections.abc import Iterable

import numpy as np

from robosc_simulated.walls import Floats


class Discs:
    """Discs, each (x, y, radius) in metres.

    Args:
        discs: In any order.
    """

    def __init__(self, discs: Iterable[tuple[float, float, float]]) -> None:
        self.discs = tuple(discs)

    def cast(self, origins: Floats, directions: Floats) -> Floats:
        """Return the lengths of rays up to the edge of a disc; an origin in a disc sees it from within.

        Args:
            origins: Shape (n, 2), or (1, 2) where all rays begin at one point, in metres.
            directions: Shape (n, 2), of any length but zero.

        Returns:
            Shape (n,): in lengths of each direction; infinity where none is met.
        """
        if not self.discs:
            return np.full(len(directions), np.inf)
        along_x, along_y = directions[:, 0], directions[:, 1]
        squares = along_x**2 + along_y**2
        found = np.full(len(directions), np.inf)
        for x_m, y_m, radius_m in self.discs:
            # |origin + t direction - middle|^2 = radius^2, a quadratic in t.
            apart_x, apart_y = x_m - origins[:, 0], y_m - origins[:, 1]
            along = apart_x * along_x + apart_y * along_y
            rest = apart_x**2 + apart_y**2 - radius_m**2
            under = along**2 - squares * rest
            met = np.flatnonzero((under >= 0.0) & ((along > 0.0) | (rest <= 0.0)))
            # Few rays meet it.
            if met.size:
                root = np.sqrt(under[met])
                is_outside = np.broadcast_to(rest > 0.0, along.shape)[met]
                lengths = np.where(is_outside, along[met] - root, along[met] + root) / squares[met]
                found[met] = np.minimum(found[met], lengths)
        return found

    def nearest(self, x_m: float, y_m: float) -> tuple[float, int]:
        """The distance from a point to the nearest disc, below 0 within it, and the place of that one.

        Infinity and -1 if there is none.
        """
        found = (math.inf, -1)
        for place, (middle_x_m, middle_y_m, radius_m) in enumerate(self.discs):
            distance_m = math.hypot(x_m - middle_x_m, y_m - middle_y_m) - radius_m
            if distance_m < found[0]:
                found = (distance_m, place)
        return found
