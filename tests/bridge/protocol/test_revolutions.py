"""Points of frames become full revolutions, and turns 360 ranges."""

import math
from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.protocol import lds01, lds02, lds03
from robosc_bridge.protocol.revolutions import (
    BINS,
    MOST_POINTS,
    Points,
    Revolution,
    RevolutionBuilder,
    nearest_by_degree,
    wrapped_deg,
)


def _points(first_deg: float, last_deg: float, range_m: float, revolutions_per_s: float | None = None) -> Points:
    """One point a degree, clockwise from the first to the last one."""
    count = round((last_deg - first_deg) % 360) + 1
    counted = tuple((first_deg + k) % 360 for k in range(count))
    return Points(
        counted, tuple(wrapped_deg(360 - deg) for deg in counted), (range_m,) * count, (1,) * count, revolutions_per_s
    )


def _turns(builder: RevolutionBuilder, parts: Iterable[Points]) -> list[Revolution]:
    return [revolution for part in parts if (revolution := builder.add(part))]


def _counted(revolution: Revolution) -> list[float]:
    return [wrapped_deg(360 - deg) for deg in revolution.angles_deg]


# Turns


def test_a_turn_ends_where_the_angle_passes_zero_between_two_frames() -> None:
    builder = RevolutionBuilder()
    parts = [_points(0, 119, 1), _points(120, 239, 1), _points(240, 359, 1)]
    assert _turns(builder, parts) == []
    revolution = builder.add(_points(0, 9, 2, 7.0))
    assert revolution
    assert _counted(revolution) == list(range(360))
    assert set(revolution.ranges_m) == {1}
    assert revolution.revolutions_per_s == 7.0


def test_a_turn_ends_where_the_angle_passes_zero_within_a_frame() -> None:
    builder = RevolutionBuilder()
    first, second = _turns(builder, [_points(0, 349, 1), _points(350, 9, 2), _points(10, 355, 3), _points(356, 5, 4)])
    assert _counted(first) == list(range(360))
    assert first.ranges_m == (1,) * 350 + (2,) * 10
    assert _counted(second) == list(range(360))
    assert second.ranges_m == (2,) * 10 + (3,) * 346 + (4,) * 4


def test_a_turn_of_which_the_end_is_known_does_not_wait_for_the_next_frame() -> None:
    builder = RevolutionBuilder()
    frame = lds01.Frame(0, 3000, (1000,) * 6, (1,) * 6)
    ended = []
    for n in range(180):
        revolution = builder.add(lds01.points(lds01.Frame(n % 60, *_rest(frame))))
        if revolution:
            ended.append((n, len(revolution.angles_deg)))
    assert ended == [(59, 360), (119, 360), (179, 360)]


def _rest(frame: lds01.Frame) -> tuple[int, tuple[int, ...], tuple[int, ...]]:
    return frame.speed, frame.distances_mm, frame.intensities


def test_what_came_before_the_first_beginning_is_no_turn() -> None:
    builder = RevolutionBuilder()
    assert _turns(builder, [_points(4, 359, 1), _points(0, 350, 2)]) == []
    [revolution] = _turns(builder, [_points(351, 5, 3)])
    assert set(revolution.ranges_m) == {2, 3}


def test_a_device_that_begins_at_zero_loses_no_turn() -> None:
    assert len(_turns(RevolutionBuilder(), [_points(3, 359, 1), _points(0, 9, 2)])) == 1


def test_after_forgetting_there_is_no_half_turn_and_nothing_stale() -> None:
    builder = RevolutionBuilder()
    assert _turns(builder, [_points(0, 179, 1)]) == []
    builder.forget()
    assert _turns(builder, [_points(180, 359, 2), _points(0, 359, 3)]) == []
    [revolution] = _turns(builder, [_points(0, 0, 4)])
    assert set(revolution.ranges_m) == {3}
    builder.forget()
    assert _turns(builder, [_points(60, 359, 5), _points(0, 0, 6)]) == []


