"""Round things, seen by rays and touched by a round body."""

import math
from collections.abc import Iterable

import numpy as np

from robosc_bridge.simulated.walls import Floats


class Rounds:
    """Discs, each (x, y, radius) in metres.

    Args:
        discs: In any order.
    """

    def __init__(self, discs: Iterable[tuple[float, float, float]]) -> None:
        self.discs = tuple(discs)
        table = np.array(self.discs, dtype=np.float64).reshape(-1, 3)
        self._middles: Floats = np.ascontiguousarray(table[:, :2])
        self._squares: Floats = table[:, 2] ** 2

    def cast(self, origins: Floats, directions: Floats) -> Floats:
        """How far rays go until the edge of a disc; who stands in one sees it from within.

        Args:
            origins: Shape (n, 2), metres.
            directions: Shape (n, 2), of any length but zero.

        Returns:
            Shape (n,): in lengths of each direction; infinity where none is met.
        """
        if not self.discs:
            return np.full(len(origins), np.inf)
        # |origin + t direction - middle|^2 = radius^2, a quadratic in t.
        apart = self._middles[None, :, :] - origins[:, None, :]
        squares = (directions**2).sum(axis=1)[:, None]
        along = (apart * directions[:, None, :]).sum(axis=2)
        rest = (apart**2).sum(axis=2) - self._squares
        under = along**2 - squares * rest
        root = np.sqrt(np.maximum(under, 0.0))
        lengths = np.where(rest > 0.0, along - root, along + root) / squares
        found: Floats = np.where((under >= 0.0) & (lengths >= 0.0), lengths, np.inf).min(axis=1)
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
