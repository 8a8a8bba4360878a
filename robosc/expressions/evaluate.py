"""The value of an expression in a state: the slow, obvious evaluator that all other ones must agree with."""

from collections.abc import Callable, Mapping
from typing import Any, assert_never

from robosc.expressions import values
from robosc.expressions.tree import (
    Binary,
    Call,
    Conditional,
    Constant,
    Element,
    EnumValue,
    Expression,
    PathStep,
    Quantifier,
    Received,
    Reduction,
    StateTest,
    Unary,
    VariableRead,
)
from robosc.expressions.types import Value


def _whole_quotient(a: Any, b: Any) -> Any:
    """The quotient of two integers, towards zero; unknown for division by zero or beyond 32 bits."""
    if a is None or b is None or b == 0:
        return None
    quotient = abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)
    return values.add(quotient, 0)


def _remainder(a: Any, b: Any) -> Any:
    """Return the remainder of a division, with the sign of the dividend; unknown for division by zero."""
    if a is None or b is None or b == 0:
        return None
    return abs(a) % abs(b) * (-1 if a < 0 else 1)


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
    "div": _whole_quotient,
    "mod": _remainder,
}
"""The function of each binary operator."""

UNARY: Mapping[str, Callable[[Any], Any]] = {
    "not": values.not_,
    "-": values.negate,
    "holds": lambda a: a is True,
}
"""The function of each unary operator."""


CALL: Mapping[str, Callable[..., Any]] = {
    "abs": values.absolute,
    "min": values.minimum,
    "max": values.maximum,
    "clamp": values.clamp,
    "integer": values.to_integer,
    "double": values.to_double,
}
"""The meaning of each function of numbers."""

REDUCTION: Mapping[str, Callable[[Any], Any]] = {
    "length": values.array_length,
    "min": values.least,
    "max": values.greatest,
}
"""The meaning of each reduction of an array's elements."""

QUANTIFIER: Mapping[str, Callable[[Any, Any], Any]] = {"any": values.any_of, "all": values.all_of}
"""The meaning of each quantifier."""

Elements = tuple[Any, ...]
"""Elements that the quantifiers around an expression look at, the innermost first."""


def evaluate(
    expression: Expression,
    read_variable: Callable[[str, str], Value],
    read_location: Callable[[str], str],
    read_received: Callable[[tuple[PathStep, ...]], Any] = lambda path: None,
    elements: Elements = (),
) -> Any:
    """Return the value of an expression, or None where it is unknown.

    Args:
        expression: A resolved expression.
        read_variable: Value of a variable, given automaton and variable.
        read_location: Current location of an automaton.
        read_received: Received data of a path, or None where it is unknown; an array is a sequence of values,
            a property of an object a mapping's item.
        elements: Elements that the quantifiers around it look at.
    """

    def part(node: Expression, inner: Elements = elements) -> Any:
        return evaluate(node, read_variable, read_location, read_received, inner)

    match expression:
        case Constant(value=value) | EnumValue(value=value):
            return value
        case VariableRead(component=component, variable=variable):
            return read_variable(component, variable)
        case StateTest(component=component, state=state):
            return read_location(component) == state
        case Received(path=path):
            return read_received(path)
        case Element(level=level, path=path):
            return values.part_at(elements[level], path)
        case Unary(operator=operator, operand=operand):
            return UNARY[operator](part(operand))
        case Binary(operator=operator, left=left, right=right):
            return BINARY[operator](part(left), part(right))
        case Conditional(condition=condition, then=then, otherwise=otherwise):
            return values.conditional(part(condition), part(then), part(otherwise))
        case Call(function=function, arguments=arguments):
            return CALL[function](*map(part, arguments))
        case Reduction(function=function, part=where):
            return REDUCTION[function](values.array_part(part(where.array), where.low, where.high))
        case Quantifier(word=word, part=where, condition=condition):
            looked_at = values.array_part(part(where.array), where.low, where.high)
            return QUANTIFIER[word](looked_at, lambda element: part(condition, (element, *elements)))
    assert_never(expression)
