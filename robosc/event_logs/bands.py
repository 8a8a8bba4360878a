"""States and values over time: bands of a state or a text, curves of numbers, for plots of event logs."""

import math
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import Any

from robosc.errors import RoboscError
from robosc.event_logs.entries import LoggedRun
from robosc.event_logs.values import Kind, as_kind, common_kind, kind_of, leaves, text_of
from robosc.motion_record import Motion

MAXIMUM_BANDS = 30
"""Bands that a picture can hold: of more, those that change most often are shown."""

MAXIMUM_CURVES = 12


class PlotError(RoboscError):
    """The log has no part that can be drawn as asked."""


@dataclass(frozen=True, slots=True)
class Span:
    """Time during which a state or value holds.

    Attributes:
        begin_s: Its begin, in seconds since the begin of the log.
        end_s: Its end.
        text: The state or value.
    """

    begin_s: float
    end_s: float
    text: str


@dataclass(frozen=True, slots=True)
class Band:
    """States of a component, or values of a variable that is no number.

    Attributes:
        name: `Component`, or `Component.variable`.
        spans: Spans in the order of time; between two of them there is a gap where the model began again.
    """

    name: str
    spans: tuple[Span, ...]

    @property
    def texts(self) -> tuple[str, ...]:
        """Its states or values, each once, in the order in which they first come."""
        return tuple(dict.fromkeys(span.text for span in self.spans))

    def thinned(self, begin_s: float, end_s: float, places: int) -> "Band":
        """The band with at most one span, the longest of those that begin there, in each of so many places."""
        if len(self.spans) <= places:
            return self
        width_s = (end_s - begin_s) / places or 1.0
        kept: dict[int, Span] = {}
        for span in self.spans:
            place = min(int((span.begin_s - begin_s) / width_s), places - 1)
            before = kept.get(place)
            if before is None or span.end_s - span.begin_s > before.end_s - before.begin_s:
                kept[place] = span
        return Band(self.name, tuple(kept[place] for place in sorted(kept)))


@dataclass(frozen=True, slots=True)
class Curve:
    """Values of a variable that is a number: each holds until the next one.

    Attributes:
        name: `Component.variable`.
        times_s: Times at which it takes a value, in seconds since the begin of the log, and the end.
        values: The values; NaN where the model began again.
    """

    name: str
    times_s: tuple[float, ...]
    values: tuple[float, ...]

    def thinned(self, begin_s: float, end_s: float, places: int) -> "Curve":
        """The curve with the least and the greatest value, and its last one, in each of so many places."""
        if len(self.times_s) <= 3 * places:
            return self
        width_s = (end_s - begin_s) / places or 1.0
        groups: dict[int, list[int]] = {}
        for number, time_s in enumerate(self.times_s):
            groups.setdefault(int((time_s - begin_s) / width_s), []).append(number)
        kept: set[int] = set()
        for group in groups.values():
            known = [number for number in group if not math.isnan(self.values[number])] or group
            kept |= {min(known, key=self.values.__getitem__), max(known, key=self.values.__getitem__), group[-1]}
        chosen = sorted(kept)
        return Curve(self.name, tuple(self.times_s[n] for n in chosen), tuple(self.values[n] for n in chosen))


def bands_of(run: LoggedRun, begin_s: float, end_s: float) -> tuple[tuple[Band, ...], tuple[str, ...]]:
    """Return the states of all components in a time window, and remarks on what is not shown.

    Args:
        run: The log.
        begin_s: Begin of the window, in seconds since the begin of the log.
        end_s: Its end.
    """
    states = _changes(run, lambda state: ((name, part["state"]) for name, part in state.items()))
    return _chosen([_band(name, samples, begin_s, end_s) for name, samples in states.items()], "components")


def variables_of(
    run: LoggedRun, begin_s: float, end_s: float, patterns: Sequence[str]
) -> tuple[tuple[Band, ...], tuple[Curve, ...], tuple[str, ...]]:
    """Return bands and curves of variables in a time window, and remarks on what is not shown.

    Args:
        run: The log.
        begin_s: Begin of the window, in seconds since the begin of the log.
        end_s: Its end.
        patterns: Names such as `Arm.height`, or patterns such as `Arm.*`; empty: no variable.

    Raises:
        PlotError: A pattern fits no variable.
    """
    if not patterns:
        return (), (), ()

    def values(state: Any) -> Iterator[tuple[str, Any]]:
        for name, part in state.items():
            for path, value in leaves(part.get("variables", {}), (name,)):
                yield ".".join(path), value

    changes = _changes(run, values)
    wanted: set[str] = set()
    for pattern in patterns:
        found = {name for name in changes if name == pattern or fnmatchcase(name, pattern)}
        if not found:
            known = ", ".join(list(changes)[:20]) or "none"
            raise PlotError(f"no variable of the log is called '{pattern}'; there are {known}")
        wanted |= found
    bands, curves = [], []
    for name, samples in changes.items():
        if name in wanted:
            kind = common_kind({kind_of(value) for _, value in samples if value is not None})
            if kind.is_number:
                curves.append(_curve(name, samples, begin_s, end_s))
            else:
                bands.append(_band(name, samples, begin_s, end_s))
    shown, notes = _chosen(bands, "variables")
    if len(curves) > MAXIMUM_CURVES:
        notes += (f"of {len(curves)} numbers the first {MAXIMUM_CURVES} are drawn",)
    return shown, tuple(curves[:MAXIMUM_CURVES]), notes


