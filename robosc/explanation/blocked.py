"""Requests that a supervisor allows in the current state of a robot, and the reasons why the others are blocked.

A request is not enabled in five cases: its service or action is not idle; a behaviour that mentions
it has no transition on it; an update would take a variable out of its range; a requirement does not hold; or synthesis
forbids it. Each case gives one sentence, so a request has a sentence if and only if it is not enabled. The condition
that synthesis adds has no meaning if another case blocks the request, and is reported only if none does.

The state comes from a bridge, a topic or a log file, and is untrusted: numbers and texts are converted to the model's
types, and a value that does not fit is an error. Locations of services and actions may be unknown.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from robosc.automata.compile import Function, State, compile_expression, subjects_read
from robosc.automata.decision import Decision, Test, index_in
from robosc.automata.executable import CALLED_KINDS, ExecutableEvent, ExecutableSystem, Moves, Participant
from robosc.automata.plants import communication_plant, communication_plant_name
from robosc.automata.state import Subject
from robosc.conditions.requirements import requirement_text
from robosc.errors import RoboscError
from robosc.explanation.notation import MAXIMUM_NAMES, bracketed, cut, listed, value_text
from robosc.expressions import (
    BooleanType,
    DoubleType,
    EnumType,
    Expression,
    IntegerType,
    Type,
    Value,
    conjuncts,
    domain,
    type_text,
    values,
)
from robosc.expressions.text import automaton_text, expression_text
from robosc.model.structure import (
    Communication,
    EventKind,
    Requirement,
    RequirementForm,
)
from robosc.supervisor import AddedCondition, DecisionDiagram

MAXIMUM_REASONS = 8
"""Maximum number of sentences about one request."""

MAXIMUM_DIGITS = 400
"""Maximum number of characters of a number that is given as a text."""

_INTEGER = re.compile(r"-?[0-9]{1,18}", re.ASCII)
_TRUTHS = {"true": True, "false": False}


class StateError(RoboscError, ValueError):
    """A state that the model cannot be in; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class Blocked:
    """A request that is not enabled.

    Attributes:
        event: The request, such as `move.request`.
        why: One sentence for each cause; at least one.
    """

    event: str
    why: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RequestAvailability:
    """The requests of a model in one state, divided into three groups, each in the model's order.

    Attributes:
        enabled: Requests that may be made.
        blocked: Requests that may not be made.
        unknown: Requests that cannot be decided, because the location of a service or action is not known.
    """

    enabled: tuple[str, ...]
    blocked: tuple[Blocked, ...]
    unknown: tuple[str, ...]


class _NoData(dict[Any, Any]):
    """Data without values: every part of it is unknown."""

    def __missing__(self, key: Any) -> None:
        return None


_NO_DATA: Mapping[Any, Any] = _NoData()


@dataclass(frozen=True, slots=True)
class _Condition:
    """A compiled expression."""

    function: Function
    text: str
    reads: tuple[Subject, ...]

    def holds(self, state: State) -> bool:
        return self.function(state, _NO_DATA) is True


@dataclass(frozen=True, slots=True)
class _RangeCheck:
    """An update that must stay in a range."""

    subject: Subject
    function: Function
    low: int
    high: int


@dataclass(frozen=True, slots=True)
class _Part:
    """A component whose behaviour mentions a request: in each state that allows it, the updates that have a range."""

    name: str
    kept: Mapping[str, tuple[_RangeCheck, ...]]


@dataclass(frozen=True, slots=True)
class _Need:
    """A requirement on a request."""

    text: str
    is_needs: bool
    condition: _Condition
    parts: tuple[_Condition, ...]


@dataclass(frozen=True, slots=True)
class _Rule:
    """All conditions that may block a request."""

    event: str
    moves: Moves | None
    parts: tuple[_Part, ...]
    needs: tuple[_Need, ...]
    added: Decision | None


