"""Sources that expressions of a synthesis problem read, as CIF text: locations, variables, received data."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from robosc.automata.state import Subject
from robosc.automata.structure import InputVariable, System
from robosc.expressions import (
    BooleanType,
    EnumType,
    IntegerType,
    Received,
    StateTest,
    Type,
    Value,
    VariableRead,
    domain,
)
from robosc.targets.cif.names import Names, array_steps, shift
from robosc.targets.cif.numbers import Number, Term, comparison
from robosc.targets.cif.text import TRUE, Text, all_of, any_of, compared, escaped, negated


@dataclass(frozen=True, slots=True)
class Place:
    """Place of an expression.

    Attributes:
        what: Description in words, for messages, e.g. `the guard of Base.tau_1`.
        automaton: The automaton around it, or None outside all of them.
        event: The event whose data it may read, or None.
    """

    what: str
    automaton: str | None = None
    event: str | None = None


Source = Subject | InputVariable
"""Source that a leaf of an expression reads."""


class Reader:
    """Writes down what is read.

    Args:
        system: The synthesis problem.
        names: Its names.

    Attributes:
        tried: Combinations of values that expressions were evaluated for so far.
    """

    def __init__(self, system: System, names: Names) -> None:
        self._system = system
        self.names = names
        self.tried = 0
        self._inputs = {(item.event, item.path): item for item in system.inputs}
        self._types = {
            (automaton.name, variable.name): variable.type
            for automaton in system.automata
            for variable in automaton.variables
        }
        self._literals = frozenset(map(escaped, names.literals.values()))
        self._locations = {automaton.name: automaton.locations for automaton in system.automata}

    def source(self, leaf: VariableRead | StateTest | Received, place: Place) -> Source:
        """Return the source that a leaf reads."""
        match leaf:
            case VariableRead(component=automaton, variable=variable):
                return Subject(automaton, variable)
            case StateTest(component=automaton):
                return Subject(automaton)
            case Received(path=path):
                return self._inputs[str(place.event), path]

    def type(self, source: Source) -> Type | None:
        """The type of what is read; None for a location."""
        if isinstance(source, InputVariable):
            return source.type
        return None if source.variable is None else self._types[source.automaton, source.variable]

    def values(self, source: Source) -> Sequence[Value | None]:
        """Return the values that can be read there, None for unknown at the end."""
        if isinstance(source, InputVariable) and source.may_be_unknown:
            return (*domain(source.type), None)
        type_ = self.type(source)
        return self._locations[source.automaton] if type_ is None else domain(type_)  # type: ignore[union-attr]

    def reference(self, source: Source, place: Place) -> Text:
        """The variable or input that is read."""
        if isinstance(source, InputVariable):
            owner, name = self.names.owner(source.event), self.names.inputs[source.event, source.path]
        else:
            owner, name = source.automaton, self.names.variables[source.automaton, str(source.variable)]
        return Text(self.names.reference(owner, name, place.automaton))

    def location(self, automaton: str, location: str, place: Place) -> Text:
        """Return the condition that an automaton is in a location."""
        if len(self._locations[automaton]) == 1:
            return TRUE
        return Text(self.names.reference(automaton, self.names.locations[automaton, location], place.automaton))

    def known(self, source: Source, place: Place) -> Text:
        """Return the condition that a source is known.

        An element is known if each index on its path lies inside its array.
        """
        if not isinstance(source, InputVariable) or not source.may_be_unknown:
            return TRUE
        tests = []
        for array, index in array_steps(source.path):
            presence = self.names.presences[source.event, array]
            name = self.names.reference(self.names.owner(source.event), presence.name, place.automaton)
            tests.append(compared(name, ">", str(presence.indices.index(index))))
        return all_of(tests)

    def number(self, source: Source, place: Place) -> Number:
        """The value of an integer."""
        type_ = self.type(source)
        assert isinstance(type_, IntegerType) and type_.low is not None and type_.high is not None  # noqa: S101
        moved = shift(type_)
        term = Term(self.reference(source, place), type_.low + moved, type_.high + moved)
        return Number((term,), -moved, self.known(source, place))

    def literal(self, enum: str, value: str) -> Text:
        """A value of an enum."""
        return Text(escaped(self.names.literals[enum, value]))

    def is_literal(self, text: Text) -> bool:
        """Return True if a text is a value of an enum."""
        return text.text in self._literals

    def test(self, source: Source, runs: Iterable[range], place: Place) -> Text:
        """Return the condition that a source has one of the values with some indices (in runs, ascending, apart)."""
        values = self.values(source)
        runs = list(runs)
        if sum(map(len, runs)) == len(values):
            return TRUE
        is_unknown_wanted = values[-1] is None and runs[-1][-1] == len(values) - 1
        if is_unknown_wanted:
            return negated(self.test(source, _gaps(runs, len(values)), place))
        return all_of([self.known(source, place), self._value_test(source, runs, values, place)])

    def _value_test(self, source: Source, runs: list[range], values: Sequence[Value | None], place: Place) -> Text:
        """The test for values that are known."""
        count = len(values) - (values[-1] is None)
        if sum(map(len, runs)) == count:
            return TRUE
        type_ = self.type(source)
        if isinstance(type_, IntegerType):
            return any_of(self._between(source, run, values, place) for run in runs)
        inside = [str(values[index]) for run in runs for index in run]
        outside = [str(values[index]) for index in range(count) if str(values[index]) not in set(inside)]
        if isinstance(type_, BooleanType):
            reference = self.reference(source, place)
            return reference if values[runs[0][0]] else negated(reference)
        if isinstance(type_, EnumType):
            reference = self.reference(source, place)
            is_negative = len(outside) < len(inside)
            tests = [
                compared(reference.text, "!=" if is_negative else "=", self.literal(type_.name, item).text)
                for item in (outside if is_negative else inside)
            ]
            return all_of(tests) if is_negative else any_of(tests)
        automaton = source.automaton  # type: ignore[union-attr]  # only a location has no type
        if len(outside) < len(inside):
            return all_of(negated(self.location(automaton, item, place)) for item in outside)
        return any_of(self.location(automaton, item, place) for item in inside)

    def _between(self, source: Source, run: range, values: Sequence[Value | None], place: Place) -> Text:
        number = self.number(source, place)
        low, high = (Number((), int(values[index])) for index in (run[0], run[-1]))  # type: ignore[arg-type]
        if len(run) == 1:
            return comparison("=", number, low)
        # A comparison with an end of the range is always true, and left out.
        return all_of([comparison(">=", number, low), comparison("<=", number, high)])


def _gaps(runs: list[range], count: int) -> list[range]:
    """The runs between some runs."""
    found, start = [], 0
    for run in runs:
        if run.start > start:
            found.append(range(start, run.start))
        start = run.stop
    return found if start == count else [*found, range(start, count)]
