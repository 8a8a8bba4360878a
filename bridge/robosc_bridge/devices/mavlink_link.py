"""One line to a vehicle, shared by all its users in this process.

A drive base and a scanner, each with its own thread, may be configured on one line. The line has a thread that reads
and dispatches messages, but never sends. Only the threads of the users send, so that a user whose thread has ended
keeps nothing alive: above all, the heartbeat comes from the drive base, if there is one.
"""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from robosc_bridge.devices.mavlink_state import VehicleState
from robosc_bridge.errors import LineBusyError, LineError, LineLostError
from robosc_bridge.host import Host, NetworkPort
from robosc_bridge.protocol.framing import FrameCounts
from robosc_bridge.protocol.mavlink import Codec, Decoder
from robosc_bridge.protocol.mavlink_messages import (
    AUTOPILOT,
    ONBOARD_COMPUTER,
    MavCommand,
    Message,
    ObstacleRing,
    SectorDistance,
    Telemetry,
    command,
    own_heartbeat,
    vehicle_message,
)
from robosc_bridge.protocol.mavlink_signing import Signing
from robosc_bridge.transport.system_host import SYSTEM_HOST, open_line

BAUD = 57_600
OWN_SYSTEM = 254
"""Neither a vehicle's usual number nor 255, which ground stations have."""

OWN_COMPONENT = ONBOARD_COMPUTER
"""MAV_COMP_ID_ONBOARD_COMPUTER of `minimal.xml`, which `common.xml` includes; 190 is that of ground stations."""

HEARTBEAT_S = 1.0
_KEPT_OBSTACLES = 32
_LARGEST_NUMBER = 255
_READ_S = 0.2
# A read that takes so long was paused, with the process.
_PAUSE_S = 0.5


@dataclass(frozen=True, slots=True)
class ObstacleReport:
    """Report of a sensor that looks around.

    Attributes:
        time_s: Time when it came, by the host's clock, in seconds.
        component: Component that it comes from.
        content: Content of the report.
    """

    time_s: float
    component: int
    content: ObstacleRing | SectorDistance


@dataclass(frozen=True, slots=True)
class LinkSettings:
    """Settings of the line to a vehicle, the same for all users of the line.

    Attributes:
        path: Path of a serial port, or an address of `transport.network_line`.
        baud: Speed of a serial port.
        system: System number of the vehicle; None: the first rover that is heard.
        own_system: Our system number. ArduPilot's failsafe counts the heartbeats of 255 alone, unless set otherwise.
        own_component: Our component number.
        signing: Signing of packets; None: none, and signatures are not asked for.

    Raises:
        ValueError: A number is out of its range, or ours are those of the vehicle's autopilot.
    """

    path: str
    baud: int = BAUD
    system: int | None = None
    own_system: int = OWN_SYSTEM
    own_component: int = OWN_COMPONENT
    signing: Signing | None = None

    def __post_init__(self) -> None:
        for name in ("system", "own_system", "own_component"):
            number = getattr(self, name)
            if number is not None and not 1 <= number <= _LARGEST_NUMBER:
                raise ValueError(f"{name} must be from 1 to {_LARGEST_NUMBER}, not {number}")
        if self.is_own(self.system, AUTOPILOT):
            raise ValueError(
                f"own_system {self.own_system} and own_component {self.own_component} are the autopilot's own; choose "
                f"another own_component, such as {OWN_COMPONENT}"
            )

    def is_own(self, system: int | None, component: int | None) -> bool:
        """Return True if these numbers are ours."""
        return (system, component) == (self.own_system, self.own_component)


