"""Expressions as Promela text, with three truth values and exact numbers.

Promela computes with C integers and has no unknown values: see `robosc.targets.code.predicates`. An expression with
doubles, or with results that could exceed 32 bits, is listed for every combination of the values that it reads: only
finite types take part.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod

from robosc.automata.compile import Path, compile_expression, paths_read, subjects_read
from robosc.automata.state import Subject, subject_domain, subject_type
from robosc.automata.structure import System
from robosc.errors import UnsupportedModelError
from robosc.expressions import (
    MAXIMUM_INTEGER,
    MINIMUM_INTEGER,
    BooleanType,
    Call,
    EnumType,
    Expression,
    IntegerType,
    Received,
    Type,
    Value,
    VariableRead,
    domain,
)
from robosc.expressions.bounds import call_bounds
from robosc.expressions.text import expression_text
from robosc.targets.code.expression_writer import arithmetic_bounds
from robosc.targets.code.predicates import Logic, Predicate, PredicateWriter
from robosc.targets.promela.names import Names

MAXIMUM_TEXT = 1_000_000
"""Characters of one condition: a text repeats what it needs twice, so it can be far larger than its expression."""

MAXIMUM_TABLE = 20_000
"""Combinations of values that one condition may be listed for."""

TRUE = "true"

_COMPARISONS = {"=": "==", "!=": "!=", "<": "<", "<=": "<=", ">": ">", ">=": ">="}


@dataclass(frozen=True, slots=True)
class Number:
    """An integer, or the index of an enum's value: its text, where it is known, and its bounds."""

    text: str
    known: str
    low: int
    high: int


@dataclass(frozen=True, slots=True)
class Datum:
    """Received data: what holds it, where it is known, and its type."""

    name: str
    known: str
    type: Type


class Translator(PredicateWriter[str, Number]):
    """Translates the expressions of one system.

    Args:
        system: The system.
        names: Names of its places.
        data: Received data that can be read, by path.
    """

    def __init__(self, system: System, names: Names, data: Mapping[Path, Datum] | None = None) -> None:
        self.logic = LOGIC
        self._system = system
        self._names = names
        self._data = data or {}

    def condition(self, expression: Expression) -> str:
        """Return the text that holds where a condition is true (not unknown)."""
        return self.truth(expression).true

    def value(self, expression: Expression, type_: Type) -> Number:
        """Return the number that an update writes: 0 or 1, an integer, or the index of an enum's value."""
        match self.result(expression):
            case Number() as number:
                return number
            case Predicate() as truth:
                return Number(truth.true, LOGIC.knownness(truth), 0, 1)
            case _:
                return self._listed_number(expression, type_)

    def _location(self, automaton: str, location: str) -> str:
        return self._names.locations[automaton, location]

    def _read(self, leaf: VariableRead | Received) -> Predicate[str] | Number:
        if isinstance(leaf, VariableRead):
            subject = Subject(leaf.component, leaf.variable)
            datum = Datum(self._names.places[subject], TRUE, subject_type(self._system, subject))
        else:
            datum = self._data[leaf.path]
        if isinstance(datum.type, BooleanType):
            return LOGIC.where(datum.known, datum.name)
        return Number(datum.name, datum.known, *_bounds(datum.type))

    def _integer(self, value: int) -> Number:
        return Number(integer_text(value), TRUE, value, value)

    def _enum_value(self, enum: str, value: str) -> Number:
        return Number(self._names.values[enum, value], TRUE, 0, 0)

    def _negative(self, operand: Number) -> Number | None:
        return _number(f"(-{operand.text})", operand.known, -operand.high, -operand.low)

    def _arithmetic(self, operator: str, left: Number, right: Number) -> Number | None:
        bounds = arithmetic_bounds(operator, (left.low, left.high), (right.low, right.high))
        return _number(f"({left.text} {operator} {right.text})", all_of([left.known, right.known]), *bounds)

    def _function(self, node: Call, arguments: Sequence[Number]) -> Number | None:
        match node.function, arguments:
            case "integer", [number]:
                return number
            case "abs", [number]:
                low, high = call_bounds("abs", [(number.low, number.high)])
                return _number(f"({number.text} < 0 -> -{number.text} : {number.text})", number.known, low, high)
            case "min" | "max" as function, [first, second]:
                return _extreme(function, first, second)
            case "clamp", [number, low_end, high_end]:
                raised = _extreme("max", number, low_end)
                return None if raised is None else _extreme("min", raised, high_end)
        return None

    def _values_compared(self, operator: str, left: Number, right: Number) -> Predicate[str]:
        text = _checked(f"({left.text} {_COMPARISONS[operator]} {right.text})")
        return LOGIC.where(all_of([left.known, right.known]), text)

    def _value_chosen(self, test: Predicate[str], then: Number, otherwise: Number) -> Number | None:
        known = self._choice_known(test, then.known, otherwise.known)
        text = f"({test.true} -> {then.text} : {otherwise.text})"
        return _number(text, known, min(then.low, otherwise.low), max(then.high, otherwise.high))

    # Lists of values

    def _tabulated(self, node: Expression) -> Predicate[str]:
        cases = self._cases(node)
        true = any_of(cases.get(True, []))
        return Predicate(true, any_of(cases.get(False, []))) if cases.get(None) else LOGIC.known(true)

    def _listed_number(self, expression: Expression, type_: Type) -> Number:
        cases = self._cases(expression)
        unknown = cases.pop(None, [])
        values = {index_of(value, type_): tests for value, tests in cases.items()}
        known = any_of([test for tests in values.values() for test in tests]) if unknown else TRUE
        text = "0"
        for value, tests in values.items():
            text = f"({any_of(tests)} -> {integer_text(value)} : {text})"
        return Number(_checked(text), known, min(values, default=0), max(values, default=0))

    def _cases(self, expression: Expression) -> dict[Value | None, list[str]]:
        """For each value of an expression, None for unknown, the tests of what it reads that lead to it."""
        read = sorted(subjects_read(expression), key=str)
        paths = paths_read(expression)
        choices = [self._subject_cases(subject) for subject in read] + [self._data_cases(path) for path in paths]
        if prod(len(choice) for choice in choices) > MAXIMUM_TABLE:
            raise UnsupportedModelError(
                "the promela target lists the values of what computes with doubles or beyond 32 bits, and "
                f"'{_shortened(expression)}' has more than {MAXIMUM_TABLE}; use integers, or smaller ranges"
            )
        function = compile_expression(expression, {subject: place for place, subject in enumerate(read)})
        found: dict[Value | None, list[str]] = {}
        for combination in product(*choices):
            values = [value for value, _ in combination]
            state = tuple(value for value in values[: len(read)] if value is not None)
            data = dict(zip(paths, values[len(read) :], strict=True))
            found.setdefault(function(state, data), []).append(all_of([test for _, test in combination]))
        return found

    def _subject_cases(self, subject: Subject) -> list[tuple[Value | None, str]]:
        """Every value of a place of the state, and the test for it."""
        values = subject_domain(self._system, subject)
        if subject.variable is None:
            return [(value, self._names.locations[subject.automaton, str(value)]) for value in values]
        name, type_ = self._names.places[subject], subject_type(self._system, subject)
        return [(value, f"({name} == {integer_text(index_of(value, type_))})") for value in values]

    def _data_cases(self, path: Path) -> list[tuple[Value | None, str]]:
        """Every value of a received datum, and the test for it."""
        datum = self._data[path]
        found: list[tuple[Value | None, str]] = [
            (value, all_of([datum.known, f"({datum.name} == {integer_text(index_of(value, datum.type))})"]))
            for value in domain(datum.type)
        ]
        return found if datum.known == TRUE else [*found, (None, negated(datum.known))]


