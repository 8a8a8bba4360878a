"""From points to full revolutions and from a revolution to 360 ranges, the same for all LiDARs.

A revolution ends where the angle that the device counts passes 360 degrees. Whatever came before the first revolution
that was seen from its beginning is dropped, and so is a revolution of which too much is missing; what is missing of
another one stays missing, as nothing is taken from an earlier revolution.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

BINS = 360

WIDEST_STEP_DEG = 3.0
"""Two points of one revolution that are further apart than this have lost others between them.

The widest step of a sound device is 2 degrees (LDS-03 at 20 revolutions/s); the narrowest frame of a full length is 6.
"""

MOST_LOST_DEG = 90.0
"""A revolution of which more is missing is no full revolution."""

MOST_POINTS = 2048
"""Maximum number of points of one revolution; the slowest of the three LiDARs has 800 at half its speed."""


@dataclass(frozen=True, slots=True)
class Points:
    """Measurements of one frame, in the order in which they were made.

    Attributes:
        counted_deg: Angles as the device counts them: clockwise, growing, within [0, 360), passing 0 at most once.
        angles_deg: Angles of the points: counter-clockwise from the front, within [0, 360).
        ranges_m: Ranges; NaN where nothing valid was measured.
        intensities: Intensities as the device gives them.
        revolutions_per_s: Speed of the motor; None: this frame does not report it.
        is_last: True if it is known without the next frame that the revolution ends here.
    """

    counted_deg: tuple[float, ...]
    angles_deg: tuple[float, ...]
    ranges_m: tuple[float, ...]
    intensities: tuple[float, ...]
    revolutions_per_s: float | None = None
    is_last: bool = False


@dataclass(frozen=True, slots=True)
class Revolution:
    """One full revolution.

    Attributes:
        angles_deg: Of each point, counter-clockwise from the front, within [0, 360).
        ranges_m: NaN where nothing valid was measured.
        intensities: As the device gives them.
        revolutions_per_s: Speed of the motor; NaN: the device has not reported it yet.
    """

    angles_deg: tuple[float, ...]
    ranges_m: tuple[float, ...]
    intensities: tuple[float, ...]
    revolutions_per_s: float


class RevolutionBuilder:
    """Joins points to full revolutions."""

    def __init__(self) -> None:
        self._angles: list[float] = []
        self._ranges: list[float] = []
        self._intensities: list[float] = []
        self._revolutions_per_s = math.nan
        self._reached_deg: float | None = None
        self._lost_deg = 0.0

    def forget(self) -> None:
        """Begin anew, after a silence or at another place of the stream."""
        self._begin()
        self._reached_deg = None

    def add(self, points: Points) -> Revolution | None:
        """The revolution that these points end; those behind its end begin the next one."""
        if points.revolutions_per_s is not None:
            self._revolutions_per_s = points.revolutions_per_s
        counted = points.counted_deg
        ended = None
        if counted[-1] < counted[0]:
            passed = next(k for k in range(1, len(counted)) if counted[k] < counted[k - 1])
            ended = self._move(points, 0, passed)
            ended = self._end() or ended
            self._move(points, passed, len(counted))
            return ended
        ended = self._move(points, 0, len(counted))
        return self._end() if points.is_last else ended

    def _move(self, points: Points, begin: int, end: int) -> Revolution | None:
        """Take points that do not pass 0 among themselves; the revolution that ended before the first of them."""
        ended = None
        first_deg = points.counted_deg[begin]
        if self._reached_deg is None:
            # The points before are unknown; only a beginning at 0 makes this a revolution.
            self._reached_deg = 0.0
            self._lost_deg = 0.0 if first_deg <= WIDEST_STEP_DEG else math.inf
        elif first_deg < self._reached_deg - WIDEST_STEP_DEG:
            ended = self._end()
        if len(self._angles) + end - begin > MOST_POINTS:
            self.forget()
            return ended
        self._lose(first_deg - self._reached_deg)
        self._angles += points.angles_deg[begin:end]
        self._ranges += points.ranges_m[begin:end]
        self._intensities += points.intensities[begin:end]
        self._reached_deg = points.counted_deg[end - 1]
        return ended

    def _lose(self, gap_deg: float) -> None:
        if gap_deg > WIDEST_STEP_DEG:
            self._lost_deg += gap_deg

    def _end(self) -> Revolution | None:
        self._lose(360.0 - (self._reached_deg or 0.0))
        revolution = None
        if self._angles and self._lost_deg <= MOST_LOST_DEG:
            revolution = Revolution(
                tuple(self._angles), tuple(self._ranges), tuple(self._intensities), self._revolutions_per_s
            )
        self._begin()
        return revolution

    def _begin(self) -> None:
        self._angles.clear()
        self._ranges.clear()
        self._intensities.clear()
        self._reached_deg = 0.0
        self._lost_deg = 0.0


def nearest_by_degree(angles_deg: Iterable[float], ranges_m: Iterable[float]) -> tuple[float, ...]:
    """The smallest range of each of `BINS` bins of one degree, NaN where there is none.

    Args:
        angles_deg: Within [0, 360); bin k covers [k - 0.5, k + 0.5).
        ranges_m: NaN counts as none.
    """
    nearest = [math.inf] * (BINS + 1)
    for angle_deg, range_m in zip(angles_deg, ranges_m, strict=True):
        k = int(angle_deg + 0.5)
        if range_m < nearest[k]:
            nearest[k] = range_m
    # The last half degree belongs to the front.
    nearest[0] = min(nearest[0], nearest.pop())
    return tuple([range_m if range_m < math.inf else math.nan for range_m in nearest])


def wrapped_deg(angle_deg: float) -> float:
    """The same direction within [0, 360)."""
    if 0.0 <= angle_deg < 360.0:
        return angle_deg
    wrapped = angle_deg % 360.0
    return wrapped if wrapped < 360.0 else 0.0  # The remainder of a tiny negative number is rounded to 360.
