"""The explicit semantics of a system: slow and obvious, and the reference for all other algorithms.

A transition is one synchronous step: every automaton with the event in its alphabet takes an edge whose guard is
true; an automaton that only monitors the event may have no such edge, and then stays. All updates read the old state
and the same received data, and happen together. A step into a state that violates a plant invariant does not happen.
The steps of one event depend on few locations and variables, so they are computed once for each combination of their
values.

Definitions: Ouedraogo, Kumar, Malik and Akesson, "Nonblocking and safe control of discrete-event
systems modeled as extended finite automata", IEEE T-ASE 8(3), 2011, pp. 560-569, sec. II.
"""

from collections.abc import Callable, Iterable
from copy import copy
from dataclasses import replace
from functools import cached_property
from itertools import product
from math import prod
from operator import itemgetter

import msgspec

from robosc.automata.compile import (
    NO_DATA,
    Carried,
    Data,
    Function,
    State,
    compile_expression,
    paths_read,
    subjects_read,
)
from robosc.automata.inputs import connected_inputs, valuations
from robosc.automata.state import Subject, initial_values, subject_type, subjects
from robosc.automata.structure import Assignment, Automaton, Edge, Event, InputVariable, Role, System
from robosc.errors import RoboscError
from robosc.expressions import TRUE, Expression, IntegerType, Type, Value, domain
from robosc.expressions.text import expression_text

MAXIMUM_CHOICES = 500_000
"""Choices of received data for one step beyond which it is not worked out; also ways to begin."""


class TooManyChoicesError(RoboscError):
    """A step has too many choices of received data, or a system too many ways to begin, to go through them all."""


_Writes = tuple[tuple[int, Value], ...]
"""Values that a step writes, each with its place in a state tuple."""


class _Update(msgspec.Struct, frozen=True):
    place: int
    function: Function
    type: Type
    inputs: tuple[InputVariable, ...]

    def stays_in_range(self, value: Value) -> bool:
        match self.type:
            case IntegerType(low=int(low), high=int(high)):
                return low <= value <= high  # type: ignore[operator]  # an integer's update is a number
            case _:
                return True


class _Arc(msgspec.Struct, frozen=True, eq=False):
    """A compiled edge; compared by identity."""

    guard: Function
    place: int
    target: str
    updates: tuple[_Update, ...]


class _Outcome(msgspec.Struct, frozen=True):
    """Effect of one event in a state.

    Attributes:
        is_possible: True if every plant that does not monitor it has an edge for it whose guard is true, every plant
            condition is true, and plant invariants leave it a step.
        may_leave_range: True if some data or edge would take a variable out of its range.
        meets_condition: True if every event condition is true and every requirement automaton that does not monitor
            it has such an edge, too.
        writes: Changes by each choice of data and edges that stays in range and keeps the plant invariants.
    """

    is_possible: bool
    may_leave_range: bool
    meets_condition: bool
    writes: tuple[_Writes, ...]


_Participant = tuple[int, dict[Value, tuple[_Arc, ...]]]
"""An automaton: place of its location, and its arcs by location."""


