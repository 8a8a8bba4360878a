"""A global state of a system, as a flat tuple: the interchange form of every explicit algorithm."""

import msgspec

from robosc.automata.structure import System
from robosc.expressions import Type, Value, domain
from robosc.expressions.text import variable_text


class Subject(msgspec.Struct, frozen=True):
    """Content of one place of a state tuple: an automaton's location, or one of its variables.

    Attributes:
        automaton: Name of the automaton.
        variable: Name of the variable, or None for the location.
    """

    automaton: str
    variable: str | None = None

    def __str__(self) -> str:
        return self.automaton if self.variable is None else variable_text(self.automaton, self.variable)


def subjects(system: System) -> tuple[Subject, ...]:
    """The places of a state tuple: for each automaton its location, then its variables."""
    return tuple(
        subject
        for automaton in system.automata
        for subject in (
            Subject(automaton.name),
            *(Subject(automaton.name, variable.name) for variable in automaton.variables),
        )
    )


def subject_domain(system: System, subject: Subject) -> tuple[Value, ...] | range:
    """All values of one place, in order."""
    automaton = system.automaton(subject.automaton)
    if subject.variable is None:
        return automaton.locations
    return domain(subject_type(system, subject))


def subject_type(system: System, subject: Subject) -> Type:
    """The type of a variable's place (KeyError for a location's)."""
    for variable in system.automaton(subject.automaton).variables:
        if variable.name == subject.variable:
            return variable.type
    raise KeyError(str(subject))


def initial_values(system: System) -> tuple[tuple[Value, ...], ...]:
    """For each place of a state, in the order of `subjects`, the values that it may begin with."""
    return tuple(
        values
        for automaton in system.automata
        for values in (automaton.initial, *(variable.initial for variable in automaton.variables))
    )


def whole_names(system: System) -> frozenset[str]:
    """The names that keep those of a system's automata whole in texts: see `automaton_text`."""
    return frozenset(automaton.name.rpartition(" ")[2] for automaton in system.automata)