def index_of(value: Value | None, type_: Type) -> int:
    """Return the number for a value in Promela: an integer itself, 0 or 1, or the place of an enum's value."""
    return type_.values.index(str(value)) if isinstance(type_, EnumType) else int(value or 0)


def integer_text(value: int) -> str:
    """An integer as Promela, and C behind it, can read it: neither has negative literals, nor one of 2^31."""
    if value == MINIMUM_INTEGER:
        return f"(-{MAXIMUM_INTEGER} - 1)"
    return str(value) if value >= 0 else f"(-{-value})"


def _number(text: str, known: str, low: int, high: int) -> Number | None:
    """A number, or None if it can exceed 32 bits."""
    return Number(_checked(text), known, low, high) if low >= MINIMUM_INTEGER and high <= MAXIMUM_INTEGER else None


def _extreme(function: str, first: Number, second: Number) -> Number | None:
    comparison = "<=" if function == "min" else ">="
    text = f"({first.text} {comparison} {second.text} -> {first.text} : {second.text})"
    bounds = call_bounds(function, [(first.low, first.high), (second.low, second.high)])
    return _number(text, all_of([first.known, second.known]), *bounds)


def _bounds(type_: Type) -> tuple[int, int]:
    match type_:
        case IntegerType(low=int(low), high=int(high)):
            return low, high
        case EnumType(values=values):
            return 0, len(values) - 1
        case _:
            return 0, 1


def negated(text: str) -> str:
    """A negation; `!!` would be another operator of Promela."""
    return text[1:] if text.startswith("!") else f"!{text}"


def all_of(parts: Sequence[str]) -> str:
    """A conjunction."""
    return _joined(parts, "&&", "true", "false")


def any_of(parts: Sequence[str]) -> str:
    """A disjunction."""
    return _joined(parts, "||", "false", "true")


def _implied(condition: str, result: str) -> str:
    return any_of([negated(condition), result])


def _equal(operator: str, left: str, right: str) -> str:
    return _checked(f"({left} {_COMPARISONS[operator]} {right})")


def _joined(parts: Sequence[str], operator: str, neutral: str, decisive: str) -> str:
    kept = [part for part in dict.fromkeys(parts) if part != neutral]
    if decisive in kept:
        return decisive
    if len(kept) <= 1:
        return kept[0] if kept else neutral
    return _checked(f"({f' {operator} '.join(kept)})")


def _checked(text: str) -> str:
    if len(text) > MAXIMUM_TEXT:
        raise UnsupportedModelError(
            f"a condition becomes longer than {MAXIMUM_TEXT} characters in Promela; split it over several variables"
        )
    return text


def _shortened(expression: Expression) -> str:
    text = expression_text(expression)
    return text if len(text) <= 80 else f"{text[:80]}..."


LOGIC = Logic(TRUE, "false", all_of, any_of, negated, _implied, _equal)
