"""Walls as line segments, seen by rays and touched by a round body.

A wall map as text has one segment per line, `x1 y1 x2 y2` in metres; `#` begins a comment.
"""

import math
import random
from collections.abc import Iterable, Iterator
from collections.abc import Set as AbstractSet
from itertools import groupby
from operator import itemgetter

import numpy as np
import numpy.typing as npt

Segment = tuple[float, float, float, float]
Floats = npt.NDArray[np.float64]
Opening = frozenset[tuple[int, int]]
"""Two cells of a maze with no wall between them."""

CELL_M = 1.0
"""Width of a maze's ways: what the example of a maze solver is made for."""

_PARALLEL = 1e-12
_AT_ONCE = 32


class Walls:
    """Segments, each (x1, y1, x2, y2) in metres.

    Args:
        segments: In any order; none at all is open space.

    Raises:
        ValueError: A coordinate is not finite.
    """

    def __init__(self, segments: Iterable[Segment]) -> None:
        self.segments = tuple(segments)
        table = np.array(self.segments, dtype=np.float64).reshape(-1, 4)
        if not np.isfinite(table).all():
            raise ValueError("a wall's coordinates must be finite numbers")
        self._starts: Floats = np.ascontiguousarray(table[:, :2])
        self._ends: Floats = np.ascontiguousarray(table[:, 2:])
        self._edges: Floats = self._ends - self._starts
        self._squares: Floats = np.maximum((self._edges**2).sum(axis=1), 1e-18)

    def cast(self, origins: Floats, directions: Floats) -> Floats:
        """Return the lengths of rays up to a wall; one that goes along a wall meets its near end.

        Args:
            origins: Shape (n, 2), metres.
            directions: Shape (n, 2), of any length but zero.

        Returns:
            Shape (n,): in lengths of each direction; infinity where no wall is met.
        """
        if not self.segments:
            return np.full(len(origins), np.inf)
        # origin + t direction = start + u edge, solved with cross products for all pairs at once.
        apart = self._starts[None, :, :] - origins[:, None, :]
        along = directions[:, None, :]
        edges = self._edges[None, :, :]
        cross = along[..., 0] * edges[..., 1] - along[..., 1] * edges[..., 0]
        is_parallel = np.abs(cross) < _PARALLEL
        cross = np.where(is_parallel, 1.0, cross)
        lengths = (apart[..., 0] * edges[..., 1] - apart[..., 1] * edges[..., 0]) / cross
        shares = (apart[..., 0] * along[..., 1] - apart[..., 1] * along[..., 0]) / cross
        is_hit = ~is_parallel & (lengths >= 0.0) & (shares >= 0.0) & (shares <= 1.0)
        met = np.where(is_hit, lengths, np.inf)
        if is_parallel.any():
            is_in_line = is_parallel & (
                np.abs(apart[..., 0] * along[..., 1] - apart[..., 1] * along[..., 0]) < _PARALLEL
            )
            rays, walls = np.nonzero(is_in_line)
            way = directions[rays]
            both = np.stack([((ends[walls] - origins[rays]) * way).sum(axis=1) for ends in (self._starts, self._ends)])
            # Between the ends is who is on the wall.
            nearest = np.where(both[0] * both[1] <= 0.0, 0.0, both.min(axis=0)) / (way**2).sum(axis=1)
            met[rays, walls] = np.where(nearest >= 0.0, nearest, np.inf)
        found: Floats = met.min(axis=1)
        return found

    def cast_from(self, x_m: float, y_m: float, directions: Floats) -> Floats:
        """The same for rays that all begin at one point, several times as fast.

        A ray meets a wall whose ends are on different sides of it. With s1 and s2, the cross products of its direction
        with the ways to both ends, and s, that of the two ways, it does so at t = s / (s2 - s1). The greatest 1/t is
        looked for: what is behind has one below zero, and no division by zero is left.

        Args:
            x_m: Of the point.
            y_m: Of the point.
            directions: Shape (n, 2), of any length but zero.

        Returns:
            Shape (n,): in lengths of each direction; infinity where no wall is met.
        """
        if not self.segments:
            return np.full(len(directions), np.inf)
        point = np.array((x_m, y_m))
        to_starts, to_ends = self._starts - point, self._ends - point
        crosses = to_starts[:, 0] * to_ends[:, 1] - to_starts[:, 1] * to_ends[:, 0]
        is_in_line = np.abs(crosses) < _PARALLEL
        edgeways: list[tuple[float, float]] = []
        if is_in_line.any():
            if (to_starts * to_ends).sum(axis=1)[is_in_line].min() <= _PARALLEL:
                # On a wall: rare enough to be looked at pair by pair.
                return self.cast(np.broadcast_to(point, directions.shape), directions)
            edgeways = _near_ends(to_starts[is_in_line], to_ends[is_in_line])
            to_starts, to_ends, crosses = to_starts[~is_in_line], to_ends[~is_in_line], crosses[~is_in_line]
        across = np.stack((-directions[:, 1], directions[:, 0]))
        nearest = np.zeros(len(directions))
        # Not all at once: what does not fit into the processor's cache is several times as slow.
        for first in range(0, len(crosses), _AT_ONCE):
            part = slice(first, first + _AT_ONCE)
            # Shape (walls, rays): the search for the greatest goes along rows then.
            beside_starts, beside_ends = to_starts[part] @ across, to_ends[part] @ across
            inverse = beside_ends - beside_starts
            inverse /= crosses[part, None]
            beside_starts *= beside_ends
            np.copyto(inverse, 0.0, where=beside_starts > 0.0)
            np.maximum(nearest, inverse.max(axis=0), out=nearest)
        for x, y in edgeways:
            # Only a ray that goes along the wall meets it.
            along = directions[:, 0] * x + directions[:, 1] * y
            is_met = (np.abs(directions[:, 0] * y - directions[:, 1] * x) < _PARALLEL) & (along > 0.0)
            squares = (directions[is_met] ** 2).sum(axis=1)
            nearest[is_met] = np.maximum(nearest[is_met], squares / along[is_met])
        with np.errstate(divide="ignore", over="ignore"):
            found: Floats = np.where(nearest > 0.0, 1.0 / nearest, np.inf)
        return found

    def distance_m(self, x_m: float, y_m: float) -> float:
        """From a point to the nearest wall; infinity if there is none."""
        if not self.segments:
            return math.inf
        point = np.array((x_m, y_m)) - self._starts
        shares = np.clip((point * self._edges).sum(axis=1) / self._squares, 0.0, 1.0)
        return float(np.sqrt(((point - shares[:, None] * self._edges) ** 2).sum(axis=1).min()))


