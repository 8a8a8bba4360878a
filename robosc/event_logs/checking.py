"""Check whether the events that a log reports could have happened under a supervisor.

The events are replayed from the initial state on the automata. Each request must be allowed in the state before it, by
plants, ranges, requirements and the conditions of the supervisor. Each other event must be possible, and each logged
state must be the state that the events lead to. Resets, cancels and tau transitions are logged like other events. A
request is wrong if an enabled reset or tau was not taken before it, because the executor takes these first. After a
violation, the replay continues from the logged state.

The cancel of a goal is an event when the goal has ended. Earlier versions logged it when it was asked for, without an
entry `cancelling`, and possibly with an unexpected response after it: both kinds of logs are right.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass

from robosc.errors import RoboscError
from robosc.event_logs.data import is_provided
from robosc.event_logs.entries import LogEntry, LoggedRun, is_ended
from robosc.event_logs.replay import Replay, part
from robosc.model.structure import CommunicationKind, Deployment, EventKind
from robosc.supervisor import Supervisor

MAXIMUM_VIOLATIONS = 1000
"""Violations that are reported one by one: more are only counted."""

KINDS = frozenset(
    (
        *("event", "unexpected", "unknown", "release", "blocked", "fault", "stop", "resume", "restart", "dropped"),
        *("reached", "approach", "owed", "met", "limited", "cancelling", "cancel_overdue"),
    )
)
"""Kinds of entries."""

_FAULT = "a fault"
_KINDS_SHOWN = 5
_KIND_SHOWN = 40
_DATA_SHOWN = 120


class WrongDeploymentError(RoboscError):
    """The supervisor was made for another deployment than the run's."""


@dataclass(frozen=True, slots=True)
class Violation:
    """A deviation of a log from its supervisor.

    Attributes:
        line: The line of the log.
        time_s: Time, in seconds since 1970-01-01 UTC.
        sentence: Description of what is wrong.
    """

    line: int
    time_s: float
    sentence: str


@dataclass(frozen=True, slots=True)
class LogCheck:
    """Result of the check of a log.

    Attributes:
        violations: Violations in the order of the log; at most `MAXIMUM_VIOLATIONS`.
        violation_count: Number of violations in all.
        events: Number of events that were replayed.
        requests: Number of requests among them.
        blocked: Number of requests that a supervision layer held back.
        unjudged: Number of those that were held back for a reason that no state shows: a NaN in the message, a sensor
            that was awaited.
        restarts: Number of times that the model began again.
        notes: Remarks on how whole the log is: after entries that were lost, much that looks wrong may have been
            right.
    """

    violations: tuple[Violation, ...]
    violation_count: int
    events: int
    requests: int
    blocked: int
    unjudged: int
    restarts: int
    notes: tuple[str, ...]

    @property
    def has_passed(self) -> bool:
        """True if something was checked, and nothing is wrong."""
        return self.violation_count == 0 and self.events > 0


def check_log(run: LoggedRun, supervisor: Supervisor, deployment: Deployment | None = None) -> LogCheck:
    """Check a log against the supervisor that it should be of.

    Args:
        run: The log.
        supervisor: The supervisor; believed.
        deployment: Deployment in which it stood; None: the one that it was made for.

    Raises:
        WrongDeploymentError: It was made for another deployment, and its model has actions.
        UnsupportedModelError: Its automata cannot be replayed: received data has infinitely many values.
    """
    deployment = supervisor.deployment if deployment is None else Deployment(deployment)
    has_actions = any(item.kind is CommunicationKind.ACTION for item in supervisor.model.communications)
    if has_actions and supervisor.deployment is not deployment:
        raise WrongDeploymentError(
            f"the supervisor was made for the deployment {supervisor.deployment}, not {deployment}, and its model has "
            "actions"
        )
    checking = _Checking(Replay(supervisor, deployment), deployment)
    for entry in run.entries:
        checking.take(entry)
    return checking.result(run)


def _data_text(data: object) -> str:
    text = json.dumps(data, default=str)
    return text if len(text) <= _DATA_SHOWN else text[: _DATA_SHOWN - 4] + " ..."


