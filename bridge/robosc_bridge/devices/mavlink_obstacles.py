"""A range scanner made of the obstacles that a MAVLink rover reports.

It has no laser of its own: the vehicle, or companion computers in it, report rings of distances (OBSTACLE_DISTANCE) and
those of single sensors (DISTANCE_SENSOR).
"""

import threading

from robosc_bridge.devices.interface import Scan, ScannerCounters
from robosc_bridge.devices.mavlink_link import (
    BAUD,
    OWN_COMPONENT,
    OWN_SYSTEM,
    LinkSettings,
    VehicleLink,
    acquire,
    release,
)
from robosc_bridge.devices.obstacle_rounds import ObstacleRounds
from robosc_bridge.errors import LineLostError
from robosc_bridge.host import Host
from robosc_bridge.protocol.mavlink_messages import Telemetry
from robosc_bridge.protocol.mavlink_signing import Signing
from robosc_bridge.transport.system_host import SYSTEM_HOST

_SLICE_S = 0.2
_INTERVAL_S = 0.1


class MavlinkObstacles:
    """`RangeScanner` that may share its line with a `MavlinkRover` of the same settings.

    Args:
        path: Path as of `MavlinkRover`.
        baud: Speed of a serial port.
        system: System number of the vehicle; None: the first rover that is heard.
        own_system: Our system number.
        own_component: Our component number.
        signing: Signing of packets; None: none.
        host: Parts of its computer that it uses.

    Attributes:
        counters: Counters of the line since it was opened, and scans since this was made.
    """

    def __init__(
        self,
        path: str,
        baud: int = BAUD,
        *,
        system: int | None = None,
        own_system: int = OWN_SYSTEM,
        own_component: int = OWN_COMPONENT,
        signing: Signing | None = None,
        host: Host = SYSTEM_HOST,
    ) -> None:
        self.counters = ScannerCounters()
        self._host = host
        self._settings = LinkSettings(path, baud, system, own_system, own_component, signing)
        self._link: VehicleLink | None = None
        self._woken = threading.Event()
        self._is_requested = False
        self._rounds = ObstacleRounds()

    def open(self) -> None:
        """Open the line, unless a drive base has opened it already; waits for nothing.

        Raises:
            LineError: The line cannot be used.
        """
        self.close()
        self._link = acquire(self._settings, as_driver=False, host=self._host)
        self._is_requested = False
        self._rounds.forget()

    def receive(self, limit_s: float) -> Scan | None:
        """The next ring, or the next round of single sensors; when several have come, the newest.

        Raises:
            LineError: The line is gone.
        """
        link = self._opened()
        end_s = self._host.monotonic() + limit_s
        while True:
            self._keep_on(link)
            left_s = end_s - self._host.monotonic()
            scan = None
            for report in link.take_obstacles(min(left_s, _SLICE_S), self._woken.is_set):
                found = self._rounds.take(report.component, report.content, report.time_s, link.state)
                self.counters.scans += found is not None
                scan = found or scan
            self._count(link)
            is_woken = self._woken.is_set()
            if scan or is_woken or left_s <= 0:
                self._woken.clear()
                return scan

    def wake(self) -> None:
        """Let a `receive` that waits in another thread return at once."""
        self._woken.set()
        link = self._link
        if link is not None:
            link.wake()

    def restart(self) -> None:
        """Ask the vehicle once more to report obstacles.

        Raises:
            LineError: The line is gone.
        """
        self._opened()
        self._is_requested = False

    def close(self) -> None:
        """Close the line; never raises, may be called at any time and again."""
        link, self._link = self._link, None
        if link is not None:
            release(link, as_driver=False)

    def _opened(self) -> VehicleLink:
        if self._link is None:
            raise LineLostError(self._settings.path, "the line is not open")
        return self._link

    def _keep_on(self, link: VehicleLink) -> None:
        # A drive base's heartbeat says that it lives; no other message does.
        if not link.has_driver:
            link.keep_alive()
        if not self._is_requested and link.state.heartbeat is not None:
            self._is_requested = True
            link.request((Telemetry.OBSTACLE_DISTANCE, Telemetry.DISTANCE_SENSOR), _INTERVAL_S)

    def _count(self, link: VehicleLink) -> None:
        counts = link.counts
        self.counters.frames = counts.frames
        self.counters.bad_frames = counts.bad_frames
        self.counters.skipped_bytes = counts.skipped_bytes
        self.counters.invalid = self._rounds.invalid