@pytest.mark.parametrize(("resumes_deg", "is_revolution"), [(190, True), (191, False)])
def test_a_turn_may_miss_a_quarter_and_no_more(resumes_deg: int, is_revolution: bool) -> None:
    parts = [_points(0, 100, 1), _points(resumes_deg, 359, 1), _points(0, 9, 2)]
    revolutions = _turns(RevolutionBuilder(), parts)
    assert len(revolutions) == is_revolution
    for revolution in revolutions:
        assert _counted(revolution) == [*range(101), *range(resumes_deg, 360)]


def test_what_is_lost_over_zero_is_missing_in_both_turns() -> None:
    parts = [_points(0, 319, 1), _points(40, 359, 2), _points(0, 9, 3)]
    first, second = _turns(RevolutionBuilder(), parts)
    assert _counted(first) == list(range(320))
    assert _counted(second) == list(range(40, 360))
    assert set(second.ranges_m) == {2}


def test_two_halves_of_different_turns_are_no_turn() -> None:
    # Lost from 200 over 0 to 150: a fall of the angle by 50 degrees only.
    assert _turns(RevolutionBuilder(), [_points(0, 200, 1), _points(150, 359, 2), _points(0, 9, 3)]) == []


def test_an_angle_that_trembles_ends_no_turn() -> None:
    [revolution] = _turns(
        RevolutionBuilder(), [_points(0, 100, 1), _points(98, 200, 1), _points(199, 359, 1), _points(0, 9, 2)]
    )
    assert set(revolution.ranges_m) == {1}
    assert len(revolution.angles_deg) == 101 + 103 + 161


def test_the_speed_is_the_last_one_reported() -> None:
    parts = [_points(0, 359, 1), _points(0, 99, 2, 10.0), _points(100, 359, 2), _points(0, 9, 3)]
    first, second = _turns(RevolutionBuilder(), parts)
    assert first.revolutions_per_s == second.revolutions_per_s == 10.0
    [revolution] = _turns(RevolutionBuilder(), [_points(0, 359, 1), _points(0, 9, 1)])
    assert math.isnan(revolution.revolutions_per_s)


def test_a_device_that_stays_where_it_is_fills_no_memory() -> None:
    builder = RevolutionBuilder()
    same = _points(10, 10, 1)
    for _ in range(3 * MOST_POINTS):
        assert builder.add(same) is None
    assert len(builder._angles) <= MOST_POINTS
    assert _turns(builder, [_points(11, 359, 1), _points(0, 359, 2), _points(0, 9, 3)])[0].ranges_m == (2,) * 360


