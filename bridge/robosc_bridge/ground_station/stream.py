"""Telemetry, periodic and on request."""

import itertools
import math
from collections.abc import Iterator

from robosc._version import __version__
from robosc_bridge.daemon.feed import Snapshot
from robosc_bridge.daemon.operations import Operations
from robosc_bridge.daemon.states import State
from robosc_bridge.devices.interface import DriveReading, Scan
from robosc_bridge.ground_station import telemetry, values
from robosc_bridge.ground_station.schedule import Schedule
from robosc_bridge.ground_station.settings import GroundSettings
from robosc_bridge.ground_station.status import VehicleStatus, status_of
from robosc_bridge.ground_station.telemetry import Make
from robosc_bridge.protocol.mavlink_messages import Telemetry

HEARTBEAT, VERSION = 0, 148
HEARTBEAT_S = 1.0

STALE_S = 2.0
"""After so long without a new snapshot the loop is taken for hung: nothing old is reported as if it were new."""

GONE_S = 5.0
"""After so long the heartbeat ends, too: the station shows that the link is lost."""

SCAN_LIMIT_S = 0.5
READING_LIMIT_S = 1.0
"""Age above which a scan or a reading is not reported, in seconds."""

CHANGE_S = 0.1
"""Shortest time between two messages about a named value that changes."""

VALUES_FIRST = 3
"""Number of named values that go before other telemetry."""

_VALUES = (Telemetry.NAMED_VALUE_INT, Telemetry.NAMED_VALUE_FLOAT)
_MAVLINK_2, _COMMAND_INT, _TERMINATION, _SET_POINTS = 0x2000, 0x8, 0x800, 0x80