class _Rule(msgspec.Struct, frozen=True):
    """Compiled meaning of one event.

    Attributes:
        event: The event.
        reads: The part of a state that determines the outcome.
        participants: Place of the location and arcs by location, for each plant that takes part and can block it.
        observers: The same for each requirement automaton that can forbid it.
        monitors: The same for each automaton that monitors it.
        conditions: Its event conditions.
        plant_conditions: Its plant conditions.
        plant_invariants: The plant invariants that read what it may change.
        outcomes: Outcomes worked out already, by the values of `reads`.
        carried: The same for certain data.
    """

    event: Event
    reads: Callable[[State], object]
    participants: tuple[_Participant, ...]
    observers: tuple[_Participant, ...]
    monitors: tuple[_Participant, ...]
    conditions: tuple[Function, ...]
    plant_conditions: tuple[Function, ...]
    plant_invariants: tuple[Function, ...]
    outcomes: dict[object, _Outcome] = msgspec.field(default_factory=dict)
    carried: dict[object, _Writes | None] = msgspec.field(default_factory=dict)

    def outcome(self, state: State) -> _Outcome:
        key = self.reads(state)
        found = self.outcomes.get(key)
        if found is None:
            found = self.outcomes[key] = self._work_out(state)
        return found

    def outcome_given(self, state: State, given: Data) -> _Outcome:
        """Return the outcome of those choices alone in which received data is as given."""
        return self._work_out(state, given)

    def _work_out(self, state: State, given: Data = NO_DATA) -> _Outcome:
        watched = [_possible_arcs(observer, state) for observer in self.observers]
        # A requirement that has no edge forbids the event and stays where it is.
        meets_condition = _all_hold(self.conditions, state) and all(watched)
        choices = self._choices(state)
        if choices is None:
            return _Outcome(False, False, meets_condition, ())
        leaves_range = False
        writes: dict[_Writes, None] = {}
        for arcs in product(*choices, *(arcs for arcs in watched if arcs)):
            leaves, results = _joint_step(arcs, state, given)
            leaves_range = leaves_range or leaves
            writes.update(dict.fromkeys(results))
        if not self.plant_invariants:
            return _Outcome(True, leaves_range, meets_condition, tuple(writes))
        kept = tuple(item for item in writes if _all_hold(self.plant_invariants, _written(state, item)))
        return _Outcome(bool(kept) or leaves_range, leaves_range, meets_condition, kept)

    def _choices(self, state: State) -> list[list[_Arc]] | None:
        """The arcs of each plant and each monitor that moves; None where the plants cannot do the event."""
        # An event in no alphabet belongs to no automaton, so it cannot happen.
        if not (self.participants or self.observers or self.monitors):
            return None
        if not _all_hold(self.plant_conditions, state):
            return None
        taken = [_possible_arcs(participant, state) for participant in self.participants]
        if not all(taken):
            return None
        return [*taken, *(arcs for monitor in self.monitors if (arcs := _possible_arcs(monitor, state)))]

    def writes_with(self, state: State, data: Carried) -> _Writes | None:
        """Return what the first arcs change with some data; None if there are no arcs, or if that leaves a range."""
        key = (self.reads(state), data)
        if key not in self.carried:
            self.carried[key] = self._work_out_with(state, dict(data))
        return self.carried[key]

    def _work_out_with(self, state: State, data: Data) -> _Writes | None:
        choices = self._choices(state)
        if choices is None:
            return None
        writes: list[tuple[int, Value]] = []
        for arc, *_ in choices:
            writes.append((arc.place, arc.target))
            for update in arc.updates:
                value = update.function(state, data)
                if value is not None and not update.stays_in_range(value):
                    return None
                if value is not None:
                    writes.append((update.place, value))
        return tuple(writes) if _all_hold(self.plant_invariants, _written(state, writes)) else None


def _possible_arcs(participant: _Participant, state: State) -> list[_Arc]:
    """The arcs that an automaton may take."""
    place, arcs = participant
    return [arc for arc in arcs.get(state[place], ()) if arc.guard(state, NO_DATA) is True]


def _all_hold(conditions: Iterable[Function], state: State) -> bool:
    return all(condition(state, NO_DATA) is True for condition in conditions)


def _written(state: State, writes: Iterable[tuple[int, Value]]) -> State:
    """The state after some writes."""
    target = list(state)
    for place, value in writes:
        target[place] = value
    return tuple(target)


def _joint_step(arcs: tuple[_Arc, ...], state: State, given: Data) -> tuple[bool, list[_Writes]]:
    """Return whether the arcs, taken together, may leave a range, and what they write for each choice of data."""
    leaves_range = False
    moves = tuple((arc.place, arc.target) for arc in arcs)
    all_updates = [update for arc in arcs for update in arc.updates]
    if not all_updates:
        return False, [moves]
    parts: list[list[_Writes]] = [[moves]]
    for updates in _independent_updates(all_updates):
        leaves, results = _updates_together(updates, state, given)
        leaves_range = leaves_range or leaves
        parts.append(results)
    _require_few(len(part) for part in parts)
    return leaves_range, [tuple(write for part in choice for write in part) for choice in product(*parts)]


def _require_few(counts: Iterable[int]) -> None:
    """Do nothing if the combinations of so many choices each can be gone through.

    Raises:
        TooManyChoicesError: There are too many.
    """
    combinations = prod(counts)
    if combinations > MAXIMUM_CHOICES:
        raise TooManyChoicesError(f"{combinations} choices are too many to go through them")


def _updates_together(updates: list[_Update], state: State, given: Data) -> tuple[bool, list[_Writes]]:
    """Return whether updates that share data may leave a range, and what they write for each choice of data."""
    leaves_range = False
    results: dict[_Writes, None] = {}
    inputs = dict.fromkeys(item for update in updates for item in update.inputs)
    _require_few(1 if item.path in given else len(domain(item.type)) + item.may_be_unknown for item in inputs)
    for data in valuations(inputs, given):
        values = [(update, update.function(state, data)) for update in updates]
        known = [(update, value) for update, value in values if value is not None]
        if all(update.stays_in_range(value) for update, value in known):
            results[tuple((update.place, value) for update, value in known)] = None
        else:
            leaves_range = True
    return leaves_range, list(results)


