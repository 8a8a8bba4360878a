"""
The event log.

One entry for everything that happens, written without making the loop wait.

An entry is a dict with `time` (seconds since 1970-01-01 UTC), `kind` and, by kind:

    event       an event of the model: event, controllable, data, state after it, decision_us
    unexpected  something that the state could not accept: event or what
    unknown     event and what was unknown; a request of this kind was not issued
    limited     numbers of a request were moved into the bounds of limits: event, limited
    release     the default message went out: identifier
    blocked     a supervision layer held a request back: identifier, why
    cancelling  the cancel of a goal was decided, and its end is awaited: action, why
    cancel_overdue  that goal did not end within cancel_timeout_s: action, asked_s (so long ago)
    reached     an aim of the strategy has become true: aim, count (how often so far), what
    approach    the strategy approaches another aim now: aim (null: all are met), what
    owed        an assumption has been owed for too long: assumption, owed_s, what
    met         an assumption is met of which that was said: assumption, owed_s, what
    fault       a fault: what
    stop        a safe stop that is no fault (a stale sensor, a signal): what
    resume      the end of such a stop: what
    restart     the model started again
    dropped     the last line, if entries were lost: count
"""

from __future__ import annotations

import json
import math
from pathlib import Path
import queue
import threading
import time
from typing import Any, Dict, List, Protocol, TextIO

from robosc.execution.runtime.middleware_messages import fields_of

Entry = Dict[str, Any]

MAXIMUM_WAITING = 10000
CLOSE_TIMEOUT_S = 5.0
_MAXIMUM_BITS = 64
_MAXIMUM_DEPTH = 20


class EventLog(Protocol):
    """Destination of log entries. None of its methods raises or waits, but for `close`."""

    @property
    def is_active(self) -> bool:
        """Return True if the log keeps entries now; if not, none need be made."""

    @property
    def dropped(self) -> int:
        """Entries that were lost so far."""

    def write(self, entry: Entry) -> None:
        """Keep an entry; its values must not change any more."""

    def close(self) -> None:
        """Finish what was written."""


class NullLog:
    """Keeps nothing."""

    is_active = False
    dropped = 0

    def write(self, entry: Entry) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""


class MemoryLog:
    """Keeps entries in a list, for tests and simulations."""

    is_active = True
    dropped = 0

    def __init__(self) -> None:
        self.entries: List[Entry] = []

    def write(self, entry: Entry) -> None:
        """Append it."""
        self.entries.append(entry)

    def close(self) -> None:
        """Do nothing."""


class JsonLinesLog:
    """
    Log that writes entries as JSON Lines in a thread of its own.

    It drops and counts them when the disk is too slow or full.

    :param stream: Stream to write to; closed at the end.
    :param limit: Entries that may wait.
    """

    is_active = True

    def __init__(self, stream: TextIO, limit: int = MAXIMUM_WAITING) -> None:
        self._stream = stream
        self._limit = limit
        # One counter for each thread that counts.
        self._refused = 0
        self._lost = 0
        self._is_torn = False
        self._waiting: Any = queue.SimpleQueue()
        self._is_open = True
        # A daemon: a disk that hangs must not keep the process from ending.
        self._thread = threading.Thread(target=self._run, name='event log', daemon=True)
        self._thread.start()

    @property
    def dropped(self) -> int:
        """Entries that were lost so far."""
        return self._refused + self._lost

    def write(self, entry: Entry) -> None:
        """Hand an entry to the thread, or drop and count it if too many are waiting."""
        if self._is_open and self._waiting.qsize() < self._limit:
            self._waiting.put(entry)
        else:
            self._refused += 1

    def close(self) -> None:
        """Write what waits, then the number of lost entries if any are, and close the file."""
        if self._is_open:
            self._is_open = False
            self._waiting.put(None)
            self._thread.join(CLOSE_TIMEOUT_S)

    def _run(self) -> None:
        while True:
            entry = self._waiting.get()
            if entry is None:
                break
            self._write_line(entry)
            if self._waiting.empty():
                self._try(self._stream.flush)
        if self.dropped:
            self._write_line({'time': time.time(), 'kind': 'dropped', 'count': self.dropped})
        self._try(self._stream.close)

    def _write_line(self, entry: Entry) -> None:
        try:
            line = json_line(entry)
        except Exception:
            # An entry may hold a message of any class, which may do anything when it is asked for
            # its parts.
            self._lost += 1
            return
        # After a failure the last line may be cut off: the next one must not become part of it.
        if self._try(lambda: self._stream.write('\n' + line if self._is_torn else line)):
            self._is_torn = False
        else:
            self._lost += 1

    def _try(self, action: Any) -> bool:
        try:
            action()
        except (OSError, ValueError):
            self._is_torn = True
            return False
        return True


def open_event_log(folder: str, name: str, wall_s: float) -> JsonLinesLog:
    """
    Return a log in a new file `<name>-<date>-<time>.jsonl` (UTC) of a folder, which may be new.

    :param folder: Folder for the file.
    :param name: First part of the file's name.
    :param wall_s: The time for its name, in seconds since 1970-01-01 UTC.
    :raises OSError: The folder or the file cannot be made.
    """
    directory = Path(folder)
    directory.mkdir(parents=True, exist_ok=True)
    base = '{}-{}'.format(name, time.strftime('%Y%m%d-%H%M%S', time.gmtime(wall_s)))
    number = 1
    while True:
        suffix = '' if number == 1 else '-{}'.format(number)
        try:
            stream = (directory / (base + suffix + '.jsonl')).open('x', encoding='utf-8')
        except FileExistsError:
            number += 1
            continue
        return JsonLinesLog(stream)


def json_line(entry: Entry) -> str:
    """Return an entry as one line of strictly valid JSON, whatever its values are."""
    try:
        return json.dumps(entry, allow_nan=False, separators=(',', ':')) + '\n'
    except (TypeError, ValueError, RecursionError):
        return json.dumps(plain(entry), allow_nan=False, separators=(',', ':')) + '\n'


def plain(value: Any, depth: int = 0) -> Any:
    """
    Return a value in what JSON knows: messages by their fields.

    NaN, infinities, long integers, other objects as text.
    """
    if value is None or value is True or value is False or isinstance(value, str):
        return value
    if isinstance(value, int):
        return value if value.bit_length() <= _MAXIMUM_BITS else hex(value)
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if depth < _MAXIMUM_DEPTH:
        if isinstance(value, dict):
            return {str(plain(key)): plain(item, depth + 1) for key, item in value.items()}
        if isinstance(value, (list, tuple)):
            return [plain(item, depth + 1) for item in value]
        fields = fields_of(value)
        if fields:
            return {name: plain(item, depth + 1) for name, item in fields.items()}
    return type(value).__name__
