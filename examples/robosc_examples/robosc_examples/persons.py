"""Things in a laser scan that are as wide as a person. Without ROS."""

import math
from collections.abc import Sequence
from typing import NamedTuple

FULL_CIRCLE_RAD = math.tau - 0.1
SURE_BEAMS = 5
# So many beams that return nothing do not end a thing: a LiDAR loses some, and parts of a wall are no persons.
LOST_BEAMS = 2


class PersonSettings(NamedTuple):
    """Properties of a person in a scan.

    Attributes:
        narrowest_m: Least width.
        widest_m: Largest width.
        gap_m: Difference of neighbouring ranges from which they are of two things.
        beams: Least number of beams.
    """

    narrowest_m: float = 0.05
    widest_m: float = 0.7
    gap_m: float = 0.15
    beams: int = 3


class Person(NamedTuple):
    """Metres ahead and to the left, and how sure it is, 0 to 1."""

    ahead_m: float
    left_m: float
    confidence: float

    @property
    def distance_m(self) -> float:
        """Distance from the scanner, in metres."""
        return math.hypot(self.ahead_m, self.left_m)


class Scan(NamedTuple):
    """A laser scan: beams counter-clockwise, and the ranges that can be believed."""

    ranges: Sequence[float]
    start_rad: float
    step_rad: float
    nearest_m: float
    farthest_m: float


def is_blind(scan: Scan) -> bool:
    """Return True if a scan is unusable: no beams, no sensible angles or limits, or most ranges unknown."""
    sensible = all(map(math.isfinite, scan[1:])) and 0.0 <= scan.nearest_m < scan.farthest_m
    if not sensible or scan.step_rad == 0.0 or not scan.ranges:
        return True
    # LiDARs report free space as infinity, zero or beyond the farthest; never as NaN.
    return sum(map(math.isnan, scan.ranges)) * 2 > len(scan.ranges)


USUAL = PersonSettings()


def find_person(scan: Scan, settings: PersonSettings = USUAL) -> Person | None:
    """The nearest thing that is as wide as a person; None if there is none.

    A thing is a row of neighbouring beams; in a full circle, the last beam is the first's neighbour.
    """
    found = (_person(scan, beams) for beams in _things(scan, settings.gap_m) if len(beams) >= settings.beams)
    fitting = (item for width_m, item in found if settings.narrowest_m <= width_m <= settings.widest_m)
    return min(fitting, key=lambda person: person.distance_m, default=None)


def _things(scan: Scan, gap_m: float) -> list[list[int]]:
    """The beams of each thing, by their numbers."""
    things: list[list[int]] = []
    for beam, range_m in enumerate(scan.ranges):
        if not scan.nearest_m <= range_m <= scan.farthest_m:
            continue
        if things and _go_on(scan, things[-1][-1], beam, gap_m):
            things[-1].append(beam)
        else:
            things.append([beam])
    count = len(scan.ranges)
    is_circle = abs(scan.step_rad) * count >= FULL_CIRCLE_RAD
    if is_circle and len(things) > 1 and _go_on(scan, things[-1][-1] - count, things[0][0], gap_m):
        things[0] = things.pop() + things[0]
    return things


def _go_on(scan: Scan, before: int, beam: int, gap_m: float) -> bool:
    """Return True if a beam shows the same thing as the last one before it that has returned."""
    return beam - before <= 1 + LOST_BEAMS and abs(scan.ranges[before] - scan.ranges[beam]) <= gap_m


def _person(scan: Scan, beams: list[int]) -> tuple[float, Person]:
    """Return the width of a thing, in metres, and the person that it would be."""
    places = [
        (scan.ranges[beam] * math.cos(angle), scan.ranges[beam] * math.sin(angle))
        for beam in beams
        for angle in (scan.start_rad + beam * scan.step_rad,)
    ]
    ahead_m = sum(place[0] for place in places) / len(places)
    left_m = sum(place[1] for place in places) / len(places)
    # Not from end to end: a wall all around ends where it begins.
    width_m = max(math.dist(places[0], place) for place in places)
    return width_m, Person(ahead_m, left_m, min(1.0, len(beams) / SURE_BEAMS))
