"""Things of a colour on rendered pictures."""

import colorsys
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

pytest.importorskip("cv2", reason="OpenCV (the extra examples) is not installed")

from robosc_examples.blob import Colour, find_blob, place_of

HEIGHT, WIDTH = 90, 120
VIEW_RAD = 1.085


def disc(column: float, row: float, radius: float, hue: float, floor: int = 200) -> NDArray[np.uint8]:
    """A picture with a disc of a hue (0 to 179), in blue, green and red."""
    picture = np.full((HEIGHT, WIDTH, 3), floor, np.uint8)
    rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH]
    red, green, blue = (round(255 * part) for part in colorsys.hsv_to_rgb(hue / 180, 0.9, 0.8))
    picture[(columns + 0.5 - column) ** 2 + (rows + 0.5 - row) ** 2 <= radius**2] = (blue, green, red)
    return picture


@given(st.floats(25, 95), st.floats(25, 65), st.floats(4, 20), st.integers(0, 179))
def test_a_disc_is_where_it_was_drawn(column: float, row: float, radius: float, hue: int) -> None:
    # Across red, too.
    colour = Colour((hue - 6) % 180, (hue + 6) % 180)
    blob = find_blob(disc(column, row, radius, hue), colour, 0.0005)
    assert blob is not None
    assert blob.aside == pytest.approx(0.5 - column / WIDTH, abs=1.5 / WIDTH)
    assert blob.size == pytest.approx(2 * radius / WIDTH, abs=2.5 / WIDTH)
    assert 0.8 < blob.confidence <= 1.0
    # Another colour is not there.
    assert find_blob(disc(column, row, radius, hue), Colour((hue + 80) % 180, (hue + 100) % 180), 0.0005) is None


def test_the_largest_counts_and_specks_do_not() -> None:
    picture = disc(30, 45, 15, 60)
    other = disc(100, 45, 5, 60)
    picture[:, 80:] = other[:, 80:]
    green = Colour(50, 70)
    blob = find_blob(picture, green, 0.001)
    assert blob is not None
    assert blob.aside == pytest.approx(0.25, abs=0.01)
    assert find_blob(picture, green, 0.1) is None


@pytest.mark.parametrize("floor", [0, 128, 255])
def test_without_colour_there_is_nothing(floor: int) -> None:
    assert find_blob(np.full((HEIGHT, WIDTH, 3), floor, np.uint8), Colour(0, 179), 0.0005) is None


def test_scattered_pixels_give_little_confidence() -> None:
    picture = np.full((HEIGHT, WIDTH, 3), 200, np.uint8)
    for place in range(60):
        picture[place, place] = (20, 20, 200)
    blob = find_blob(picture, Colour(170, 10), 0.0005)
    assert blob is not None
    assert blob.confidence < 0.5


@given(st.floats(0.3, 5.0), st.floats(-0.1, 0.1), st.floats(0.05, 0.3))
def test_a_place_is_where_the_thing_stands(ahead_m: float, share: float, width_m: float) -> None:
    left_m = share * ahead_m
    view_m = 2 * ahead_m * math.tan(VIEW_RAD / 2)
    pixels = WIDTH / view_m
    blob = find_blob(disc(WIDTH / 2 - left_m * pixels, HEIGHT / 2, width_m / 2 * pixels, 0), Colour(170, 10), 0.0)
    if blob is None or blob.size < 0.1:
        return  # Too small to be measured by whole pixels.
    place = place_of(blob, width_m, VIEW_RAD)
    assert place.ahead_m == pytest.approx(ahead_m, rel=0.2)
    assert place.left_m == pytest.approx(left_m, abs=0.03 * ahead_m)
