"""`python -m robosc_bridge.devices.camera_process PATH`: the pictures of a camera on standard output, until it ends.

The pictures are grey, in the format of `protocol.netpbm`. A problem is reported in one line on standard error. The
process ends together with its host, whose end of standard input is then closed, even while OpenCV waits for a device.
"""

import os
import sys
import threading
import time
from collections.abc import Sequence

import cv2
import numpy as np

from robosc_bridge.devices.video_device import Picture, VideoDevice
from robosc_bridge.errors import LineError
from robosc_bridge.protocol.netpbm import GreyPicture, encoded

FAULT = 1


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    (path,) = sys.argv[1:] if arguments is None else arguments
    with os.fdopen(os.dup(2), "w", encoding="utf-8") as problems:
        # Decoders write about every damaged picture, and that is not read: a full pipe would block them.
        silence = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silence, 2)
        os.close(silence)
        threading.Thread(target=_end_with_host, daemon=True).start()
        try:
            _serve(VideoDevice(path))
        except LineError as error:
            problems.write(f"{error.problem}\n")
        except BrokenPipeError:
            pass  # The host has heard enough.
    return FAULT


def _serve(device: VideoDevice) -> None:
    """Write pictures until there are no more.

    Raises:
        LineError: There are no more.
        BrokenPipeError: The reader has gone.
    """
    due_s = time.monotonic()
    while True:
        picture = _grey(device.read())
        data = memoryview(encoded(GreyPicture(picture.shape[1], picture.shape[0], picture.tobytes())))
        while data:
            data = data[os.write(1, data) :]
        due_s = max(due_s + device.period_s, time.monotonic() - device.period_s)
        time.sleep(max(due_s - time.monotonic(), 0.0))


def _grey(picture: Picture) -> Picture:
    is_coloured = picture.ndim == 3 and picture.shape[2] == 3
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8) if is_coloured else picture


def _end_with_host() -> None:
    while os.read(0, 1):
        pass
    os._exit(FAULT)


if __name__ == "__main__":
    # Not through the interpreter's own end, which would wait for OpenCV's threads.
    os._exit(main())
