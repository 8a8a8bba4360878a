"""A line on the floor, which a camera sees: a track of straight pieces with a width.

A track as text has one point per line, `x y` in metres; `#` begins a comment. One whose last point is its first is
closed.
"""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from robosc_simulated.walls import Floats, Walls

Point = tuple[float, float]

WIDTH_M = 0.05
SHADE = 30

_CELL_M = 0.005
_MOST_CELLS = 25_000_000
_LONGEST_M = 1000.0
# Drawn at once; a piece is never parted.
_COLUMNS_AT_ONCE = 500_000
# Steps of a spline are short beside a line's width, and few for any number of points.
_STEP_M = 0.01
_STEP_SHARE = 0.05
_MOST_STEPS = 50


class Track:
    """A line on the floor.

    It is looked up in a grid of 5 mm cells, since each picture asks for thousands of points.

    Args:
        points: Points along the line, in metres; at least two.
        width_m: Width of the line.
        shade: Shade of the line, from 0 (black) to 255 (white).

    Raises:
        ValueError: There are too few points, a number is not finite, the width is not above 0, the track lies in more
            than 625 square metres, or is longer than 1 km.
    """

    def __init__(self, points: Iterable[Point], width_m: float = WIDTH_M, shade: int = SHADE) -> None:
        self.points = tuple(points)
        self.width_m = width_m
        self.shade = shade
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
        length_m = float(np.hypot(*np.diff(table, axis=0).T).sum())
        if length_m > _LONGEST_M:
            raise ValueError(f"the line on the floor is {length_m:g} m long; it may be {_LONGEST_M:g} m")
        self._middle = Walls((*start, *end) for start, end in pairwise(self.points))
        self._is_line = self._drawn(table, np.ceil(span_m / _CELL_M).astype(int) + 1)

    def _drawn(self, table: Floats, shape: npt.NDArray[np.int_]) -> npt.NDArray[np.bool_]:
        """Return for each cell whether its middle is on a piece.

        In each column of the grid, a piece with its two round ends covers one interval, because it is convex. The
        beginnings and ends of intervals are counted, and the sum along the columns shows where there is one (the
        "difference array" of competitive programming): the work grows with the columns that pieces cross, not with
        their area.
        """
        reach_m = self.width_m / 2
        # From left to right, so that the upper tangent's normal is upwards; in cells from here on.
        ends = np.concatenate((table[:-1], table[1:]), axis=1)
        is_turned = ends[:, 0] > ends[:, 2]
        ends[is_turned] = ends[is_turned][:, [2, 3, 0, 1]]
        ends = (ends - np.tile(self._corner, 2)) / _CELL_M - 0.5
        reach = reach_m / _CELL_M
        firsts = np.ceil(ends[:, 0] - reach).astype(int)
        counts = np.floor(ends[:, 2] + reach).astype(int) - firsts + 1
        changes = np.zeros((shape[0], shape[1] + 1), dtype=np.int32)
        # Columns so far, before each piece.
        before = np.concatenate(([0], np.cumsum(counts)))
        start = 0
        while start < len(ends):
            most = before[start] + _COLUMNS_AT_ONCE
            end = max(start + 1, int(np.searchsorted(before, most, side="right")) - 1)
            pieces = np.repeat(np.arange(start, end), counts[start:end])
            columns = np.arange(before[start], before[end]) - before[pieces] + firsts[pieces]
            lows, highs = _interval(ends[pieces], columns, reach)
            is_met = lows <= highs
            np.add.at(changes, (columns[is_met], lows[is_met]), 1)
            np.add.at(changes, (columns[is_met], highs[is_met] + 1), -1)
            start = end
        np.cumsum(changes, axis=1, out=changes)
        drawn: npt.NDArray[np.bool_] = changes[:, :-1] > 0
        return drawn

    def is_line(self, points: Floats) -> npt.NDArray[np.bool_]:
        """Return for each point whether it is on the line.

        Args:
            points: Shape (n, 2), in metres; one that is not finite is on no line.

        Returns:
            Shape (n,).
        """
        # By columns: numpy is several times as slow along an axis of two.
        across, along = ((points[:, axis] - self._corner[axis]) / _CELL_M for axis in (0, 1))
        columns, rows = self._is_line.shape
        is_there = (across >= 0.0) & (across < columns) & (along >= 0.0) & (along < rows)
        found = np.zeros(len(points), dtype=np.bool_)
        found[is_there] = self._is_line[across[is_there].astype(np.intp), along[is_there].astype(np.intp)]
        return found

    def distance_m(self, x_m: float, y_m: float) -> float:
        """From a point to the middle of the line."""
        return self._middle.distance_m(x_m, y_m)


