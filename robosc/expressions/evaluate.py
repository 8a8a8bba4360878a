"""The meaning of an expression in a state: the slow, obvious evaluator that everything else must agree with."""

from collections.abc import Callable, Mapping
from typing import Any, assert_never

from robosc.expressions import values
from robosc.expressions.tree import (
    Binary,
    Constant,
    EnumValue,
    Expression,
    PathStep,
    Received,
    StateTest,
    Unary,
    VariableRead,
)
from robosc.expressions.types import Value

BINARY: Mapping[str, Callable[[Any, Any], Any]] = {
    "or": values.or_,
    "and": values.and_,
    "implies": values.implies,
    "=": values.equal,
    "!=": values.unequal,
    "<": values.less,
    "<=": values.less_or_equal,
    ">": values.greater,
    ">=": values.greater_or_equal,
    "+": values.add,
    "-": values.subtract,
    "*": values.multiply,
    "/": values.divide,
}
"""The function of each binary operator."""

UNARY: Mapping[str, Callable[[Any], Any]] = {
    "not": values.not_,
    "-": values.negate,
    "holds": lambda a: a is True,
}
"""The function of each unary operator."""


def evaluate(
    expression: Expression,
    read_variable: Callable[[str, str], Value],
    read_location: Callable[[str], str],
    read_received: Callable[[tuple[PathStep, ...]], Value | None] = lambda path: None,
) -> Value | None:
    """The value of an expression, or None where it is unknown.

    Args:
        expression: A resolved expression.
        read_variable: Value of a variable, given automaton and variable.
        read_location: Current location of an automaton.
        read_received: Received data of a path, or None where it is unknown.
    """
    match expression:
        case Constant(value=value) | EnumValue(value=value):
            return value
        case VariableRead(component=component, variable=variable):
            return read_variable(component, variable)
        case StateTest(component=component, state=state):
            return read_location(component) == state
        case Received(path=path):
            return read_received(path)
        case Unary(operator=operator, operand=operand):
            inner = evaluate(operand, read_variable, read_location, read_received)
            return UNARY[operator](inner)  # type: ignore[no-any-return]  # the table is typed loosely on purpose
        case Binary(operator=operator, left=left, right=right):
            first = evaluate(left, read_variable, read_location, read_received)
            second = evaluate(right, read_variable, read_location, read_received)
            return BINARY[operator](first, second)  # type: ignore[no-any-return]
    assert_never(expression)
