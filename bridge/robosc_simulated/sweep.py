"""A whole revolution of a laser: evenly spaced rays from one point, as fast as what is around allows.

Each wall is met by the rays between the directions of its two ends and by no other, so that only these pairs of a wall
and a ray are computed: in a maze a few for each wall, where all pairs are hundreds of times as many. In the laser's own
axes the rays are always the same; it is the ends of the walls that are turned. With its ends a and b, a wall is met by
the ray d at the length t with 1/t = (d x (b - a)) / (a x b), which is linear in d: the greatest is the nearest wall.
A robot in line with a wall sees the near end of the wall, if a ray goes there; a robot on a wall sees nothing else.

`Walls.cast` and `Discs.cast` return the same distances for any rays, pair by pair.
"""

import math

import numpy as np

from robosc_simulated.discs import Discs
from robosc_simulated.walls import Floats, Walls

BEAMS = 360
"""Number of beams of a revolution, counter-clockwise; the first one straight ahead."""

_HALF = BEAMS // 2
_PER_RAD = BEAMS / math.tau
# Determinant of a wall in line with the laser, in square metres.
_PARALLEL = 1e-12
# Slack in beams: a beam at the very end of a wall meets it, and none passes between two walls that meet.
_SLACK = 1e-9
_ANGLES = np.arange(-_HALF, BEAMS + _HALF + 1) / _PER_RAD
# From half a revolution on the right; twice around, since a wall may be across the place where the counting begins.
_ALONG_X, _ALONG_Y = np.cos(_ANGLES), np.sin(_ANGLES)


class Sweep:
    """Revolutions of a laser among walls.

    Args:
        walls: Walls that it sees.
    """

    def __init__(self, walls: Walls) -> None:
        table = np.array(walls.segments, dtype=np.float64).reshape(-1, 2, 2)
        # Starts, then ends.
        self._xs: Floats = np.ascontiguousarray(table[:, :, 0].T)
        self._ys: Floats = np.ascontiguousarray(table[:, :, 1].T)

    def lengths_m(self, x_m: float, y_m: float, heading_rad: float, discs: Discs) -> Floats:
        """Return the lengths of the rays, in metres.

        Args:
            x_m: x of the laser.
            y_m: y of the laser.
            heading_rad: Heading of the first ray.
            discs: Round things, which it sees, too.

        Returns:
            Shape (360,): infinity where nothing is met.
        """
        cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
        found = self._to_walls(x_m, y_m, cosine, sine)
        for disc_x_m, disc_y_m, radius_m in discs.discs:
            apart_x, apart_y = disc_x_m - x_m, disc_y_m - y_m
            _see_disc(found, cosine * apart_x + sine * apart_y, cosine * apart_y - sine * apart_x, radius_m)
        return found

    def _to_walls(self, x_m: float, y_m: float, cosine: float, sine: float) -> Floats:
        apart_x, apart_y = self._xs - x_m, self._ys - y_m
        # Ends in the laser's axes.
        xs, ys = cosine * apart_x + sine * apart_y, cosine * apart_y - sine * apart_x
        crosses = xs[0] * ys[1] - ys[0] * xs[1]
        is_in_line = np.abs(crosses) < _PARALLEL
        edgeways = None
        if is_in_line.any():
            if (xs[0] * xs[1] + ys[0] * ys[1])[is_in_line].min() <= _PARALLEL:
                # On a wall.
                return np.zeros(BEAMS)
            edgeways = xs[:, is_in_line], ys[:, is_in_line]
            xs, ys, crosses = xs[:, ~is_in_line], ys[:, ~is_in_line], crosses[~is_in_line]
        places = np.arctan2(ys, xs)
        places *= _PER_RAD
        is_ahead = crosses > 0.0
        rights, lefts = np.where(is_ahead, places, places[::-1])
        firsts = np.ceil(rights - _SLACK).astype(np.intp)
        ends = np.floor(lefts + _SLACK).astype(np.intp) + 1
        # A wall takes less than half a revolution. What goes back by a hair is in line but for rounding.
        ends += BEAMS * (lefts - rights < -_HALF / 2)
        counts = np.maximum(ends - firsts, 0)
        totals = counts.cumsum()
        pairs = int(totals[-1]) if len(totals) else 0
        rays = np.arange(pairs) + np.repeat(firsts + _HALF - totals + counts, counts)
        inverses = _ALONG_X[rays] * np.repeat((ys[1] - ys[0]) / crosses, counts)
        inverses -= _ALONG_Y[rays] * np.repeat((xs[1] - xs[0]) / crosses, counts)
        nearest = np.zeros(len(_ANGLES))
        np.maximum.at(nearest, rays, inverses)
        # Both times around, from straight ahead.
        once = np.maximum(nearest[_HALF : _HALF + BEAMS], 0.0)
        np.maximum(once[_HALF:], nearest[:_HALF], out=once[_HALF:])
        np.maximum(once[: _HALF + 1], nearest[_HALF + BEAMS :], out=once[: _HALF + 1])
        with np.errstate(divide="ignore", over="ignore"):
            found: Floats = 1.0 / once
        if edgeways is not None:
            _see_edgeways(found, *edgeways)
        return found


def _see_edgeways(lengths_m: Floats, xs: Floats, ys: Floats) -> None:
    """Shorten the rays that go along a wall."""
    nearest_m = np.hypot(xs, ys).min(axis=0)
    places = np.arctan2(ys[0], xs[0]) * _PER_RAD
    rays = np.rint(places)
    is_met = np.abs(places - rays) < _SLACK
    np.minimum.at(lengths_m, rays[is_met].astype(np.intp) % BEAMS, nearest_m[is_met])


def _see_disc(lengths_m: Floats, ahead_m: float, left_m: float, radius_m: float) -> None:
    """Shorten the rays that meet a disc before they end."""
    square = ahead_m**2 + left_m**2
    rest = square - radius_m**2
    if rest <= 0.0:
        rays = np.arange(BEAMS)
    else:
        middle = math.atan2(left_m, ahead_m) * _PER_RAD
        aside = math.asin(min(radius_m / math.sqrt(square), 1.0)) * _PER_RAD
        rays = np.arange(math.ceil(middle - aside), math.floor(middle + aside) + 1) % BEAMS
    # |t direction - middle|^2 = radius^2, a quadratic in t.
    along = ahead_m * _ALONG_X[rays + _HALF] + left_m * _ALONG_Y[rays + _HALF]
    root = np.sqrt(np.maximum(along**2 - rest, 0.0))
    lengths_m[rays] = np.minimum(lengths_m[rays], along + root if rest <= 0.0 else along - root)
