"""Sectors as bins of one degree, against a slow twin."""

import math

from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.protocol.mavlink_messages import ObstacleRing, SectorDistance
from robosc_bridge.protocol.mavlink_obstacles import Sector, nearest_in_sectors, ring_sectors, sensor_sector

BINS = 360
ranges = st.one_of(st.just(math.nan), st.integers(0, 800).map(lambda cm: cm / 100))
# Multiples of a quarter degree: no edge is where only rounding says which side it is on.
sectors = st.builds(
    Sector, st.integers(0, 1439).map(lambda k: k / 4), st.integers(2, 1440).map(lambda k: k / 4), ranges
)


def _twin(found: list[Sector]) -> tuple[float, ...]:
    """Each bin at points less than a quarter degree apart, none at an edge."""
    nearest = []
    for k in range(BINS):
        seen = [
            sector.range_m
            for sector in found
            if not math.isnan(sector.range_m)
            and any(
                abs(math.remainder(k - 0.5 + (part + 0.5) / 8 - sector.middle_deg, 360.0)) < sector.width_deg / 2
                for part in range(8)
            )
        ]
        nearest.append(min(seen, default=math.nan))
    return tuple(nearest)


@given(st.lists(sectors, max_size=6))
def test_every_bin_has_the_nearest_of_what_reaches_into_it(found: list[Sector]) -> None:
    result = nearest_in_sectors(found)
    assert [str(range_m) for range_m in result] == [str(range_m) for range_m in _twin(found)]


def _ring(distances_cm: tuple[int, ...], increment_deg: float = 5.0, offset_deg: float = 0.0,
          is_body_fixed: bool = True) -> ObstacleRing:  # fmt: skip
    return ObstacleRing(distances_cm, increment_deg, offset_deg, 5, 800, is_body_fixed)


def test_a_ring_is_clockwise_from_the_front() -> None:
    found = ring_sectors(_ring(tuple(range(100, 172))), None)
    assert found is not None
    bins = nearest_in_sectors(found)
    assert not any(map(math.isnan, bins))
    assert bins[358] == bins[0] == bins[2] == 1.0
    # Five degrees to the right.
    assert bins[355] == bins[357] == bins[353] == 1.01
    assert bins[352] == 1.02
    assert bins[90] == 1.54
    assert bins[270] == 1.18


def test_nothing_there_and_unknown_are_no_range_and_too_near_is_touching() -> None:
    found = ring_sectors(_ring((801, 65535, 4, 0, 5, 800)), None)
    assert found is not None
    assert [str(sector.range_m) for sector in found] == ["nan", "nan", "0.0", "0.0", "0.05", "8.0"]


def test_a_sensor_that_is_too_near_is_touched_and_an_invalid_signal_says_nothing() -> None:
    def range_m(distance_cm: int, least_cm: int = 20, is_valid: bool = True) -> str:
        sector = sensor_sector(SectorDistance(0, distance_cm, least_cm, 400, 0.0, is_valid=is_valid))
        assert sector is not None
        return str(sector.range_m)

    assert [range_m(cm) for cm in (0, 1, 19, 20, 400, 401, 65535)] == ["0.0", "0.0", "0.0", "0.2", "4.0", "nan", "nan"]
    # A sensor without a shortest distance.
    assert [range_m(cm, 0) for cm in (0, 1)] == ["0.0", "0.01"]
    assert [range_m(cm, is_valid=False) for cm in (0, 10, 300)] == ["nan"] * 3


def test_offset_fine_increment_and_the_other_way_round() -> None:
    found = ring_sectors(_ring((100, 200), -10.0, 90.0), None)
    assert found is not None
    assert [sector.middle_deg for sector in found] == [270.0, 280.0]
    assert found[0].width_deg == 10.0


def test_what_goes_around_a_second_time_is_left_out() -> None:
    found = ring_sectors(_ring((100,) * 72, 30.0), None)
    assert found is not None
    assert len(found) == 12


def test_a_ring_from_north_is_turned_with_the_vehicle() -> None:
    ring = _ring((100, 65535), is_body_fixed=False)
    assert ring_sectors(ring, None) is None
    # It looks to the west: north is at its right.
    found = ring_sectors(ring, math.pi / 2)
    assert found is not None
    assert found[0].middle_deg == 270.0


def test_single_sensors_look_in_eighths_clockwise() -> None:
    assert sensor_sector(SectorDistance(2, 100, 5, 800, 0.0)) == Sector(270.0, 45.0, 1.0, 0.05, 8.0)
    assert sensor_sector(SectorDistance(0, 100, 5, 800, 10.0)) == Sector(0.0, 10.0, 1.0, 0.05, 8.0)
    # Down.
    assert sensor_sector(SectorDistance(25, 100, 5, 800, 0.0)) is None
