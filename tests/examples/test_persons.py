"""Persons in laser scans that are computed from what stands around."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_examples.persons import PersonSettings, Scan, find_person, is_blind

FARTHEST_M = 3.5


def scan_of(things: list[tuple[float, float, float]], beams: int = 360, start_rad: float = 0.0, sense: int = 1) -> Scan:
    """The scan of discs, each ahead, to the left, and its radius."""
    step_rad = sense * math.tau / beams
    ranges = []
    for beam in range(beams):
        angle = start_rad + beam * step_rad
        nearest = math.inf
        for ahead, left, radius in things:
            along = ahead * math.cos(angle) + left * math.sin(angle)
            inside = radius**2 - (ahead**2 + left**2 - along**2)
            if inside > 0 and along > 0:
                nearest = min(nearest, along - math.sqrt(inside))
        ranges.append(nearest)
    return Scan(ranges, start_rad, step_rad, 0.1, FARTHEST_M)


@given(
    st.floats(0.6, 3.0),
    st.floats(-math.pi, math.pi),
    st.floats(0.08, 0.3),
    st.sampled_from([0.0, -math.pi, 1.0]),
    st.sampled_from([1, -1]),
)
def test_a_person_is_found_wherever_the_scan_begins(
    distance: float, angle: float, radius: float, start: float, sense: int
) -> None:
    ahead, left = distance * math.cos(angle), distance * math.sin(angle)
    scan = scan_of([(ahead, left, radius)], start_rad=start, sense=sense)
    person = find_person(scan)
    assert person is not None
    # The laser sees the front, not the middle.
    assert math.hypot(person.ahead_m - ahead, person.left_m - left) <= radius
    assert person.distance_m < distance
    assert person.confidence >= 0.6


def test_the_nearest_of_two_counts() -> None:
    person = find_person(scan_of([(2.0, 0.5, 0.2), (0.0, -1.2, 0.2)]))
    assert person is not None
    assert person.left_m == pytest.approx(-1.05, abs=0.1)


@pytest.mark.parametrize(
    "thing",
    [
        (2.0, 0.0, 0.01),  # a cable
        (2.5, 0.0, 1.0),  # a pillar
    ],
)
def test_what_is_not_as_wide_as_a_person_is_none(thing: tuple[float, float, float]) -> None:
    assert find_person(scan_of([thing])) is None
    settings = PersonSettings(narrowest_m=0.0, widest_m=3.0, beams=1)
    assert find_person(scan_of([thing]), settings) is not None


def test_a_wall_around_is_nobody_but_a_person_before_it_is_somebody() -> None:
    wall = [2.0] * 360
    assert find_person(Scan(wall, 0.0, math.tau / 360, 0.1, FARTHEST_M)) is None
    before = [min(a, b) for a, b in zip(wall, scan_of([(1.2, 0.0, 0.2)]).ranges, strict=True)]
    person = find_person(Scan(before, 0.0, math.tau / 360, 0.1, FARTHEST_M))
    assert person is not None
    assert person.ahead_m == pytest.approx(1.05, abs=0.1)


def test_a_scan_that_is_no_circle_does_not_join_its_ends() -> None:
    ranges = [1.0] * 3 + [math.inf] * 84 + [1.0] * 3
    half = Scan(ranges, -math.pi / 4, math.pi / 180, 0.1, FARTHEST_M)
    person = find_person(half, PersonSettings(narrowest_m=0.01))
    assert person is not None
    assert abs(person.left_m) == pytest.approx(math.sin(math.radians(44)), abs=0.02)


@pytest.mark.parametrize(
    ("scan", "blind"),
    [
        (Scan([math.inf] * 4, 0.0, 1.0, 0.1, 3.5), False),
        (Scan([0.0] * 4, 0.0, 1.0, 0.1, 3.5), False),
        (Scan([math.nan, math.nan, 1.0, 1.0], 0.0, 1.0, 0.1, 3.5), False),
        (Scan([math.nan, math.nan, math.nan, 1.0], 0.0, 1.0, 0.1, 3.5), True),
        (Scan([], 0.0, 1.0, 0.1, 3.5), True),
        (Scan([1.0] * 4, 0.0, 0.0, 0.1, 3.5), True),
        (Scan([1.0] * 4, math.nan, 1.0, 0.1, 3.5), True),
        (Scan([1.0] * 4, 0.0, 1.0, 0.1, math.inf), True),
        (Scan([1.0] * 4, 0.0, 1.0, 3.5, 0.1), True),
    ],
)
def test_a_scan_without_a_range_is_blindness(scan: Scan, blind: bool) -> None:
    assert is_blind(scan) is blind


@given(st.lists(st.floats(), min_size=1, max_size=30), st.floats(-4, 4), st.floats(0.001, 1))
def test_no_scan_breaks_it(ranges: list[float], start: float, step: float) -> None:
    person = find_person(Scan(ranges, start, step, 0.1, FARTHEST_M), PersonSettings(0.0, 10.0, 0.15, 2))
    assert person is None or 0.0 <= person.distance_m <= FARTHEST_M


@pytest.mark.parametrize("start_rad", [0.0, 1.0])
@given(lost=st.lists(st.integers(0, 359), max_size=12))
def test_beams_that_are_lost_make_no_person_of_a_wall(start_rad: float, lost: list[int]) -> None:
    """A wall ahead, as far as it is seen, in which single beams return nothing."""
    ranges = list(scan_of([(3.0, 0.0, 1.5)], start_rad=start_rad).ranges)
    for beam in lost:
        # No three of them side by side.
        if math.isfinite(ranges[beam - 1]) and math.isfinite(ranges[beam - 2]):
            ranges[beam] = math.inf if math.isfinite(ranges[(beam + 1) % 360]) else ranges[beam]
    assert find_person(Scan(ranges, start_rad, math.tau / 360, 0.1, FARTHEST_M)) is None


def test_what_is_hidden_for_longer_ends_a_thing() -> None:
    ranges = [math.inf] * 360
    for beam in (*range(10, 16), *range(19, 25)):
        ranges[beam] = 1.0
    person = find_person(Scan(ranges, 0.0, math.tau / 360, 0.1, FARTHEST_M), PersonSettings(widest_m=0.15))
    assert person is not None
    assert person.left_m == pytest.approx(math.sin(math.radians(12.5)), abs=0.01)