def on_robots_clock(run: LoggedRun, motion: Motion) -> LoggedRun:
    """Return a log whose times are those of the robot's world, which may pass faster or slower than the computer's.

    Args:
        run: The log.
        motion: Record of the robot's motion, whose samples have both times.

    Raises:
        PlotError: The record has less than two samples.
    """
    samples = motion.samples
    if len(samples) < 2 or samples[0].time >= samples[-1].time:
        raise PlotError("the record of motion is too short to give the robot's time")
    # A clock that was set back would turn time round.
    times = [samples[0].time]
    for sample in samples[1:]:
        times.append(max(times[-1], sample.time))
    first, last = samples[0], samples[-1]
    rate = (last.world_s - first.world_s) / (times[-1] - times[0]) or 1.0

    def world_s(time_s: float) -> float:
        place = bisect_right(times, time_s)
        if place == 0:
            return first.world_s + (time_s - times[0]) * rate
        if place == len(times):
            return last.world_s + (time_s - times[-1]) * rate
        before, after = samples[place - 1], samples[place]
        share = (time_s - times[place - 1]) / (times[place] - times[place - 1])
        return before.world_s + share * (after.world_s - before.world_s)

    return replace(run, entries=tuple(replace(entry, time_s=world_s(entry.time_s)) for entry in run.entries))


def _changes(run: LoggedRun, values: Any) -> dict[str, list[tuple[float, Any]]]:
    """The times at which what has a name takes another value, by name; None: it is not known from then on."""
    found: dict[str, list[tuple[float, Any]]] = {}
    for entry in run.entries:
        time_s = entry.time_s - run.begin_s
        if entry.kind == "restart":
            for samples in found.values():
                samples.append((time_s, None))
        elif entry.kind == "event":
            for name, value in values(entry.state):
                samples = found.setdefault(name, [])
                # Equal in Python, but 1 and true are different values.
                if not samples or samples[-1][1] != value or type(samples[-1][1]) is not type(value):
                    samples.append((time_s, value))
    return found


def _band(name: str, samples: Iterable[tuple[float, Any]], begin_s: float, end_s: float) -> Band:
    spans = (
        Span(max(begin_s, from_s), min(end_s, to_s), text_of(value))
        for from_s, to_s, value in _spans(samples, end_s)
        if value is not None and to_s > begin_s and from_s < end_s
    )
    return Band(name, tuple(span for span in spans if span.end_s > span.begin_s))


def _spans(samples: Iterable[tuple[float, Any]], end_s: float) -> Iterator[tuple[float, float, Any]]:
    """The begin and end of each value, and the value; the last one lasts to the end."""
    waiting: tuple[float, Any] | None = None
    for time_s, value in samples:
        if waiting is not None:
            yield waiting[0], time_s, waiting[1]
        waiting = time_s, value
    if waiting is not None:
        yield waiting[0], max(end_s, waiting[0]), waiting[1]


def _curve(name: str, samples: Iterable[tuple[float, Any]], begin_s: float, end_s: float) -> Curve:
    times_s, values = [], []
    for from_s, to_s, value in _spans(samples, end_s):
        if to_s >= begin_s and from_s <= end_s:
            times_s.append(max(begin_s, from_s))
            values.append(math.nan if value is None else float(as_kind(value, Kind.NUMBER)))
    if times_s:
        times_s.append(end_s)
        values.append(values[-1])
    return Curve(name, tuple(times_s), tuple(values))


def _chosen(bands: Sequence[Band], what: str) -> tuple[tuple[Band, ...], tuple[str, ...]]:
    """The bands that have room, in their order."""
    shown = [band for band in bands if band.spans]
    if len(shown) <= MAXIMUM_BANDS:
        return tuple(shown), ()
    most = set(sorted(range(len(shown)), key=lambda place: (-len(shown[place].spans), place))[:MAXIMUM_BANDS])
    kept = tuple(band for place, band in enumerate(shown) if place in most)
    return kept, (f"of {len(shown)} {what} the {MAXIMUM_BANDS} that change most often are shown",)
