"""Walls as line segments, seen by rays and touched by a round body.

A wall map as text has one segment per line, `x1 y1 x2 y2` in metres; `#` begins a comment.
"""

import math
import random
from collections.abc import Iterable
from collections.abc import Set as AbstractSet

import numpy as np
import numpy.typing as npt

Segment = tuple[float, float, float, float]
Floats = npt.NDArray[np.float64]
Opening = frozenset[tuple[int, int]]
"""Two cells of a maze with no wall between them."""

_PARALLEL = 1e-12


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
        self._starts: Floats = table[:, :2]
        self._edges: Floats = table[:, 2:] - table[:, :2]
        self._squares: Floats = np.maximum((self._edges**2).sum(axis=1), 1e-18)

    def cast(self, origins: Floats, directions: Floats) -> Floats:
        """How far rays go until a wall.

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
        found: Floats = np.where(is_hit, lengths, np.inf).min(axis=1)
        return found

    def distance_m(self, x_m: float, y_m: float) -> float:
        """From a point to the nearest wall; infinity if there is none."""
        if not self.segments:
            return math.inf
        point = np.array((x_m, y_m)) - self._starts
        shares = np.clip((point * self._edges).sum(axis=1) / self._squares, 0.0, 1.0)
        return float(np.sqrt(((point - shares[:, None] * self._edges) ** 2).sum(axis=1).min()))


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


def maze(columns: int, rows: int, cell_m: float = 0.6, seed: int = 0) -> Walls:
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


def open_maze(columns: int, rows: int, cell_m: float = 0.6, seed: int = 0) -> tuple[Walls, tuple[float, float]]:
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
        for row in range(rows):
            if frozenset(((column - 1, row), (column, row))) not in opened:
                found.append((*corner(column, row), *corner(column, row + 1)))
    for column in range(columns):
        for row in range(rows + 1):
            if frozenset(((column, row - 1), (column, row))) not in opened:
                found.append((*corner(column, row), *corner(column + 1, row)))
    return Walls(found)


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
