"""Replay of a log's entries on a supervisor's automata.

The replay deliberately does not use the executor: possible events and their target states come from the explicit
semantics of the automata (`robosc.automata.Semantics`) and the conditions that synthesis has added. Variables that
synthesis leaves out are computed by the slow evaluator, if the log contains their operands; it does not contain arrays.
"""

from collections.abc import Mapping
from typing import Any

from robosc.automata import ExecutableSystem, Semantics
from robosc.automata.compile import Carried, State
from robosc.automata.state import Subject, subject_domain, subjects
from robosc.event_logs.data import MISFIT, NOT_TOLD, Misfit, NotLogged, Received, is_same, path_text, value_of
from robosc.expressions import DoubleType, IntegerType, PathStep, Value
from robosc.expressions.evaluate import evaluate
from robosc.expressions.values import assignable_double, assignable_integer
from robosc.model.structure import (
    Communication,
    CommunicationKind,
    Deployment,
    EventKind,
    Model,
    ObjectValue,
    ProvidedValue,
    Variable,
)
from robosc.supervisor import Supervisor
from robosc.supervisor.predicates import state_predicates

_WITH_RESET = (CommunicationKind.SERVICE, CommunicationKind.ACTION)
_NAMES_SHOWN = 3


class _NotLoggedError(Exception):
    """A value depends on something that the log leaves out."""


def _assigned(variable: Variable, value: Any) -> Value | None:
    """Return the value that a variable takes, or None if it keeps what it has."""
    found: Value | None
    match variable.type:
        case IntegerType(low=int(low), high=int(high)):
            found = assignable_integer(value, low, high)
        case DoubleType():
            found = assignable_double(value)
        case _:
            found = value
    return found


