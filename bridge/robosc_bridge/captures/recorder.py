"""Recorder of the bytes on the lines of a driving robot: it may lose records, but never holds up a line.

The threads of devices put the bytes into a bounded queue, and a separate thread writes them. If the disk is full or
does not answer, records are lost and the robot drives on.
"""

import contextlib
import logging
import queue
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Any

from robosc_bridge.captures.capture_file import MAGIC, CaptureError, CaptureWriter, Kind, LineInfo, Record, event
from robosc_bridge.errors import LineError
from robosc_bridge.host import Condition, Host, NetworkPort, Port, Queue, Thread

PARTS = 4
"""Files of a recording at most: the one that is written, and older ones, `.1` being the newest of these."""

LEAST_MIB = 1
USUAL_MIB = 256

_MIB = 1 << 20
_MOST_WAITING = 10_000
_FLUSH_S = 0.5
_JOIN_S = 3.0
_NS = 1_000_000_000
# Bytes of a message's record beside its data.
_OVERHEAD = 31

_log = logging.getLogger(__name__)

type Tap = Callable[[Kind, bytes], None]


class Recorder:
    """Writer of the bytes on the lines, in a thread of its own.

    Args:
        file: File that is written; an existing one becomes the first older part.
        lines: Lines, by their paths or addresses.
        host: Host whose time the records have.
        limit_bytes: Maximum size of all parts together.

    Attributes:
        lost: Number of records lost so far.

    Raises:
        CaptureError: The file exists and is not a capture.
        OSError: It cannot be written.
    """

    def __init__(self, file: Path, lines: Mapping[str, LineInfo], host: Host, limit_bytes: int) -> None:
        self.lost = 0
        self._file = file
        self._lines = dict(lines)
        self._monotonic = host.monotonic
        # Records have one clock, which no person sets, whatever the time of day does meanwhile.
        self._epoch_s = host.wall() - host.monotonic()
        self._part_bytes = limit_bytes // PARTS
        self._waiting: queue.SimpleQueue[Record | None] = queue.SimpleQueue()
        self._is_over = False
        self._reported_lost = 0
        self._written = 0
        if file.exists() and not _is_capture(file):
            raise CaptureError(f"{file}: this file is no capture, and is not overwritten; choose another name")
        _rotate(file)
        self._stream: IO[bytes] = file.open("xb")
        self._writer = self._begin()
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def tap(self, path: str) -> Tap | None:
        """Return the function that records what passes on a line; None: the line is not recorded."""
        info = self._lines.get(path)
        if info is None:
            return None
        name, put, size = info.name, self._waiting.put, self._waiting.qsize

        def record(kind: Kind, data: bytes) -> None:
            if self._is_over:
                return
            if size() >= _MOST_WAITING:
                self.lost += 1
                return
            put(Record(int((self._monotonic() + self._epoch_s) * _NS), name, kind, data))

        return record

    def close(self) -> None:
        """End the recording with what has come so far; waits for a disk for a few seconds at most."""
        self._waiting.put(None)
        self._thread.join(_JOIN_S)
        if self._thread.is_alive():
            _log.error("the recording %s is not written to its end: its disk does not answer", self._file)

    def _begin(self) -> CaptureWriter:
        self._written = 0
        return CaptureWriter(self._stream, {info.name: info for info in self._lines.values()})

    def _run(self) -> None:
        try:
            self._write_all()
        except (OSError, ValueError) as error:
            self._is_over = True
            with contextlib.suppress(OSError):
                self._stream.close()
            _log.error("%s: the recording ends here, and the robot goes on: %s", self._file, error)

    def _write_all(self) -> None:
        flushed_s = time.monotonic()
        while True:
            with contextlib.suppress(queue.Empty):
                record = self._waiting.get(timeout=_FLUSH_S)
                if record is None:
                    break
                self._write(record)
            now_s = time.monotonic()
            if now_s - flushed_s >= _FLUSH_S:
                flushed_s = now_s
                self._stream.flush()
        self._writer.finish()
        self._stream.close()

    def _write(self, record: Record) -> None:
        if self._written >= self._part_bytes:
            self._writer.finish()
            self._stream.close()
            _rotate(self._file)
            self._stream = self._file.open("xb")
            self._writer = self._begin()
        if self.lost > self._reported_lost:
            self._reported_lost, data = self.lost, event("lost", records=self.lost - self._reported_lost)
            for info in self._lines.values():
                self._writer.write(Record(record.time_ns, info.name, Kind.EVENTS, data))
            _log.warning("the recording %s has lost %d records: its disk is too slow", self._file, self.lost)
        self._writer.write(record)
        self._written += len(record.data) + _OVERHEAD


def _is_capture(file: Path) -> bool:
    if not file.is_file():
        return False
    with file.open("rb") as stream:
        return stream.read(len(MAGIC)) in (MAGIC, b"")


def part(file: Path, number: int) -> Path:
    """Return the name of an older part; 0: the newest, which is the file itself."""
    return file.with_name(f"{file.stem}.{number}{file.suffix}") if number else file