@given(
    st.lists(st.integers(1, 40), min_size=1, max_size=120),
    st.sets(st.integers(0, 119), max_size=60),
    st.integers(0, 359),
)
def test_turns_hold_points_of_one_turn_in_order_and_every_complete_turn_is_there(
    widths: list[int], lost: set[int], begin: int
) -> None:
    """A device that measures its own count of points: which turn a point is from can be read from its range."""
    builder = RevolutionBuilder()
    revolutions: list[Revolution] = []
    came: dict[int, set[int]] = {}
    at = begin
    gap = 0
    for number, width in enumerate(widths):
        places = list(range(at, at + width))
        at += width
        # A whole revolution that is lost shows in no angle: the driver sees to that by the time that it takes.
        gap = gap + width if number in lost and gap + width < 340 else 0
        if gap:
            continue
        for place in places:
            came.setdefault(place // 360, set()).add(place % 360)
        counted = tuple(float(place % 360) for place in places)
        angles = tuple(wrapped_deg(360.0 - deg) for deg in counted)
        points = Points(counted, angles, tuple(float(place // 360) for place in places), (0,) * width)
        revolutions += _turns(builder, [points])
    seen = []
    for revolution in revolutions:
        assert len(set(revolution.ranges_m)) == 1
        number = int(revolution.ranges_m[0])
        seen.append(number)
        assert _counted(revolution) == sorted(came[number])
        assert len(revolution.angles_deg) >= 360 - 90
    assert seen == sorted(set(seen))
    is_passed = [number for number, places in came.items() if len(places) == 360 and any(n > number for n in came)]
    assert set(is_passed) <= set(seen)


# Directions of the devices: one thing in sight, and where it is seen


def test_lds01_counts_clockwise_from_just_right_of_the_front() -> None:
    nearest = _nearest(
        lds01.points(lds01.Frame(n, 3000, tuple(1000 + 6 * n + k for k in range(6)), (1,) * 6)) for n in range(60)
    )
    assert nearest == tuple((1359 - k) / 1000 for k in range(BINS))


def test_lds02_counts_clockwise_from_the_front() -> None:
    # A thing at a right angle clockwise, that is to the right: about 270 degrees counter-clockwise.
    frames = [lds02.Frame(2152, at, (at + 1100) % 36000, 0, (0,) * 12, (200,) * 12) for at in range(0, 36000, 1200)]
    seen = lds02.Frame(2152, 8400, 9500, 0, (0,) * 6 + (4000,) + (0,) * 5, (200,) * 12)
    nearest = _nearest(lds02.points(seen if frame.start_cdeg == 8400 else frame) for frame in [*frames, frames[0]])
    # The optical centre is beside the axis: 3.989 m ahead, 0.4568 m to the left of a line to the right.
    bearing = 360 - 90 + math.degrees(math.atan((0.11923 * 4000 - 20.14) / 4005.9))
    [found] = [k for k in range(BINS) if not math.isnan(nearest[k])]
    assert found == round(bearing) == 277
    assert nearest[found] == pytest.approx(math.hypot(4.0059, 0.45678), abs=1e-5)


def test_lds03_counts_clockwise_from_the_front() -> None:
    frames = [lds03.Frame(False, None, 64 * at, 64 * (at + 19), (0,) * 20, (99,) * 20) for at in range(0, 360, 20)]
    frames[0] = lds03.Frame(True, 10.0, 0, 64 * 19, (2000,) + (0,) * 19, (99,) * 20)
    frames[4] = lds03.Frame(False, None, 64 * 80, 64 * 99, (0,) * 10 + (3000,) + (0,) * 9, (99,) * 20)
    nearest = _nearest(lds03.points(frame) for frame in [*frames, frames[0]])
    assert {k: nearest[k] for k in range(BINS) if not math.isnan(nearest[k])} == {0: 2.0, 270: 3.0}


def _nearest(frames: Iterable[Points]) -> tuple[float, ...]:
    [revolution] = _turns(RevolutionBuilder(), frames)
    return nearest_by_degree(revolution.angles_deg, revolution.ranges_m)


# Bins


@pytest.mark.parametrize(
    ("angle_deg", "found"),
    [
        (0.0, 0),
        (0.4999999999999, 0),
        (0.5, 1),
        (1.4999999999999, 1),
        (90.0, 90),
        (359.4999999999, 359),
        (359.5, 0),
        (math.nextafter(360.0, 0.0), 0),
    ],
)
def test_a_bin_is_half_a_degree_to_both_sides(angle_deg: float, found: int) -> None:
    nearest = nearest_by_degree([angle_deg], [1.5])
    assert [k for k, range_m in enumerate(nearest) if not math.isnan(range_m)] == [found]


@given(st.lists(st.tuples(st.integers(0, 359_999), st.floats(0, 20) | st.just(math.nan)), max_size=80))
def test_a_bin_has_the_smallest_of_its_ranges(points: list[tuple[int, float]]) -> None:
    """Angles are in thousandths of a degree here, in which the edges of bins are whole numbers."""
    expected: list[float | None] = []
    for k in range(BINS):
        inside = [
            range_m
            for millis, range_m in points
            if not math.isnan(range_m)
            and any(-500 <= millis - 1000 * (k + revolution) < 500 for revolution in (0, 360))
        ]
        expected.append(min(inside, default=None))
    found = nearest_by_degree([millis / 1000 for millis, _ in points], [range_m for _, range_m in points])
    assert [None if math.isnan(range_m) else range_m for range_m in found] == expected


@given(st.floats(-1e6, 1e6) | st.floats(-1e-12, 0))
def test_directions_are_within_one_turn(angle_deg: float) -> None:
    wrapped = wrapped_deg(angle_deg)
    assert 0 <= wrapped < 360
    assert math.cos(math.radians(wrapped)) == pytest.approx(math.cos(math.radians(angle_deg)), abs=1e-6)
    assert math.sin(math.radians(wrapped)) == pytest.approx(math.sin(math.radians(angle_deg)), abs=1e-6)
