"""Image messages as arrays: every encoding, padded rows, and messages that are no pictures."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("cv2", reason="OpenCV (the extra examples) is not installed")

from robosc_examples.pictures import PictureError, colour_picture, grey_picture

# Places of red, green and blue in each encoding.
ENCODINGS = {"rgb8": (0, 1, 2), "bgr8": (2, 1, 0), "rgba8": (0, 1, 2), "bgra8": (2, 1, 0), "mono8": (0, 0, 0)}
CHANNELS = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4, "mono8": 1}


def message(encoding: str, height: int, width: int, padding: int, data: bytes) -> Any:
    step = width * CHANNELS.get(encoding, 1) + padding
    return SimpleNamespace(encoding=encoding, height=height, width=width, step=step, data=data)


@given(st.sampled_from(sorted(ENCODINGS)), st.integers(1, 9), st.integers(1, 9), st.integers(0, 7), st.data())
def test_each_pixel_is_read_where_it_stands(encoding: str, height: int, width: int, padding: int, data: Any) -> None:
    channels = CHANNELS[encoding]
    step = width * channels + padding
    content = data.draw(st.binary(min_size=height * step, max_size=height * step))
    colours = colour_picture(message(encoding, height, width, padding, content))
    greys = grey_picture(message(encoding, height, width, padding, content))
    assert colours.shape == (height, width, 3)
    assert greys.shape == (height, width)
    for row in range(height):
        for column in range(width):
            pixel = content[row * step + column * channels :]
            red, green, blue = (pixel[place] for place in ENCODINGS[encoding])
            assert tuple(colours[row, column]) == (blue, green, red)
            # ITU-R BT.601, as OpenCV's documentation says.
            assert abs(int(greys[row, column]) - (0.299 * red + 0.587 * green + 0.114 * blue)) <= 1


@pytest.mark.parametrize(
    ("wrong", "complaint"),
    [
        ({"encoding": "yuv422"}, "encoding 'yuv422'; these can be read: mono8, rgb8, bgr8, rgba8, bgra8"),
        ({"encoding": ""}, "encoding ''"),
        ({"height": 0, "data": b""}, "a picture of 4 x 0 pixels"),
        ({"width": 0}, "a picture of 0 x 2 pixels"),
        ({"step": 11}, "rows of 11 bytes for 4 pixels of 3 bytes"),
        ({"data": b""}, "0 bytes for 2 rows of 12 bytes"),
        ({"data": bytes(23)}, "23 bytes for 2 rows of 12 bytes"),
        ({"data": bytes(25)}, "25 bytes for 2 rows of 12 bytes"),
    ],
)
def test_what_is_no_picture_is_reported(wrong: dict[str, Any], complaint: str) -> None:
    sound = {"encoding": "rgb8", "height": 2, "width": 4, "step": 12, "data": bytes(24)}
    assert colour_picture(SimpleNamespace(**sound)).shape == (2, 4, 3)
    for read in (colour_picture, grey_picture):
        with pytest.raises(PictureError) as caught:
            read(SimpleNamespace(**{**sound, **wrong}))
        assert complaint in str(caught.value)


@given(
    st.sampled_from([*ENCODINGS, "16UC1", "bayer_rggb8"]),
    st.integers(0, 5),
    st.integers(0, 5),
    st.integers(0, 20),
    st.binary(max_size=60),
)
def test_no_message_does_anything_else(encoding: str, height: int, width: int, step: int, data: bytes) -> None:
    given_message = SimpleNamespace(encoding=encoding, height=height, width=width, step=step, data=data)
    try:
        picture = colour_picture(given_message)
    except PictureError:
        return
    assert picture.shape == (height, width, 3)
    assert picture.dtype == np.uint8
