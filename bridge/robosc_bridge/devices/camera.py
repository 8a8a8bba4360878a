"""Cameras as streams of grey pictures from a V4L2 device, a video file or a simulator, with bounded waits.

OpenCV's calls for V4L2 devices may wait forever, and decoders of damaged pictures may crash. So both run in a separate
process (`camera_process`), which can be ended at any time. A simulator serves the same stream on a Unix socket.
"""

import contextlib
import os
import select
import socket
import subprocess
import sys
import time
from abc import ABC, abstractmethod
from typing import IO, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from robosc_bridge.errors import LineDeniedError, LineError, LineLostError, LineMissingError, WrongDeviceError
from robosc_bridge.protocol.netpbm import Decoder, GreyPicture, NotPicturesError

SIMULATED = "simulated:"
"""Before the path of a simulator's Unix socket, in the name of a camera."""

MISSING = "there is no such camera; is it plugged in?"
DENIED = "no permission; is this user in the group video?"

_CHUNK = 1 << 18
_CONNECT_S = 1.0
_END_S = 2.0
_LONGEST_PROBLEM = 4096

GreyRows = NDArray[np.uint8]
"""Rows of pixels from above, 0 is black."""


class Camera(Protocol):
    """Source of pictures; used from one thread, in which no call waits for longer than two seconds."""

    def open(self) -> None:
        """Open the camera, without waiting for a picture.

        Raises:
            LineError: The camera cannot be reached.
        """

    def receive(self, limit_s: float) -> GreyRows | None:
        """Return the newest picture that has come, waiting for one; None: none was complete within the limit.

        Raises:
            LineError: The camera is gone, or could not be opened.
            WrongDeviceError: The device sends data that are no pictures.
        """

    def close(self) -> None:
        """Close the camera; never raises, may be called at any time and again."""


def make_camera(name: str) -> Camera:
    """Return a camera that is not opened yet.

    Args:
        name: Path of a V4L2 device or a film; or `simulated:` and the path of a simulator's socket.
    """
    if name.startswith(SIMULATED):
        return SocketCamera(name.removeprefix(SIMULATED))
    return ProcessCamera(name)


class _StreamCamera(ABC):
    """A camera whose pictures come from a file descriptor.

    Args:
        path: Of what gives them, for messages.
    """

    def __init__(self, path: str) -> None:
        self._path = path
        self._descriptor = -1
        self._decoder = Decoder()

    def open(self) -> None:
        """Open the camera."""
        self.close()
        self._decoder = Decoder()
        self._descriptor = self._connected()
        os.set_blocking(self._descriptor, False)

    def receive(self, limit_s: float) -> GreyRows | None:
        """Return the next picture, or None if none came in time."""
        if self._descriptor < 0:
            raise LineLostError(self._path, "the camera is not open")
        poll = select.poll()
        poll.register(self._descriptor, select.POLLIN)
        now_s = time.monotonic()
        end_s = now_s + limit_s
        newest = None
        # Those that wait show the past, but one who sends without end must not keep the caller for ever.
        while poll.poll(0 if newest else max(end_s - now_s, 0.0) * 1000):
            newest = self._decoded(self._read()) or newest
            now_s = time.monotonic()
            if now_s >= end_s:
                break
        if newest is None:
            return None
        return np.frombuffer(newest.pixels, np.uint8).reshape(newest.height, newest.width)

    def _read(self) -> bytes:
        try:
            data = os.read(self._descriptor, _CHUNK)
        except OSError as error:
            raise LineLostError(self._path, f"the camera is gone: {error.strerror}") from error
        if not data:
            raise LineLostError(self._path, self._why_it_ended())
        return data

    def _decoded(self, data: bytes) -> GreyPicture | None:
        try:
            return self._decoder.feed(data)
        except NotPicturesError as error:
            raise WrongDeviceError(f"{self._path}: {error}") from error

    @abstractmethod
    def _connected(self) -> int:
        """A descriptor from which pictures come."""

    @abstractmethod
    def _why_it_ended(self) -> str:
        """Describe what is wrong, when no more bytes come."""

    @abstractmethod
    def close(self) -> None:
        """Close the camera."""


class SocketCamera(_StreamCamera):
    """Pictures from a Unix socket, such as that of a simulator.

    Args:
        path: Path of the socket.
    """

    _socket: socket.socket | None = None

    def _connected(self) -> int:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._socket.settimeout(_CONNECT_S)
            self._socket.connect(self._path)
        except (FileNotFoundError, ConnectionRefusedError) as error:
            self.close()
            raise LineMissingError(self._path, "no program serves pictures there; is the simulator running?") from error
        except PermissionError as error:
            self.close()
            raise LineDeniedError(self._path, "no permission") from error
        except OSError as error:
            self.close()
            raise LineError(self._path, f"cannot be opened: {error.strerror or error}") from error
        return self._socket.fileno()

    def _why_it_ended(self) -> str:
        return "the camera is gone: whoever served its pictures has ended"

    def close(self) -> None:
        """Close the camera."""
        self._descriptor = -1
        if self._socket is not None:
            self._socket.close()
            self._socket = None


class ProcessCamera(_StreamCamera):
    """Pictures of a V4L2 device or a video file, read in a separate process.

    Args:
        path: Path of the device (/dev/video0, or a stable name below /dev/v4l/by-id) or of the video file.
    """

    _process: subprocess.Popen[bytes] | None = None

    def _connected(self) -> int:
        # Asked without opening it, which may take for ever, and before a process is started in vain.
        if not os.path.exists(self._path):  # noqa: PTH110 (a name that is no path at all is none that exists)
            raise LineMissingError(self._path, MISSING)
        if not os.access(self._path, os.R_OK):
            raise LineDeniedError(self._path, DENIED)
        command = [sys.executable, "-P", "-m", "robosc_bridge.devices.camera_process", self._path]
        try:
            # The process gets a session of its own: Ctrl-C in a terminal is for the bridge, which ends it after the
            # wheels.
            self._process = subprocess.Popen(  # noqa: S603 (our own module, and no shell)
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                start_new_session=True,
                bufsize=0,
            )
        except OSError as error:
            raise LineError(self._path, f"no process for the camera could be started: {error.strerror}") from error
        return cast(IO[bytes], self._process.stdout).fileno()

    def _why_it_ended(self) -> str:
        process = cast(subprocess.Popen[bytes], self._process)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(_END_S)
        problems = cast(IO[bytes], process.stderr).fileno()
        os.set_blocking(problems, False)
        text = b""
        with contextlib.suppress(BlockingIOError):
            text = os.read(problems, _LONGEST_PROBLEM)
        lines = text.decode("utf-8", "replace").split("\n")
        lines_with_text = [line.strip() for line in lines if line.strip()]
        return (
            lines_with_text[-1] if lines_with_text else f"the camera's process has ended with status {process.poll()}"
        )

    def close(self) -> None:
        """Close the camera."""
        self._descriptor = -1
        process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        for stream in (process.stdin, process.stdout, process.stderr):
            if stream is not None:
                stream.close()
        # One that the kernel itself holds up ends when that lets go of it.
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(_END_S)
