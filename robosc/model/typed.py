"""Typed expressions: compatibility of types, and the types and bounds of results."""

import msgspec

from robosc.errors import InternalError
from robosc.expressions import (
    MAXIMUM_INTEGER,
    MINIMUM_INTEGER,
    ArrayType,
    BooleanType,
    Call,
    Constant,
    DoubleType,
    EnumValue,
    Expression,
    IntegerType,
    NoneType,
    ObjectType,
    StringType,
    Type,
    Value,
    is_numeric,
    leaves,
)
from robosc.expressions.bounds import call_bounds
from robosc.expressions.evaluate import evaluate


class Typed(msgspec.Struct, frozen=True):
    """A resolved expression, its type, and for a bounded integer the values it can have.

    Attributes:
        expression: The expression.
        type: Its type; an integer's bounds are those its value can have.
    """

    expression: Expression
    type: Type


def fits(found: Type, wanted: Type) -> bool:
    """Return True if a value of one type can stand where another is wanted (ranges are judged elsewhere)."""
    return same_kind(found, wanted) or (isinstance(found, IntegerType) and isinstance(wanted, DoubleType))


def may_leave(found: Type, wanted: Type) -> bool:
    """Return True if an integer can lie outside the range that is wanted."""
    if not isinstance(found, IntegerType) or not isinstance(wanted, IntegerType) or not wanted.is_bounded:
        return False
    (low, high), (least, most) = bounds_of(found), bounds_of(wanted)
    return low < least or high > most


def same_kind(first: Type, second: Type) -> bool:
    """Return True if two types are one, whatever the ranges of integers."""
    if isinstance(first, IntegerType) and isinstance(second, IntegerType):
        return True
    return first == second


def literal_type(value: bool | int | float | str) -> Type:
    """The type of a literal; an integer has no other value than its own."""
    match value:
        case bool():
            return BooleanType()
        case int():
            return IntegerType(value, value)
        case float():
            return DoubleType()
        case _:
            return StringType()


def bounds_of(type_: IntegerType) -> tuple[int, int]:
    """The least and the greatest value of an integer type."""
    low = MINIMUM_INTEGER if type_.low is None else type_.low
    high = MAXIMUM_INTEGER if type_.high is None else type_.high
    return low, high


def bounded_integer(low: int, high: int) -> IntegerType:
    """An integer of these bounds; results beyond 32 bits are unknown, so they need no place."""
    return IntegerType(max(low, MINIMUM_INTEGER), min(high, MAXIMUM_INTEGER))


def arithmetic(operator: str, left: IntegerType, right: IntegerType) -> IntegerType:
    """Bounds of a sum, difference or product (interval arithmetic)."""
    (a, b), (c, d) = bounds_of(left), bounds_of(right)
    match operator:
        case "+":
            return bounded_integer(a + c, b + d)
        case "-":
            return bounded_integer(a - d, b - c)
        case _:
            corners = (a * c, a * d, b * c, b * d)
            return bounded_integer(min(corners), max(corners))


def common_type(first: Type, second: Type) -> Type | None:
    """The type of a value that is one of two, or None where they do not go together."""
    if isinstance(first, IntegerType) and isinstance(second, IntegerType):
        (a, b), (c, d) = bounds_of(first), bounds_of(second)
        return IntegerType(min(a, c), max(b, d))
    if is_numeric(first) and is_numeric(second):
        return DoubleType()
    return first if first == second and not isinstance(first, ObjectType | ArrayType | NoneType) else None


def as_type(typed: Typed, common: Type) -> Expression:
    """An expression of a common type: an integer beside doubles becomes one, or it would overflow like an integer."""
    if isinstance(typed.type, IntegerType) and isinstance(common, DoubleType):
        return Call("double", (typed.expression,))
    return typed.expression


def applied(name: str, arguments: tuple[Typed, ...]) -> Typed:
    """A function of numbers, with the bounds that an integer result can have (interval arithmetic)."""
    types = [item.type for item in arguments]
    common = types[0] if all(isinstance(type_, IntegerType) for type_ in types) else DoubleType()
    parts = tuple(item.expression if len(types) == 1 else as_type(item, common) for item in arguments)
    call = Call(name, parts)  # type: ignore[arg-type]  # one of `ARGUMENTS`
    if name == "double":
        return Typed(call, DoubleType())
    if name == "integer":
        (type_,) = types
        return Typed(call, type_ if isinstance(type_, IntegerType) else IntegerType(MINIMUM_INTEGER, MAXIMUM_INTEGER))
    if not all(isinstance(type_, IntegerType) for type_ in types):
        return Typed(call, DoubleType())
    bounds = [bounds_of(type_) for type_ in types if isinstance(type_, IntegerType)]
    return Typed(call, bounded_integer(*call_bounds(name, bounds)))


def constant_value(expression: Expression) -> Value | None:
    """The value of an expression of constants; None for any other one, and for one that is unknown."""
    if not all(isinstance(leaf, Constant | EnumValue) for leaf in leaves(expression)):
        return None
    return evaluate(expression, _not_constant, _not_constant)  # type: ignore[no-any-return]


def _not_constant(*names: str) -> str:
    raise InternalError(f"{names} was taken for a constant")
