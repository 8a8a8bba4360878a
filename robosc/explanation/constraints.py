"""Constraints that a synthesis problem can be relaxed by (requirements, ranges, markings), and the relaxed problem.

A supervisor stays a supervisor if a constraint is left out: the system under it stays safe and nonblocking. Without a
condition or an invariant, less is forbidden, and with one more marked location, there is one more location to reach. A
range is left out by updates that stop at its end, as `clamp` does: states from which the variable does not leave its
range are unchanged, and the other states become safe. So emptiness is monotone, as the search for a minimal set needs
(see `robosc.synthesis.conflict`), and without any constraint every system with an initial state has a supervisor.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace
from enum import StrEnum

import msgspec

from robosc.automata.state import Subject
from robosc.automata.structure import Assignment, Automaton, System
from robosc.expressions import TRUE, Call, Constant, Expression, IntegerType
from robosc.synthesis.questions import Restriction


class ConstraintKind(StrEnum):
    """Kind of constraint; earlier kinds are preferred for blame."""

    REQUIREMENT = "requirement"
    """Requirement on events."""
    INVARIANT = "invariant"
    """Condition that must be true in every state."""
    CONDITION = "condition"
    """An event condition that comes from no single requirement, such as the one on cancel."""
    RANGE = "range"
    """Range of a variable."""
    MARKING = "marking"
    """Marking: an automaton must reach its marked locations again, or the system a state in which its marker holds."""


class RelaxableConstraint(msgspec.Struct, frozen=True):
    """A part that can be left out of a problem.

    Attributes:
        kind: Kind of constraint.
        conditions: Places in `System.conditions`.
        invariants: Places in `System.invariants`.
        range: The variable of the range.
        marking: The automaton of the marking.
        is_marker: True if the part is the condition that all marked states have in common (`System.marker`).
    """

    kind: ConstraintKind
    conditions: tuple[int, ...] = ()
    invariants: tuple[int, ...] = ()
    range: Subject | None = None
    marking: str | None = None
    is_marker: bool = False


def relaxable_constraints(system: System, restrictions: Sequence[Restriction] = ()) -> tuple[RelaxableConstraint, ...]:
    """Every constraint of a system; earlier ones are preferred for blame.

    Args:
        system: The system.
        restrictions: Conditions and invariants that stand or fall together; the others stand alone.
    """
    found = [
        RelaxableConstraint(
            ConstraintKind.INVARIANT if item.invariants else ConstraintKind.REQUIREMENT,
            item.conditions,
            item.invariants,
        )
        for item in restrictions
    ]
    conditions = {place for item in found for place in item.conditions}
    invariants = {place for item in found for place in item.invariants}
    found += [
        RelaxableConstraint(ConstraintKind.CONDITION, conditions=(place,))
        for place in range(len(system.conditions))
        if place not in conditions
    ]
    found += [
        RelaxableConstraint(ConstraintKind.INVARIANT, invariants=(place,))
        for place in range(len(system.invariants))
        if place not in invariants
    ]
    found += [RelaxableConstraint(ConstraintKind.RANGE, range=subject) for subject in _ranged(system)]
    found += [
        RelaxableConstraint(ConstraintKind.MARKING, marking=item.name)
        for item in system.automata
        if not item.marked.issuperset(item.locations)
    ]
    if system.marker != TRUE:
        found.append(RelaxableConstraint(ConstraintKind.MARKING, is_marker=True))
    ranks = list(ConstraintKind)
    return tuple(sorted(found, key=lambda item: ranks.index(item.kind)))


def _ranged(system: System) -> Iterator[Subject]:
    """The integer variables that are assigned other values than constants."""
    for automaton in system.automata:
        computed = {
            update.variable
            for edge in automaton.edges
            for update in edge.updates
            if not isinstance(update.expression, Constant)
        }
        for variable in automaton.variables:
            if isinstance(variable.type, IntegerType) and variable.name in computed:
                yield Subject(automaton.name, variable.name)


def without(system: System, constraints: Iterable[RelaxableConstraint]) -> System:
    """The system without some constraints."""
    dropped = tuple(constraints)
    conditions = {place for item in dropped for place in item.conditions}
    invariants = {place for item in dropped for place in item.invariants}
    return replace(
        without_marks(without_ranges(system, dropped), dropped),
        conditions=tuple(item for place, item in enumerate(system.conditions) if place not in conditions),
        invariants=tuple(item for place, item in enumerate(system.invariants) if place not in invariants),
    )


def without_marks(system: System, constraints: Iterable[RelaxableConstraint]) -> System:
    """The system in which every location of some automata is marked, or which needs no marker."""
    chosen = tuple(constraints)
    dropped = {item.marking for item in chosen}
    automata = (
        replace(item, marked=frozenset(item.locations)) if item.name in dropped else item for item in system.automata
    )
    marker = TRUE if any(item.is_marker for item in chosen) else system.marker
    return replace(system, automata=tuple(automata), marker=marker)


def without_ranges(system: System, constraints: Iterable[RelaxableConstraint]) -> System:
    """The system in which updates of some variables stop at the ends of their ranges."""
    dropped = {item.range for item in constraints if item.range is not None}
    touched = {subject.automaton for subject in dropped}
    automata = (_clamped(item, dropped) if item.name in touched else item for item in system.automata)
    return replace(system, automata=tuple(automata))


def _clamped(automaton: Automaton, dropped: Collection[Subject]) -> Automaton:
    types = {item.name: item.type for item in automaton.variables if Subject(automaton.name, item.name) in dropped}

    def clamped(update: Assignment) -> Assignment:
        match types.get(update.variable):
            case IntegerType(low=int(low), high=int(high)):
                return replace(update, expression=_clamp(update.expression, low, high))
            case _:
                return update

    edges = tuple(replace(edge, updates=tuple(map(clamped, edge.updates))) for edge in automaton.edges)
    return replace(automaton, edges=edges)


def _clamp(expression: Expression, low: int, high: int) -> Expression:
    return Call("clamp", (expression, Constant(low), Constant(high)))