def _independent_updates(updates: list[_Update]) -> list[list[_Update]]:
    """Updates in groups that share no received data: the groups' results combine freely."""
    group_of: dict[InputVariable, int] = {}
    for number, inputs in enumerate(connected_inputs(dict.fromkeys(i for update in updates for i in update.inputs))):
        group_of.update(dict.fromkeys(inputs, number))
    groups: list[tuple[set[int], list[_Update]]] = []
    for update in updates:
        numbers = {group_of[item] for item in update.inputs}
        together = [group for group in groups if group[0] & numbers]
        groups = [group for group in groups if not group[0] & numbers]
        merged = [*(item for group in together for item in group[1]), update]
        groups.append((numbers.union(*(group[0] for group in together)), merged))
    return [group[1] for group in groups]


class Semantics:
    """The uncontrolled system, state by state.

    States are tuples in the order of `subjects(system)`. What asks for the steps of a state raises
    `TooManyChoicesError` where received data has more than `MAXIMUM_CHOICES` values that matter together.

    Args:
        system: The system.
        text: Function that writes a condition of the system, for the reasons of `bad_reason`.

    Attributes:
        system: The system.
    """

    def __init__(self, system: System, text: Callable[[Expression], str] = expression_text) -> None:
        self.system = system
        self._text = text
        self._places = {subject: place for place, subject in enumerate(subjects(system))}
        self._marked = tuple((self._places[Subject(item.name)], item.marked) for item in system.automata)
        self._rules = {event.name: self._rule(event) for event in system.events}
        self._invariants = tuple(compile_expression(item, self._places) for item in system.invariants)
        self._initial = tuple(
            compile_expression(item, self._places) for item in (system.initial, *system.plant_invariants)
        )
        self._marker = compile_expression(system.marker, self._places)
        self._uncontrollable = tuple(rule for rule in self._rules.values() if not rule.event.is_controllable)

    def only(self, event: Event) -> "Semantics":
        """The meaning of one event alone, without invariants, and with nothing remembered.

        Args:
            event: One of the system's.
        """
        alone = copy(self)
        alone.system = replace(self.system, events=(event,), invariants=())
        rule = msgspec.structs.replace(self._rules[event.name], outcomes={}, carried={})
        alone._rules = {event.name: rule}
        alone._invariants = ()
        alone._uncontrollable = () if event.is_controllable else (rule,)
        return alone

    @cached_property
    def initial_states(self) -> tuple[State, ...]:
        """Every initial state, whether it is bad or not, in the order of the values.

        Raises:
            TooManyChoicesError: Automata and variables have more than `MAXIMUM_CHOICES` ways to begin.
        """
        values = initial_values(self.system)
        _require_few(len(places) for places in values)
        return tuple(state for state in product(*values) if _all_hold(self._initial, state))

    @property
    def initial(self) -> State:
        """The first initial state: of a RoboSC model the only one (IndexError where there is none)."""
        return self.initial_states[0]

    def enabled(self, state: State, event: str) -> bool:
        """Return True if the plant enables an event; a controllable one must also stay in every range."""
        rule = self._rules[event]
        outcome = rule.outcome(state)
        return outcome.is_possible and not (rule.event.is_controllable and outcome.may_leave_range)

    def condition(self, state: State, event: str) -> bool:
        """Return True if every event condition on an event is true."""
        rule = self._rules[event]
        return not (rule.conditions or rule.observers) or rule.outcome(state).meets_condition

    def targets(self, state: State, event: str, given: Data = NO_DATA) -> frozenset[State]:
        """The states that an event can lead to, over all received data and edges; none if it is not enabled.

        Choices that would leave a variable's range have no target: see `bad`.

        Args:
            state: The state before it.
            event: The event.
            given: Received data that is the same in all choices, None where it is unknown; the rest is open.
        """
        rule = self._rules[event]
        outcome = rule.outcome(state)
        # A controllable event is disabled where any data would take a variable out of its range.
        if rule.event.is_controllable and outcome.may_leave_range:
            return frozenset()
        if given:
            outcome = rule.outcome_given(state, given)
        return frozenset(_written(state, writes) for writes in outcome.writes)

    def target_with(self, state: State, event: str, data: Carried) -> State | None:
        """The state that an event with certain data leads to where each automaton takes its first edge.

        Args:
            state: The state before it.
            event: The event.
            data: The value of each path that is read, None where it is unknown.

        Returns:
            The state, or None if the plant does not enable the event or a variable would leave its range.
        """
        writes = self._rules[event].writes_with(state, data)
        return None if writes is None else _written(state, writes)

    def bad(self, state: State) -> bool:
        """Return True if a state violates an invariant, or an uncontrollable event of it a condition or range."""
        return bool(self.bad_reason(state))

    def bad_reason(self, state: State) -> str | None:
        """Return the reason why a state is bad, in words, or None if it is not."""
        for number, invariant in enumerate(self._invariants):
            if invariant(state, NO_DATA) is not True:
                return f"'{self._text(self.system.invariants[number])}' is not true"
        for rule in self._uncontrollable:
            outcome = rule.outcome(state)
            if outcome.is_possible and not outcome.meets_condition:
                whose = "the supervisor" if self.system.is_controlled else "its requirement"
                return f"{rule.event.name} can happen against {whose}"
            if outcome.may_leave_range:
                return f"{rule.event.name} can take a variable out of its range"
        return None

    def is_marked(self, state: State) -> bool:
        """Return True if every automaton is in a marked location, and the marker condition is true."""
        return all(state[place] in marked for place, marked in self._marked) and self._marker(state, NO_DATA) is True

    def _rule(self, event: Event) -> _Rule:
        automata = [item for item in self.system.automata if event.name in item.alphabet]
        conditions = [item.condition for item in self.system.conditions if item.event == event.name]
        plant_conditions = [item.condition for item in self.system.plant_conditions if item.event == event.name]
        return _Rule(
            event=event,
            reads=_reader(sorted(self._places[subject] for subject in subjects_deciding(self.system, event.name))),
            participants=self._participants(automata, event.name, Role.PLANT),
            observers=self._participants(automata, event.name, Role.REQUIREMENT),
            monitors=tuple(self._participant(item, event.name) for item in automata if event.name in item.monitors),
            conditions=self._compiled(item for item in conditions if item != TRUE),
            plant_conditions=self._compiled(plant_conditions),
            plant_invariants=self._compiled(plant_invariants_on(self.system, event.name)),
        )

    def _compiled(self, conditions: Iterable[Expression]) -> tuple[Function, ...]:
        return tuple(compile_expression(item, self._places) for item in conditions)

    def _participants(self, automata: Iterable[Automaton], event: str, role: Role) -> tuple[_Participant, ...]:
        return tuple(
            self._participant(item, event) for item in automata if item.role is role and event not in item.monitors
        )

    def _participant(self, automaton: Automaton, event: str) -> _Participant:
        place = self._places[Subject(automaton.name)]
        arcs: dict[Value, tuple[_Arc, ...]] = {}
        for edge in automaton.edges:
            if edge.event == event:
                arcs[edge.source] = (*arcs.get(edge.source, ()), self._arc(automaton, edge, place))
        return place, arcs

    def _arc(self, automaton: Automaton, edge: Edge, place: int) -> _Arc:
        updates = tuple(self._update(automaton, edge, update) for update in edge.updates)
        return _Arc(compile_expression(edge.guard, self._places), place, edge.target, updates)

    def _update(self, automaton: Automaton, edge: Edge, update: Assignment) -> _Update:
        subject = Subject(automaton.name, update.variable)
        paths = paths_read(update.expression)
        return _Update(
            place=self._places[subject],
            function=compile_expression(update.expression, self._places),
            type=subject_type(self.system, subject),
            inputs=_inputs_of(self.system.inputs, edge.event, paths),
        )