class Replay:
    """The state that the events so far lead to.

    Args:
        supervisor: Supervisor with its automata, requirements and added conditions.
        deployment: Deployment in which it stood.

    Attributes:
        model: The model.
        requests: The communications that are requested, by identifier.
        state: State of the automata.
        stored: Values of the variables that synthesis leaves out, by component and name.

    Raises:
        UnsupportedModelError: A synthesis variable takes received data with infinitely many values.
    """

    def __init__(self, supervisor: Supervisor, deployment: Deployment) -> None:
        model = self.model = supervisor.model
        self._executable = ExecutableSystem(model, deployment)
        system = self._executable.executed_automata
        self._semantics = Semantics(system)
        self._added = state_predicates(system, supervisor.added)
        self._events = {event.name: event.is_controllable for event in system.events}
        self._subjects = subjects(system)
        self._places = {subject: place for place, subject in enumerate(self._subjects)}
        self._domains = [subject_domain(system, subject) for subject in self._subjects]
        self._inputs = {
            event: tuple((item.path, item.type) for item in system.inputs if item.event == event)
            for event in self._events
        }
        self._behaviours = {item.name: item.behaviour for item in model.components if item.behaviour}
        self._received = Received(model)
        self.requests: Mapping[str, tuple[Communication, ...]] = _requests(model)
        self.state: State = ()
        self.stored: dict[tuple[str, str], Value] = {}
        self.restart()

    def restart(self) -> None:
        """Back to the initial state."""
        self.state = self._semantics.initial
        self.stored = {
            (component, variable.name): _initial(variable)
            for component, behaviour in self._behaviours.items()
            for variable in behaviour.variables
            if not variable.is_synthesis
        }

    # Conditions of the state.

    def has(self, event: str) -> bool:
        """Return True if the model has an event of that name."""
        return event in self._events

    def is_controllable(self, event: str) -> bool:
        """Return True if the supervisor may disable an event."""
        return self._events[event]

    def is_possible(self, event: str) -> bool:
        """Return True if the plants can do an event."""
        if self._events[event]:
            return self._semantics.enabled(self.state, event)
        # Data never blocks what the environment does, and there may be too many choices of it to try them all.
        unknown = tuple((path, None) for path, _ in self._inputs[event])
        return self._semantics.target_with(self.state, event, unknown) is not None

    def refusal(self, event: str) -> str:
        """Return the reason why a controllable event is not allowed now, in words; empty if it is allowed."""
        if not self._semantics.enabled(self.state, event):
            return self._blocked_by(event)
        if not self._semantics.condition(self.state, event):
            return "its requirements do not hold"
        added = self._added.get(event)
        if added is not None and not added(self.state):
            return "what the supervisor adds to its requirements does not hold"
        return ""

    def _blocked_by(self, event: str) -> str:
        found = self._executable.events[event]
        if found.moves and found.communication:
            location = str(self.state[self._places[Subject(found.moves.plant)]])
            if location not in found.moves.targets:
                return f"the {found.communication.kind} is {location}"
        if found.kind in (None, EventKind.REQUEST):
            return "a component has no transition for it in its state, or a variable would leave its range"
        return "the robot cannot do it in this state"

    def pending(self) -> str | None:
        """A silent step that is still to be taken before any request: a reset, or a tau that changes something."""
        for event in self._executable.resets_and_taus:
            if not self.refusal(event):
                (target,) = self._semantics.targets(self.state, event)
                if target != self.state:
                    return event
        return None

    def provided(self, request: str) -> tuple[bool, Any]:
        """The data that the model provides for a request in this state, within its limits: (is known, data)."""
        name, _, _ = request.rpartition(".")
        is_known, data = True, None
        for statement in self.model.provides_for(name):
            if statement.condition is None or self._value(statement.condition, "", None) is True:
                is_known, data = self._provided_value(statement.value)
                break
        limits = self.limits(request) if is_known else ()
        # Where the bounds have a number in common, the one that is found so is within all of them.
        for path, low, high in reversed(limits):
            value = part(data, path) or 0
            if not low <= value <= high:
                data = _with_part(data, path, low if value < low else high)
        return is_known and all(low <= (part(data, path) or 0) <= high for path, low, high in limits), data

    def limits(self, request: str) -> tuple[tuple[tuple[str, ...], float, float], ...]:
        """The bounds of numbers of a request that apply in this state."""
        return tuple(
            (bound.path, bound.low, bound.high)
            for limit in self.model.limits_for(request.rpartition(".")[0])
            if limit.condition is None or self._value(limit.condition, "", None) is not False
            for bound in limit.bounds
        )

    def _provided_value(self, provided: ProvidedValue) -> tuple[bool, Any]:
        if not isinstance(provided, ObjectValue):
            value = self._value(provided, "", None)
            return value is not None, value
        found = {name: self._provided_value(part) for name, part in provided.properties}
        return all(is_known for is_known, _ in found.values()), {name: value for name, (_, value) in found.items()}

    # Steps.

    def step(self, event: str, data: Any, logged: Mapping[str, Mapping[str, Any]]) -> tuple[str, ...]:
        """Take an event, whether it is allowed or not.

        Args:
            event: An event of the model.
            data: Data of the event in the log.
            logged: The state after it by the log: what the log leaves out is taken from there.

        Returns:
            Faults, in sentences: the event is not possible, its data is no such data, or the state after it is
            another one than the logged. The replay goes on from what the log reports, so that nothing is reported
            twice.
        """
        problems: list[str] = []
        target = self._target(event, data, problems)
        if target is None:
            if not problems:
                problems.append(f"{event} cannot happen here: {self._blocked_by(event)}")
            self.adopt(event, logged)
            return tuple(problems)
        unknown = self._store(event, data)
        self.state = target
        for component, name in unknown:
            self._trust(component, name, logged)
        differences = self._differences(logged)
        if differences:
            shown = "; ".join(differences[:_NAMES_SHOWN])
            more = f"; and {len(differences) - _NAMES_SHOWN} more" if len(differences) > _NAMES_SHOWN else ""
            problems.append(f"the state after {event} is not the logged one: {shown}{more}")
        if problems:
            self._trust_all(logged)
        return tuple(problems)

    def _target(self, event: str, data: Any, problems: list[str]) -> State | None:
        found: list[tuple[tuple[PathStep, ...], Value | None]] = []
        for path, type_ in self._inputs[event]:
            # A number outside the declared range would have been moved into it.
            value = self._received.value(event, data, path)
            if value is NOT_TOLD or value_of(value, type_) is MISFIT:
                problems.append(f"{event} carries no {path_text(path)} of the declared type")
                return None
            found.append((path, value))
        given: Carried = tuple(found)
        return self._semantics.target_with(self.state, event, given)

    def adopt(self, event: str, logged: Mapping[str, Mapping[str, Any]]) -> None:
        """An event that is not possible has happened, says the log: its service or action is where that leads."""
        moves = self._executable.events[event].moves
        targets = set(moves.targets.values()) if moves else set()
        if moves and len(targets) == 1:
            self._put(self._places[Subject(moves.plant)], targets.pop())
        self._trust_all(logged)

    def _trust_all(self, logged: Mapping[str, Mapping[str, Any]]) -> None:
        for component, behaviour in self._behaviours.items():
            entry = logged.get(component)
            if entry is not None:
                place = self._places[Subject(component)]
                if entry["state"] in self._domains[place]:
                    self._put(place, entry["state"])
                for variable in behaviour.variables:
                    self._trust(component, variable.name, logged)

    def _trust(self, component: str, name: str, logged: Mapping[str, Mapping[str, Any]]) -> None:
        variable = next(item for item in self._behaviours[component].variables if item.name == name)
        entry = logged.get(component, {}).get("variables", {}).get(name)
        value = value_of(entry, variable.type)
        if value is None or isinstance(value, Misfit):
            return
        if variable.is_synthesis:
            self._put(self._places[Subject(component, name)], value)
        else:
            self.stored[component, name] = value

    def _put(self, place: int, value: Value) -> None:
        self.state = (*self.state[:place], value, *self.state[place + 1 :])

    def _store(self, event: str, data: Any) -> tuple[tuple[str, str], ...]:
        """Update what synthesis leaves out, before the state changes; the variables whose value is not known."""
        new: dict[tuple[str, str], Value] = {}
        unknown: list[tuple[str, str]] = []
        for participant in self._executable.events[event].participants:
            component = participant.component
            taken = participant.taken.get(str(self.state[self._places[Subject(component)]]))
            for update in () if taken is None else taken.updates:
                if (component, update.variable) in self.stored:
                    variable = next(v for v in participant.behaviour.variables if v.name == update.variable)
                    try:
                        value = _assigned(variable, self._value(update.expression, event, data))
                    except _NotLoggedError:
                        unknown.append((component, update.variable))
                    else:
                        if value is not None:
                            new[component, update.variable] = value
        self.stored.update(new)
        return tuple(unknown)

    def _value(self, expression: Any, event: str, data: Any) -> Any:
        def received(path: tuple[PathStep, ...]) -> Any:
            value = self._received.value(event, data, path)
            if isinstance(value, Misfit | NotLogged):
                raise _NotLoggedError
            return value

        return evaluate(
            expression,
            self._variable,
            lambda component: str(self.state[self._places[Subject(component)]]),
            received,
        )

    def _variable(self, component: str, variable: str) -> Value:
        place = self._places.get(Subject(component, variable))
        return self.stored[component, variable] if place is None else self.state[place]

    def _differences(self, logged: Mapping[str, Mapping[str, Any]]) -> list[str]:
        """Return the differences of the logged state from the replayed one."""
        found: list[str] = []
        for component, behaviour in self._behaviours.items():
            entry = logged.get(component)
            if entry is None:
                found.append(f"the state of {component} is missing")
                continue
            location = self.state[self._places[Subject(component)]]
            if entry["state"] != location:
                found.append(f"{component} is in {location}, not in {_short(entry['state'])}")
            values = entry["variables"]
            for variable in behaviour.variables:
                value = self._variable(component, variable.name)
                if not is_same(values.get(variable.name, MISFIT), value, variable.type):
                    shown = _short(values.get(variable.name))
                    found.append(f"{component}.{variable.name} is {_short(value)}, not {shown}")
        return found


def _short(value: object) -> str:
    text = {True: "true", False: "false"}[value] if isinstance(value, bool) else str(value)
    return text if len(text) <= 40 else text[:37] + "..."


def _initial(variable: Variable) -> Value:
    return float(variable.initial) if isinstance(variable.type, DoubleType) else variable.initial


def _requests(model: Model) -> dict[str, tuple[Communication, ...]]:
    """The communications that are requested, by identifier."""
    found: dict[str, tuple[Communication, ...]] = {}
    for item in model.communications:
        if item.kind is not CommunicationKind.OUTGOING_MESSAGE:
            found[item.identifier] = (*found.get(item.identifier, ()), item)
    return found


def part(data: Any, path: tuple[str, ...]) -> Any:
    """The part of a request's data at a path; None where it is not given."""
    for name in path:
        data = data.get(name) if isinstance(data, dict) else None
    return data


def _with_part(data: Any, path: tuple[str, ...], value: float) -> Any:
    if not path:
        return value
    given = data if isinstance(data, dict) else {}
    return {**given, path[0]: _with_part(given.get(path[0]), path[1:], value)}
