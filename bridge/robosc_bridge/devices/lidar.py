"""The TurtleBot3's LiDARs as range scanners: one driver, with the particulars of each model as data."""

import contextlib
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from robosc_bridge.devices.interface import RawScan, Scan, ScannerCounters
from robosc_bridge.errors import LineError, LineLostError
from robosc_bridge.host import Host, Port
from robosc_bridge.protocol import lds01, lds02, lds03
from robosc_bridge.protocol.framing import FrameDecoder
from robosc_bridge.protocol.revolutions import Points, Revolution, RevolutionBuilder, nearest_by_degree, wrapped_deg
from robosc_bridge.transport.system_host import SYSTEM_HOST

BAUD_TRIAL_S = 1.0
"""A device sends well-formed frames within this time after its start, or it speaks at another speed."""


@dataclass(frozen=True)
class Model[Frame]:
    """Particulars of a LiDAR.

    Attributes:
        name: Name in the registry.
        bauds: Baud rates of its line, the most likely one first.
        make_decoder: Function that makes a decoder of its frames.
        points: Function that returns the points of a frame.
        start: Command that starts its motor; empty: it rotates by itself.
        stop: Command that stops its motor; empty: it cannot be stopped.
        restart_pause_s: Pause between stop and start, in seconds; None: a restart is the start alone.
        stale_after_s: Three revolutions: after a silence of this length, earlier bytes are discarded.
        min_m: Shortest distance that it measures.
        max_m: Longest.
        is_dtr_off: True if its official driver drops this modem line, which opening a port raises.
    """

    name: str
    bauds: tuple[int, ...]
    make_decoder: Callable[[], FrameDecoder[Frame]]
    points: Callable[[Frame], Points]
    start: bytes
    stop: bytes
    restart_pause_s: float | None
    stale_after_s: float
    min_m: float
    max_m: float
    is_dtr_off: bool = False


LDS01 = Model("lds01", (230_400,), lds01.Decoder, lds01.points, lds01.START, lds01.STOP, None, 0.6, 0.12, 3.5)
LDS02 = Model("lds02", (115_200,), lds02.Decoder, lds02.points, b"", b"", None, 0.5, 0.16, 8.0)
# Its driver says the first speed, its manual the second.
LDS03 = Model(
    "lds03",
    (230_400, 115_200),
    lds03.Decoder,
    lds03.points,
    lds03.START,
    lds03.STOP,
    1.0,
    0.3,
    0.05,
    12.0,
    is_dtr_off=True,
)


