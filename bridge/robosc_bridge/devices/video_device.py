"""Where pictures come from: a V4L2 device through OpenCV, or whoever else has them (a simulator)."""

import errno
import os
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np

from robosc_bridge.errors import LineDeniedError, LineError, LineLostError, LineMissingError
from robosc_bridge.skills.line import Picture


class PictureSource(Protocol):
    """A camera; used from one thread of its own, for pictures are waited for."""

    def read(self) -> Picture:
        """The next picture, waiting for it.

        Raises:
            LineLostError: The camera is gone, or has no more pictures.
        """

    def close(self) -> None:
        """Give the camera back; may be called again."""


class VideoDevice:
    """A camera as a V4L2 device, or a recorded film.

    Args:
        path: Of the device (/dev/video0, or a stable name below /dev/v4l/by-id) or the film.

    Raises:
        LineMissingError: There is no such device.
        LineDeniedError: This user may not open it.
        LineError: OpenCV cannot read it: another program has it, or it is no camera.
    """

    def __init__(self, path: str) -> None:
        self._path = path
        _require_readable(path)
        kind = cv2.CAP_V4L2 if Path(path).is_char_device() else cv2.CAP_ANY
        self._capture = cv2.VideoCapture(path, kind)
        if not self._capture.isOpened():
            self._capture.release()
            raise LineError(path, "no pictures can be read: another program uses it, or it is no camera")
        # The newest picture counts: those that wait show the past. Not every device can do so.
        self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)

    def read(self) -> Picture:
        """The next picture, waiting for it.

        Raises:
            LineLostError: The camera is gone, or the film has ended.
        """
        is_read, picture = self._capture.read()
        if not is_read:
            raise LineLostError(self._path, "no more pictures come")
        return np.asarray(picture, np.uint8)

    def close(self) -> None:
        """Give it back; may be called again."""
        self._capture.release()


def _require_readable(path: str) -> None:
    """OpenCV only says no; the reason is asked for before.

    Raises:
        LineError: The file cannot be opened.
    """
    try:
        # Not blocking, as a pipe without a writer would.
        os.close(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC))
    except OSError as error:
        match error.errno:
            case errno.ENOENT | errno.ENODEV | errno.ENXIO:
                raise LineMissingError(path, "there is no such camera; is it plugged in?") from error
            case errno.EACCES | errno.EPERM:
                raise LineDeniedError(path, "no permission; is this user in the group video?") from error
        raise LineError(path, f"cannot be opened: {error.strerror}") from error
