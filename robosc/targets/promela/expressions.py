"""Expressions as Promela text, with three truth values and exact numbers.

Promela computes with C integers and knows no unknown values, so a boolean is a pair of texts (where it is true, where
it is false) and a number a text with another one that tells where it is known. What computes with doubles, or could go
beyond 32 bits, is listed value by value of what it reads: only values of finite types take part.
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
    Binary,
    BooleanType,
    Call,
    Conditional,
    Constant,
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    Received,
    StateTest,
    Type,
    Unary,
    Value,
    VariableRead,
    domain,
)
from robosc.expressions.text import expression_text
from robosc.targets.promela.names import Names

MAXIMUM_TEXT = 1_000_000
"""Characters of one condition: a text repeats what it needs twice, so it can be far larger than its expression."""

MAXIMUM_TABLE = 20_000
"""Combinations of values that one condition may be listed for."""

_COMPARISONS = {"=": "==", "!=": "!=", "<": "<", "<=": "<=", ">": ">", ">=": ">="}


@dataclass(frozen=True, slots=True)
class Truth:
    """A boolean: where it is true, and where it is false, or None where it is always one of the two."""

    true: str
    false_text: str | None = None

    @property
    def false(self) -> str:
        """Text that holds where it is false."""
        return negated(self.true) if self.false_text is None else self.false_text


@dataclass(frozen=True, slots=True)
class Number:
    """An integer, or the index of an enum's value: its text, where it is known (None: always), and its bounds."""

    text: str
    known: str | None
    low: int
    high: int


@dataclass(frozen=True, slots=True)
class Datum:
    """Received data: what holds it, where it is known (None: always), and its type."""

    name: str
    known: str | None
    type: Type


class _NotIntegers(Exception):
    """The expression needs more than 32-bit integers: list its values."""


