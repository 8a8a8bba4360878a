"""
Scans of any LiDAR as 360 ranges, one for each degree: `ranges[270]` is at 270 degrees.

Degrees count counter-clockwise from straight ahead, as ROS counts angles (REP 103). A bin is
centred on its degree.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable
import copy
import math
from typing import Any

BIN_COUNT = 360
_BINS_PER_RADIAN = BIN_COUNT / (2.0 * math.pi)
_NAN = float('nan')
_INFINITY = float('inf')


def bin_numbers(angle_min: float, angle_increment: float, count: int) -> list[int]:
    """
    Return the bin of each beam: its angle, rounded to a degree.

    Empty if the angles are no numbers.
    """
    if not (math.isfinite(angle_min) and math.isfinite(angle_increment)):
        return []
    first, step = angle_min * _BINS_PER_RADIAN + 0.5, angle_increment * _BINS_PER_RADIAN
    # A remainder before the floor: angles that are far too large stay numbers of bins.
    return [int((first + index * step) % BIN_COUNT) % BIN_COUNT for index in range(count)]


class Resampler:
    """
    Resamples the scans of one topic.

    The beams' bins are computed anew only when the angles change.
    """

    def __init__(self) -> None:
        self._angles: tuple[float, float, int] = (_NAN, _NAN, 0)
        self._bins: list[int] = []
        self._seen: Any = None
        self._copy: Any = None

    def ranges(
        self, angle_min: float, angle_increment: float, ranges: Any, low: float, high: float
    ) -> array[float]:
        """
        Return the smallest valid range of each bin; NaN where there is none.

        :param angle_min: Angle of the first beam, in radians.
        :param angle_increment: Angle from a beam to the next, in radians.
        :param ranges: Range of each beam, in metres.
        :param low: The smallest valid range.
        :param high: The greatest valid range; an infinity is never one.
        """
        angles = (angle_min, angle_increment, len(ranges))
        if angles != self._angles:
            self._angles, self._bins = angles, bin_numbers(*angles)
        smallest = [_INFINITY] * BIN_COUNT
        # A NaN fails every comparison.
        for number, distance in zip(self._bins, ranges):
            if low <= distance <= high and distance < smallest[number]:
                smallest[number] = distance
        return array('f', [_NAN if distance == _INFINITY else distance for distance in smallest])

    def resample(self, scan: Any) -> Any:
        """Return the sensor_msgs/LaserScan, changed to 360 ranges from 0 to 359 degrees."""
        scan.ranges = self.ranges(
            scan.angle_min, scan.angle_increment, scan.ranges, scan.range_min, scan.range_max
        )
        # The values of single beams mean nothing any more.
        scan.intensities = array('f')
        scan.time_increment = 0.0
        scan.angle_min = 0.0
        scan.angle_increment = 1.0 / _BINS_PER_RADIAN
        scan.angle_max = (BIN_COUNT - 1) / _BINS_PER_RADIAN
        return scan

    def resampled(self, scan: Any) -> Any:
        """
        Return a copy with 360 ranges, the scan left as it is.

        Asked for one scan several times, the same copy.
        """
        if scan is not self._seen:
            # A shallow one: whatever is resampled is replaced, not changed.
            self._seen, self._copy = scan, self.resample(copy.copy(scan))
        return self._copy


def resampling(system: Any, topics: Iterable[Any]) -> Any:
    """
    Return a controlled system that sees every laser scan with 360 ranges.

    The scans themselves stay as they are.

    :param system: It is changed.
    :param topics: The topics of the node.
    """
    resamplers = {
        topic.identifier: (Resampler(), topic.received)
        for topic in topics
        if topic.received and (topic.package, topic.type_name) == ('sensor_msgs', 'LaserScan')
    }
    by_event = {
        f'{name}.response': resampler for resampler, names in resamplers.values() for name in names
    }
    read, receive = system.read, system.receive

    def read_resampled(event: str, data: Any) -> Any:
        resampler = by_event.get(event)
        return read(
            event, data if resampler is None or data is None else resampler.resampled(data)
        )

    def receive_resampled(identifier: str, data: Any) -> Any:
        resampler, _ = resamplers.get(identifier, (None, ()))
        return receive(
            identifier, data if resampler is None or data is None else resampler.resampled(data)
        )

    system.read, system.receive = read_resampled, receive_resampled
    return system
