"""Lines on the floor, and what a pinhole sees of them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc_simulated import Mount, PinholeCamera, Scene, Track, Walls, oval, parse_track
from robosc_simulated.floor import SHADE as LINE
from robosc_simulated.floor import Point
from robosc_simulated.pinhole_camera import DISTANCE, ground_points
from robosc_simulated.textures import PLAIN
from support.effort import examples

FLOOR = PLAIN.shade
STRAIGHT = Track([(-1.0, 0.0), (3.0, 0.0)], width_m=0.04)
BARE = Scene("bare", Walls(()))
LINED = replace(BARE, line=STRAIGHT)
# Straight down from 1 m with a right angle of view: one metre to each side.
ABOVE = Mount(x_m=0.0, height_m=1.0, tilt_rad=math.pi / 2, field_of_view_rad=math.pi / 2, width=100, height=50)


def test_a_point_is_on_the_line_within_half_of_its_width() -> None:
    ys = np.array([-1.0, -0.026, -0.012, 0.0, 0.012, 0.026, 1.0])
    found = STRAIGHT.is_line(np.stack((np.full(7, 0.7), ys), axis=1))
    assert found.tolist() == [False, False, True, True, True, False, False]


def test_far_away_and_nowhere_is_no_line() -> None:
    far = np.array([[1e9, 0.0], [-1e9, 0.0], [math.nan, 0.0], [0.0, math.inf], [3.5, 0.0]])
    assert not STRAIGHT.is_line(far).any()


def test_a_track_of_any_direction_is_drawn_as_wide_as_it_is() -> None:
    track = Track([(0.0, 0.0), (1.0, 1.0), (2.0, 0.5), (2.0, 0.5)], width_m=0.1)
    chance = np.random.default_rng(1)
    points = chance.uniform((-0.2, -0.2), (2.2, 1.2), (4000, 2))
    for point, is_line in zip(points.tolist(), track.is_line(points), strict=True):
        distance_m = track.distance_m(*point)
        if abs(distance_m - 0.05) > 0.004:
            assert bool(is_line) is (distance_m < 0.05), point


PLACES = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))


@settings(max_examples=examples(40))
@given(st.lists(PLACES, min_size=2, max_size=6), st.floats(0.005, 1.0), st.integers(0, 4))
def test_a_track_is_drawn_as_a_slow_twin_draws_it(points: list[Point], width_m: float, repeats: int) -> None:
    # Also upright pieces, and such as are but a point.
    points = [*points, *([(points[-1][0], 0.3)] * repeats)]
    track = Track(points, width_m)
    corner = np.array(points).min(axis=0) - width_m
    for column, row in np.random.default_rng(1).integers((0, 0), track._is_line.shape, (300, 2)).tolist():
        x_m, y_m = corner + (np.array((column, row)) + 0.5) * 0.005
        beyond_m = track.distance_m(float(x_m), float(y_m)) - width_m / 2
        # At the very edge, rounding decides.
        assert bool(track._is_line[column, row]) is (beyond_m <= 0.0) or abs(beyond_m) < 1e-9


def test_many_pieces_are_drawn_part_by_part(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = oval()
    monkeypatch.setattr("robosc_simulated.floor._COLUMNS_AT_ONCE", 40)
    assert (oval()._is_line == whole._is_line).all()


def test_the_oval_is_closed_and_goes_through_the_start() -> None:
    track = oval()
    assert track.points[0] == track.points[-1]
    assert track.distance_m(0.0, 0.0) == 0.0
    assert track.distance_m(0.0, 1.0) == pytest.approx(0.0)
    assert track.distance_m(1.0, 0.5) == pytest.approx(0.0, abs=1e-9)
    assert track.distance_m(-1.0, 0.5) == pytest.approx(0.0, abs=1e-9)
    length_m = sum(math.dist(*pair) for pair in zip(track.points, track.points[1:], strict=False))
    assert length_m == pytest.approx(2.0 + math.pi, rel=0.001)


@pytest.mark.parametrize(
    ("points", "width_m", "text"),
    [
        ([(0.0, 0.0)], 0.05, "at least two points"),
        ([(0.0, 0.0), (math.nan, 1.0)], 0.05, "finite"),
        ([(0.0, 0.0), (1.0, 1.0)], 0.0, "above 0"),
        ([(0.0, 0.0), (1.0, 1.0)], math.inf, "finite"),
        ([(0.0, 0.0), (1e200, 1.0)], 0.05, "too far"),
        ([(0.0, 0.0), (26.0, 26.0)], 0.05, "too far"),
    ],
)
def test_what_is_no_track_is_reported(points: list[tuple[float, float]], width_m: float, text: str) -> None:
    with pytest.raises(ValueError, match=text):
        Track(points, width_m)


def test_a_track_is_read_from_text() -> None:
    assert parse_track("# a bend\n0 0\n\n1.5 0 # first\n1.5 -2\n").points == ((0.0, 0.0), (1.5, 0.0), (1.5, -2.0))
    for text, problem in (
        ("0 0\n1\n", "line 2 of the track is not `x y`: '1'"),
        ("0 0\n1 nan\n", "line 2 of the track has a number that is not finite"),
        ("# none\n", "at least two points"),
    ):
        with pytest.raises(ValueError, match=problem):
            parse_track(text)


def test_pixels_show_the_floor_by_central_projection() -> None:
    points = ground_points(ABOVE).reshape(50, 100, 2)
    # The middle of the outermost pixels: up is forward, left is left.
    assert points[0, 0] == pytest.approx((0.49, 0.99))
    assert points[-1, -1] == pytest.approx((-0.49, -0.99))
    slanted = Mount(x_m=0.1, height_m=0.2, tilt_rad=math.radians(30), width=101, height=101)
    middle = ground_points(slanted).reshape(101, 101, 2)[50, 50]
    assert middle == pytest.approx((0.1 + 0.2 / math.tan(math.radians(30)), 0.0))


def test_the_edges_of_the_picture_are_half_the_field_of_view_aside() -> None:
    mount = replace(Mount(), width=10_000, height=2)
    x_m, y_m = ground_points(mount).reshape(2, 10_000, 2)[:, 0].mean(axis=0)
    along_m = math.hypot(x_m - mount.x_m, mount.height_m)
    assert math.degrees(math.atan2(y_m, along_m)) == pytest.approx(31.1, abs=0.01)


def test_the_line_is_seen_where_it_is() -> None:
    camera = PinholeCamera(ABOVE, LINED)
    for pose, column in (
        ((0.0, 0.0, 0.0), 50),
        ((0.0, 0.3, 0.0), 65),
        ((1.0, -0.3, 0.0), 35),
        ((0.0, 0.3, math.pi), 35),
    ):
        picture = camera.picture(pose)
        dark = np.flatnonzero(picture[25] == LINE)
        assert dark.mean() + 0.5 == pytest.approx(column, abs=0.6)
        assert len(dark) == pytest.approx(2, abs=1)
    # Turned to the left, the line goes to the right with the distance.
    picture = camera.picture((0.0, 0.0, 0.3))
    assert np.flatnonzero(picture[0] == LINE).mean() > 55 > 45 > np.flatnonzero(picture[-1] == LINE).mean()


def test_above_the_horizon_there_is_no_floor() -> None:
    level = replace(Mount(), tilt_rad=0.0)
    picture = PinholeCamera(level, LINED).picture((0.0, 0.0, 0.0))
    assert (picture[:60] == DISTANCE).all()
    assert set(np.unique(picture[60:])) == {LINE, FLOOR}
    assert (PinholeCamera(Mount(), BARE).picture((0.0, 0.0, 0.0)) == FLOOR).all()