def subjects_deciding(system: System, event: str) -> frozenset[Subject]:
    """The places of a state that decide what an event does."""
    automata = [item for item in system.automata if event in item.alphabet]
    edges = [edge for item in automata for edge in item.edges if edge.event == event]
    expressions = [
        *(item.condition for item in (*system.conditions, *system.plant_conditions) if item.event == event),
        *plant_invariants_on(system, event),
        *(edge.guard for edge in edges),
        *(update.expression for edge in edges for update in edge.updates),
    ]
    return frozenset({Subject(item.name) for item in automata}.union(*map(subjects_read, expressions)))


def subjects_changed(system: System, event: str) -> frozenset[Subject]:
    """The places of a state that an event may change."""
    return frozenset(
        subject
        for automaton in system.automata
        for edge in automaton.edges
        if edge.event == event
        for subject in (
            *([Subject(automaton.name)] if edge.source != edge.target else []),
            *(Subject(automaton.name, update.variable) for update in edge.updates),
        )
    )


def plant_invariants_on(system: System, event: str) -> tuple[Expression, ...]:
    """The plant invariants that read what an event may change; the others stay as true as they are.

    With those that a supervisor in the system has, if it can prevent the event.
    """
    kept = system.plant_invariants
    if system.is_controlled and system.invariants and system.event(event).is_controllable:
        kept = (*kept, *system.invariants)
    if not kept:
        return ()
    changed = subjects_changed(system, event)
    return tuple(item for item in kept if subjects_read(item) & changed)


def _reader(places: list[int]) -> Callable[[State], object]:
    return itemgetter(*places) if places else lambda state: ()


def _inputs_of(inputs: Iterable[InputVariable], event: str, paths: Iterable[object]) -> tuple[InputVariable, ...]:
    wanted = set(paths)
    return tuple(item for item in inputs if item.event == event and item.path in wanted)
