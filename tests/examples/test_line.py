"""The line on rendered and random pictures, against a search that goes from pixel to pixel."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

pytest.importorskip("cv2", reason="OpenCV (the extra examples) is not installed")

from robosc_examples.line import find_line
from robosc_examples.line_runs import LineSettings

WHOLE = LineSettings(top=0.0, smallest=0.0, largest=1.0)
FLOOR, LINE = 220, 30

Picture = NDArray[np.uint8]


def floor(height: int = 48, width: int = 64) -> Picture:
    return np.full((height, width), FLOOR, np.uint8)


@given(st.integers(8, 60), st.integers(12, 80), st.data())
def test_a_line_is_where_it_was_drawn(height: int, width: int, data: st.DataObject) -> None:
    picture = floor(height, width)
    first = data.draw(st.integers(0, width - 2))
    wide = data.draw(st.integers(1, max(1, min(width // 3, width - first))))
    picture[:, first : first + wide] = LINE
    aside = find_line(picture)
    assert aside is not None
    assert aside == pytest.approx(0.5 - (first + wide / 2) / width)
    # Seen in a mirror it is on the other side.
    assert find_line(np.ascontiguousarray(picture[:, ::-1])) == pytest.approx(-aside)
    # And a light line on a dark floor is the same.
    assert find_line(255 - picture, LineSettings(threshold=155.0, is_dark=False)) == pytest.approx(aside)


def patches(mask: NDArray[np.bool_]) -> list[list[tuple[int, int]]]:
    """The connected patches, corners counting, found from pixel to pixel."""
    left = {(int(row), int(column)) for row, column in np.argwhere(mask)}
    found = []
    while left:
        patch, pending = [], [left.pop()]
        while pending:
            row, column = pending.pop()
            patch.append((row, column))
            near = {(row + down, column + right) for down in (-1, 0, 1) for right in (-1, 0, 1)} & left
            left -= near
            pending.extend(near)
        found.append(patch)
    return found


@given(arrays(np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.sampled_from([FLOOR, LINE])))
def test_it_is_the_largest_patch(picture: Picture) -> None:
    found = sorted(patches(picture == LINE), key=len)
    assume(len(found) < 2 or len(found[-1]) > len(found[-2]))
    expected = 0.5 - (np.mean([column for _, column in found[-1]]) + 0.5) / picture.shape[1] if found else None
    assert find_line(picture, WHOLE) == (None if expected is None else pytest.approx(expected))


@given(
    arrays(np.uint8, st.tuples(st.integers(1, 12), st.integers(1, 12))),
    st.floats(0, 1),
    st.floats(0, 1),
    st.floats(0, 255),
)
def test_no_picture_breaks_it(picture: Picture, top: float, bottom: float, threshold: float) -> None:
    aside = find_line(picture, LineSettings(threshold, True, top, bottom, 0.0, 1.0))
    assert aside is None or -0.5 < aside < 0.5


@pytest.mark.parametrize("shade", [0, FLOOR, 255])
def test_a_picture_of_one_shade_shows_no_line(shade: int) -> None:
    assert find_line(np.full((48, 64), shade, np.uint8)) is None


def test_a_speck_is_no_line() -> None:
    picture = floor()
    picture[40:42, 10:12] = LINE
    assert find_line(picture) is None
    assert find_line(picture, WHOLE) is not None


def test_only_the_chosen_rows_count() -> None:
    picture = floor()
    picture[:20, 5:15] = LINE
    assert find_line(picture) is None
    assert find_line(picture, LineSettings(top=0.0, bottom=0.4)) == pytest.approx(0.5 - 10 / 64)


def test_noise_moves_it_by_less_than_a_pixel() -> None:
    source = np.random.default_rng(1)
    picture = floor()
    picture[:, 40:46] = LINE
    noisy = np.clip(picture + source.normal(0, 20, picture.shape), 0, 255).astype(np.uint8)
    assert find_line(noisy) == pytest.approx(0.5 - 43 / 64, abs=1 / 64)
