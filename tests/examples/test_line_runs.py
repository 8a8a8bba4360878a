"""The line detector without OpenCV sees what the one with OpenCV sees."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

cv2 = pytest.importorskip("cv2", reason="OpenCV (the extra examples) is not installed")

from robosc_examples.line import find_line as find_line_with_opencv  # noqa: E402
from robosc_examples.line_runs import LineSettings, find_line  # noqa: E402

DARK, LIGHT = 30, 220


def has_one_largest(marks: np.ndarray[tuple[int, int], np.dtype[np.uint8]]) -> bool:
    """Return True unless two patches share the largest size: which of them counts is not specified."""
    _, _, figures, _ = cv2.connectedComponentsWithStats(marks)
    areas = sorted(figures[1:, cv2.CC_STAT_AREA])
    return len(areas) < 2 or areas[-1] != areas[-2]


@given(
    st.integers(1, 12).flatmap(
        lambda width: st.lists(st.lists(st.booleans(), min_size=width, max_size=width), min_size=1, max_size=12)
    ),
    st.sampled_from([(0.0, 1.0), (0.6, 1.0), (0.3, 0.7), (0.99, 1.0)]),
    st.booleans(),
    st.integers(0, 5),
)
def test_they_agree(rows: list[list[bool]], looked_at: tuple[float, float], is_dark: bool, padding: int) -> None:
    marks = np.array(rows, np.uint8)
    picture = np.where(marks == 1, DARK, LIGHT).astype(np.uint8)
    height, width = picture.shape
    top, bottom = looked_at
    first = min(int(top * height), height - 1)
    seen = marks[first : max(first + 1, round(bottom * height))]
    expected = find_line_with_opencv(picture, LineSettings(is_dark=is_dark, top=top, bottom=bottom))
    padded = np.pad(picture, ((0, 0), (0, padding)), constant_values=DARK)
    found = find_line(
        padded.tobytes(), width, height, width + padding, LineSettings(is_dark=is_dark, top=top, bottom=bottom)
    )
    if has_one_largest(seen if is_dark else (1 - seen).astype(np.uint8)):
        assert found == pytest.approx(expected) if expected is not None else found is None