class Requests:
    """Requests of one supervisor: those that are allowed in a state, and why the others are not.

    Args:
        system: Executable system that it supervises.
        added: Conditions that synthesis adds to it.
    """

    def __init__(self, system: ExecutableSystem, added: Iterable[AddedCondition]) -> None:
        model = system.model
        self._components = frozenset(item.name for item in model.components)
        self._behaviours = {item.name: item.behaviour for item in model.components if item.behaviour is not None}
        self._plants = {
            communication_plant_name(item): item for item in model.communications if item.kind in CALLED_KINDS
        }
        self._types: dict[Subject, Type] = {
            Subject(name, variable.name): variable.type
            for name, behaviour in self._behaviours.items()
            for variable in behaviour.variables
        }
        locations = [Subject(name) for name in (*self._behaviours, *self._plants)]
        self._places = {subject: place for place, subject in enumerate([*locations, *self._types])}
        diagrams = {item.event: item.condition for item in added}
        self._rules = tuple(
            self._rule(event, diagrams.get(event.name))
            for event in system.events.values()
            if event.kind is EventKind.REQUEST
        )

    @property
    def events(self) -> tuple[str, ...]:
        """Every request, in the model's order."""
        return tuple(rule.event for rule in self._rules)

    def availability(self, components: Mapping[str, Any], communications: Mapping[str, str]) -> RequestAvailability:
        """Return the requests that are allowed in a state, and the reasons why the others are not.

        Args:
            components: State and variables of every component with a behaviour, `{name: {"state": s, "variables": {v:
                value}}}`; values as the model has them, as JSON has them, or as texts.
            communications: Location of services and actions, by name; missing ones are unknown.

        Raises:
            StateError: The model has no such state.
        """
        state = self._state(components, communications)
        enabled, blocked, unknown = list[str](), list[Blocked](), list[str]()
        for rule in self._rules:
            why = tuple(self._why(rule, state))[:MAXIMUM_REASONS]
            is_unknown = rule.moves is not None and state[self._places[Subject(rule.moves.plant)]] is None
            if not why and rule.added is not None:
                allowed, tested = self._decided(rule.added, state)
                is_unknown = is_unknown or allowed is None
                if allowed is False:
                    why = (f"the supervisor forbids it, because of what can follow{bracketed(tested)}",)
            if why:
                blocked.append(Blocked(rule.event, why))
            elif is_unknown:
                unknown.append(rule.event)
            else:
                enabled.append(rule.event)
        return RequestAvailability(tuple(enabled), tuple(blocked), tuple(unknown))

    # Taking the model apart

    def _rule(self, event: ExecutableEvent, added: DecisionDiagram | None) -> _Rule:
        return _Rule(
            event.name,
            event.moves,
            tuple(_Part(item.component, self._range_checks(item)) for item in event.participants),
            tuple(map(self._need, event.requirements)),
            None if added is None else self._decision(added),
        )

    def _range_checks(self, participant: Participant) -> dict[str, tuple[_RangeCheck, ...]]:
        """The updates that must stay in a range, by the state in which they are made."""
        types = {item.name: item.type for item in participant.behaviour.variables if item.is_synthesis}
        found: dict[str, tuple[_RangeCheck, ...]] = {}
        for states, transition in participant.branches:
            kept = []
            for update in transition.updates:
                match types.get(update.variable):
                    case IntegerType(low=int(low), high=int(high)):
                        function = compile_expression(update.expression, self._places)
                        kept.append(_RangeCheck(Subject(participant.component, update.variable), function, low, high))
            found.update(dict.fromkeys(states, tuple(kept)))
        return {state: found[state] for state in participant.taken}

    def _need(self, item: Requirement) -> _Need:
        is_needs = item.form is RequirementForm.NEEDS
        return _Need(
            cut(requirement_text(item, self._components)),
            is_needs,
            self._condition(item.condition),
            tuple(map(self._condition, conjuncts(item.expression))) if is_needs else (),
        )

    def _condition(self, expression: Expression) -> _Condition:
        reads = sorted(subjects_read(expression), key=self._places.__getitem__)
        text = cut(expression_text(expression, self._components))
        return _Condition(compile_expression(expression, self._places), text, tuple(reads))

    def _decision(self, diagram: DecisionDiagram) -> Decision:
        nodes = tuple(
            Test(self._places[Subject(node.automaton, node.variable)], node.starts, node.children)
            for node in diagram.nodes
        )
        # Only what a diagram tests must have finitely many values.
        tested = {node.place for node in nodes}
        indices = tuple(
            index_in(self._domain(subject) if place in tested else ()) for subject, place in self._places.items()
        )
        return Decision(nodes, diagram.root, indices)

    def _domain(self, subject: Subject) -> tuple[Value, ...] | range:
        if subject.variable is not None:
            return domain(self._types[subject])
        if subject.automaton in self._plants:
            return communication_plant(self._plants[subject.automaton]).locations
        return tuple(state.name for state in self._behaviours[subject.automaton].states)

    # The state

    def _state(self, components: Mapping[str, Any], communications: Mapping[str, str]) -> State:
        found: list[Any] = []
        for subject in self._places:
            name = subject.automaton
            if name in self._plants:
                found.append(self._location(self._plants[name], communications))
                continue
            part = components.get(name)
            if not isinstance(part, Mapping):
                raise StateError(f"the state of component '{name}' is missing")
            found.append(self._value(subject, part))
        return tuple(found)

    def _location(self, communication: Communication, communications: Mapping[str, str]) -> str | None:
        location = communications.get(communication.name)
        if location is not None and location not in communication_plant(communication).locations:
            raise StateError(f"'{communication.name}' cannot be in '{str(location)[:100]}'")
        return location

    def _value(self, subject: Subject, part: Mapping[str, Any]) -> Value:
        name = subject.automaton
        if subject.variable is None:
            state = part.get("state")
            if not any(item.name == state for item in self._behaviours[name].states):
                raise StateError(f"component '{name}' has no state '{str(state)[:100]}'")
            return str(state)
        variables, type_ = part.get("variables"), self._types[subject]
        raw = variables.get(subject.variable) if isinstance(variables, Mapping) else None
        value = read_value(type_, raw)
        if value is None:
            raise StateError(f"the value of {subject} is missing or is no {type_text(type_)}")
        return value

    # Reasons

    def _why(self, rule: _Rule, state: State) -> Iterator[str]:
        if rule.moves is not None:
            location = state[self._places[Subject(rule.moves.plant)]]
            if location is not None and location not in rule.moves.targets:
                needed = listed(list(rule.moves.targets))
                yield f"{automaton_text(rule.moves.plant, self._components)} is in {location}, not in {needed}"
        for part in rule.parts:
            yield from self._blocking_causes(part, state)
        for need in rule.needs:
            if not need.condition.holds(state):
                yield self._violated(need, state)

    def _blocking_causes(self, part: _Part, state: State) -> Iterator[str]:
        location = str(state[self._places[Subject(part.name)]])
        if location not in part.kept:
            yield f"{part.name} is in {location}, not in {listed(list(part.kept))}"
            return
        for item in part.kept[location]:
            value = item.function(state, _NO_DATA)
            if value is not None and values.assignable_integer(value, item.low, item.high) is None:
                now = value_text(state[self._places[item.subject]])
                yield f"it would take {item.subject}, which is {now}, out of its range {item.low}..{item.high}"

    def _violated(self, need: _Need, state: State) -> str:
        if need.condition.function(state, _NO_DATA) is None:
            return f"{need.text}: its value is not known{self._values(need.condition.reads, state)}"
        if not need.is_needs:
            return f"{need.text}, and that holds{self._values(need.condition.reads, state)}"
        failing = [part for part in need.parts if not part.holds(state)]
        read = tuple(dict.fromkeys(subject for part in failing for subject in part.reads))
        if len(need.parts) == 1:
            return f"{need.text}, which does not hold{self._values(read, state)}"
        words = " and ".join(part.text for part in failing[:MAXIMUM_NAMES])
        return f"{need.text}: {words} do{'' if len(failing) > 1 else 'es'} not hold{self._values(read, state)}"

    def _values(self, read: Iterable[Subject], state: State) -> str:
        return bracketed([self._value_words(subject, state) for subject in read])

    def _value_words(self, subject: Subject, state: State) -> str:
        value = state[self._places[subject]]
        name = automaton_text(subject.automaton, self._components) if subject.variable is None else str(subject)
        return f"{name} is {cut(value_text(value))}"

    def _decided(self, decision: Decision, state: State) -> tuple[bool | None, list[str]]:
        """Return whether a diagram is true (None if it reads an unknown value), and the places that it reads."""
        order = tuple(self._places)
        number, words = decision.root, list[str]()
        while number > 1:
            node = decision.nodes[number - 2]
            value = state[node.place]
            if value is None:
                return None, words
            words.append(self._value_words(order[node.place], state))
            number = node.child(decision.indices[node.place](value))
        return number == 1, words


