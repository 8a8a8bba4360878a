"""A range scanner made of the obstacles that a MAVLink rover reports.

It has no laser of its own: the vehicle, or a companion computer in it, reports a ring of distances (OBSTACLE_DISTANCE)
or those of single sensors (DISTANCE_SENSOR). If rings are reported, single sensors are ignored.
"""

import math
import threading

from robosc_bridge.devices.interface import RawScan, Scan, ScannerCounters
from robosc_bridge.devices.mavlink_link import (
    BAUD,
    OWN_COMPONENT,
    OWN_SYSTEM,
    LinkSettings,
    Obstacle,
    VehicleLink,
    acquire,
    release,
)
from robosc_bridge.devices.mavlink_state import Timestamped, VehicleState
from robosc_bridge.errors import LineLostError
from robosc_bridge.host import Host
from robosc_bridge.protocol.mavlink_messages import ObstacleRing, SectorDistance, Telemetry
from robosc_bridge.protocol.mavlink_obstacles import Sector, nearest_in_sectors, ring_sectors, sensor_sector
from robosc_bridge.protocol.mavlink_signing import Signing
from robosc_bridge.transport.system_host import SYSTEM_HOST

# ArduPilot, too, ignores measurements that are older.
STALE_AFTER_S = 0.5
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
        self._ring_s = -math.inf
        self._sensors: dict[int, Timestamped[Sector]] = {}
        self._reported: set[int] = set()

    def open(self) -> None:
        """Open the line, unless a drive base has opened it already; waits for nothing.

        Raises:
            LineError: The line cannot be used.
        """
        self.close()
        self._link = acquire(self._settings, as_driver=False, host=self._host)
        self._is_requested = False
        self._ring_s = -math.inf
        self._sensors.clear()
        self._reported.clear()

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
            for obstacle in link.take_obstacles(min(left_s, _SLICE_S), self._woken.is_set):
                scan = self._after(obstacle, link.state) or scan
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

    def _after(self, obstacle: Timestamped[Obstacle], state: VehicleState) -> Scan | None:
        """The scan that this completes."""
        if isinstance(obstacle.content, ObstacleRing):
            attitude = state.attitude
            is_known = attitude is not None and abs(obstacle.time_s - attitude.time_s) <= STALE_AFTER_S
            sectors = ring_sectors(obstacle.content, attitude.content.heading_rad if attitude and is_known else None)
            if sectors is None:
                return None
            self._ring_s = obstacle.time_s
            return self._scan(sectors, obstacle.time_s)
        return self._after_sensor(obstacle.content, obstacle.time_s)

    def _after_sensor(self, content: SectorDistance, time_s: float) -> Scan | None:
        """Return a scan when a round of the sensors is complete: when its first sensor reports again."""
        sector = sensor_sector(content)
        if sector is None or time_s - self._ring_s <= STALE_AFTER_S:
            return None
        self._sensors[content.orientation] = Timestamped(time_s, sector)
        is_full = content.orientation in self._reported
        if is_full:
            self._reported.clear()
        self._reported.add(content.orientation)
        if not is_full:
            return None
        fresh = [obstacle.content for obstacle in self._sensors.values() if time_s - obstacle.time_s <= STALE_AFTER_S]
        return self._scan(tuple(fresh), time_s)

    def _scan(self, sectors: tuple[Sector, ...], time_s: float) -> Scan:
        self.counters.scans += 1
        raw = RawScan(
            tuple(math.radians(sector.middle_deg) for sector in sectors),
            tuple(sector.range_m for sector in sectors),
            (math.nan,) * len(sectors),
        )
        # Fixed sensors have no rotation whose speed could be given: it is NaN.
        min_m = min(sector.min_m for sector in sectors)
        max_m = max(sector.max_m for sector in sectors)
        return Scan(time_s, nearest_in_sectors(sectors), raw, math.nan, min_m, max_m)