def _rotate(file: Path) -> None:
    """Let every part be one older; the oldest goes."""
    for number in range(PARTS - 1, 0, -1):
        with contextlib.suppress(FileNotFoundError):
            part(file, number - 1).replace(part(file, number))


def _read(line: Port | NetworkPort, limit_s: float, tap: Tap) -> bytes:
    """Return what has come on a line, recorded; so is the end of the line."""
    try:
        data = line.read(limit_s)
    except LineError as error:
        tap(Kind.EVENTS, event("lost line", problem=error.problem))
        raise
    if data:
        tap(Kind.IN, data)
    return data


class RecordedPort:
    """A serial port whose bytes are recorded: a `Port`.

    Args:
        port: The port.
        tap: Function that records.
    """

    def __init__(self, port: Port, tap: Tap) -> None:
        self._port = port
        self._tap = tap

    @property
    def path(self) -> str:
        """Its name."""
        return self._port.path

    @property
    def baud(self) -> int:
        """Bits per second."""
        return self._port.baud

    def read(self, limit_s: float) -> bytes:
        """Return what has come, waiting for the first byte."""
        return _read(self._port, limit_s, self._tap)

    def write(self, data: bytes, limit_s: float = 0.1) -> None:
        """Send all of it."""
        if data:
            self._tap(Kind.OUT, data)
        self._port.write(data, limit_s)

    def discard_input(self) -> None:
        """Forget what has come and was not read."""
        self._tap(Kind.EVENTS, event("discard"))
        self._port.discard_input()

    def set_baud(self, baud: int) -> None:
        """Go on at another speed."""
        self._tap(Kind.EVENTS, event("baud", baud=baud))
        self._port.set_baud(baud)

    def set_dtr(self, is_on: bool) -> None:
        """Set the modem line "data terminal ready"."""
        self._tap(Kind.EVENTS, event("dtr", is_on=is_on))
        self._port.set_dtr(is_on)

    def wake(self) -> None:
        """Let a `read` that waits in another thread return."""
        self._port.wake()

    def close(self) -> None:
        """Give it back."""
        self._tap(Kind.EVENTS, event("close"))
        self._port.close()


class RecordedNetwork(NetworkPort):
    """A line over a network whose bytes are recorded.

    Args:
        line: The line.
        tap: Function that records.
    """

    def __init__(self, line: NetworkPort, tap: Tap) -> None:
        self.path = line.path
        self.is_datagram = line.is_datagram
        self._line = line
        self._tap = tap

    @property
    def port(self) -> int:
        """Address of its own end."""
        return self._line.port

    @property
    def is_stranger(self) -> bool:
        """Return whether the last datagram came from elsewhere than where what is written goes."""
        return self._line.is_stranger

    def read(self, limit_s: float) -> bytes:
        """Return what has come, waiting for the first of it."""
        return _read(self._line, limit_s, self._tap)

    def reply(self, data: bytes) -> None:
        """Send one datagram to where the last one came from."""
        self._tap(Kind.OUT, data)
        self._line.reply(data)

    def answer_sender(self) -> None:
        """From now on, what is written goes to where the last datagram came from."""
        self._line.answer_sender()

    def write(self, data: bytes, limit_s: float = 0.1) -> None:
        """Send all of it."""
        self._tap(Kind.OUT, data)
        self._line.write(data, limit_s)

    def wake(self) -> None:
        """Let a `read` that waits in another thread return."""
        self._line.wake()

    def close(self) -> None:
        """Give it back."""
        self._tap(Kind.EVENTS, event("close"))
        self._line.close()


class RecordingHost:
    """A host whose lines are recorded: a `Host`.

    Args:
        host: The host.
        recorder: Recorder of its lines.
    """

    def __init__(self, host: Host, recorder: Recorder) -> None:
        self._host = host
        self._recorder = recorder
        # Asked for all the time.
        self.monotonic = host.monotonic
        self.wall = host.wall
        self.sleep = host.sleep

    def condition(self) -> Condition:
        """Return a new condition variable."""
        return self._host.condition()

    def queue(self) -> Queue[Any]:
        """Return a new queue."""
        return self._host.queue()

    def thread(self, run: Callable[[], None], name: str) -> Thread:
        """Return a new thread that does not keep the process from ending."""
        return self._host.thread(run, name)

    def open_port(self, path: str, baud: int) -> Port:
        """Open a serial port.

        Raises:
            LineError: It cannot be used.
        """
        port, tap = self._host.open_port(path, baud), self._recorder.tap(path)
        if tap is None:
            return port
        tap(Kind.EVENTS, event("open", baud=baud))
        return RecordedPort(port, tap)

    def open_network(self, address: str) -> NetworkPort:
        """Open a line over a network.

        Raises:
            LineError: It cannot be used.
        """
        line, tap = self._host.open_network(address), self._recorder.tap(address)
        if tap is None:
            return line
        tap(Kind.EVENTS, event("open"))
        return RecordedNetwork(line, tap)