def _interval(
    ends: Floats, columns: npt.NDArray[np.int_], reach: float
) -> tuple[npt.NDArray[np.int_], npt.NDArray[np.int_]]:
    """The rows whose middles a piece covers in a column, the last one included.

    Args:
        ends: Shape (n, 4): x1, y1, x2, y2 of each piece with x1 <= x2, in cells from the middle of the first one.
        columns: Shape (n,): a column within reach of the piece.
        reach: Half of the width, in cells.

    Returns:
        The first and the last row; the first is greater where there is none.
    """
    x1, y1, x2, y2 = ends.T
    lengths = np.hypot(x2 - x1, y2 - y1)
    is_point = lengths == 0.0
    scale = np.where(is_point, 1.0, lengths)
    # Normal of the upper tangent; the lower one's is opposite.
    across, up = (y1 - y2) / scale * reach, np.where(is_point, 1.0, (x2 - x1) / scale) * reach
    slopes = np.divide(y2 - y1, x2 - x1, out=np.zeros_like(x1), where=x2 > x1)
    discs = [np.sqrt(np.maximum(reach**2 - (columns - middle) ** 2, 0.0)) for middle in (x1, x2)]
    found = []
    for sign in (-1.0, 1.0):
        # Left of the tangent the one round end bounds it, right of it the other.
        begin, end = x1 + sign * across, x2 + sign * across
        straight = y1 + sign * up + slopes * (columns - begin)
        found.append(
            np.where(columns <= begin, y1 + sign * discs[0], np.where(columns >= end, y2 + sign * discs[1], straight))
        )
    return np.ceil(found[0]).astype(int), np.floor(found[1]).astype(int)


def oval() -> Track:
    """Return a closed track to the left of the origin, which is on it, with straight pieces of 1 m along x."""
    straight_m, radius_m = 1.0, 0.5
    angles = [math.radians(degree) for degree in range(-90, 91, 5)]
    half_m = straight_m / 2
    right = [(half_m + radius_m * math.cos(angle), radius_m * (1 + math.sin(angle))) for angle in angles]
    left = [(-x_m, 2 * radius_m - y_m) for x_m, y_m in right]
    return Track([*right, *left, right[0]])


def spline(points: Sequence[Point], width_m: float = WIDTH_M) -> tuple[Point, ...]:
    """A smooth curve through points: a cubic spline, by the length of the straight way between them.

    Needs scipy. It is periodic where the last point is the first one, and natural otherwise (C. de Boor, "A Practical
    Guide to Splines", revised ed., Springer 2001, chapter IV).

    Args:
        points: At least two, or three of which the last is the first; none twice in a row.
        width_m: Of the line that goes along it.

    Returns:
        Points of the curve, about every centimetre, or every twentieth of the width where that is more.

    Raises:
        ValueError: There are too few points, two in a row are the same, or scipy is not installed.
    """
    try:
        # Here, since most scenes do without.
        from scipy.interpolate import CubicSpline
    except ImportError as error:
        raise ValueError("a spline needs scipy; install RoboSC with its extra `simulation`") from error
    table = np.array(points, dtype=np.float64).reshape(-1, 2)
    if len(table) < 2:
        raise ValueError("a spline has at least two points")
    is_closed = bool((table[0] == table[-1]).all())
    if is_closed and len(table) < 4:
        raise ValueError("a closed spline has at least three points")
    chords_m = np.hypot(*np.diff(table, axis=0).T)
    if not (chords_m > 0).all():
        raise ValueError(f"point {int(np.argmin(chords_m)) + 2} of the spline is the same as the one before it")
    places_m = np.concatenate(([0.0], np.cumsum(chords_m)))
    curve = CubicSpline(places_m, table, bc_type="periodic" if is_closed else "natural")
    step_m = max(_STEP_M, width_m * _STEP_SHARE)
    steps = [max(1, min(_MOST_STEPS, math.ceil(chord_m / step_m))) for chord_m in chords_m.tolist()]
    asked = [
        start + (end - start) * step / count
        for (start, end), count in zip(pairwise(places_m.tolist()), steps, strict=True)
        for step in range(count)
    ]
    found = [(float(x_m), float(y_m)) for x_m, y_m in curve(asked)]
    return (*found, found[0] if is_closed else (float(table[-1][0]), float(table[-1][1])))


def parse_track(text: str) -> Track:
    """A line on the floor from text.

    Raises:
        ValueError: A line of the text, which the message names, has no two finite numbers, or there is no track.
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