class Lidar[Frame]:
    """A LiDAR on a serial line: a `RangeScanner`.

    Args:
        model: Model of the LiDAR.
        path: Path of its port.
        baud: Baud rate of its line; None: those of the model are tried.
        front_rad: Direction of its front, in radians, counter-clockwise from that of the robot.
        is_upside_down: True if it is mounted upside down, so that it rotates the other way round.
        host: Parts of its computer that it uses.

    Attributes:
        counters: Counters since this object was made; opening the line anew does not reset them.
    """

    def __init__(
        self,
        model: Model[Frame],
        path: str,
        baud: int | None = None,
        *,
        front_rad: float = 0.0,
        is_upside_down: bool = False,
        host: Host = SYSTEM_HOST,
    ) -> None:
        self.counters = ScannerCounters()
        self._model = model
        self._path = path
        self._bauds = model.bauds if baud is None else (baud,)
        self._front_deg = math.degrees(front_rad)
        self._is_upside_down = is_upside_down
        self._host = host
        self._clock = host.monotonic
        self._decoder = model.make_decoder()
        self._revolutions = RevolutionBuilder()
        self._line: Port | None = None
        self._woken = threading.Event()
        self._listened_s = self._heard_s = self._clock()
        self._is_baud_known = False
        self._start_at_s: float | None = None
        self._trial_end_s: float | None = None

    @property
    def model(self) -> Model[Frame]:
        """Model of the LiDAR."""
        return self._model

    @property
    def baud(self) -> int | None:
        """Speed of the open line."""
        return self._line.baud if self._line else None

    def open(self) -> None:
        """Open the line and start the motor, without waiting for a frame.

        Raises:
            LineError: The line cannot be used.
        """
        self.close()
        self._line = self._host.open_port(self._path, self._bauds[0])
        try:
            if self._model.is_dtr_off:
                self._line.set_dtr(False)
            self._is_baud_known = len(self._bauds) == 1
            self._begin(self._line)
        except LineError:
            self.close()
            raise

    def receive(self, limit_s: float) -> Scan | None:
        """Return the next full revolution; when one read brings several, the newest.

        It must be called again and again: it also sends the delayed start command of a restart, and tries another baud
        rate as long as no well-formed frame has come. Bytes that waited in the line until they were stale, because
        nobody called or the process was paused, are discarded.

        Args:
            limit_s: Longest wait.

        Returns:
            None: no revolution was complete within the limit, or before `wake` was called.

        Raises:
            LineError: The line is gone.
        """
        line = self._opened()
        now_s = self._clock()
        end_s = now_s + limit_s
        self._discard_stale(line, now_s)
        while True:
            due_s = self._keep_on(line, now_s)
            data = line.read(min(end_s, due_s) - now_s)
            now_s = self._clock()
            # A process that was paused while it read has got the oldest bytes of those that waited.
            is_stale = self._discard_stale(line, now_s)
            revolution = self._decode(data, now_s) if data and not is_stale else None
            is_woken = self._woken.is_set()
            if revolution or is_woken or now_s >= end_s:
                self._woken.clear()
                return self._scan(revolution, now_s) if revolution else None

    def wake(self) -> None:
        """Let a `receive` that waits in another thread return at once."""
        self._woken.set()
        line = self._line
        if line:
            line.wake()

    def restart(self) -> None:
        """Stop and start a motor that has fallen silent; an LDS-02 has no command for that, and nothing happens.

        It does not wait: if a pause is needed between stop and start, `receive` sends the start after it.

        Raises:
            LineError: The line is gone.
        """
        line = self._opened()
        if self._model.restart_pause_s is None:
            self._start(line)
        else:
            line.write(self._model.stop)
            self._start_at_s = self._clock() + self._model.restart_pause_s

    def close(self) -> None:
        """Stop the motor, close the line; never raises, may be called at any time and again."""
        line, self._line = self._line, None
        if line:
            with contextlib.suppress(LineError):
                line.write(self._model.stop)
            line.close()

    def _opened(self) -> Port:
        if not self._line:
            raise LineLostError(self._path, "the line is not open")
        return self._line

    def _begin(self, line: Port) -> None:
        """Start the motor on a line that was opened or has got another speed."""
        line.discard_input()
        self._forget(self._clock())
        self._start(line)

    def _forget(self, now_s: float) -> None:
        self._decoder.forget()
        self._count()
        self._revolutions.forget()
        self._listened_s = self._heard_s = now_s

    def _discard_stale(self, line: Port, now_s: float) -> bool:
        """Discard what waited in the line if nothing was read for so long that it is stale; return whether it was."""
        is_stale = now_s - self._listened_s > self._model.stale_after_s
        if is_stale:
            line.discard_input()
            self._forget(now_s)
        self._listened_s = now_s
        return is_stale

    def _start(self, line: Port) -> None:
        line.write(self._model.start)
        self._start_at_s = None
        self._trial_end_s = None if self._is_baud_known else self._clock() + BAUD_TRIAL_S

    def _keep_on(self, line: Port, now_s: float) -> float:
        """Do what is due at this time; the time when something will be due next."""
        if self._start_at_s is not None and now_s >= self._start_at_s:
            self._start(line)
        if self._trial_end_s is not None and now_s >= self._trial_end_s:
            line.set_baud(self._bauds[(self._bauds.index(line.baud) + 1) % len(self._bauds)])
            self._begin(line)
        return min(at_s for at_s in (self._start_at_s, self._trial_end_s, math.inf) if at_s is not None)

    def _decode(self, data: bytes, now_s: float) -> Revolution | None:
        """The newest revolution that these bytes complete."""
        if now_s - self._heard_s > self._model.stale_after_s:
            self._forget(now_s)
        newest = None
        for frame in self._decoder.feed(data):
            self._heard_s = now_s
            revolution = self._revolutions.add(self._model.points(frame))
            if revolution:
                self.counters.scans += 1
                newest = revolution
        if self._decoder.counts.frames > self.counters.frames:
            self._is_baud_known = True
            self._trial_end_s = None
        self._count()
        return newest

    def _count(self) -> None:
        counts = self._decoder.counts
        self.counters.frames = counts.frames
        self.counters.bad_frames = counts.bad_frames
        self.counters.skipped_bytes = counts.skipped_bytes

    def _scan(self, revolution: Revolution, now_s: float) -> Scan:
        angles_deg = self._seen_by_the_robot(revolution.angles_deg)
        ranges_m = nearest_by_degree(angles_deg, revolution.ranges_m)
        raw = RawScan(
            tuple([math.radians(angle_deg) for angle_deg in angles_deg]), revolution.ranges_m, revolution.intensities
        )
        return Scan(now_s, ranges_m, raw, revolution.revolutions_per_s, self._model.min_m, self._model.max_m)

    def _seen_by_the_robot(self, angles_deg: tuple[float, ...]) -> tuple[float, ...]:
        if self._is_upside_down:
            return tuple([wrapped_deg(self._front_deg - angle_deg) for angle_deg in angles_deg])
        return tuple([wrapped_deg(self._front_deg + angle_deg) for angle_deg in angles_deg])


make_lds01 = partial(Lidar, LDS01)
make_lds02 = partial(Lidar, LDS02)
make_lds03 = partial(Lidar, LDS03)
