"""A V4L2 device or a video file through OpenCV, whose calls may wait forever: only for use in a separate process."""

import errno
import math
import os
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from robosc_bridge.devices.camera import DENIED, MISSING
from robosc_bridge.errors import LineDeniedError, LineError, LineLostError, LineMissingError

Picture = NDArray[np.uint8]
"""Rows of pixels from above: blue, green and red, or shades of grey."""

# No film is watched faster or slower than this, whatever its file says.
_SLOWEST_S, _FASTEST_S = 1.0, 0.005


class VideoDevice:
    """A camera as a V4L2 device, or a video file.

    Args:
        path: Path of the device (/dev/video0, or a stable name below /dev/v4l/by-id) or of the video file.

    Raises:
        LineMissingError: There is no such device.
        LineDeniedError: This user may not open it.
        LineError: OpenCV cannot read it: another program has it, or it is not a camera.
    """

    def __init__(self, path: str) -> None:
        self._path = path
        _require_readable(path)
        self._is_film = not Path(path).is_char_device()
        self._capture = cv2.VideoCapture(path, cv2.CAP_ANY if self._is_film else cv2.CAP_V4L2)
        if not self._capture.isOpened():
            self._capture.release()
            raise LineError(path, "no pictures can be read: another program uses it, or it is not a camera")
        # The newest picture counts: those that wait show the past. Not every device can do so.
        self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)

    @property
    def period_s(self) -> float:
        """Time to wait between pictures, in seconds; 0: reading a picture waits for it."""
        if not self._is_film:
            return 0.0
        rate = float(self._capture.get(cv2.CAP_PROP_FPS))
        if not (math.isfinite(rate) and rate > 0.0):
            return _SLOWEST_S
        return min(max(1.0 / rate, _FASTEST_S), _SLOWEST_S)

    def read(self) -> Picture:
        """Return the next picture, after waiting for it.

        Raises:
            LineLostError: The camera is gone, or the film has ended.
        """
        is_read, picture = self._capture.read()
        if not is_read:
            raise LineLostError(self._path, "no more pictures come")
        return np.asarray(picture, np.uint8)

    def close(self) -> None:
        """Close the device; may be called again."""
        self._capture.release()


def _require_readable(path: str) -> None:
    """OpenCV gives no reason; it is looked up before.

    Raises:
        LineError: The file cannot be opened.
    """
    try:
        # Not blocking, as a pipe without a writer would.
        os.close(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC))
    except OSError as error:
        match error.errno:
            case errno.ENOENT | errno.ENODEV | errno.ENXIO:
                raise LineMissingError(path, MISSING) from error
            case errno.EACCES | errno.EPERM:
                raise LineDeniedError(path, DENIED) from error
        raise LineError(path, f"cannot be opened: {error.strerror}") from error