class _Checking:
    """One log while it is checked."""

    def __init__(self, replay: Replay, deployment: Deployment) -> None:
        self._replay = replay
        self._deployment = deployment
        self._violations: list[Violation] = []
        self._count = 0
        self._events = self._requests = self._blocked = self._unjudged = self._restarts = 0
        # Reasons that keep the robot at rest, by the texts of the log.
        self._stops: set[str] = set()
        # Actions that were requested: their goals may be under way for longer than the model knows.
        self._requested: set[str] = set()
        model = replay.model
        # Identifiers whose first message must come before any request. Not checked after a restart: a log does not
        # record every message of a later run.
        self._awaited = {item.identifier for item in model.communications if item.max_age is not None}
        self._identifiers = {event: item.identifier for item in model.communications for event in item.events}
        self._actions = {item.name for item in model.communications if item.kind is CommunicationKind.ACTION}
        self._unknown_kinds: set[str] = set()
        self._others = 0

    def result(self, run: LoggedRun) -> LogCheck:
        return LogCheck(
            violations=tuple(self._violations),
            violation_count=self._count,
            events=self._events,
            requests=self._requests,
            blocked=self._blocked,
            unjudged=self._unjudged,
            restarts=self._restarts,
            notes=(*run.notes(), *self._notes()),
        )

    def _notes(self) -> Iterator[str]:
        if not self._events:
            yield "the log contains no events; nothing was checked"
        if self._others:
            kinds = sorted(self._unknown_kinds)
            shown = ", ".join(repr(kind[:_KIND_SHOWN]) for kind in kinds[:_KINDS_SHOWN])
            more = ", ..." if len(kinds) > _KINDS_SHOWN else ""
            yield f"{self._others} lines are of an unknown kind and were not checked: {shown}{more}"

    def take(self, entry: LogEntry) -> None:
        if entry.kind not in KINDS:
            self._others += 1
            self._unknown_kinds.add(entry.kind)
        match entry.kind:
            case "event":
                self._event(entry)
            case "unexpected" if entry.event:
                self._unexpected(entry)
                self._note_arrival(entry.event)
            case "unknown":
                self._note_arrival(entry.event)
            case "blocked":
                self._held_back(entry)
            case "cancelling" | "cancel_overdue":
                self._cancelled(entry)
            case "restart":
                self._restarts += 1
                self._replay.restart()
                self._stops.clear()
                self._awaited.clear()
            case "fault":
                self._stops.add(_FAULT)
            case "stop":
                self._stops.add(entry.text("what"))
            case "resume":
                self._stops = {item for item in self._stops if not is_ended(item, entry.text("what"))}

    def _event(self, entry: LogEntry) -> None:
        replay, event = self._replay, entry.event
        self._events += 1
        if not replay.has(event):
            self._wrong(entry, f"{event} is not an event of the model")
            return
        problems: list[str] = []
        name, _, kind = event.rpartition(".")
        if kind == EventKind.REQUEST:
            self._requests += 1
            self._requested.add(name)
            if self._stops:
                problems.append(f"{event} happened while the robot was to be at rest: {'; '.join(sorted(self._stops))}")
            pending = replay.pending()
            if pending is not None:
                problems.append(f"{event} happened although {pending} was still to be taken before any request")
            if self._awaited:
                problems.append(f"{event} happened before the first message on {', '.join(sorted(self._awaited))}")
        self._note_arrival(event)
        if kind != EventKind.CANCEL and entry.is_controllable is not replay.is_controllable(event):
            # A cancel is the caller's or the layer's own; both stand in the log of a layer.
            what = "controllable" if entry.is_controllable else "uncontrollable"
            problems.append(f"{event} is logged as {what}")
        why = replay.refusal(event) if replay.is_controllable(event) else ""
        if why:
            problems.append(f"{event} was not allowed: {why}")
        elif kind == EventKind.REQUEST and self._deployment is Deployment.CONTROLLER:
            problems += self._provided_otherwise(event, entry.data)
        elif kind == EventKind.REQUEST:
            problems += self._outside(event, entry.data)
        if why and not replay.is_possible(event):
            replay.adopt(event, entry.state)
        else:
            problems += replay.step(event, entry.data, entry.state)
        if problems:
            self._wrong(entry, "; ".join(problems))

    def _note_arrival(self, event: str) -> None:
        """Note that an event has come, whether the state could accept it or not."""
        if self._awaited and event in self._identifiers:
            self._awaited.discard(self._identifiers[event])

    def _provided_otherwise(self, event: str, data: object) -> Iterator[str]:
        """Yield the faults in the data of a controller's request. A layer passes on what it was given."""
        is_known, provided = self._replay.provided(event)
        if not is_known:
            yield f"{event} happened although the data that the model provides for it was not known"
        elif not is_provided(data, provided):
            yield f"{event} carries {_data_text(data)}, where the model provides {_data_text(provided)}"

    def _outside(self, event: str, data: object) -> Iterator[str]:
        """Yield the numbers of a layer's request that are outside a limit."""
        for path, low, high in self._replay.limits(event):
            value = part(data, path)
            if isinstance(value, int | float) and not low <= value <= high:
                name = ".".join(path) or "its number"
                yield f"{event} went through with {name} = {value}, which a limit keeps within {low}..{high}"

    def _unexpected(self, entry: LogEntry) -> None:
        if self._replay.has(entry.event) and self._replay.is_possible(entry.event):
            self._wrong(entry, f"{entry.event} is logged as unexpected, but could happen")

    def _cancelled(self, entry: LogEntry) -> None:
        """Check whether there can be a goal whose cancel was asked for."""
        action = entry.text("action")
        if action not in self._actions:
            self._wrong(entry, f"'{action[:_KIND_SHOWN]}' is not an action of the model")
        elif action not in self._requested:
            self._wrong(entry, f"the cancel of a goal of {action} was asked for, but {action}.request never happened")

    def _held_back(self, entry: LogEntry) -> None:
        """Check whether a layer held a request back with reason."""
        self._blocked += 1
        identifier, why = entry.text("identifier"), entry.text("why")
        if self._deployment is Deployment.CONTROLLER:
            self._wrong(entry, "a controller holds back nothing, as a layer does")
            return
        candidates = self._replay.requests.get(identifier, ())
        if not candidates:
            self._wrong(entry, f"a request on {identifier} was held back, but the model has none there")
            return
        names = ", ".join(f"{item.name}.request" for item in candidates)
        match why:
            case "not allowed now":
                # The log does not say which of several messages it was: one forbidden message is reason enough.
                if not any(self._replay.refusal(f"{item.name}.request") for item in candidates):
                    self._wrong(entry, f"a request on {identifier} was held back, but {names} was allowed")
            case "stopped":
                if not self._stops:
                    self._wrong(entry, f"a request on {identifier} was held back as stopped, but nothing stopped it")
            case "its last goal may still be under way":
                if not any(item.name in self._requested for item in candidates):
                    self._wrong(entry, f"a request on {identifier} was held back, but {names} never happened before")
            case _:
                self._unjudged += 1

    def _wrong(self, entry: LogEntry, sentence: str) -> None:
        self._count += 1
        if len(self._violations) < MAXIMUM_VIOLATIONS:
            self._violations.append(Violation(entry.line, entry.time_s, sentence))
