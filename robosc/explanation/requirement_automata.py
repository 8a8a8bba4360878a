"""Requirement automata as event conditions, so that explanations treat both in the same way."""

from collections.abc import Iterable
from dataclasses import replace

from robosc.automata.structure import Automaton, EventCondition, Role, System
from robosc.expressions import FALSE, TRUE, Binary, Expression, StateTest


def as_conditions(system: System) -> tuple[System, dict[str, tuple[int, ...]]]:
    """Return an equal system in which plants replace requirement automata, and conditions forbid the same events.

    A requirement automaton forbids an event if it has no edge for it, which is a condition on its location and on the
    values that its guards read. A plant that monitors all of its events moves in the same way as the requirement.

    Returns:
        The system, whose own conditions come first; and for each requirement automaton the places of its conditions.
    """
    automata: list[Automaton] = []
    conditions = list(system.conditions)
    places: dict[str, tuple[int, ...]] = {}
    for automaton in system.automata:
        watching = automaton
        if automaton.role is Role.REQUIREMENT:
            watching = replace(automaton, role=Role.PLANT, monitors=automaton.alphabet)
            forbidding = automaton.alphabet - automaton.monitors
            made = [
                EventCondition(event.name, _has_edge(automaton, event.name))
                for event in system.events
                if event.name in forbidding
            ]
            made = [item for item in made if item.condition != TRUE]
            places[automaton.name] = tuple(range(len(conditions), len(conditions) + len(made)))
            conditions += made
        automata.append(watching)
    return replace(system, automata=tuple(automata), conditions=tuple(conditions)), places


def _has_edge(automaton: Automaton, event: str) -> Expression:
    """Return the condition that an automaton has an edge for an event whose guard is true."""
    guards: dict[str, list[Expression]] = {}
    for edge in automaton.edges:
        if edge.event == event:
            guards.setdefault(edge.source, []).append(edge.guard)
    free = [location for location in automaton.locations if TRUE in guards.get(location, ())]
    if len(free) == len(automaton.locations):
        return TRUE
    return _any_of(
        expression
        for location, found in guards.items()
        for expression in (
            [StateTest(automaton.name, location)]
            if TRUE in found
            else [Binary("and", StateTest(automaton.name, location), guard) for guard in found]
        )
    )


def _any_of(expressions: Iterable[Expression]) -> Expression:
    """Return the disjunction of some expressions as a balanced tree, because there may be very many."""
    level = list(expressions)
    while len(level) > 1:
        pairs = [Binary("or", *level[place : place + 2]) for place in range(0, len(level) - 1, 2)]
        level = pairs + level[2 * len(pairs) :]
    return level[0] if level else FALSE
