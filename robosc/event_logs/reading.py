"""Reader of event logs. Logs are untrusted: every size is bounded, and errors are reported with their lines."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, Protocol

from robosc.errors import RoboscError
from robosc.event_logs.entries import LogEntry, LoggedRun

if TYPE_CHECKING:
    from typing_extensions import TypeIs

MAXIMUM_BYTES = 1 << 29
"""Size of a file beyond which it is not read."""

MAXIMUM_LINE_BYTES = 1 << 20
"""The longest entry: the state of a robot with thousands of components."""

MAXIMUM_ENTRIES = 1_000_000
"""A day of ten events a second."""

MAXIMUM_TIME_S = 1e12
"""The latest time: a log of the year 33658 is none."""

_MAXIMUM_NAME = 600
"""Characters of an event's name: two identifiers of 255 and more."""


class LogError(RoboscError):
    """A file is no event log, or too large a one; the message names the line."""


def read_log(path: str | Path) -> LoggedRun:
    """Read a log (JSON Lines).

    A last line that is cut off is left out and reported. The same holds for lines that a full disk cut off: the writer
    has counted them as dropped.

    Args:
        path: The file; no pipe or device, which might never end.

    Raises:
        LogError: It is no event log, or too large.
        OSError: It cannot be read.
    """
    reader = LogReader(path)
    entries = tuple(reader)
    return LoggedRun(entries, reader.dropped, reader.torn_line)


class LogReader:
    """Reader of a log (JSON Lines), entry by entry: a long one takes no room. It may be gone through again.

    Args:
        path: The file; no pipe or device, which might never end.

    Attributes:
        dropped: Number of entries that the writer of the log lost, by its own word; known at the end.
        torn_line: Number of the last line, if it is cut off, or None; known at the end.

    Raises:
        LogError: It is no event log, or too large: when it is made, and while it is gone through.
        OSError: It cannot be read.
    """

    def __init__(self, path: str | Path) -> None:
        self._file = Path(path)
        self.dropped = 0
        self.torn_line: int | None = None
        if self._file.exists() and not (self._file.is_file() or self._file.is_dir()):
            # A pipe would not even open before its writer does.
            raise LogError(f"{path} is not a plain file")

    def __iter__(self) -> Iterator[LogEntry]:
        with self._file.open("rb") as stream:
            size = self._file.stat().st_size
            if size > MAXIMUM_BYTES:
                raise LogError(f"{self._file} has {size} bytes; a log of more than {MAXIMUM_BYTES} is not read")
            reading = _Reading(str(self._file))
            yield from reading.entries(stream)
            self.dropped, self.torn_line = reading.dropped, reading.torn_line


class LineStream(Protocol):
    """A file or pipe that is read line by line, in bytes."""

    def readline(self, size: int, /) -> bytes:
        """Return the next line, or at most so much of it; nothing at the end."""


def read_log_stream(stream: LineStream, name: str) -> LoggedRun:
    """Read a log, as `read_log` does, from something that is open; it waits for the end of a pipe.

    Args:
        stream: The log, at its beginning.
        name: Name of the log, for messages.

    Raises:
        LogError: It is no event log, or too large.
        OSError: It cannot be read.
    """
    reading = _Reading(name)
    entries = tuple(reading.entries(stream))
    return LoggedRun(entries, reading.dropped, reading.torn_line)


