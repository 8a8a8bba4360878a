"""Expressions as predicates: connectives become operations on diagrams, all else is worked out value by value."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any

from robosc.automata.compile import Path, compile_expression, paths_read, subjects_read
from robosc.automata.state import Subject, subject_type
from robosc.expressions import (
    Binary,
    BooleanType,
    Conditional,
    Constant,
    Expression,
    Received,
    StateTest,
    Unary,
    Value,
    VariableRead,
)
from robosc.verification.symbolic.variables import Digits, Variables
from robosc.verification.symbolic.work import TooMuchWorkError

MAXIMUM_VALUATIONS = 50_000
"""Combinations of values for which one expression is worked out."""

_CONNECTIVES = ("and", "or", "implies")
_COMPARISONS = ("=", "!=", "<", "<=", ">", ">=")


@dataclass(frozen=True, slots=True)
class Truth:
    """Where a condition is true and where it is false; elsewhere it is unknown."""

    true: Any
    false: Any


class Expressions:
    """The expressions of one event, or those that read no data.

    Args:
        variables: The variables.
        event: The event whose data they may read, or None.
    """

    def __init__(self, variables: Variables, event: str | None = None) -> None:
        self._variables = variables
        self._event = event
        self._known: dict[Expression, Truth] = {}

    def truth(self, expression: Expression) -> Truth:
        """Where a condition is true and where it is false."""
        # A chain is a tree as deep as it is long, leaning left: a loop takes it.
        spine: list[Binary] = []
        while isinstance(expression, Binary) and self._is_split(expression):
            spine.append(expression)
            expression = expression.left
        result = self._operand(expression)
        for item in reversed(spine):
            result = self._combined(item.operator, result, self.truth(item.right))
        return result

    def _is_split(self, item: Binary) -> bool:
        """Whether an operation is one between two conditions."""
        return item.operator in _CONNECTIVES or (
            item.operator in ("=", "!=") and self.is_condition(item.left) and self.is_condition(item.right)
        )

    def is_condition(self, expression: Expression) -> bool:
        """Whether an expression is certainly boolean."""
        match expression:
            case Binary(operator=operator):
                return operator in _CONNECTIVES or operator in _COMPARISONS
            case Unary(operator=operator):
                return operator != "-"
            case StateTest():
                return True
            case Constant(value=value):
                return isinstance(value, bool)
            case VariableRead(component=component, variable=variable):
                return isinstance(subject_type(self._variables.system, Subject(component, variable)), BooleanType)
            case _:
                return False

    def _operand(self, expression: Expression) -> Truth:
        match expression:
            case Unary(operator="not", operand=operand):
                inner = self.truth(operand)
                return Truth(inner.false, inner.true)
            case Unary(operator="holds", operand=operand):
                inner = self.truth(operand)
                return Truth(inner.true, ~inner.true)
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                test, yes, no = self.truth(condition), self.truth(then), self.truth(otherwise)
                return Truth(
                    (test.true & yes.true) | (test.false & no.true), (test.true & yes.false) | (test.false & no.false)
                )
            case StateTest() | VariableRead():
                found = self._known.get(expression)
                if found is None:
                    found = self._known[expression] = self._worked_out(expression)
                return found
            case _:
                return self._worked_out(expression)

    def _worked_out(self, expression: Expression) -> Truth:
        table, manager = self.table(expression), self._variables.manager
        return Truth(
            table.where(lambda value: manager.true if value is True else manager.false),
            table.where(lambda value: manager.true if value is False else manager.false),
        )

    def _combined(self, operator: str, a: Truth, b: Truth) -> Truth:
        match operator:
            case "and":
                return self._counted(a.true & b.true, a.false | b.false)
            case "or":
                return self._counted(a.true | b.true, a.false & b.false)
            case "implies":
                return self._counted(a.false | b.true, a.true & b.false)
            case _:
                same, other = (a.true & b.true) | (a.false & b.false), (a.true & b.false) | (a.false & b.true)
                return self._counted(same, other) if operator == "=" else self._counted(other, same)

    def _counted(self, true: Any, false: Any) -> Truth:
        count = self._variables.work.count
        return Truth(count(true), count(false))

    def table(self, expression: Expression) -> "Table":
        """The value of an expression for all values of what it reads.

        Raises:
            TooMuchWorkError: There are too many.
        """
        variables = self._variables
        places = sorted(variables.place_of[subject] for subject in subjects_read(expression))
        paths = paths_read(expression)
        read = [*(variables.places[place] for place in places), *(self._data(path) for path in paths)]
        count = prod(digits.size() for digits in read)
        if count > MAXIMUM_VALUATIONS:
            raise TooMuchWorkError(f"an expression has {count} values")
        variables.work.spend(count)
        function = compile_expression(expression, variables.place_of)
        state: list[Any] = [None] * len(variables.places)
        values = []
        for combination in product(*(digits.choices() for digits in read)):
            for place, value in zip(places, combination, strict=False):
                state[place] = value
            data = dict(zip(paths, combination[len(places) :], strict=True))
            values.append(function(tuple(state), data))
        return Table(variables, read, values)

    def _data(self, path: Path) -> Digits:
        if self._event is None:
            raise TooMuchWorkError(f"data is read where no event brings any: {Received(path)}")
        return self._variables.data[self._event, path]


@dataclass(frozen=True, slots=True)
class Table:
    """The values of an expression.

    Attributes:
        variables: The variables.
        read: What it reads.
        values: Its value for each combination of values of what it reads, the last of them varying fastest; None
            where it is unknown.
    """

    variables: Variables
    read: Sequence[Digits]
    values: Sequence[Value | None]

    def where(self, leaf: Callable[[Value | None], Any]) -> Any:
        """What a predicate for each value makes together."""
        known = {_key(value): value for value in self.values}
        made = {key: leaf(value) for key, value in known.items()}
        level = [made[_key(value)] for value in self.values]
        for digits in reversed(self.read):
            size = digits.size()
            level = [self.variables.chosen(digits, level[start : start + size]) for start in range(0, len(level), size)]
        return level[0]


def _key(value: Value | None) -> tuple[type, Value | None]:
    """True is not 1."""
    return type(value), value
