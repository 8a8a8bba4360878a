"""A line on the floor, which a camera sees: a track of straight pieces with a width.

A track as text has one point per line, `x y` in metres; `#` begins a comment. One whose last point is its first is
closed.
"""

import math
from collections.abc import Iterable
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from robosc_bridge.simulated.walls import Floats, Walls

Point = tuple[float, float]

WIDTH_M = 0.05

_CELL_M = 0.005
_MOST_CELLS = 25_000_000


class Track:
    """A line on the floor.

    It is looked up in a grid of 5 mm cells, since each picture asks for thousands of points.

    Args:
        points: Where it goes, in metres; at least two.
        width_m: Of the line.

    Raises:
        ValueError: There are too few points, a number is not finite, the width is not above 0, or the track lies in
            more than 625 square metres.
    """

    def __init__(self, points: Iterable[Point], width_m: float = WIDTH_M) -> None:
        self.points = tuple(points)
        self.width_m = width_m
        table = np.array(self.points, dtype=np.float64).reshape(-1, 2)
        if len(table) < 2:
            raise ValueError("a line on the floor has at least two points")
        if not (np.isfinite(table).all() and math.isfinite(width_m) and width_m > 0):
            raise ValueError("the points and the width of a line on the floor must be finite, the width above 0")
        self._corner: Floats = table.min(axis=0) - width_m
        span_m = table.max(axis=0) + width_m - self._corner
        # Before it is rounded: it may be too large for whole numbers.
        if float(span_m[0]) * float(span_m[1]) > _MOST_CELLS * _CELL_M**2:
            raise ValueError(
                f"the line on the floor is spread over {span_m[0]:g} m by {span_m[1]:g} m: that is too far"
            )
        self._middle = Walls((*start, *end) for start, end in pairwise(self.points))
        self._is_line = np.zeros(np.ceil(span_m / _CELL_M).astype(int) + 1, dtype=np.bool_)
        for start, end in pairwise(table):
            self._draw(start, end)

    def _draw(self, start: Floats, end: Floats) -> None:
        """Mark the cells whose middle is on a piece."""
        reach_m = self.width_m / 2
        first = np.floor((np.minimum(start, end) - reach_m - self._corner) / _CELL_M).astype(int)
        last = np.ceil((np.maximum(start, end) + reach_m - self._corner) / _CELL_M).astype(int)
        across, along = (np.arange(low, high + 1) for low, high in zip(first, last, strict=True))
        cells = np.stack(np.meshgrid(across, along, indexing="ij"), axis=-1)
        apart = (cells + 0.5) * _CELL_M + self._corner - start
        edge = end - start
        shares = np.clip((apart @ edge) / max(float(edge @ edge), 1e-18), 0.0, 1.0)
        is_near = ((apart - shares[..., None] * edge) ** 2).sum(axis=-1) <= reach_m**2
        self._is_line[first[0] : last[0] + 1, first[1] : last[1] + 1] |= is_near

    def is_line(self, points: Floats) -> npt.NDArray[np.bool_]:
        """Whether each point is on the line.

        Args:
            points: Shape (n, 2), in metres; one that is not finite is on no line.

        Returns:
            Shape (n,).
        """
        places = (points - self._corner) / _CELL_M
        is_there = ((places >= 0.0) & (places < self._is_line.shape)).all(axis=1)
        found = np.zeros(len(points), dtype=np.bool_)
        cells = places[is_there].astype(int)
        found[is_there] = self._is_line[cells[:, 0], cells[:, 1]]
        return found

    def distance_m(self, x_m: float, y_m: float) -> float:
        """From a point to the middle of the line."""
        return self._middle.distance_m(x_m, y_m)


def oval(straight_m: float = 1.0, radius_m: float = 0.5, width_m: float = WIDTH_M) -> Track:
    """A closed track to the left of the origin, which is on it, with its straight pieces along x.

    Args:
        straight_m: Length of each straight piece.
        radius_m: Of both curves.
        width_m: Of the line.
    """
    angles = [math.radians(degree) for degree in range(-90, 91, 5)]
    half_m = straight_m / 2
    right = [(half_m + radius_m * math.cos(angle), radius_m * (1 + math.sin(angle))) for angle in angles]
    left = [(-x_m, 2 * radius_m - y_m) for x_m, y_m in right]
    return Track([*right, *left, right[0]], width_m)


def parse_track(text: str) -> Track:
    """A line on the floor from text.

    Raises:
        ValueError: A line of the text has no two finite numbers, which is told with its number, or there is no track.
    """
    found: list[Point] = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        try:
            x_m, y_m = (float(word) for word in words)
        except ValueError:
            raise ValueError(f"line {number} of the track is not `x y`: {line.strip()!r}") from None
        if not (math.isfinite(x_m) and math.isfinite(y_m)):
            raise ValueError(f"line {number} of the track has a number that is not finite: {line.strip()!r}")
        found.append((x_m, y_m))
    return Track(found)
