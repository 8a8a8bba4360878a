"""A short way to write small systems by hand.

An edge is written `idle -go-> busy`. Events whose names start with `u_` are uncontrollable.
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

from robosc.automata import (
    Assignment,
    Automaton,
    DiscreteVariable,
    Edge,
    Event,
    EventCondition,
    InputVariable,
    Semantics,
    System,
)
from robosc.automata.compile import State
from robosc.automata.state import Subject, subjects
from robosc.expressions import TRUE, Binary, BinaryOperator, Constant, Expression, Received, Value, VariableRead


class Unrestricted(NamedTuple):
    """Automata with a supervisor that adds nothing."""

    system: System
    added: tuple[()] = ()
    initial: None = None


def edge(text: str, guard: Expression = TRUE, /, **updates: Expression) -> Edge:
    """An edge such as `idle -go-> busy`, with updates by variable name."""
    found = re.fullmatch(r"(\w+) -([\w.]+)-> (\w+)", text)
    assert found, text
    source, event, target = found.groups()
    return Edge(source, event, target, guard, tuple(Assignment(name, value) for name, value in updates.items()))


def automaton(
    name: str,
    edges: Iterable[Edge | str],
    *,
    initial: str | Sequence[str] | None = None,
    marked: Iterable[str] | None = None,
    variables: Iterable[DiscreteVariable] = (),
    blocks: Iterable[str] = (),
) -> Automaton:
    """An automaton; it starts where its first edge does, and all its locations are marked, unless given otherwise.

    Args:
        name: Its name.
        edges: Its edges, as values or as text.
        initial: Its initial location, or several.
        marked: Its marked locations.
        variables: Its variables.
        blocks: Events of its alphabet that have no edge.
    """
    arcs = tuple(edge(item) if isinstance(item, str) else item for item in edges)
    locations = tuple(dict.fromkeys(place for arc in arcs for place in (arc.source, arc.target)))
    return Automaton(
        name=name,
        locations=locations,
        initial=(locations[0],) if initial is None else (initial,) if isinstance(initial, str) else tuple(initial),
        marked=frozenset(locations if marked is None else marked),
        alphabet=frozenset([*(arc.event for arc in arcs), *blocks]),
        edges=arcs,
        variables=tuple(variables),
    )


def system(
    *automata: Automaton,
    conditions: Mapping[str, Expression] | None = None,
    inputs: Iterable[InputVariable] = (),
) -> System:
    """A system; its events are those of its automata, by name."""
    names = sorted(set().union(*(item.alphabet for item in automata)))
    return System(
        name="by hand",
        events=tuple(Event(name, not name.startswith("u_")) for name in names),
        automata=automata,
        inputs=tuple(inputs),
        conditions=tuple(EventCondition(event, condition) for event, condition in (conditions or {}).items()),
    )


def operation(left: Expression | Value, operator: BinaryOperator, right: Expression | Value) -> Expression:
    """An operation; plain values become constants."""
    return Binary(operator, _expression(left), _expression(right))


def _expression(item: Expression | Value) -> Expression:
    return Constant(item) if isinstance(item, bool | int | float | str) else item


def read(text: str) -> VariableRead:
    """The variable `A.x`."""
    component, _, variable = text.partition(".")
    return VariableRead(component, variable)


def received(*path: str | int) -> Received:
    """Received data."""
    return Received(tuple(path))


def state(system_: System, **values: Value) -> State:
    """The initial state with some places changed, given as `A="busy"` or `A_x=3` for variable x of A."""
    initial = dict(zip(subjects(system_), Semantics(system_).initial, strict=True))
    for name, value in values.items():
        automaton_name, _, variable = name.partition("_")
        subject = Subject(automaton_name, variable or None)
        assert subject in initial, subject
        initial[subject] = value
    return tuple(initial.values())


def replay(made: System, added: Mapping[str, Callable[[State], bool]], trace: Sequence[str]) -> set[State]:
    """The states that a trace can lead to in the controlled system."""
    semantics = Semantics(made)
    states = {semantics.initial}
    for name in trace:
        states = {
            target
            for at in states
            if name not in added or added[name](at)
            if not made.event(name).is_controllable or semantics.condition(at, name)
            for target in semantics.targets(at, name)
        }
    return states
