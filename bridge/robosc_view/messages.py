"""Messages to the page from a source's reports: updates, and events with the transitions that they took."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from robosc.execution.runtime.event_log import Entry, plain
from robosc.explanation.blocked import RequestAvailability, Requests, StateError
from robosc.pipeline.counter_run import CounterRun
from robosc_view.definition import Robot, definition_text
from robosc_view.reports import EventBatch, LaserScan, Notice, RunReport, Status

if TYPE_CHECKING:
    from robosc.pipeline.manual_run import ManualRun

MAXIMUM_TEXT = 300
"""Characters of an entry's text."""

MAXIMUM_NAME = 600
"""Characters of an entry's kind or event."""

NOT_EXECUTED = "nothing is executed now"
NOT_KNOWN = "the executor does not allow it; why is not known here"

_MAXIMUM_DEPTH = 20
"""Maximum depth of the values in an entry; deeper ones are not reported."""

_WORDS = ("identifier", "action", "what")
_SHOWN_APART = ("time", "kind", "event", "controllable", "state", "decision_us", "transitions")


class PreparedRobot:
    """Data that is computed once for a robot, since it takes time: laid out graphs, and the judge of its requests.

    Args:
        robot: Robot as the source defines it.

    Attributes:
        robot: Robot as the source defines it.
        text: The message `definition`.
        requests: Judge of its requests; None: the supervisor is not known.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.text = definition_text(robot)
        made = robot.supervisor
        self.requests = None if made is None else Requests(made.executable, made.added)


class MessageBuilder:
    """Builder of the messages about one robot.

    Args:
        prepared: Robot, prepared for it.
    """

    def __init__(self, prepared: PreparedRobot) -> None:
        self._robot = prepared.robot
        self._requests = prepared.requests
        self._available: tuple[Any, Any, RequestAvailability | str] | None = None
        self._tracker = TransitionTracker(prepared.robot)
        self._number = 0

    def update(self, status: Status, number: int, age_s: float) -> str:
        """Return the message `update`.

        Args:
            status: Status of the robot.
            number: Number of the message.
            age_s: Age of the status, in seconds.
        """
        enabled, disabled, warnings = self._permitted(status)
        drive = status.drive
        message = {
            "type": "update",
            "number": number,
            "time_s": status.time_s,
            "state": status.state,
            "problem": status.problem,
            "reasons": [_notice(item) for item in status.reasons],
            "warnings": [_notice(item) for item in (*status.warnings, *warnings)],
            "stops": list(status.stops),
            "devices": dict(status.devices),
            "components": plain(dict(status.components)),
            "communications": dict(status.communications),
            "cancelling": list(status.cancelling),
            "enabled": enabled,
            "disabled": disabled,
            "drive": None
            if drive is None
            else {
                "pose": [_number(value) for value in drive.pose],
                "linear_m_s": _number(drive.linear_m_s),
                "angular_rad_s": _number(drive.angular_rad_s),
                "battery_v": None if drive.battery_v is None else _number(drive.battery_v),
                "is_torque_on": drive.is_torque_on,
            },
            "age_s": round(age_s, 3),
            "last": None if status.last is None else dict(status.last),
            "progress": None if status.progress is None else status.progress.plain(),
            "latencies": [[name, *(round(one_ms, 1) for one_ms in times_ms)] for name, *times_ms in status.latencies],
        }
        return _text(message)

    def entries(self, batch: EventBatch, first: int | None = None) -> list[str]:
        """Return entries of the event log, each as a JSON text for the message `events`.

        Args:
            batch: Entries that happened.
            first: Number of its first entry; None: the next one.
        """
        if first is not None:
            self._number = first - 1
        elif batch.lost:
            self._number += batch.lost
            self._tracker.forget()
        return [self._entry(entry) for entry in batch.entries]

    def begin(self, components: Mapping[str, Any]) -> None:
        """Take the known state in which the next entries begin."""
        self._tracker.begin(components)

    def _entry(self, entry: Entry) -> str:
        self._number += 1
        return _text(
            {
                "number": self._number,
                "time_s": _time(entry),
                "kind": str(entry.get("kind"))[:MAXIMUM_NAME],
                "event": str(entry.get("event", ""))[:MAXIMUM_NAME],
                "controllable": entry.get("controllable") is True,
                "text": entry_text(entry),
                "transitions": [{"component": name, "id": number} for name, number in self._tracker.of(entry)],
            }
        )

    def _permitted(self, status: Status) -> tuple[list[str], list[dict[str, Any]], list[Notice]]:
        """Return the events that may be requested, those that may not and why, and any notices about that."""
        events = self._robot.requests
        if not status.components:
            # A robot without any behaviour has no components to show, executed or not.
            has_behaviour = any(item.behaviour for item in self._robot.shape.components)
            if has_behaviour:
                return [], [{"event": event, "why": [NOT_EXECUTED]} for event in events], []
        available = self._availability(status)
        if isinstance(available, str):
            warnings = [Notice("STATE_UNKNOWN", available)] if available else []
            known = None if status.enabled is None else {f"{name}.request" for name in status.enabled}
            if known is None:
                return [], [], warnings
            why = {event: [NOT_KNOWN] for event in events}
        else:
            enabled = available.enabled if status.enabled is None else [f"{name}.request" for name in status.enabled]
            known = set(enabled)
            why = {item.event: list(item.why) for item in available.blocked}
            if status.enabled is not None:
                why = {event: why.get(event) or [NOT_KNOWN] for event in events}
            warnings = []
        disabled = [{"event": event, "why": why[event]} for event in events if event not in known and event in why]
        return [event for event in events if event in known], disabled, warnings

    def _availability(self, status: Status) -> RequestAvailability | str:
        """The requests judged; or why they cannot be, which is empty where the supervisor is unknown."""
        if self._requests is None:
            return ""
        state = status.components, status.communications
        if self._available is None or (self._available[0], self._available[1]) != state:
            try:
                found: RequestAvailability | str = self._requests.availability(*state)
            except StateError as error:
                found = f"The model is not that of this robot: {error}."
            self._available = (*state, found)
        return self._available[2]


class TransitionTracker:
    """Transitions that an event takes: those of the states that its components were in before it.

    The states before it may not be known: then the state after the event decides, where it can only come from one
    state.

    Args:
        robot: Robot as the source defines it.
    """

    def __init__(self, robot: Robot) -> None:
        self._table = robot.table
        self._next = {
            (component.name, transition.id): transition.next
            for component in robot.shape.components
            if component.behaviour
            for state in component.behaviour.states
            for transition in state.transitions
        }
        self._component = {number: name for name, number in self._next}
        self._initial = {
            component.name: next((state.name for state in component.behaviour.states if state.initial), None)
            for component in robot.shape.components
            if component.behaviour
        }
        self._before: Mapping[str, str | None] = {}

    def forget(self) -> None:
        """Forget the state, which is no longer known."""
        self._before = {}

    def begin(self, components: Mapping[str, Any]) -> None:
        """Set the state; an empty one is the initial state."""
        self._before = _states(components) or dict(self._initial)

    def of(self, entry: Mapping[str, Any]) -> Iterator[tuple[str, int]]:
        """Return the components and numbers of the transitions of an entry."""
        kind = entry.get("kind")
        if "transitions" in entry:
            # Numbers come with the entry only from the bridge's own sources; in a log they may be anything.
            numbers = entry["transitions"]
            for number in numbers if isinstance(numbers, list | tuple) else ():
                if isinstance(number, int) and number in self._component:
                    yield self._component[number], number
        elif kind == "restart":
            self._before = dict(self._initial)
        elif kind == "state":
            # A run has ended or begun.
            self.forget()
        elif kind == "event":
            after = _states(entry.get("state"))
            for component, numbers in self._table.get(str(entry.get("event")), {}).items():
                number = self._transition_number(component, numbers, after.get(component))
                if number is not None:
                    yield component, number
            self._before = after

    def _transition_number(self, component: str, numbers: Mapping[str, int], after: str | None) -> int | None:
        number = numbers.get(self._before.get(component) or "")
        if number is not None and self._next.get((component, number)) == after:
            return number
        if number is None and component in self._before:
            return None  # It was in a state where the event changes nothing.
        fitting = {item for item in numbers.values() if self._next.get((component, item)) == after}
        return fitting.pop() if len(fitting) == 1 else None


def _states(components: Any) -> dict[str, str | None]:
    if not isinstance(components, Mapping):
        return {}
    return {name: part.get("state") for name, part in components.items() if isinstance(part, Mapping)}


def entry_text(entry: Entry) -> str:
    """Return the text of an entry beside its event, for a person."""
    words = [_word(entry[name]) for name in _WORDS if name in entry]
    rest = {name: value for name, value in entry.items() if name not in (*_SHOWN_APART, *_WORDS)}
    words += [
        _word(value) if name == "data" else f"{name}: {_word(value)}"
        for name, value in sorted(rest.items())
        if value not in (None, {}, [])
    ]
    text = "; ".join(words)
    return text if len(text) <= MAXIMUM_TEXT else f"{text[: MAXIMUM_TEXT - 4]} ..."


def _word(value: Any, depth: int = 0) -> str:
    if depth > _MAXIMUM_DEPTH:
        return "..."
    if isinstance(value, str):
        return value[: MAXIMUM_TEXT + 1]
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, dict):
        items = list(value.items())[:20]
        return ", ".join(f"{str(name)[:MAXIMUM_TEXT]} = {_word(item, depth + 1)}" for name, item in items)
    if isinstance(value, Sequence):
        return ", ".join(_word(item, depth + 1) for item in value[:20]) + (", ..." if len(value) > 20 else "")
    return str(plain(value))


def scan_text(scan: LaserScan) -> str:
    """Return the message `scan`."""
    ranges = [round(value, 3) if math.isfinite(value) else None for value in scan.ranges_m]
    pose = None if scan.pose is None else [_number(value) for value in scan.pose]
    return _text({"type": "scan", "ranges_m": ranges, "pose": pose})


def events_text(entries: Sequence[str], lost: int) -> str:
    """Return the message `events` for entries that `MessageBuilder.entries` has made."""
    return f'{{"type":"events","entries":[{",".join(entries)}],"lost":{lost}}}'


def position_text(time_s: float, speed: float, *, is_playing: bool) -> str:
    """Return the message `position`."""
    return _text({"type": "position", "time_s": time_s, "is_playing": is_playing, "speed": speed})


def run_text(run: "ManualRun", entries: int, report: RunReport, beginning: int = 0) -> str:
    """Return the message `run`: the possible events of a run that is stepped by hand, and what was just done.

    Args:
        run: The run.
        entries: Number of its entries in the event log.
        report: Report of what was done.
        beginning: Number of the state that it has begun in, among those that the definition lists.
    """
    blocked = run.blocked()
    undone = run.undone
    opposition = None
    if isinstance(run, CounterRun):
        # In the order of the goals and missions of the definition.
        goals = ["true" if is_true else "not yet" for is_true in run.reached]
        missions = [item.words for item in run.missions]
        opposition = {
            "goals": [*goals, *missions],
            "denied": run.denied,
            "denied_next": list(run.denied_next),
            "assumptions": list(run.came_true),
        }
    return _text(
        {
            "type": "run",
            "entries": entries,
            "steps": len(run),
            "undo": run.history[-1].event if len(run) else "",
            "redo": undone[0].event if undone else "",
            "is_marked": run.is_marked,
            "blocked": {event: list(why) for event, why in blocked.items()},
            "kind": report.kind,
            "lines": list(report.lines),
            "choice": None if report.choice is None else asdict(report.choice),
            "beginning": beginning,
            "opposition": opposition,
            "ends": [] if isinstance(run, CounterRun) else [_ends(run, action) for action in run.cancelling],
        }
    )


def _ends(run: "ManualRun", action: str) -> dict[str, Any]:
    """Return the ends that the goal of an action can have that is being cancelled, each with its event."""
    cancel, error = f"{action}.cancel", f"{action}.error"
    ended = cancel if cancel in run.enabled else error
    ways = [["as cancelled", ended], ["succeeded in spite of it", f"{action}.response"], ["with an error", error]]
    return {"action": action, "ways": ways}


def saved_text(name: str, text: str) -> str:
    """Return the message `saved`: a file for the page that requested it."""
    return _text({"type": "saved", "name": name, "text": text})


def refused_text(what: str, why: str) -> str:
    """Return the message `refused`."""
    return _text({"type": "refused", "what": what, "why": why})


def done_text(what: str) -> str:
    """Return the message `done`."""
    return _text({"type": "done", "what": what})


def source_lost_text(why: str) -> str:
    """Return the message `gone`."""
    return _text({"type": "gone", "why": why})


def _text(message: Mapping[str, Any]) -> str:
    return json.dumps(message, allow_nan=False, separators=(",", ":"))


def _notice(item: Notice) -> dict[str, Any]:
    return {"code": item.code, "text": item.text, "holds_until_reset": item.holds_until_reset}


def _number(value: float) -> float | None:
    return round(value, 4) if math.isfinite(value) else None


def _time(entry: Entry) -> float:
    time_s = entry.get("time")
    return float(time_s) if isinstance(time_s, int | float) and math.isfinite(time_s) else 0.0
