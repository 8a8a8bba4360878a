"""Pictures as arrays: what a `sensor_msgs/Image` holds, checked, without cv_bridge and without ROS."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
"""Rows, columns and, in colour, blue, green and red."""

_CHANNELS = {"mono8": 1, "rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4}
_TO_COLOUR = {
    "mono8": cv2.COLOR_GRAY2BGR,
    "rgb8": cv2.COLOR_RGB2BGR,
    "rgba8": cv2.COLOR_RGBA2BGR,
    "bgra8": cv2.COLOR_BGRA2BGR,
}
_TO_GREY = {
    "rgb8": cv2.COLOR_RGB2GRAY,
    "bgr8": cv2.COLOR_BGR2GRAY,
    "rgba8": cv2.COLOR_RGBA2GRAY,
    "bgra8": cv2.COLOR_BGRA2GRAY,
}


class PictureError(ValueError):
    """A message is no picture that these nodes can read; says why."""


def grey_picture(message: Any) -> Picture:
    """A `sensor_msgs/Image` in shades of grey.

    Raises:
        PictureError: Its encoding is another, it is empty, or its data does not fit its size.
    """
    return _converted(_pixels(message), _TO_GREY.get(message.encoding))


def colour_picture(message: Any) -> Picture:
    """A `sensor_msgs/Image` in blue, green and red.

    Raises:
        PictureError: Its encoding is another, it is empty, or its data does not fit its size.
    """
    return _converted(_pixels(message), _TO_COLOUR.get(message.encoding))


def _pixels(message: Any) -> Picture:
    """The pixels as they are encoded, without what pads the rows."""
    channels = _CHANNELS.get(message.encoding)
    if channels is None:
        raise PictureError(f"encoding {message.encoding!r:.40}; these can be read: {', '.join(_CHANNELS)}")
    height, width, step = message.height, message.width, message.step
    if height < 1 or width < 1:
        raise PictureError(f"a picture of {width} x {height} pixels")
    if step < width * channels:
        raise PictureError(f"rows of {step} bytes for {width} pixels of {channels} bytes")
    data = np.frombuffer(message.data, np.uint8)
    if data.size != step * height:
        raise PictureError(f"{data.size} bytes for {height} rows of {step} bytes")
    rows = data.reshape(height, step)[:, : width * channels]
    return rows.reshape((height, width) if channels == 1 else (height, width, channels))


def _converted(pixels: Picture, code: int | None) -> Picture:
    if code is None:
        return np.ascontiguousarray(pixels)
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(pixels), code), np.uint8)
