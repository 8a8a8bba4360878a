"""Worker for the camera: each picture becomes a sighting, with the line or without."""

import logging
import math
from collections.abc import Callable

from robosc_bridge.daemon.threads.backoff import Backoff
from robosc_bridge.daemon.threads.reports import Device, DeviceDown, DeviceUp, Report, Sighting
from robosc_bridge.devices.camera import Camera, GreyRows
from robosc_bridge.errors import BridgeError, DeviceSilentError
from robosc_bridge.skills.line import LOST, LineDetector
from robosc_bridge.skills.settings import LineSettings

FIRST_PICTURE_S = 10.0
"""Time that a camera may take for its first picture, in seconds, with all that must be started before."""

REOPEN_S = 3.0
"""After so long without a picture, or twice the time after which the line is lost, it is closed and opened anew."""

LISTEN_S = 0.05
"""Duration of one wait for a picture, in seconds."""

_log = logging.getLogger(__name__)


class CameraWorker:
    """Worker that keeps a camera open and reports where the line is.

    The line is reported as lost again and again, once in `timeout_s`, as long as no picture comes, even if there is no
    camera.

    Args:
        camera: The camera.
        settings: Definition of a line, and the time without a picture after which it is lost.
        report: Function that takes the reports; must not wait.
        clock: Clock that returns the time, in seconds.
        backoff: Pauses between attempts to open it.
    """

    name = "camera"

    def __init__(
        self,
        camera: Camera,
        settings: LineSettings,
        report: Callable[[Report], None],
        clock: Callable[[], float],
        backoff: Backoff | None = None,
    ) -> None:
        self._camera = camera
        self._timeout_s = settings.timeout_s
        self._report = report
        self._clock = clock
        self._backoff = backoff or Backoff()
        self._detector = LineDetector(settings, clock())
        self._is_open = self._is_seeing = False
        self._open_at_s = -math.inf
        self._silent_end_s = 0.0

    def step(self, now_s: float) -> float:
        """Open the camera, or wait for a picture."""
        try:
            if self._is_open:
                return self._look()
            if now_s < self._open_at_s:
                self._watch(None)
                return min(self._open_at_s, now_s + LISTEN_S)
            self._camera.open()
        except BridgeError as error:
            return self._failed(str(error))
        except Exception as error:  # A failed camera is reported to the model as a lost line.
            _log.exception("the camera's driver failed")
            return self._failed(f"the driver failed: {type(error).__name__}: {error}")
        self._is_open = True
        self._silent_end_s = self._clock() + FIRST_PICTURE_S
        return now_s

    def _look(self) -> float:
        picture = self._camera.receive(LISTEN_S)
        now_s = self._clock()
        if picture is not None:
            self._silent_end_s = now_s + max(REOPEN_S, 2 * self._timeout_s)
            self._backoff.succeeded()
            if not self._is_seeing:
                self._is_seeing = True
                self._report(DeviceUp(Device.CAMERA))
        self._watch(picture)
        if now_s >= self._silent_end_s:
            raise DeviceSilentError("the camera sends no pictures")
        return now_s

    def _watch(self, picture: GreyRows | None) -> None:
        """Report the line that a picture shows, or that no picture has come for too long."""
        now_s = self._clock()
        line = self._detector.update(picture, now_s)
        if line is None:
            return
        self._report(Sighting(now_s, line.correction_rad_s))
        if picture is None and self._is_seeing:
            self._is_seeing = False
            what = f"no picture for {self._timeout_s:g} s"
            self._report(DeviceDown(Device.CAMERA, what, 0.0, is_first=True))

    def _failed(self, problem: str) -> float:
        if self._is_seeing:
            # The last sighting is over: the model must not go by it until the time limit.
            self._report(Sighting(self._clock(), LOST.correction_rad_s))
        self._is_open = self._is_seeing = False
        is_first = self._backoff.is_fresh
        retry_s = self._backoff.failed()
        self._report(DeviceDown(Device.CAMERA, problem, retry_s, is_first))
        self.close()
        self._open_at_s = self._clock() + retry_s
        return self._clock()

    def wake(self) -> None:
        """Do nothing: no step waits for long."""

    def close(self) -> None:
        """Close the camera."""
        try:
            self._camera.close()
        except Exception:
            _log.exception("the camera's driver failed when it was closed")