def read_value(type_: Type, raw: Any) -> Value | None:
    """A value of a type, from JSON (whose numbers may all be doubles) or a text; None if it is no such value."""
    match type_:
        case BooleanType():
            return raw if isinstance(raw, bool) else _TRUTHS.get(raw) if isinstance(raw, str) else None
        case IntegerType(low=low, high=high):
            number = _whole(raw)
            is_in = number is not None and (low is None or low <= number) and (high is None or number <= high)
            return number if is_in else None
        case DoubleType():
            return _double(raw)
        case EnumType(values=names):
            return raw if isinstance(raw, str) and raw in names else None
        case _:
            return raw if isinstance(raw, str) else None


def _whole(raw: Any) -> int | None:
    if isinstance(raw, float):
        return int(raw) if raw.is_integer() else None
    if isinstance(raw, str):
        return int(raw) if _INTEGER.fullmatch(raw) else None
    return raw if isinstance(raw, int) and not isinstance(raw, bool) else None


def _double(raw: Any) -> float | None:
    if (
        isinstance(raw, bool)
        or not isinstance(raw, int | float | str)
        or (isinstance(raw, str) and len(raw) > MAXIMUM_DIGITS)
    ):
        return None
    try:
        return float(raw)
    except (ValueError, OverflowError):
        return None
