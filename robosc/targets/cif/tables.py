"""Tables for expressions that CIF cannot compute, made by evaluating every combination of the values that they read.

Expressions with doubles, with results that may exceed 32 bits, or without a counterpart in CIF are evaluated here, with
the semantics of RoboSC. The result is a decision over the few locations, variables and data that the expression reads.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod

from robosc.automata.compile import compile_expression
from robosc.automata.state import Subject
from robosc.automata.structure import InputVariable
from robosc.conditions.literals import merged
from robosc.expressions import Expression, Received, StateTest, Value, VariableRead, leaves
from robosc.targets.cif.numbers import Number, Term
from robosc.targets.cif.subjects import Place, Reader, Source
from robosc.targets.cif.text import FALSE, TRUE, Text, all_of, any_of, chosen

MAXIMUM_COMBINATIONS = 100_000
"""Combinations of values beyond which an expression is not tried out."""

MAXIMUM_TRIED = 20 * MAXIMUM_COMBINATIONS
"""Combinations beyond which nothing more of one model is tried out."""

MAXIMUM_CASES = 1_000
"""Cases that one table may have."""


class TableTooLargeError(Exception):
    """The table has too many values to try, or cases to write down."""


@dataclass(frozen=True, slots=True)
class _Choice:
    """Result of an expression, by the value of one thing that it reads.

    Attributes:
        source: The thing.
        branches: Results, each with the indices of the values that lead to it.
    """

    source: Source
    branches: tuple[tuple["_Result", tuple[range, ...]], ...]


_Result = Value | None | _Choice


@dataclass(frozen=True, slots=True)
class Table:
    """The value of an expression for every value of what it reads.

    Attributes:
        reader: Writer of what is read.
        place: Place of the expression.
        result: The decision.
    """

    reader: Reader
    place: Place
    result: _Result

    def results(self) -> set[Value | None]:
        """Return the values that it can be, None for unknown."""
        found, stack = set[Value | None](), [self.result]
        while stack:
            result = stack.pop()
            if isinstance(result, _Choice):
                stack.extend(part for part, _ in result.branches)
            else:
                found.add(result)
        return found

    def where(self, wanted: Callable[[Value | None], bool]) -> Text:
        """Return the condition that the expression has one of some values."""
        return self._where(self.result, wanted)

    def number(self) -> Number:
        """The expression as a number."""
        values = [value for value in self.results() if isinstance(value, int)]
        known = self.where(lambda value: value is not None)
        if len(values) <= 1:
            return Number((), values[0] if values else 0, known)
        low = min(values)
        return Number((Term(self._number(self.result, low), 0, max(values) - low),), low, known)

    def _where(self, result: _Result, wanted: Callable[[Value | None], bool]) -> Text:
        if not isinstance(result, _Choice):
            return TRUE if wanted(result) else FALSE
        found: dict[Text, list[range]] = {}
        for part, runs in result.branches:
            found.setdefault(self._where(part, wanted), []).extend(runs)
        return any_of(
            all_of([self.reader.test(result.source, merged(runs), self.place), text])
            for text, runs in found.items()
            if text != FALSE
        )

    def _number(self, result: _Result, low: int) -> Text:
        """The text of how much a result exceeds the least one."""
        if not isinstance(result, _Choice):
            return Text("0" if result is None else str(int(result) - low))
        parts = [(runs, self._number(part, low)) for part, runs in result.branches]
        cases = [(self.reader.test(result.source, runs, self.place), text) for runs, text in parts[:-1]]
        return chosen(cases, parts[-1][1])


@dataclass(slots=True)
class _Builder:
    """Builder of a decision, bottom-up.

    Attributes:
        sources: Sources that are read.
        domains: Their values.
        values: Results of all combinations, the last source changing fastest.
        cases: Cases so far, each a run of equal values.
    """

    sources: Sequence[Source]
    domains: Sequence[Sequence[Value | None]]
    values: Iterator[Value | None]
    cases: int = 0

    def build(self, depth: int) -> _Result:
        """The decision over the sources from `depth` on, for the next combinations."""
        if depth == len(self.sources):
            return next(self.values)
        found: dict[tuple[type, _Result], list[range]] = {}
        for index in range(len(self.domains[depth])):
            result = self.build(depth + 1)
            runs = found.setdefault((type(result), result), [])
            if runs and runs[-1].stop == index:
                runs[-1] = range(runs[-1].start, index + 1)
            else:
                runs.append(range(index, index + 1))
        if len(found) == 1:
            return next(iter(found))[1]
        self.cases += sum(map(len, found.values()))
        if self.cases > MAXIMUM_CASES:
            raise TableTooLargeError
        branches = tuple((result, tuple(runs)) for (_, result), runs in found.items())
        return _Choice(self.sources[depth], branches)


def tabulate(expression: Expression, reader: Reader, place: Place) -> Table:
    """The table of an expression.

    Raises:
        TableTooLargeError: It would be too large.
    """
    read = [leaf for leaf in leaves(expression) if isinstance(leaf, VariableRead | StateTest | Received)]
    sources = tuple(dict.fromkeys(reader.source(leaf, place) for leaf in read))
    domains = [reader.values(source) for source in sources]
    combinations = prod(map(len, domains))
    if combinations > MAXIMUM_COMBINATIONS:
        raise TableTooLargeError
    reader.tried += combinations
    if reader.tried > MAXIMUM_TRIED:
        raise TableTooLargeError
    values = _values(expression, sources, domains)
    return Table(reader, place, _Builder(sources, domains, values).build(0))


def _values(
    expression: Expression, sources: Sequence[Source], domains: Sequence[Sequence[Value | None]]
) -> Iterator[Value | None]:
    """The values of an expression, the last source changing fastest."""
    subjects = [source for source in sources if isinstance(source, Subject)]
    function = compile_expression(expression, {subject: place for place, subject in enumerate(subjects)})
    for choice in product(*domains):
        state = tuple(
            value
            for source, value in zip(sources, choice, strict=True)
            if isinstance(source, Subject) and value is not None
        )
        data = {
            source.path: value
            for source, value in zip(sources, choice, strict=True)
            if isinstance(source, InputVariable)
        }
        yield function(state, data)