def _near_ends(starts: Floats, ends: Floats) -> list[tuple[float, float]]:
    is_start = (starts**2).sum(axis=1) <= (ends**2).sum(axis=1)
    return [(x, y) for x, y in np.where(is_start[:, None], starts, ends).tolist()]


def room(width_m: float, height_m: float) -> Walls:
    """A rectangular room around the origin.

    Args:
        width_m: Along x.
        height_m: Along y.
    """
    x_m, y_m = width_m / 2, height_m / 2
    return Walls(
        ((-x_m, -y_m, x_m, -y_m), (x_m, -y_m, x_m, y_m), (x_m, y_m, -x_m, y_m), (-x_m, y_m, -x_m, -y_m)),
    )


def maze(columns: int, rows: int, cell_m: float = CELL_M, seed: int = 0) -> Walls:
    """A grid maze in which there is exactly one way between any two cells (a random depth-first tree).

    The middle of the first cell is the origin; columns go along x, rows along y.

    Args:
        columns: Cells along x.
        rows: Cells along y.
        cell_m: Width of a cell.
        seed: Of the choice.

    Raises:
        ValueError: There is no cell.
    """
    return _grid(columns, rows, cell_m, _tree(columns, rows, seed))


def open_maze(columns: int, rows: int, cell_m: float = CELL_M, seed: int = 0) -> tuple[Walls, tuple[float, float]]:
    """The same maze with an exit: the last cell has no wall towards greater y.

    All of its walls hang together, so that who keeps one of them on the right hand comes to the exit (the wall
    follower's rule; it was known to W. H. Matthews, "Mazes and Labyrinths", Longmans, Green and Co. 1922, chapter 20).

    Args:
        columns: Cells along x.
        rows: Cells along y.
        cell_m: Width of a cell.
        seed: Of the choice.

    Returns:
        The walls, and the middle of the cell outside of the exit.

    Raises:
        ValueError: There is no cell.
    """
    opened = _tree(columns, rows, seed)
    opened.add(frozenset(((columns - 1, rows - 1), (columns - 1, rows))))
    return _grid(columns, rows, cell_m, opened), ((columns - 1) * cell_m, rows * cell_m)


def _tree(columns: int, rows: int, seed: int) -> set[Opening]:
    """The pairs of cells without a wall between them."""
    if columns < 1 or rows < 1:
        raise ValueError("a maze needs at least one cell")
    chance = random.Random(seed)  # noqa: S311 (a maze is no secret)
    opened: set[Opening] = set()
    visited = {(0, 0)}
    path = [(0, 0)]
    while path:
        column, row = path[-1]
        around = ((column + 1, row), (column - 1, row), (column, row + 1), (column, row - 1))
        free = [cell for cell in around if cell not in visited and 0 <= cell[0] < columns and 0 <= cell[1] < rows]
        if not free:
            path.pop()
            continue
        chosen = chance.choice(free)
        opened.add(frozenset(((column, row), chosen)))
        visited.add(chosen)
        path.append(chosen)
    return opened


def _grid(columns: int, rows: int, cell_m: float, opened: AbstractSet[Opening]) -> Walls:
    def corner(column: int, row: int) -> tuple[float, float]:
        return ((column - 0.5) * cell_m, (row - 0.5) * cell_m)

    found: list[Segment] = []
    for column in range(columns + 1):
        is_wall = [frozenset(((column - 1, row), (column, row))) not in opened for row in range(rows)]
        found += [(*corner(column, first), *corner(column, end)) for first, end in _runs(is_wall)]
    for row in range(rows + 1):
        is_wall = [frozenset(((column, row - 1), (column, row))) not in opened for column in range(columns)]
        found += [(*corner(first, row), *corner(end, row)) for first, end in _runs(is_wall)]
    return Walls(found)


def _runs(flags: Iterable[bool]) -> Iterator[tuple[int, int]]:
    """Yield the begin and end of each run of true flags: a long wall is quicker to meet than many short ones."""
    places = groupby(enumerate(flags), key=itemgetter(1))
    for is_run, run in places:
        indices = [index for index, _ in run]
        if is_run:
            yield indices[0], indices[-1] + 1


def parse_walls(text: str) -> Walls:
    """A wall map.

    Raises:
        ValueError: A line has no four finite numbers; the text names the line.
    """
    found: list[Segment] = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        try:
            x1, y1, x2, y2 = (float(word) for word in words)
        except ValueError:
            raise ValueError(f"line {number} of the wall map is not `x1 y1 x2 y2`: {line.strip()!r}") from None
        if not all(math.isfinite(value) for value in (x1, y1, x2, y2)):
            raise ValueError(f"line {number} of the wall map has a number that is not finite: {line.strip()!r}")
        found.append((x1, y1, x2, y2))
    return Walls(found)
