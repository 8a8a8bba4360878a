"""Expressions as predicates: connectives become operations on diagrams, and few values are enumerated.

Wide integers have too many values: their comparisons and updates become linear relations.
"""

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
    Call,
    Conditional,
    Constant,
    Expression,
    Received,
    StateTest,
    Unary,
    Value,
    VariableRead,
)
from robosc.verification.symbolic.linear import Cases, Form, Linear, NotLinearError
from robosc.verification.symbolic.variables import Digits, Variables
from robosc.verification.symbolic.work import TooMuchWorkError

MAXIMUM_VALUATIONS = 50_000
"""Combinations of values for which one expression is worked out."""

FEW_VALUATIONS = 500
"""Combinations up to which that is done even where the expression is linear."""

_CONNECTIVES = ("and", "or", "implies")
_COMPARISONS = ("=", "!=", "<", "<=", ">", ">=")


@dataclass(frozen=True, slots=True)
class Truth:
    """Predicates that a condition is true and that it is false; elsewhere it is unknown."""

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
        self._linear = Linear(variables)

    def truth(self, expression: Expression) -> Truth:
        """Return the predicates that a condition is true and that it is false."""
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
        """Return True if an operation is one between two conditions."""
        return item.operator in _CONNECTIVES or (
            item.operator in ("=", "!=") and self.is_condition(item.left) and self.is_condition(item.right)
        )

    def is_condition(self, expression: Expression) -> bool:
        """Return True if an expression is certainly boolean."""
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
        if isinstance(expression, Binary) and expression.operator in _COMPARISONS:
            left, right = self.integer(expression.left, expression), self.integer(expression.right, expression)
            if left is not None and right is not None:
                return self._compared(expression.operator, left, right)
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

    def _compared(self, operator: str, left: Cases, right: Cases) -> Truth:
        variables = self._variables
        true = false = variables.manager.false
        for first, one in left:
            for second, other in right:
                both = first & second
                if both != variables.manager.false:
                    outcome = self._linear.compared(operator, one, other)
                    true, false = variables.work.count(true | (both & outcome)), false | (both & ~outcome)
        return self._counted(true, false)

    # Integers

    def integer(self, expression: Expression, whole: Expression) -> Cases | None:
        """The linear forms of an integer; None where it has none, or where the whole it is in has few values."""
        if self._valuations(whole) <= FEW_VALUATIONS:
            return None
        try:
            return self._integer(expression)
        except NotLinearError:
            return None

    def equal(self, form: Form, digits: Digits) -> Any:
        """Return the predicate that a form and some digits are the same integer."""
        return self._linear.compared("=", form, self._linear.form(digits))

    def between(self, form: Form, low: int, high: int) -> Any:
        """Return the predicate that a form is between two numbers."""
        return self._linear.between(form, low, high)

    def _valuations(self, expression: Expression) -> int:
        """Return the number of combinations of values of what an expression reads."""
        places = (self._variables.place_of[subject] for subject in subjects_read(expression))
        count = prod(self._variables.places[place].size() for place in places)
        return count * prod(self._data(path).size() for path in paths_read(expression))

    def _integer(self, expression: Expression) -> Cases:
        spine: list[Binary] = []
        while isinstance(expression, Binary):
            spine.append(expression)
            expression = expression.left
        result = self._integer_operand(expression)
        functions = {
            "+": lambda one, other: [(self._variables.manager.true, one.plus(other))],
            "-": lambda one, other: [(self._variables.manager.true, one.plus(other, -1))],
            "*": self._linear.product,
            "div": self._linear.quotient,
            "mod": self._linear.remainder,
        }
        for item in reversed(spine):
            if item.operator not in functions:
                raise NotLinearError
            result = self._linear.joined(result, self._integer(item.right), functions[item.operator])
        return result

    def _integer_operand(self, expression: Expression) -> Cases:
        linear, true = self._linear, self._variables.manager.true
        match expression:
            case Constant(value=int(value)) if not isinstance(value, bool):
                return ((true, Form((), value)),)
            case VariableRead(component=component, variable=variable):
                return self._read(self._variables.places[self._variables.place_of[Subject(component, variable)]])
            case Received(path=path):
                return self._read(self._data(path))
            case Unary(operator="-", operand=operand):
                return linear.collected((where, form.times(-1)) for where, form in self._integer(operand))
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                test = self.truth(condition)
                yes = [(test.true & where, form) for where, form in self._integer(then)]
                return linear.collected(
                    [*yes, *((test.false & where, form) for where, form in self._integer(otherwise))]
                )
            case Call(function="integer", arguments=(argument,)):
                return self._integer(argument)
            case Call(function="abs", arguments=(argument,)):
                return linear.joined(
                    self._integer(argument), ((true, Form((), 0)),), lambda one, _: linear.greater(one, one.times(-1))
                )
            case Call(function="min", arguments=(first, second)):
                return linear.joined(self._integer(first), self._integer(second), linear.lesser)
            case Call(function="max", arguments=(first, second)):
                return linear.joined(self._integer(first), self._integer(second), linear.greater)
            case Call(function="clamp", arguments=(value, low, high)):
                raised = linear.joined(self._integer(value), self._integer(low), linear.greater)
                return linear.joined(raised, self._integer(high), linear.lesser)
        raise NotLinearError

    def _read(self, digits: Digits) -> Cases:
        if not isinstance(digits.values, range):
            raise NotLinearError
        manager = self._variables.manager
        known = manager.true if digits.known is None else manager.var(digits.known)
        return ((known, self._linear.form(digits)),)

    # Tables

    def table(self, expression: Expression) -> "Table":
        """The value of an expression for all values of what it reads.

        Raises:
            TooMuchWorkError: There are too many.
        """
        variables = self._variables
        places = sorted(variables.place_of[subject] for subject in subjects_read(expression))
        paths = paths_read(expression)
        read = [*(variables.places[place] for place in places), *(self._data(path) for path in paths)]
        count = self._valuations(expression)
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
        read: Digits that it reads.
        values: Its value for each combination of values of what it reads, the last of them varying fastest; None
            where it is unknown.
    """

    variables: Variables
    read: Sequence[Digits]
    values: Sequence[Value | None]

    def where(self, leaf: Callable[[Value | None], Any]) -> Any:
        """Return the predicate combined from a predicate for each value."""
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