class Translator:
    """Translates the expressions of one system.

    Args:
        system: The system.
        names: Names of its places.
        data: Received data that can be read, by path.
    """

    def __init__(self, system: System, names: Names, data: Mapping[Path, Datum] | None = None) -> None:
        self._system = system
        self._names = names
        self._data = data or {}

    def condition(self, expression: Expression) -> str:
        """Return the text that holds where a condition is true (not unknown)."""
        return self._truth(expression).true

    def value(self, expression: Expression, type_: Type) -> Number:
        """Return the number that an update writes: 0 or 1, an integer, or the index of an enum's value."""
        if isinstance(type_, BooleanType):
            truth = self._truth(expression)
            known = None if truth.false_text is None else any_of([truth.true, truth.false])
            return Number(truth.true, known, 0, 1)
        try:
            return self._number(expression)
        except _NotIntegers:
            return self._listed_number(expression, type_)

    # Booleans

    def _truth(self, expression: Expression) -> Truth:
        match expression:
            case Constant(value=value):
                return Truth("true" if value is True else "false")
            case StateTest(component=component, state=state):
                return Truth(self._names.locations[component, state])
            case VariableRead(component=component, variable=variable):
                return Truth(self._names.places[Subject(component, variable)])
            case Received(path=path):
                datum = self._data[path]
                if datum.known is None:
                    return Truth(datum.name)
                return Truth(all_of([datum.known, datum.name]), all_of([datum.known, negated(datum.name)]))
            case Unary(operator="not", operand=operand):
                inner = self._truth(operand)
                return Truth(inner.false, None if inner.false_text is None else inner.true)
            case Unary(operator="holds", operand=operand):
                return Truth(self._truth(operand).true)
            case Binary(operator="and" | "or" as operator):
                return self._chain(operator, expression)
            case Binary(operator="implies", left=left, right=right):
                first, second = self._truth(left), self._truth(right)
                is_known = first.false_text is None and second.false_text is None
                return Truth(
                    any_of([first.false, second.true]), None if is_known else all_of([first.true, second.false])
                )
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                return self._choice(*(self._truth(item) for item in (condition, then, otherwise)))
            case Binary(operator=operator, left=left, right=right):
                if operator in ("=", "!=") and self._is_boolean(left):
                    return self._same(operator, self._truth(left), self._truth(right))
                try:
                    return self._compared(operator, self._number(left), self._number(right))
                except _NotIntegers:
                    return self._listed_truth(expression)
            case _:
                return self._listed_truth(expression)

    def _chain(self, operator: str, expression: Expression) -> Truth:
        """Operands of a chain together: it can be longer than the stack is deep."""
        operands: list[Expression] = []
        while isinstance(expression, Binary) and expression.operator == operator:
            operands.append(expression.right)
            expression = expression.left
        parts = [self._truth(item) for item in (expression, *reversed(operands))]
        joined, other = (all_of, any_of) if operator == "and" else (any_of, all_of)
        is_known = all(part.false_text is None for part in parts)
        return Truth(joined([part.true for part in parts]), None if is_known else other([part.false for part in parts]))

    @staticmethod
    def _choice(test: Truth, then: Truth, otherwise: Truth) -> Truth:
        is_known = test.false_text is None and then.false_text is None and otherwise.false_text is None
        true = any_of([all_of([test.true, then.true]), all_of([test.false, otherwise.true])])
        return Truth(
            true, None if is_known else any_of([all_of([test.true, then.false]), all_of([test.false, otherwise.false])])
        )

    @staticmethod
    def _same(operator: str, first: Truth, second: Truth) -> Truth:
        if first.false_text is None and second.false_text is None:
            return Truth(_checked(f"({first.true} {_COMPARISONS[operator]} {second.true})"))
        same = any_of([all_of([first.true, second.true]), all_of([first.false, second.false])])
        other = any_of([all_of([first.true, second.false]), all_of([first.false, second.true])])
        return Truth(same, other) if operator == "=" else Truth(other, same)

    @staticmethod
    def _compared(operator: str, first: Number, second: Number) -> Truth:
        text = _checked(f"({first.text} {_COMPARISONS[operator]} {second.text})")
        known = _both_known(first, second)
        return Truth(text) if known is None else Truth(all_of([known, text]), all_of([known, negated(text)]))

    def _is_boolean(self, expression: Expression) -> bool:
        match expression:
            case Constant(value=value):
                return isinstance(value, bool)
            case VariableRead(component=component, variable=variable):
                return isinstance(subject_type(self._system, Subject(component, variable)), BooleanType)
            case Received(path=path):
                return isinstance(self._data[path].type, BooleanType)
            case Unary(operator=operator):
                return operator != "-"
            case Binary(operator=operator):
                return operator in _COMPARISONS or operator in ("and", "or", "implies")
            case Conditional(then=then):
                return self._is_boolean(then)
            case _:
                return isinstance(expression, StateTest)

    # Integers and enums

    def _number(self, expression: Expression) -> Number:
        match expression:
            case Constant(value=int(value)) if not isinstance(value, bool):
                return Number(integer_text(value), None, value, value)
            case EnumValue(enum=enum, value=value):
                return Number(self._names.values[enum, value], None, 0, 0)
            case VariableRead(component=component, variable=variable):
                subject = Subject(component, variable)
                return Number(self._names.places[subject], None, *_bounds(subject_type(self._system, subject)))
            case Received(path=path):
                datum = self._data[path]
                return Number(datum.name, datum.known, *_bounds(datum.type))
            case Unary(operator="-", operand=operand):
                inner = self._number(operand)
                return _number(f"(-{inner.text})", inner.known, -inner.high, -inner.low)
            case Binary(operator="+" | "-" | "*" as operator, left=left, right=right):
                return self._arithmetic(operator, self._number(left), self._number(right))
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                return self._chosen(self._truth(condition), self._number(then), self._number(otherwise))
            case Call(function="integer", arguments=(argument,)):
                return self._number(argument)
            case Call(function="abs", arguments=(argument,)):
                inner = self._number(argument)
                low, high = sorted((abs(inner.low), abs(inner.high)))
                low = 0 if inner.low <= 0 <= inner.high else low
                return _number(f"({inner.text} < 0 -> -{inner.text} : {inner.text})", inner.known, low, high)
            case Call(function="min" | "max" as function, arguments=(first, second)):
                return self._extreme(function, self._number(first), self._number(second))
            case Call(function="clamp", arguments=(number, low, high)):
                raised = self._extreme("max", self._number(number), self._number(low))
                return self._extreme("min", raised, self._number(high))
            case _:
                raise _NotIntegers

    @staticmethod
    def _arithmetic(operator: str, first: Number, second: Number) -> Number:
        match operator:
            case "+":
                bounds = (first.low + second.low, first.high + second.high)
            case "-":
                bounds = (first.low - second.high, first.high - second.low)
            case _:
                corners = [a * b for a in (first.low, first.high) for b in (second.low, second.high)]
                bounds = (min(corners), max(corners))
        return _number(f"({first.text} {operator} {second.text})", _both_known(first, second), *bounds)

    @staticmethod
    def _extreme(function: str, first: Number, second: Number) -> Number:
        comparison, choose = ("<=", min) if function == "min" else (">=", max)
        text = f"({first.text} {comparison} {second.text} -> {first.text} : {second.text})"
        bounds = choose(first.low, second.low), choose(first.high, second.high)
        return _number(text, _both_known(first, second), *bounds)

    @staticmethod
    def _chosen(test: Truth, then: Number, otherwise: Number) -> Number:
        known = None
        if test.false_text is not None or then.known is not None or otherwise.known is not None:
            known = any_of([all_of([test.true, then.known or "true"]), all_of([test.false, otherwise.known or "true"])])
        text = f"({test.true} -> {then.text} : {otherwise.text})"
        return _number(text, known, min(then.low, otherwise.low), max(then.high, otherwise.high))

    # Lists of values

    def _listed_truth(self, expression: Expression) -> Truth:
        cases = self._cases(expression)
        unknown = cases.pop(None, [])
        true = any_of(cases.get(True, []))
        return Truth(true, any_of(cases.get(False, [])) if unknown else None)

    def _listed_number(self, expression: Expression, type_: Type) -> Number:
        cases = self._cases(expression)
        unknown = cases.pop(None, [])
        values = {index_of(value, type_): tests for value, tests in cases.items()}
        known = any_of([test for tests in values.values() for test in tests]) if unknown else None
        text = "0"
        for value, tests in values.items():
            text = f"({any_of(tests)} -> {integer_text(value)} : {text})"
        return _number(text, known, min(values, default=0), max(values, default=0))

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
        known = [] if datum.known is None else [datum.known]
        found: list[tuple[Value | None, str]] = [
            (value, all_of([*known, f"({datum.name} == {integer_text(index_of(value, datum.type))})"]))
            for value in domain(datum.type)
        ]
        return found if datum.known is None else [*found, (None, negated(datum.known))]


