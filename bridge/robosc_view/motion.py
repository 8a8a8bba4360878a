"""The motion of a robot that was recorded beside an event log, for the page that replays the log."""

import math
from bisect import bisect_right
from itertools import accumulate

from robosc.motion_record import Motion, Sample
from robosc_view.reports import Drive

MOST_POINTS = 2000
"""Points of the whole way that are sent to the page."""

_DIGITS = 4


class MotionTrace:
    """Motion of the robot in the coordinates of the page's map.

    Args:
        motion: The record.
        start: x and y in metres and heading in radians of the map's origin, in the coordinates of the record.
    """

    def __init__(self, motion: Motion, start: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        self._samples = motion.samples
        # A clock that was set back would hide what came after it.
        self._times_s = list(accumulate((sample.time for sample in motion.samples), max))
        self._start = start

    def drive(self, time_s: float) -> Drive | None:
        """Return where the robot was at a time and how fast; None before the record begins.

        Args:
            time_s: The time, in seconds since 1970-01-01 UTC.
        """
        place = bisect_right(self._times_s, time_s) - 1
        if place < 0:
            return None
        sample = self._samples[place]
        return Drive(self._pose(sample), sample.linear_m_s, sample.angular_rad_s, battery_v=None, is_torque_on=None)

    def way(self) -> list[list[float]]:
        """Return the whole way, each point [x, y] in metres; at most `MOST_POINTS` and the end."""
        step = max(-(-len(self._samples) // MOST_POINTS), 1)
        chosen = [*self._samples[::step], *self._samples[-1:]]
        return [[round(value, _DIGITS) for value in self._pose(sample)[:2]] for sample in chosen]

    def _pose(self, sample: Sample) -> tuple[float, float, float]:
        begin_x_m, begin_y_m, heading_rad = self._start
        cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
        x_m, y_m = sample.x_m - begin_x_m, sample.y_m - begin_y_m
        return cosine * x_m + sine * y_m, cosine * y_m - sine * x_m, sample.heading_rad - heading_rad
