import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from robosc_bridge.skills import LineSettings
from robosc_bridge.skills.line import LOST, LineDetector, Picture, line_offset

FLOOR, LINE = 200, 30
USUAL = LineSettings()
WHOLE = LineSettings(top=0.0, bottom=1.0, smallest=0.0, largest=1.0)


def floor(height: int = 48, width: int = 64) -> Picture:
    return np.full((height, width), FLOOR, np.uint8)


def with_line(middle: int, width: int = 6) -> Picture:
    picture = floor()
    picture[:, middle - width // 2 : middle + width // 2] = LINE
    return picture


@pytest.mark.parametrize("middle", [3, 16, 32, 48, 61])
def test_a_line_is_found_where_it_is_drawn(middle: int) -> None:
    assert line_offset(with_line(middle), USUAL) == pytest.approx(0.5 - middle / 64)


def test_a_slanted_line_counts_where_the_robot_is_next() -> None:
    picture = floor(100, 100)
    cv2.line(picture, (20, 0), (80, 99), LINE, 4)
    near = line_offset(picture, USUAL)
    far = line_offset(picture, LineSettings(top=0.0, bottom=0.3))
    assert near == pytest.approx(0.5 - 0.68, abs=0.02)
    assert far == pytest.approx(0.5 - 0.29, abs=0.02)


def test_a_coloured_picture_counts_by_its_shade() -> None:
    picture = np.full((48, 64, 3), (200, 200, 200), np.uint8)
    picture[:, 10:16] = (120, 0, 0)
    assert line_offset(picture, USUAL) == pytest.approx(0.5 - 13 / 64)
    assert line_offset(with_line(20)[:, :, np.newaxis], USUAL) == pytest.approx(0.5 - 20 / 64)


def test_a_light_line_on_a_dark_floor() -> None:
    picture = 255 - with_line(20)
    assert line_offset(picture, LineSettings(shade="light", threshold=150)) == pytest.approx(0.5 - 20 / 64)
    assert line_offset(picture, USUAL) is None


def test_the_largest_patch_is_the_line() -> None:
    picture = with_line(50, 8)
    picture[40:44, 5:9] = LINE
    assert line_offset(picture, USUAL) == pytest.approx(0.5 - 50 / 64)


def test_the_shade_at_the_threshold_is_the_line_and_the_next_is_floor() -> None:
    picture = floor()
    picture[:, 10:20] = 100
    assert line_offset(picture, USUAL) == pytest.approx(0.5 - 15 / 64)
    picture[:, 10:20] = 101
    assert line_offset(picture, USUAL) is None


@pytest.mark.parametrize("shade", [0, LINE, FLOOR, 255])
def test_one_shade_shows_no_line(shade: int) -> None:
    assert line_offset(np.full((48, 64), shade, np.uint8), USUAL) is None


def test_a_speck_is_no_line() -> None:
    picture = floor()
    picture[40:42, 10:12] = LINE
    assert line_offset(picture, USUAL) is None
    assert line_offset(picture, WHOLE) is not None


@pytest.mark.parametrize(
    "picture",
    [
        np.zeros((0, 64), np.uint8),
        np.zeros((48, 64, 2), np.uint8),
        np.zeros(64, np.uint8),
        np.zeros((48, 64), np.float32),
    ],
)
def test_what_is_no_picture_shows_no_line(picture: Picture) -> None:
    assert line_offset(picture, WHOLE) is None


@given(
    arrays(np.uint8, st.tuples(st.integers(1, 12), st.integers(1, 12))),
    st.floats(0, 1),
    st.floats(0, 1),
    st.floats(0, 255),
    st.sampled_from(["dark", "light"]),
)
def test_every_picture_has_an_answer(picture: Picture, top: float, bottom: float, threshold: float, shade: str) -> None:
    chosen = LineSettings(top=top, bottom=bottom, threshold=threshold, shade=shade, smallest=0, largest=1)  # type: ignore[arg-type]
    aside = line_offset(picture, chosen)
    mirrored = line_offset(np.ascontiguousarray(picture[:, ::-1]), chosen)
    assert (aside is None) == (mirrored is None)
    assert aside is None or -0.5 < aside < 0.5


@given(arrays(np.uint8, st.tuples(st.integers(1, 8), st.integers(1, 8)), elements=st.sampled_from([0, 255])))
def test_it_agrees_with_a_search_by_hand(picture: Picture) -> None:
    patches = sorted(_patches(picture), key=len, reverse=True)
    aside = line_offset(picture, WHOLE)
    if not patches:
        assert aside is None
        return
    largest = [patch for patch in patches if len(patch) == len(patches[0])]
    width = picture.shape[1]
    assert any(
        aside == pytest.approx(0.5 - (sum(column for _, column in patch) / len(patch) + 0.5) / width)
        for patch in largest
    )


def _patches(picture: Picture) -> list[set[tuple[int, int]]]:
    left = {(int(row), int(column)) for row, column in np.argwhere(picture == 0)}
    found = []
    while left:
        waiting, patch = [left.pop()], set[tuple[int, int]]()
        while waiting:
            row, column = waiting.pop()
            patch.add((row, column))
            near = {(row + i, column + j) for i in (-1, 0, 1) for j in (-1, 0, 1)} & left
            left -= near
            waiting.extend(near)
        found.append(patch)
    return found


def test_corrections_turn_towards_the_line_and_have_a_limit() -> None:
    detector = LineDetector(LineSettings(gain_rad_s=2.0, limit_rad_s=0.5), 0.0)
    corrections = []
    for middle in (3, 28, 32, 36, 61):
        line = detector.update(with_line(middle), 0.0)
        assert line is not None
        corrections.append(line.correction_rad_s)
    assert corrections == pytest.approx([0.5, 0.125, 0.0, -0.125, -0.5])


def test_a_picture_without_a_line_and_a_silent_camera_are_a_lost_line() -> None:
    detector = LineDetector(USUAL, 10.0)
    assert detector.update(None, 10.4) is None
    assert detector.update(None, 10.5) == LOST
    assert detector.update(None, 10.6) is None
    assert detector.update(None, 11.0) == LOST, "again after as long"
    found = detector.update(with_line(32), 11.1)
    assert found is not None
    assert found.correction_rad_s == pytest.approx(0.0)
    assert detector.update(None, 11.5) is None
    assert detector.update(floor(), 11.6) == LOST
    assert detector.update(None, 12.0) is None