def index_of(value: Value | None, type_: Type) -> int:
    """Return the number for a value in Promela: an integer itself, 0 or 1, or the place of an enum's value."""
    return type_.values.index(str(value)) if isinstance(type_, EnumType) else int(value or 0)


def integer_text(value: int) -> str:
    """An integer as Promela, and C behind it, can read it: neither has negative literals, nor one of 2^31."""
    if value == MINIMUM_INTEGER:
        return f"(-{MAXIMUM_INTEGER} - 1)"
    return str(value) if value >= 0 else f"(-{-value})"


def _number(text: str, known: str | None, low: int, high: int) -> Number:
    if low < MINIMUM_INTEGER or high > MAXIMUM_INTEGER:
        raise _NotIntegers
    return Number(_checked(text), known, low, high)


def _bounds(type_: Type) -> tuple[int, int]:
    match type_:
        case IntegerType(low=int(low), high=int(high)):
            return low, high
        case EnumType(values=values):
            return 0, len(values) - 1
        case _:
            return 0, 1


def _both_known(first: Number, second: Number) -> str | None:
    known = [item for item in (first.known, second.known) if item is not None]
    return all_of(known) if known else None


def negated(text: str) -> str:
    """A negation; `!!` would be another operator of Promela."""
    return text[1:] if text.startswith("!") else f"!{text}"


def all_of(parts: Sequence[str]) -> str:
    """A conjunction."""
    return _joined(parts, "&&", "true", "false")


def any_of(parts: Sequence[str]) -> str:
    """A disjunction."""
    return _joined(parts, "||", "false", "true")


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