class VehicleLink:
    """An open line to a vehicle; made by `acquire`.

    Args:
        settings: Settings for reaching it.
        host: Parts of its computer that it uses.

    Raises:
        LineError: The line cannot be used.
    """

    def __init__(self, settings: LinkSettings, host: Host) -> None:
        self.settings = settings
        self._host = host
        self.has_driver = False
        self.users = 0
        self._signing = settings.signing.begin() if settings.signing else None
        self._codec = Codec(
            settings.own_system,
            settings.own_component,
            self._signing.key if self._signing else None,
            settings.signing.link if settings.signing else 0,
            self._signing.timestamp() if self._signing else 0,
        )
        self._decoder = Decoder(self._codec, vehicle_message)
        self._state = VehicleState(settings.system)
        self._obstacles: deque[ObstacleReport] = deque(maxlen=_KEPT_OBSTACLES)
        self._lost: LineError | None = None
        self._is_closing = False
        self._changed = host.condition()
        self._sending = threading.Lock()
        self._heartbeat_s = -HEARTBEAT_S
        self._line = open_line(settings.path, settings.baud, host)
        self._reader = host.thread(self._read, f"MAVLink {settings.path}")
        self._reader.start()

    @property
    def state(self) -> VehicleState:
        """State of the vehicle, as reported so far.

        Raises:
            LineLostError: The line is gone.
        """
        with self._changed:
            self._check()
            return self._state

    @property
    def counts(self) -> FrameCounts:
        """Counts of the frames that the line has brought."""
        with self._changed:
            return replace(self._decoder.counts)

    @property
    def is_lost(self) -> bool:
        """True if the line is gone."""
        return self._lost is not None

    def wait(self, is_so: Callable[[VehicleState], bool], limit_s: float) -> bool:
        """Wait for a state of the vehicle; returns whether it came in time.

        Raises:
            LineLostError: The line is gone.
        """
        with self._changed:
            found = self._changed.wait_for(lambda: self._lost is not None or is_so(self._state), limit_s)
            self._check()
            return found

    def take_obstacles(self, limit_s: float, is_woken: Callable[[], bool]) -> list[ObstacleReport]:
        """Return the reports of obstacles since they were taken last; wait for the first.

        Raises:
            LineLostError: The line is gone.
        """
        with self._changed:
            self._changed.wait_for(lambda: bool(self._lost or self._obstacles or is_woken()), max(limit_s, 0.0))
            self._check()
            found = list(self._obstacles)
            self._obstacles.clear()
            return found

    def wake(self) -> None:
        """Wake all waiting threads, which then check whether they were meant."""
        with self._changed:
            self._changed.notify_all()

    def send(self, make: Callable[[Any], Any]) -> None:
        """Send one message, made with the library's codec.

        Raises:
            LineLostError: The line is gone, or does not take it.
        """
        with self._sending:
            # The codec is the reader's, too: what is heard moves the time of signing.
            with self._changed:
                self._check()
                if self._signing:
                    self._codec.not_before(self._signing.timestamp())
                packet = self._codec.encode(make)
                timestamp = self._codec.timestamp
            if self._signing:
                self._signing.reserve(timestamp)
            self._line.write(packet)

    def keep_alive(self) -> None:
        """Send our heartbeat when it is due.

        Raises:
            LineLostError: The line is gone.
        """
        now_s = self._host.monotonic()
        if now_s - self._heartbeat_s >= HEARTBEAT_S:
            self._heartbeat_s = now_s
            self.send(own_heartbeat)

    def request(self, telemetry: tuple[Telemetry, ...], interval_s: float) -> None:
        """Ask the vehicle to send messages at an interval; it refuses messages that it does not know, without effect.

        Raises:
            LineLostError: The line is gone.
        """
        state = self.state
        if state.system is None or state.component is None:
            return
        for number in telemetry:
            self.send(
                command(
                    state.system, state.component, MavCommand.SET_MESSAGE_INTERVAL, 0, float(number), interval_s * 1e6
                )
            )

    def close(self) -> None:
        """Close the line; never raises."""
        self._is_closing = True
        self._line.wake()
        self._reader.join()
        self._line.close()

    def _check(self) -> None:
        if self._lost is not None:
            raise LineLostError(self.settings.path, self._lost.problem)

    def _read(self) -> None:
        try:
            now_s, is_old = self._host.monotonic(), False
            while not self._is_closing:
                data = self._line.read(0.0 if is_old else _READ_S)
                before_s, now_s = now_s, self._host.monotonic()
                # All that waits in the line is of the time of the pause.
                is_old = now_s - before_s > _PAUSE_S or (is_old and bool(data))
                if data:
                    self._take(data, now_s, is_old=is_old)
        except LineError as error:
            with self._changed:
                self._lost = error
                self._changed.notify_all()
            # The port must not be busy for the one who plugs it in again.
            self._line.close()

    def _take(self, data: bytes, time_s: float, *, is_old: bool) -> None:
        with self._changed:
            messages = self._decoder.feed(data)
            for message in messages:
                self._sort(message, time_s)
            if is_old:
                # A robot that drives by them would drive by things that are gone.
                self._obstacles.clear()
            if isinstance(self._line, NetworkPort) and self._line.is_datagram:
                # A packet does not go on in the next datagram.
                self._decoder.forget()
            if messages:
                self._changed.notify_all()

    def _sort(self, message: Message, time_s: float) -> None:
        own = (self.settings.own_system, self.settings.own_component)
        before = self._state
        self._state = before.after(message, time_s, own)
        if self._state.heartbeat is not before.heartbeat and isinstance(self._line, NetworkPort):
            self._line.answer_sender()
        # A companion computer of the vehicle may be what sees.
        if isinstance(message.content, (ObstacleRing, SectorDistance)) and message.system == self._state.system:
            self._obstacles.append(ObstacleReport(time_s, message.component, message.content))


_links: dict[str, VehicleLink] = {}
_guard = threading.Lock()


def acquire(settings: LinkSettings, *, as_driver: bool, host: Host = SYSTEM_HOST) -> VehicleLink:
    """Return the link on a line, which is opened if it has no user yet; `release` gives it back.

    Args:
        settings: Settings for reaching the vehicle.
        as_driver: True if the user drives the vehicle; only one user at a time may.
        host: Parts of its computer that it uses.

    Raises:
        LineBusyError: The vehicle is driven already, or the line is used with other settings.
        LineError: The line cannot be used.
    """
    with _guard:
        link = _links.get(settings.path)
        if link is not None and not link.is_lost:
            if link.settings != settings:
                raise LineBusyError(settings.path, "another device of this program uses it with other settings")
            if as_driver and link.has_driver:
                raise LineBusyError(settings.path, "another drive base of this program uses this port")
        else:
            link = _links[settings.path] = VehicleLink(settings, host)
        link.users += 1
        link.has_driver = link.has_driver or as_driver
        return link


def release(link: VehicleLink, *, as_driver: bool) -> None:
    """Give a link back; the last user closes it."""
    with _guard:
        link.users -= 1
        if as_driver:
            link.has_driver = False
        if link.users:
            return
        if _links.get(link.settings.path) is link:
            del _links[link.settings.path]
    link.close()
