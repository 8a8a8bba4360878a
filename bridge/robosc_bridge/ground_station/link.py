"""The thread of a ground station: opens its line again and again, and carries bytes to and from a session."""

import contextlib
import logging
import threading

from robosc_bridge.daemon.operations import Operations
from robosc_bridge.daemon.threads.backoff import Backoff
from robosc_bridge.errors import BridgeError
from robosc_bridge.ground_station.session import STATION_LIMIT_S, StationSession
from robosc_bridge.ground_station.settings import GroundSettings
from robosc_bridge.host import Host, NetworkPort
from robosc_bridge.transport.system_host import SYSTEM_HOST, Line, open_line

_log = logging.getLogger(__name__)

TURN_S = 0.05
"""Longest time between two looks at what the daemon shows."""

LONGEST_DATAGRAM = 2048
"""Bytes of a datagram that are looked at."""

REST = 2.0
"""Factor of the pause that leaves the processor to the robot where bytes wait already.

The pause is so many times as long as the work on the bytes before.
"""

LASTING_S = 5.0
"""A line that has been open for so long works."""

_LONGEST_REST_S = 0.1
_JOIN_S = 3.0


class GroundLink:
    """Link to a ground station; the daemon continues, whatever happens to the link.

    Args:
        operations: The daemon.
        settings: Settings for reaching the station.
        host: Parts of its computer that it uses; readings and scans have their times from its clock, too.

    Raises:
        SigningError: There is no key, or the time stamp of signatures cannot be stored.
    """

    def __init__(self, operations: Operations, settings: GroundSettings, host: Host = SYSTEM_HOST) -> None:
        self._settings = settings
        self._host = host
        self._clock = host.monotonic
        self._session = StationSession(operations, settings, self._clock())
        self._backoff = Backoff()
        self._guard = threading.Lock()
        self._line: Line | None = None
        self._is_over = False
        self._ending = host.condition()
        self._peer_s = -STATION_LIMIT_S
        self._problem = ""
        self._thread = host.thread(self._run, self.name)

    name = "ground station"

    @property
    def port(self) -> int | None:
        """Port of its own end, if the line is open and has a network."""
        with self._guard:
            return self._line.port if isinstance(self._line, NetworkPort) else None

    @property
    def is_alive(self) -> bool:
        """True if its thread runs; only `stop` ends it, whatever happens to the line."""
        return self._thread.is_alive()

    def start(self) -> None:
        """Start the thread, whether or not the station is there."""
        self._thread.start()

    def stop(self) -> None:
        """Send a last heartbeat and end the thread; may be called again, and before `start`."""
        with self._ending:
            self._is_over = True
            self._ending.notify_all()
        with self._guard:
            if self._line is not None:
                self._line.wake()
        if self._thread.ident is not None:
            self._thread.join(_JOIN_S)

    def _run(self) -> None:
        try:
            while not self._is_over:
                try:
                    self._talk(self._opened())
                except BridgeError as error:
                    self._failed(str(error))
                except Exception:  # The link survives everything that a station sends or the daemon shows.
                    _log.exception("ground station")
                    self._failed("an internal error; see above")
            with contextlib.suppress(BridgeError):
                last = self._session.end(self._clock())
                if self._line is not None:
                    self._line.write(last)
        finally:
            # The end of the thread, however it came, ends driving by the station.
            self._close()
            self._session.lost()

    def _opened(self) -> Line:
        line = open_line(self._settings.address, self._settings.baud, self._host)
        with self._guard:
            self._line = line
        self._peer_s = -STATION_LIMIT_S
        return line

    def _talk(self, line: Line) -> None:
        opened_s = self._clock()
        while not self._is_over:
            asked_s = self._clock()
            data = line.read(TURN_S)
            now_s = self._clock()
            if isinstance(line, NetworkPort) and line.is_datagram:
                self._datagram(line, data[:LONGEST_DATAGRAM], now_s)
            else:
                line.write(self._session.step(now_s, data))
            done_s = self._clock()
            if now_s - opened_s > LASTING_S:
                self._backoff.succeeded()
                self._problem = ""
            if now_s - asked_s < done_s - now_s:
                self._pause(min((done_s - now_s) * REST, _LONGEST_REST_S))

    def _datagram(self, line: NetworkPort, data: bytes, now_s: float) -> None:
        if data and line.is_stranger and now_s - self._peer_s < STATION_LIMIT_S:
            # One station at a time; another may stop the robot.
            if answers := self._session.receive_from_other(now_s, data):
                line.reply(answers)
            data = b""
        is_stranger = line.is_stranger
        accepted, claims = self._session.accepted, self._session.claims
        found = self._session.step(now_s, data, is_datagram=True)
        if self._session.claims > claims:
            self._peer_s = now_s
            line.answer_sender()
        elif self._session.accepted > accepted and not is_stranger:
            self._peer_s = now_s
        if found:
            line.write(found)

    def _failed(self, problem: str) -> None:
        if problem != self._problem:
            _log.warning("ground station: %s", problem)
        self._problem = problem
        self._close()
        self._session.lost()
        self._pause(self._backoff.failed())

    def _pause(self, limit_s: float) -> None:
        """Do nothing for a time, or until the end."""
        with self._ending:
            self._ending.wait_for(lambda: self._is_over, limit_s)

    def _close(self) -> None:
        with self._guard:
            line, self._line = self._line, None
        if line is not None:
            line.close()
