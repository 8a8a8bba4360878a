"""Place of a line on the floor in a grey picture, with the standard library alone: no OpenCV, no numpy, no ROS.

The same answer as `line.find_line`, from runs of dark pixels that are joined row by row (union of equivalent runs: A.
Rosenfeld, J. L. Pfaltz, "Sequential operations in digital picture processing", Journal of the ACM 13 (4), 1966).
"""

from typing import NamedTuple


class LineSettings(NamedTuple):
    """Properties of a line, here and for `line.find_line`.

    Attributes:
        threshold: Shade that parts the line from the floor, 0 (black) to 255.
        is_dark: True if the line is the darker of the two.
        top: Begin of the rows that are looked at, as a share of the height from above.
        bottom: Their end.
        smallest: Smallest share of the looked-at pixels that is a line.
        largest: Largest; a picture that is dark all over shows no line.
    """

    threshold: float = 100.0
    is_dark: bool = True
    top: float = 0.6
    bottom: float = 1.0
    smallest: float = 0.005
    largest: float = 0.6


USUAL = LineSettings()


def find_line(data: bytes, width: int, height: int, step: int, settings: LineSettings = USUAL) -> "float | None":
    """Return the distance of the line off the middle, to the left above zero, as a share of the width; None: no line.

    The line is the largest patch of its shade, the pixels of which touch at edges or corners; its centre of mass is
    what counts. Takes time in the pixels looked at.

    Args:
        data: Shades, row by row from above.
        width: Width in pixels, at least 1.
        height: Height in pixels, at least 1.
        step: Bytes from row to row.
        settings: Properties of a line.
    """
    first = min(int(settings.top * height), height - 1)
    last = max(first + 1, round(settings.bottom * height))
    # 1 for the line's shade: one look for each of the 256.
    table = bytes(int((shade <= settings.threshold) == settings.is_dark) for shade in range(256))
    patches = _Patches()
    above: list[tuple[int, int, int]] = []
    for row in range(first, last):
        runs = _runs(data[row * step : row * step + width].translate(table))
        above = patches.join(above, runs)
    largest = patches.largest()
    if largest is None:
        return None
    area, columns = largest
    if not settings.smallest <= area / ((last - first) * width) <= settings.largest:
        return None
    return 0.5 - (columns / area + 0.5) / width


def _runs(marks: bytes) -> "list[tuple[int, int]]":
    """Return the begin and the end (exclusive) of each run of ones."""
    found = []
    begin = marks.find(1)
    while begin >= 0:
        end = marks.find(0, begin)
        end = len(marks) if end < 0 else end
        found.append((begin, end))
        begin = marks.find(1, end)
    return found


class _Patches:
    """Patches of a picture, by runs: each has a number, and the smaller of two that touch holds both."""

    def __init__(self) -> None:
        self._parents: list[int] = []
        self._areas: list[int] = []
        self._columns: list[int] = []

    def join(self, above: "list[tuple[int, int, int]]", runs: "list[tuple[int, int]]") -> "list[tuple[int, int, int]]":
        """The runs of a row with their patches, joined with those of the row above that they touch."""
        found = []
        place = 0
        for begin, end in runs:
            patch = len(self._parents)
            self._parents.append(patch)
            self._areas.append(end - begin)
            # The sum of its columns.
            self._columns.append((begin + end - 1) * (end - begin) // 2)
            # Corners touch.
            while place < len(above) and above[place][1] < begin:
                place += 1
            other = place
            while other < len(above) and above[other][0] <= end:
                patch = self._union(patch, above[other][2])
                other += 1
            found.append((begin, end, patch))
        return found

    def _root(self, patch: int) -> int:
        while self._parents[patch] != patch:
            # Halves the way for whoever comes next.
            self._parents[patch] = patch = self._parents[self._parents[patch]]
        return patch

    def _union(self, first: int, second: int) -> int:
        first, second = sorted((self._root(first), self._root(second)))
        if first != second:
            self._parents[second] = first
            self._areas[first] += self._areas[second]
            self._columns[first] += self._columns[second]
        return first

    def largest(self) -> "tuple[int, int] | None":
        """Area and sum of the columns of the largest patch; of two of one size, that which comes first."""
        roots = [patch for patch, parent in enumerate(self._parents) if patch == parent]
        if not roots:
            return None
        best = max(roots, key=lambda patch: self._areas[patch])
        return self._areas[best], self._columns[best]
