"""Distances around a vehicle as bins of one degree.

A sector is as near as what is nearest in it, so its distance counts for every bin that it reaches into.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from robosc_bridge.protocol.mavlink_messages import ObstacleRing, SectorDistance
from robosc_bridge.protocol.revolutions import BINS, wrapped_deg

RING_STEP_DEG = 5
_UNKNOWN_CM = 65535
_EIGHTHS = 8
_EIGHTH_DEG = 45.0
_TINY_DEG = 1e-6
_FAR_M = 1e6


@dataclass(frozen=True, slots=True)
class Sector:
    """A part of the surroundings.

    Attributes:
        middle_deg: Counter-clockwise from the front, within [0, 360).
        width_deg: Of all of it.
        range_m: 0: something is nearer than its sensor measures; NaN: nothing is there, or it is unknown.
        min_m: Shortest distance that its sensor measures.
        max_m: Longest.
    """

    middle_deg: float
    width_deg: float
    range_m: float
    min_m: float = 0.0
    max_m: float = math.inf


def _range_m(distance_cm: int, least_cm: int, most_cm: int) -> float:
    if distance_cm == _UNKNOWN_CM or distance_cm > most_cm:
        return math.nan
    # A distance below the shortest one was seen, and is nearer than can be measured.
    return distance_cm / 100 if distance_cm >= least_cm else 0.0


def ring_sectors(ring: ObstacleRing, heading_rad: float | None) -> tuple[Sector, ...] | None:
    """The sectors of a ring, without those that go around a second time.

    Args:
        ring: As it was reported.
        heading_rad: Of the vehicle, counter-clockwise from north; None: unknown.

    Returns:
        None: it counts from north, whose direction is unknown.
    """
    if ring.is_body_fixed:
        turned_deg = 0.0
    elif heading_rad is None:
        return None
    else:
        turned_deg = math.degrees(heading_rad)
    width_deg = abs(ring.increment_deg)
    count = min(len(ring.distances_cm), math.ceil(360.0 / width_deg - _TINY_DEG))
    return tuple(
        Sector(
            wrapped_deg(-(ring.offset_deg + index * ring.increment_deg) - turned_deg),
            width_deg,
            _range_m(distance_cm, ring.least_cm, ring.most_cm),
            ring.least_cm / 100,
            ring.most_cm / 100,
        )
        for index, distance_cm in enumerate(ring.distances_cm[:count])
    )


def sensor_sector(distance: SectorDistance) -> Sector | None:
    """The sector of a single sensor; None: it does not look around."""
    if distance.orientation >= _EIGHTHS:
        return None
    range_m = math.nan
    if distance.is_valid:
        range_m = _range_m(distance.distance_cm, distance.least_cm, distance.most_cm)
    middle_deg = wrapped_deg(-distance.orientation * _EIGHTH_DEG)
    width_deg = distance.width_deg or _EIGHTH_DEG
    return Sector(middle_deg, width_deg, range_m, distance.least_cm / 100, distance.most_cm / 100)


def nearest_in_sectors(sectors: Iterable[Sector]) -> tuple[float, ...]:
    """The smallest range of each of `BINS` bins, NaN where there is none; bin k covers [k - 0.5, k + 0.5)."""
    nearest = [math.inf] * BINS
    for sector in sectors:
        if math.isnan(sector.range_m):
            continue
        first = math.floor(sector.middle_deg - sector.width_deg / 2 + 0.5 + _TINY_DEG)
        last = math.ceil(sector.middle_deg + sector.width_deg / 2 + 0.5 - _TINY_DEG) - 1
        for k in range(first, min(last, first + BINS - 1) + 1):
            nearest[k % BINS] = min(nearest[k % BINS], sector.range_m)
    return tuple(math.nan if math.isinf(range_m) else range_m for range_m in nearest)


def ring_distances_cm(ranges_m: Sequence[float], least_cm: int, most_cm: int) -> tuple[int, ...]:
    """The 72 distances of OBSTACLE_DISTANCE: `RING_STEP_DEG` apart, clockwise from the front.

    Args:
        ranges_m: `BINS` bins, counter-clockwise from the front; 0: nearer than can be measured; NaN: nothing valid was
            measured.
        least_cm: Shortest that is reported: what is nearer is reported as this.
        most_cm: Longest.

    Returns:
        Of the nearest of each entry's bins, never farther than it is; `most_cm` + 1: it is beyond that; 65535: nothing
        was measured, which need not mean that nothing is there.
    """
    half = RING_STEP_DEG // 2
    # A beam without a measurement counts as farther than every range, also than an infinite one.
    clear = [range_m if 0.0 <= range_m < _FAR_M else _FAR_M if range_m >= _FAR_M else math.inf for range_m in ranges_m]
    clear = clear[-half:] + clear[: BINS - half]
    found = []
    for first in range(0, BINS, RING_STEP_DEG):
        nearest_m = min(clear[first : first + RING_STEP_DEG])
        if nearest_m == math.inf:
            found.append(_UNKNOWN_CM)
        else:
            # The smallest part of a millimetre keeps 0.29 m at 29 cm.
            found.append(max(int(min(nearest_m * 100 + 1e-6, most_cm + 1)), least_cm))
    return (found[0], *reversed(found[1:]))