class _Reading:
    """One log while it is read."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._has_entries = False
        self._torn: list[tuple[int, str]] = []
        self._state: Mapping[str, Any] = {}
        self.dropped = 0
        self.torn_line: int | None = None

    def entries(self, stream: LineStream) -> Iterator[LogEntry]:
        number, is_ended, read_bytes = 0, True, 0
        while content := stream.readline(MAXIMUM_LINE_BYTES + 1):
            number += 1
            read_bytes += len(content)
            is_ended = content.endswith(b"\n")
            if len(content) > MAXIMUM_LINE_BYTES:
                self._refuse(number, f"longer than {MAXIMUM_LINE_BYTES} bytes")
            if read_bytes > MAXIMUM_BYTES or number > MAXIMUM_ENTRIES:
                # It may also have grown since its size was looked up.
                self._refuse(number, f"a log of more than {MAXIMUM_ENTRIES} lines is not read")
            entry = self._read_entry(number, content)
            if entry is not None:
                self._has_entries = True
                yield entry
        if self._torn and self._torn[-1][0] == number and not is_ended:
            self.torn_line = self._torn.pop()[0]
        if len(self._torn) > self.dropped:
            self._refuse(*self._torn[0])

    def _read_entry(self, number: int, content: bytes) -> LogEntry | None:
        if not content.strip():
            return None
        try:
            document = json.loads(content.decode("utf-8"), parse_constant=_refuse_constant)
        except RecursionError:
            self._refuse(number, "nested too deeply")
        except ValueError as error:
            if not (self._has_entries or content.startswith(b"{")):
                self._refuse(number, "no entry of an event log")
            self._torn.append((number, f"no JSON: {str(error)[:200]}"))
            return None
        if not isinstance(document, dict):
            self._refuse(number, "no JSON object")
        return self._entry(number, document)

    def _entry(self, number: int, document: dict[str, Any]) -> LogEntry:
        time_s, kind = document.get("time"), document.get("kind")
        if not _is_time(time_s):
            self._refuse(number, "its 'time' is not a number of seconds")
        if not _is_name(kind) or not kind:
            self._refuse(number, "it has no 'kind'")
        event = document.get("event", "")
        if not _is_name(event) or (kind == "event" and not event):
            self._refuse(number, "its 'event' is not an event's name")
        what = document.get("what", "")
        if isinstance(what, str) and not _is_text(what):
            self._refuse(number, "its 'what' is not a text that can be shown")
        is_controllable = document.get("controllable", False)
        if not isinstance(is_controllable, bool):
            self._refuse(number, "its 'controllable' is neither true nor false")
        if kind == "event":
            document["state"] = self._shared_state(number, document.get("state"))
        if kind == "dropped":
            count = document.get("count")
            if not isinstance(count, int) or isinstance(count, bool) or count < 0:
                self._refuse(number, "its 'count' is not a number of entries")
            self.dropped += count
        return LogEntry(number, float(time_s), kind, event, is_controllable, document)

    def _shared_state(self, number: int, state: object) -> Mapping[str, Any]:
        """The state of an entry; components that did not change are those of the entry before, to save room."""
        if not isinstance(state, dict):
            self._refuse(number, "it has no 'state'")
        for name, part in state.items():
            before = self._state.get(name)
            if before is not None and part == before:
                # Equal in Python, but 1, 1.0 and true are different values of a variable.
                if repr(part) == repr(before):
                    state[name] = before
            elif not _is_component(part):
                self._refuse(number, f"the state of '{name[:_MAXIMUM_NAME]}' is not a state with variables")
        self._state = state
        return state

    def _refuse(self, number: int, why: str) -> NoReturn:
        raise LogError(f"{self._name}, line {number}: {why}")


def _is_time(value: object) -> "TypeIs[int | float]":
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return abs(value) <= MAXIMUM_TIME_S


def _is_name(value: object) -> "TypeIs[str]":
    return isinstance(value, str) and len(value) <= _MAXIMUM_NAME and value.isprintable()


def _is_text(value: str) -> bool:
    """Return True if a text can be drawn: no half of a UTF-16 character, no control character but white space."""
    return all(char.isprintable() or char.isspace() for char in value)


def _is_component(part: object) -> bool:
    return isinstance(part, dict) and isinstance(part.get("state"), str) and isinstance(part.get("variables"), dict)


def _refuse_constant(text: str) -> NoReturn:
    raise ValueError(f"{text} is not a JSON number")