class Stream:
    """Messages about the daemon.

    Args:
        operations: The daemon.
        settings: Settings of the link.
        now_s: Time when it begins.

    Attributes:
        snapshot: Latest snapshot; None: there was none yet.
        bad_packets: Number of received packets that were ignored.
        held_back: Number of requests that a supervision layer has held back.
        schedule: Schedule of each message.
    """

    def __init__(self, operations: Operations, settings: GroundSettings, now_s: float) -> None:
        self.snapshot: Snapshot | None = None
        self.bad_packets = 0
        self.held_back = 0
        self.schedule = Schedule(
            {
                Telemetry.SYS_STATUS: 1.0,
                Telemetry.OBSTACLE_DISTANCE: settings.interval_s,
                Telemetry.ODOMETRY: settings.interval_s,
                Telemetry.BATTERY_STATUS: 2.0,
                Telemetry.ATTITUDE: math.inf,
                Telemetry.LOCAL_POSITION: math.inf,
                Telemetry.NAMED_VALUE_INT: 1.0,
                Telemetry.NAMED_VALUE_FLOAT: 1.0,
            }
        )
        self.values = values.named_values(operations.model)
        self._is_layer = operations.is_layer
        self._settings = settings
        self._began_s = self._fresh_s = self._pulse_s = now_s
        self._sent: dict[str, tuple[values.Number, float]] = {}

    def poll(self, snapshot: Snapshot | None, now_s: float) -> bool:
        """Read the latest snapshot; return True if it is new."""
        is_new = snapshot is not None and (self.snapshot is None or snapshot.number != self.snapshot.number)
        if is_new:
            self.snapshot = snapshot
            self._fresh_s = now_s
        return is_new

    def is_stale(self, now_s: float) -> bool:
        """Return True if the loop seems to hang."""
        return now_s - self._fresh_s > STALE_S

    def status(self, now_s: float) -> VehicleStatus:
        """Return the content of a heartbeat now."""
        return status_of(self.snapshot, is_layer=self._is_layer, is_stale=self.is_stale(now_s))

    def pulse(self, now_s: float) -> list[Make]:
        """Return the heartbeat, if it is due; none if the loop has hung for long."""
        if now_s < self._pulse_s:
            return []
        self._pulse_s = max(self._pulse_s + HEARTBEAT_S, now_s)
        return self._heartbeat(now_s)

    def due(self, now_s: float) -> Iterator[Make]:
        """Yield the messages to send now; each is made when it is taken, so that the caller may stop early."""
        values = self._changed_values(now_s)
        # On a slow line, neither leaves the other nothing.
        yield from itertools.islice(values, VALUES_FIRST)
        for message in self.schedule.due(now_s):
            if message not in _VALUES:
                yield from self.once(message, now_s) or ()
        yield from values

    def _heartbeat(self, now_s: float) -> list[Make]:
        is_gone = now_s - self._fresh_s > GONE_S
        return [] if is_gone else [telemetry.heartbeat(self.status(now_s))]

    def once(self, message: int, now_s: float) -> list[Make] | None:
        """A message about the present state; empty: there is nothing to report; None: there is no such message here."""
        if message == VERSION:
            return [self._version]
        if message == HEARTBEAT:
            return self._heartbeat(now_s)
        if message in _VALUES:
            is_float = message == Telemetry.NAMED_VALUE_FLOAT
            return [make for _, make in self._values(now_s, is_float=is_float)]
        if message not in set(Telemetry) or message == Telemetry.DISTANCE_SENSOR:
            return None
        made = self._measured(message, now_s)
        return [] if made is None else [made]

    def _measured(self, message: int, now_s: float) -> Make | None:
        snapshot = self.snapshot
        if snapshot is None or self.is_stale(now_s):
            return None
        reading, scan = _fresh(snapshot.reading, now_s, READING_LIMIT_S), _fresh(snapshot.scan, now_s, SCAN_LIMIT_S)
        match message:
            case Telemetry.SYS_STATUS:
                return telemetry.sys_status(snapshot, self.bad_packets)
            case Telemetry.BATTERY_STATUS:
                return telemetry.battery_status(snapshot)
            case Telemetry.OBSTACLE_DISTANCE if scan is not None:
                return telemetry.obstacle_distance(scan, *self._settings.range_m)
            case Telemetry.ODOMETRY if reading is not None:
                return telemetry.odometry(reading)
            case Telemetry.ATTITUDE if reading is not None:
                return telemetry.attitude(reading, self._boot_ms(now_s))
            case Telemetry.LOCAL_POSITION if reading is not None:
                return telemetry.local_position(reading, self._boot_ms(now_s))
        return None

    def _values(self, now_s: float, *, is_float: bool) -> Iterator[tuple[str, Make]]:
        for name, number in self._numbers():
            if isinstance(number, float) is is_float and not self.is_stale(now_s):
                yield name, values.named_value(name, number, self._boot_ms(now_s))

    def _numbers(self) -> Iterator[tuple[str, values.Number]]:
        snapshot = self.snapshot
        if snapshot is None:
            return
        yield values.SUPERVISOR_STATE, values.supervisor_state(snapshot)
        yield values.BLOCKED, min(self.held_back, 2**31 - 1)
        for value in self.values:
            number = value.number(snapshot.components)
            if number is not None:
                yield value.name, number

    def _changed_values(self, now_s: float) -> Iterator[Make]:
        """Named values that have changed, or were not sent for long; the one that waits longest is first."""
        if self.is_stale(now_s):
            return
        found = []
        for name, number in self._numbers():
            kind = Telemetry.NAMED_VALUE_FLOAT if isinstance(number, float) else Telemetry.NAMED_VALUE_INT
            interval_s = self.schedule.interval_s(kind)
            sent, sent_s = self._sent.get(name, (None, -math.inf))
            wait_s = interval_s if sent == number else min(interval_s, CHANGE_S)
            if not math.isinf(interval_s) and now_s - sent_s >= wait_s:
                found.append((sent_s, name, number))
        for _, name, number in sorted(found):
            yield values.named_value(name, number, self._boot_ms(now_s))
            self._sent[name] = (number, now_s)

    def _boot_ms(self, now_s: float) -> int:
        return int((now_s - self._began_s) * 1000) % 2**32

    @property
    def _version(self) -> Make:
        major, minor, patch = (int(part) for part in __version__.split(".")[:3])
        version = major << 24 | minor << 16 | patch << 8
        capabilities = _MAVLINK_2 | _COMMAND_INT | _TERMINATION | (_SET_POINTS if self._is_layer else 0)
        none = [0] * 8
        return lambda codec: codec.autopilot_version_encode(capabilities, version, 0, 0, 0, none, none, none, 0, 0, 0)

    @property
    def is_running(self) -> bool:
        """True if the supervisor is executed."""
        return self.snapshot is not None and self.snapshot.state is State.RUNNING


def _fresh[Measured: (DriveReading, Scan)](measured: Measured | None, now_s: float, limit_s: float) -> Measured | None:
    return measured if measured is not None and now_s - measured.time_s <= limit_s else None
