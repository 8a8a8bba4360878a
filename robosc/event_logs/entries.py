"""Content that was read from an event log."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

Document = Mapping[str, Any]
"""An entry as it stands in the log."""


@dataclass(frozen=True, slots=True)
class LogEntry:
    """One line of a log.

    Attributes:
        line: Its number in the file, from 1.
        time_s: Time, in seconds since 1970-01-01 UTC.
        kind: `event`, `blocked`, `fault` and so on: see `robosc.execution.runtime.event_log`.
        event: The event that it is about; empty if it is about none.
        is_controllable: True if the controller took the event by itself.
        document: The whole entry as it is in the log. It must not be changed, because entries share equal parts.
    """

    line: int
    time_s: float
    kind: str
    event: str
    is_controllable: bool
    document: Document

    @property
    def data(self) -> Any:
        """Data that came or went with the event, or None."""
        return self.document.get("data")

    @property
    def state(self) -> Mapping[str, Mapping[str, Any]]:
        """State and variables of each component with a behaviour after the event."""
        found: Mapping[str, Mapping[str, Any]] = self.document.get("state", {})
        return found

    def text(self, field: str) -> str:
        """A field that is a text (`what`, `why`, `identifier`); empty if there is none."""
        value = self.document.get(field)
        return value if isinstance(value, str) else ""


@dataclass(frozen=True, slots=True)
class LoggedRun:
    """A log.

    Attributes:
        entries: Its entries in their order.
        dropped: Number of entries that its writer lost, by its own word.
        torn_line: Number of the last line, if it was cut off (the writer ended while it wrote, or writes still); it
            is left out. None: the last line is whole.
    """

    entries: tuple[LogEntry, ...]
    dropped: int = 0
    torn_line: int | None = None

    @property
    def events(self) -> tuple[LogEntry, ...]:
        """The entries of events that happened."""
        return tuple(entry for entry in self.entries if entry.kind == "event")

    @property
    def begin_s(self) -> float:
        """Time of the first entry, in seconds since 1970-01-01 UTC; 0 if there is none."""
        return self.entries[0].time_s if self.entries else 0.0

    def notes(self) -> tuple[str, ...]:
        """Return remarks on how whole the log is, in sentences."""
        return notes_of(self.dropped, self.torn_line)


def notes_of(dropped: int, torn_line: int | None) -> tuple[str, ...]:
    """Return remarks on how whole a log is, in sentences.

    Args:
        dropped: Number of entries that its writer lost.
        torn_line: Number of the last line, if that was cut off, or None.
    """
    found = []
    if dropped:
        found.append(f"the log lacks {dropped} entries that its writer lost")
    if torn_line is not None:
        found.append(f"line {torn_line}, the last one, is cut off and was left out")
    return tuple(found)


def is_ended(stop: str, resumed: str) -> bool:
    """Return True if an entry `resume` ends a stop.

    `scan is back` ends `scan on /scan is stale`, and no other.

    Args:
        stop: Text of the entry `stop`.
        resumed: Text of the entry `resume`.
    """
    # A person who stops it may give a reason that begins with a sensor's name.
    return stop.startswith(f"{resumed.removesuffix(' is back')} on ") and stop.endswith(" is stale")
