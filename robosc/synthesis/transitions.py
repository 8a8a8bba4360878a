"""Events as predicates and next-state functions, without the product of the automata's edges.

Each bit that an event may change has one function of the state before the event and of received data. It is correct
wherever the event is possible: an if-then-else over the edges of the bit's automaton. The predecessors of a predicate
are then computed by substitution, so backward images need no next-state variables.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from copy import copy
from functools import cached_property
from typing import Any, Self

import msgspec

from robosc.automata.semantics import plant_invariants_on
from robosc.automata.state import Subject
from robosc.automata.structure import Automaton, Edge, Event, EventCondition, Role
from robosc.synthesis.changes import Leads, leads_of
from robosc.synthesis.encoding import Bits, Encoding, next_name
from robosc.synthesis.expression_encoder import ExpressionEncoder
from robosc.synthesis.image import Image
from robosc.synthesis.nodes import assigned

MAXIMUM_SUBSTITUTED = 300
"""Nodes of what an event writes up to which it is substituted in a set of states to find those before it. Substituting
much more takes many times as long as the relation between both, as where many edges of one event write few bits."""


class Transition(msgspec.Struct, frozen=True):
    """Effect of one event; predicates are over current-state variables and `hidden` ones.

    Attributes:
        event: The event.
        possible: Predicate that every automaton takes an edge or may stay without one, and the plant conditions are
            true, for data that can come.
        out_of_range: Predicate that an update leaves its variable's range when the event is taken.
        condition: Predicate that its event conditions are true (current-state variables only).
        watched: Predicate that every requirement automaton that does not monitor it has an edge for it (current-state
            variables only).
        lasting: Predicate that those plant invariants are true that read what it may change (current-state variables
            only).
        functions: Value of each changed bit after it, right where the event is possible.
        hidden: Variables of received data and of choices between edges.
    """

    event: Event
    possible: Any
    out_of_range: Any
    condition: Any
    watched: Any
    lasting: Any
    functions: dict[str, Any]
    hidden: tuple[str, ...]


class _Arc(msgspec.Struct, frozen=True):
    """An edge with the predicate where it is taken, what it writes and where it leaves a range."""

    taken: Any
    written: dict[str, Any]
    out_of_range: Any


def transition_of(encoding: Encoding, event: Event) -> Transition:
    """Return the effect of an event of the encoded system."""
    manager, system = encoding.manager, encoding.system
    encoder = ExpressionEncoder(encoding, encoding.inputs_of(event.name))
    participants = [automaton for automaton in system.automata if event.name in automaton.alphabet]
    # An event in no alphabet belongs to no automaton, so it cannot happen.
    possible = encoding.possible_inputs(event.name) if participants else manager.false
    possible = possible & _condition(encoding, encoder, system.plant_conditions, event.name)
    watched = manager.true
    hidden = list(encoding.input_names(event.name))
    functions: dict[str, Any] = {}
    out_of_range = manager.false
    for automaton in participants:
        arcs, choice, is_taken = _arcs(encoding, encoder, automaton, event)
        if choice is not None:
            hidden += choice.names
            possible = possible & encoding.valid(choice)
        is_monitor = event.name in automaton.monitors
        if automaton.role is Role.PLANT and not is_monitor:
            possible = possible & encoding.any_of(arc.taken for arc in arcs)
        else:
            if not is_monitor:
                watched = watched & is_taken
            possible = possible & (~is_taken | encoding.any_of(arc.taken for arc in arcs))
            # The automaton stays where it is without an edge.
            arcs = [*arcs, _Arc(~is_taken, {}, manager.false)]
        out_of_range = out_of_range | encoding.any_of(arc.taken & arc.out_of_range for arc in arcs)
        functions |= _functions(encoding, arcs)
    return Transition(
        event=event,
        possible=possible,
        out_of_range=out_of_range,
        condition=_condition(encoding, encoder, system.conditions, event.name),
        watched=watched,
        lasting=encoding.all_of(map(encoder.holds, plant_invariants_on(system, event.name))),
        functions=functions,
        hidden=tuple(hidden),
    )


def _condition(encoding: Encoding, encoder: ExpressionEncoder, conditions: Iterable[EventCondition], event: str) -> Any:
    return encoding.all_of(encoder.holds(item.condition) for item in conditions if item.event == event)


def _arcs(
    encoding: Encoding, encoder: ExpressionEncoder, automaton: Automaton, event: Event
) -> tuple[list[_Arc], Bits | None, Any]:
    """The edges of an automaton for an event; where several may be taken, a choice decides; and where one may be."""
    guards = _guards(encoding, encoder, automaton, event)
    is_taken = encoding.any_of(guard for _, guard in guards)
    leads = leads_of([edge for edge, _ in guards])
    rivals = _rivals(encoding, guards)
    if not rivals:
        return [_arc(encoding, encoder, automaton, edge, guard, leads) for edge, guard in guards], None, is_taken
    choice = encoding.choice(max(index for index in rivals.values()) + 1)
    arcs = []
    for number, (edge, guard) in enumerate(guards):
        taken = guard & encoding.code(choice, rivals[number]) if number in rivals else guard
        arcs.append(_arc(encoding, encoder, automaton, edge, taken, leads))
    return arcs, choice, is_taken


def choices(encoding: Encoding, event: Event) -> Iterator[tuple[str, str]]:
    """Each automaton, with each of its locations, in which it has several edges to take for an event of the system.

    Edges count by which no variable leaves its range, in states in which the other automata allow the event; whether a
    state can be reached, and conditions and invariants, do not count.
    """
    encoder = ExpressionEncoder(encoding, encoding.inputs_of(event.name))
    arcs: list[tuple[Automaton, list[tuple[Edge, Any]]]] = []
    for automaton in encoding.system.automata:
        if event.name in automaton.alphabet:
            guards = _guards(encoding, encoder, automaton, event)
            leads = leads_of([edge for edge, _ in guards])
            taken = [
                (edge, guard & ~_arc(encoding, encoder, automaton, edge, guard, leads).out_of_range)
                for edge, guard in guards
            ]
            arcs.append((automaton, taken))
    for automaton, taken in arcs:
        others = encoding.all_of(
            encoding.any_of(guard for _, guard in theirs)
            for other, theirs in arcs
            if other is not automaton and other.role is Role.PLANT and event.name not in other.monitors
        )
        able = [(edge, guard & others) for edge, guard in taken]
        yield from dict.fromkeys((automaton.name, able[number][0].source) for number in sorted(_rivals(encoding, able)))


def _guards(
    encoding: Encoding, encoder: ExpressionEncoder, automaton: Automaton, event: Event
) -> list[tuple[Edge, Any]]:
    """The edges of an automaton for an event, each with the states in which it can be taken."""
    return [
        (edge, encoding.in_location(automaton.name, edge.source) & encoder.holds(edge.guard))
        for edge in automaton.edges
        if edge.event == event.name
    ]


def _rivals(encoding: Encoding, guards: Sequence[tuple[Edge, Any]]) -> dict[int, int]:
    """Edges of which several can be taken in one state, each with its number among those of its location."""
    by_location: defaultdict[str, list[int]] = defaultdict(list)
    for number, (edge, _) in enumerate(guards):
        by_location[edge.source].append(number)
    found: dict[int, int] = {}
    for numbers in by_location.values():
        earlier = overlap = encoding.manager.false
        for number in numbers:
            overlap = overlap | (earlier & guards[number][1])
            earlier = earlier | guards[number][1]
        # Codes that stand for no value must not count.
        if overlap != encoding.manager.false and overlap & encoding.valid_states() != encoding.manager.false:
            found |= {number: place for place, number in enumerate(numbers)}
    return found


def _arc(
    encoding: Encoding, encoder: ExpressionEncoder, automaton: Automaton, edge: Edge, taken: Any, leads: Leads
) -> _Arc:
    manager = encoding.manager
    written: dict[str, Any] = {}
    out_of_range = manager.false
    # Edges to one place all write it, so that the written value is a constant.
    if leads is Leads.TO_ONE_PLACE or (leads is Leads.AWAY and edge.target != edge.source):
        location = encoding.subjects[Subject(automaton.name)]
        index = location.domain.index(edge.target)
        for place, name in enumerate(reversed(location.names)):
            written[name] = manager.true if (index >> place) & 1 else manager.false
    for update in edge.updates:
        bits = encoding.subjects[Subject(automaton.name, update.variable)]
        new, leaves = encoder.written(bits, update.expression)
        written |= new
        out_of_range = out_of_range | leaves
    return _Arc(taken, written, out_of_range)


def _functions(encoding: Encoding, arcs: Sequence[_Arc]) -> dict[str, Any]:
    """The next value of every bit that one of the edges changes, where one of them is taken."""
    result: dict[str, Any] = {}
    for name in dict.fromkeys(name for arc in arcs for name in arc.written):
        value = _next_value(encoding, arcs, name)
        if value != encoding.manager.var(name):
            result[name] = value
    return result


def _next_value(encoding: Encoding, arcs: Sequence[_Arc], name: str) -> Any:
    """The next value of a bit, where one of the edges is taken.

    Elsewhere it does not matter, so what most edges write needs no test: often it is a constant, and no guard gets
    into what is substituted.
    """
    current = encoding.manager.var(name)
    cases: list[tuple[Any, list[Any]]] = []
    for arc in arcs:
        value = arc.written.get(name, current)
        same = next((taken for other, taken in cases if other == value), None)
        if same is None:
            cases.append((value, [arc.taken]))
        else:
            same.append(arc.taken)
    result, most = max(cases, key=lambda case: len(case[1]))
    for value, taken in cases:
        if taken is not most:
            result = encoding.manager.ite(encoding.any_of(taken), value, result)
    return result


def _names(encoding: Encoding, transition: Transition) -> frozenset[str]:
    """The current-state variables that a transition reads or changes."""
    conditions = transition.condition & transition.watched
    predicates = (
        transition.possible,
        transition.out_of_range,
        conditions,
        transition.lasting,
        *transition.functions.values(),
    )
    read = set().union(*(encoding.manager.support(predicate) for predicate in predicates))
    return frozenset(encoding.state_names) & (read | transition.functions.keys())


class Steps:
    """Predecessors and successors of predicates under one event.

    Args:
        encoding: The variables.
        transition: The event.
    """

    def __init__(self, encoding: Encoding, transition: Transition) -> None:
        self._manager = encoding.manager
        self._transition = transition
        true, false = self._manager.true, self._manager.false
        self._constants = {name: f == true for name, f in transition.functions.items() if f in (true, false)}
        self._composed = {name: f for name, f in transition.functions.items() if name not in self._constants}
        self.arrival = encoding.all_of(
            self._manager.var(name) if value else ~self._manager.var(name) for name, value in self._constants.items()
        )
        """States that have all that the event writes as a constant: it leads to no other ones."""
        self.leaving = self._without_hidden(transition.possible & transition.out_of_range)
        """States in which the event can take a variable out of its range."""
        self._in_range = transition.possible & ~transition.out_of_range
        enabled = self._without_hidden(transition.possible)
        if transition.lasting != true:
            self._in_range = self._in_range & self._after(transition.lasting)
            enabled = self._without_hidden(self._in_range) | self.leaving
        self.event = transition.event
        self.plant = enabled & ~self.leaving if self.event.is_controllable else enabled
        """States in which the plant enables the event; a controllable one must stay in every range.

        States in which a plant invariant is not true do not count: there are none.
        """
        self.sources = self._without_hidden(self._in_range)
        """States from which the event leads anywhere."""
        self.condition = transition.condition & transition.watched
        """States in which its event conditions are true, and no requirement automaton is against it."""
        self.is_deterministic = not transition.hidden
        """True if it leads to one state at most."""
        self.names = _names(encoding, transition)
        """The current-state variables that it reads or changes."""
        self._state_names = encoding.state_names
        self.changed = tuple(transition.functions)
        """The current-state variables that it changes."""
        self.made: dict[str, Any] = {}
        """Predicates made of the event, by name, for as long as its conditions and data stay as they are."""

    @property
    def bad(self) -> Any:
        """States in which the event, uncontrollable, can do harm at once."""
        if self.event.is_controllable:
            return self._manager.false
        if "bad" not in self.made:
            self.made["bad"] = self.leaving | (self.plant & ~self.condition)
        return self.made["bad"]

    def under(self, condition: Any) -> Self:
        """The same event under other event conditions."""
        other = copy(self)
        other.made = {}
        other.condition = condition & self._transition.watched
        read = self._manager.support(other.condition)
        other.names = self.names | (frozenset(self._state_names) & read)
        return other

    def carrying(self, data: Any) -> Self:
        """The same event with some of its data, or in some states, alone: a predicate; `plant` stays that of all."""
        other = copy(self)
        other.made = {}
        # They are made on first use.
        other.__dict__.pop("_relation", None)
        other.__dict__.pop("_predecessors", None)
        other._in_range = self._in_range & data
        other.sources = self._without_hidden(other._in_range)
        return other

    def moving(self) -> Any:
        """Return the states in which the event can lead to another state than the one it happens in."""
        manager = self._manager
        found = manager.false
        for name, function in self._transition.functions.items():
            found = found | manager.ite(manager.var(name), ~function, function)
        return self._without_hidden(self._in_range & found)

    def backwards(self, source: Any = None) -> Image:
        """Return the image that leads from states to those of a source from which the event can lead to one of them.

        Args:
            source: States that count as such; None if all do.
        """
        functions, relation, hidden = self._composed, self._in_range, self._transition.hidden
        if sum(function.dag_size for function in functions.values()) > MAXIMUM_SUBSTITUTED:
            functions = {name: self._manager.var(next_name(name)) for name in functions}
            relation, hidden = self._relation, tuple(map(next_name, functions))
        return Image(
            manager=self._manager,
            needed=self.arrival,
            constants=self._constants,
            functions=functions,
            relation=relation,
            hidden=hidden,
            outside=source,
        )

    def forwards(self, source: Any = None) -> Image:
        """Return the image that leads from states to those to which the event can lead from one of them.

        Args:
            source: States from which the event may happen; None if from all.
        """
        # A bit that is written as a constant needs no next-state variable: it is forgotten, and then known.
        return Image(
            manager=self._manager,
            inside=source,
            relation=self._relation,
            hidden=self.changed,
            names={next_name(name): name for name in self._composed},
            outside=self.arrival,
        )

    def some(self, predicate: Any) -> Any:
        """Return the states from which the event can lead into a predicate."""
        return self._predecessors(predicate)

    def only(self, predicate: Any) -> Any:
        """Return the states from which the event, if it happens, leads into a predicate for all data."""
        return ~self._without_hidden(self._in_range & ~self._after(predicate))

    def image(self, states: Any) -> Any:
        """The states that the event leads to from `states`."""
        return self.forwards()(states)

    @cached_property
    def _predecessors(self) -> Image:
        return self.backwards()

    @cached_property
    def _relation(self) -> Any:
        """The pairs of a state and one that the event leads to, without what it writes as a constant."""
        relation = self._in_range
        for name, function in self._composed.items():
            following = self._manager.var(next_name(name))
            relation = relation & self._manager.ite(following, function, ~function)
        return self._without_hidden(relation)

    def _after(self, predicate: Any) -> Any:
        """Return the predicate that another will be true after the event, by substituting next-state functions."""
        # Constants first: what the other functions bring in are values from before the event.
        if self._constants:
            predicate = assigned(self._manager, self._constants, self.arrival, predicate)
        return self._manager.let(self._composed, predicate) if self._composed else predicate

    def _without_hidden(self, predicate: Any) -> Any:
        hidden = self._transition.hidden
        return self._manager.exist(hidden, predicate) if hidden else predicate
