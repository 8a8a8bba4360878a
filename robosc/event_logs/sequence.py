"""Content of a plot of a sequence of events: rows and marks along time; marks that would cover others are left out."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

from robosc.event_logs.bands import Band, Curve, PlotError, bands_of, variables_of
from robosc.event_logs.entries import LogEntry, LoggedRun

MAXIMUM_ROWS = 80
"""Rows that a page can hold: of more, the most frequent are shown."""

MAXIMUM_INTERRUPTIONS = 200

_INTERRUPTIONS = ("fault", "stop", "resume", "restart")
_MAXIMUM_LABEL = 60


@dataclass(frozen=True, slots=True)
class Row:
    """One event.

    Attributes:
        event: Its name.
        is_controllable: True if the controller took it by itself.
        times_s: Times at which it happened, in seconds since the begin of the log.
        lines: Its lines in the log.
    """

    event: str
    is_controllable: bool
    times_s: tuple[float, ...]
    lines: tuple[int, ...]

    @property
    def label(self) -> str:
        """Its name, short enough to stand beside the row."""
        return self.event if len(self.event) <= _MAXIMUM_LABEL else self.event[: _MAXIMUM_LABEL - 1] + "…"

    def thinned(self, begin_s: float, end_s: float, places: int) -> "Row":
        """The row with at most one mark, the first, in each of so many places between two times."""
        if len(self.times_s) <= places:
            return self
        width_s = (end_s - begin_s) / places or 1.0
        kept: dict[int, int] = {}
        for number, time_s in enumerate(self.times_s):
            kept.setdefault(min(int((time_s - begin_s) / width_s), places - 1), number)
        chosen = sorted(kept.values())
        times_s = tuple(self.times_s[number] for number in chosen)
        return Row(self.event, self.is_controllable, times_s, tuple(self.lines[number] for number in chosen))


@dataclass(frozen=True, slots=True)
class Interruption:
    """A fault, a stop, its end, or a restart: a line through all rows."""

    time_s: float
    text: str


@dataclass(frozen=True, slots=True)
class EventSequence:
    """Content of a drawing.

    Attributes:
        rows: Rows from top to bottom, by their first occurrence in the log.
        interruptions: Faults, stops, their ends and restarts.
        begin_s: Begin of the time axis, in seconds since the begin of the log.
        end_s: End of the time axis.
        count: Number of events in it.
        notes: Remarks on what is not shown of what was asked for, in sentences.
        bands: States of components, then variables that are no numbers; they stand above the rows.
        curves: Variables that are numbers; they stand below the rows.
        blocked: Requests that were held back, by identifier; they stand below the events.
        is_robots_time: True if the times are those of the robot's world.
    """

    rows: tuple[Row, ...]
    interruptions: tuple[Interruption, ...]
    begin_s: float
    end_s: float
    count: int
    notes: tuple[str, ...]
    bands: tuple[Band, ...] = ()
    curves: tuple[Curve, ...] = ()
    blocked: tuple[Row, ...] = ()
    is_robots_time: bool = False

    @property
    def axis(self) -> str:
        """The name of the time axis."""
        return f"{'robot’s time' if self.is_robots_time else 'time'} since the begin of the log (s)"

    @property
    def drawn(self) -> int:
        """Number of marks."""
        return sum(len(row.times_s) for row in self.rows)

    def thinned(self, places: int) -> "EventSequence":
        """The same with at most one mark of an event in each of so many places along the time axis."""
        rows = tuple(row.thinned(self.begin_s, self.end_s, places) for row in self.rows)
        left_out = self.drawn - sum(len(row.times_s) for row in rows)
        notes = list(self.notes)
        if left_out:
            note = f"of {self.drawn} events {left_out} are not drawn: they stand where a mark of the same event is"
            notes.append(note)
        bands = tuple(band.thinned(self.begin_s, self.end_s, places) for band in self.bands)
        if any(len(band.spans) < len(whole.spans) for band, whole in zip(bands, self.bands, strict=True)):
            notes.append("of states that change more often than can be seen the longer ones are drawn")
        return replace(
            self,
            rows=rows,
            notes=tuple(notes),
            bands=bands,
            curves=tuple(curve.thinned(self.begin_s, self.end_s, places) for curve in self.curves),
            blocked=tuple(row.thinned(self.begin_s, self.end_s, places) for row in self.blocked),
        )


def sequence_of(
    run: LoggedRun,
    begin_s: float | None = None,
    end_s: float | None = None,
    events: Sequence[str] = (),
    *,
    only_changes: bool = False,
    has_bands: bool = True,
    variables: Sequence[str] = (),
    is_robots_time: bool = False,
) -> EventSequence:
    """Return the events of a log in a time window.

    Args:
        run: The log.
        begin_s: The window's begin, in seconds since the begin of the log; None: the first event or interruption.
        end_s: Its end; None: the last event or interruption.
        events: Names, or patterns such as `*.request`, of the events to show; empty: all.
        only_changes: True if events are left out that say nothing new.
        has_bands: True if the states of components are shown.
        variables: Names, or patterns such as `Arm.*`, of the variables to show; empty: none.
        is_robots_time: True if the times of the log are those of the robot's world.

    Raises:
        PlotError: There is nothing to show.
    """
    if begin_s is not None and end_s is not None and not begin_s < end_s:
        raise PlotError(f"the time window from {begin_s:g} s to {end_s:g} s is empty")
    happened = run.events
    if not happened:
        raise PlotError("the log contains no events")
    chosen = _chosen(_news(happened) if only_changes else happened, events)
    inside = [
        (entry.time_s - run.begin_s, entry)
        for entry in chosen
        if (begin_s is None or entry.time_s - run.begin_s >= begin_s)
        and (end_s is None or entry.time_s - run.begin_s <= end_s)
    ]
    if not inside:
        last_s = max(entry.time_s for entry in chosen) - run.begin_s
        raise PlotError(f"no event in the time window; the last one is at {last_s:.3f} s")
    # A fault that ends a run comes after its last event.
    interrupted = [entry for entry in run.entries if entry.kind in _INTERRUPTIONS]
    held = [(entry.time_s - run.begin_s, entry) for entry in run.entries if entry.kind == "blocked"]
    times_s = [time_s for time_s, _ in inside + held] + [entry.time_s - run.begin_s for entry in interrupted]
    first_s = min(times_s) if begin_s is None else begin_s
    last_s = max(times_s) if end_s is None else end_s
    shown, notes = _most_frequent([entry for _, entry in inside])
    if only_changes:
        notes = ("events that repeat what was known already are left out", *notes)
    interruptions = tuple(
        Interruption(entry.time_s - run.begin_s, f"{entry.kind}: {entry.text('what')}".removesuffix(": ")[:80])
        for entry in interrupted
        if first_s <= entry.time_s - run.begin_s <= last_s
    )
    if len(interruptions) > MAXIMUM_INTERRUPTIONS:
        notes += (f"of {len(interruptions)} faults, stops and restarts the first {MAXIMUM_INTERRUPTIONS} are drawn",)
    bands, band_notes = bands_of(run, first_s, last_s) if has_bands else ((), ())
    values, curves, value_notes = variables_of(run, first_s, last_s, variables)
    blocked = [(time_s, entry) for time_s, entry in held if first_s <= time_s <= last_s]
    return EventSequence(
        rows=_rows(inside, shown),
        interruptions=interruptions[:MAXIMUM_INTERRUPTIONS],
        begin_s=first_s,
        end_s=last_s,
        count=len(inside),
        notes=(*run.notes(), *notes, *band_notes, *value_notes),
        bands=bands + values,
        curves=curves,
        blocked=_blocked(blocked),
        is_robots_time=is_robots_time,
    )


def _blocked(held: Iterable[tuple[float, LogEntry]]) -> tuple[Row, ...]:
    """The requests that were held back, in one row for each identifier."""
    found: dict[str, list[tuple[float, LogEntry]]] = {}
    for time_s, entry in held:
        found.setdefault(entry.text("identifier"), []).append((time_s, entry))
    rows = (
        Row(f"{name} blocked", True, tuple(time_s for time_s, _ in marks), tuple(entry.line for _, entry in marks))
        for name, marks in found.items()
    )
    return tuple(rows)[:MAXIMUM_ROWS]


def _news(happened: Iterable[LogEntry]) -> list[LogEntry]:
    """The events that say something new: they carry other data than the time before, or have changed the state."""
    found: list[LogEntry] = []
    last: dict[str, LogEntry] = {}
    before: LogEntry | None = None
    for entry in happened:
        earlier = last.get(entry.event)
        if earlier is None or before is None or entry.data != earlier.data or entry.state != before.state:
            found.append(entry)
        last[entry.event] = before = entry
    return found


def _chosen(happened: Iterable[LogEntry], patterns: Sequence[str]) -> list[LogEntry]:
    """The entries of the wanted events.

    Raises:
        PlotError: A pattern fits no event of the log.
    """
    happened = list(happened)
    if not patterns:
        return happened
    names = dict.fromkeys(entry.event for entry in happened)
    wanted: set[str] = set()
    for pattern in patterns:
        found = [name for name in names if name == pattern or fnmatchcase(name, pattern)]
        if not found:
            known = ", ".join(list(names)[:20])
            raise PlotError(f"no event of the log is called '{pattern}'; there are {known}")
        wanted.update(found)
    return [entry for entry in happened if entry.event in wanted]


def _most_frequent(entries: list[LogEntry]) -> tuple[set[str], tuple[str, ...]]:
    """The events that get a row, and what is to be said of the others."""
    counts = Counter(entry.event for entry in entries)
    if len(counts) <= MAXIMUM_ROWS:
        return set(counts), ()
    shown = {name for name, _ in counts.most_common(MAXIMUM_ROWS)}
    return shown, (f"of {len(counts)} different events the {MAXIMUM_ROWS} most frequent are shown",)


def _rows(inside: list[tuple[float, LogEntry]], shown: set[str]) -> tuple[Row, ...]:
    found: dict[str, list[tuple[float, LogEntry]]] = {}
    for time_s, entry in inside:
        if entry.event in shown:
            found.setdefault(entry.event, []).append((time_s, entry))
    return tuple(
        Row(
            event=event,
            # A cancel of a layer may be the caller's or its own: the first one decides.
            is_controllable=marks[0][1].is_controllable,
            times_s=tuple(time_s for time_s, _ in marks),
            lines=tuple(entry.line for _, entry in marks),
        )
        for event, marks in found.items()
    )
