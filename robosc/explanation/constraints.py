"""Constraints that a synthesis problem could be without (requirements, ranges, markings), and the problem left.

Leaving a constraint out never takes anything from a supervisor: where one keeps the system safe and nonblocking, it
still does. A condition or an invariant less forbids less, and a location more that is marked is one more to get to.
A range counts as left out when an update beyond it stops at its end, as `clamp` does: in a state from which the
variable is not led out of its range nothing changes, and the others become safe. So emptiness is monotone, which is
all that finding a minimal set needs (see `conflict`), and without any constraint every system that can begin has a
supervisor.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from robosc.automata.state import Subject
from robosc.automata.structure import Assignment, Automaton, System
from robosc.expressions import TRUE, Call, Constant, Expression, IntegerType
from robosc.synthesis.questions import Restriction


class ConstraintKind(StrEnum):
    """Kind of constraint; in this order the earlier are blamed rather than the later."""

    REQUIREMENT = "requirement"
    """On events."""
    INVARIANT = "invariant"
    """Condition that must be true in every state."""
    CONDITION = "condition"
    """An event condition that no single requirement brings, such as the one on cancel."""
    RANGE = "range"
    """Range of a variable."""
    MARKING = "marking"
    """Need of an automaton to get back to its marked locations, or of the system to where its marker holds."""


@dataclass(frozen=True, slots=True)
class RelaxableConstraint:
    """A part that a problem could be without.

    Attributes:
        kind: Kind of constraint.
        conditions: Places in `System.conditions`.
        invariants: Places in `System.invariants`.
        range: The variable whose range it is.
        marking: The automaton whose marking it is.
        is_marker: True if it is the condition that all marked states have in common (`System.marker`).
    """

    kind: ConstraintKind
    conditions: tuple[int, ...] = ()
    invariants: tuple[int, ...] = ()
    range: Subject | None = None
    marking: str | None = None
    is_marker: bool = False


def relaxable_constraints(system: System, restrictions: Sequence[Restriction] = ()) -> tuple[RelaxableConstraint, ...]:
    """Every constraint of a system, the earlier ones to be blamed rather than the later ones.

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
    """The integer variables that get more than constants."""
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
    """The system that is left without some constraints."""
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
