"""Meaning of a CIF expression: its type, and a static value or an expression of the automata.

An expression that synthesis does not support is an error only where it is used, so a term carries the reason along.
"""

import math
from collections.abc import Callable, Mapping
from itertools import product
from typing import Any

import msgspec
from msgspec.structs import replace

from robosc.cif.types import BOOL, UNKNOWN, CifType, integer
from robosc.expressions import MINIMUM_INTEGER, Binary, Conditional, Constant, EnumValue, Expression, Unary, children
from robosc.source import Location

MAXIMUM_SIZE = 20_000
"""Operators of an expression, algebraic variables written out, beyond which it is refused."""

MAXIMUM_DEPTH = 400


class Problem(msgspec.Struct, frozen=True):
    """A part of an expression that synthesis cannot take."""

    message: str
    location: Location


class Term(msgspec.Struct, frozen=True, eq=False):
    """Meaning of an expression.

    Attributes:
        type: Its type.
        value: Its static value, if `is_static`: a literal of an enum is its name, a list or tuple a Python tuple, a
            set a frozenset, a dictionary a frozenset of pairs.
        is_static: True if it is the same in every state.
        expression: The expression, if it is a boolean, an integer or a literal of an enum that is not static.
        parts: Terms of a tuple that is not static.
        problems: Parts that synthesis cannot take.
        size: Number of operators in it.
        depth: Number of operators that are nested.
    """

    type: CifType
    value: Any = None
    is_static: bool = False
    expression: Expression | None = None
    parts: tuple["Term", ...] = ()
    problems: tuple[Problem, ...] = ()
    size: int = 1
    depth: int = 1

    @property
    def core(self) -> Expression:
        """The expression of the automata; only of a term without problems."""
        if self.is_static:
            return EnumValue(self.type.name, self.value) if self.type.kind == "enum" else Constant(self.value)
        assert self.expression is not None  # noqa: S101 - a term without problems has one
        return self.expression

    @property
    def is_usable(self) -> bool:
        """True if the automata have an expression for it."""
        has_value = self.is_static and self.type.kind in ("bool", "int", "enum")
        return not self.problems and (has_value or self.expression is not None)


ERROR = Term(UNKNOWN)
"""Meaning of an expression with an error that has been reported."""


def static(type_: CifType, value: Any) -> Term:
    """A term with a static value."""
    return Term(type_, value, is_static=True)


def truth(value: bool) -> Term:
    """The term `true` or `false`."""
    return static(BOOL, value)


def number(value: int) -> Term:
    """The term of an integer."""
    return static(integer(value, value), value)


def made(type_: CifType, expression: Expression, *operands: Term) -> Term:
    """A term of an expression of the automata over operands."""
    size = 1 + sum(item.size for item in operands)
    depth = 1 + max((item.depth for item in operands), default=0)
    return Term(type_, expression=expression, size=size, depth=depth)


def broken(type_: CifType, *operands: Term, problem: Problem | None = None) -> Term:
    """A term that synthesis cannot take, because of its operands or by itself."""
    found = dict.fromkeys(item for operand in operands for item in operand.problems)
    if problem is not None:
        found[problem] = None
    return Term(type_, problems=tuple(found))


def negation(term: Term) -> Term:
    """The term that is true where another is false."""
    if term.is_static:
        return truth(not term.value)
    if term.type.kind == "unknown":
        return ERROR
    if term.problems or term.expression is None:
        return broken(BOOL, term)
    return made(BOOL, Unary("not", term.expression), term)


def logic(operator: str, left: Term, right: Term) -> Term:
    """Two booleans joined by `and`, `or`, `=>`, `<=>`, `=` or `!=`."""
    if "unknown" in (left.type.kind, right.type.kind):
        return ERROR
    if left.problems or right.problems:
        return broken(BOOL, left, right)
    if operator == "=>":
        return logic("or", negation(left), right)
    if operator in ("<=>", "=", "!="):
        is_equality = operator != "!="
        if left.is_static:
            return right if left.value is is_equality else negation(right)
        if right.is_static:
            return left if right.value is is_equality else negation(left)
        return made(BOOL, Binary("=" if is_equality else "!=", left.core, right.core), left, right)
    for one, other in ((left, right), (right, left)):
        if one.is_static:
            return one if one.value is (operator == "or") else other
    return made(BOOL, Binary("and" if operator == "and" else "or", left.core, right.core), left, right)


def conditional(condition: Term, then: Term, otherwise: Term, type_: CifType) -> Term:
    """`if condition: then else otherwise end`, of one type."""
    if "unknown" in (condition.type.kind, then.type.kind, otherwise.type.kind):
        return ERROR
    if condition.is_static:
        return retyped(then if condition.value else otherwise, type_)
    if type_.kind == "tuple" and not condition.problems:
        pairs = zip(tuple_parts(retyped(then, type_)), tuple_parts(retyped(otherwise, type_)), type_.parts, strict=True)
        parts = tuple(conditional(condition, one, other, part) for one, other, part in pairs)
        return tuple_term(type_, parts)
    if not (condition.is_usable and then.is_usable and otherwise.is_usable):
        return broken(type_, condition, then, otherwise)
    return made(type_, Conditional(condition.core, then.core, otherwise.core), condition, then, otherwise)


def tuple_parts(term: Term) -> tuple[Term, ...]:
    """Terms of the fields of a tuple."""
    if term.parts:
        return term.parts
    if term.is_static:
        return tuple(static(type_, value) for type_, value in zip(term.type.parts, term.value, strict=True))
    return tuple(broken(type_, term) for type_ in term.type.parts)


def flat(term: Term) -> list[Term]:
    """The term, or those of the fields of a tuple, however deep."""
    return [item for part in tuple_parts(term) for item in flat(part)] if term.type.kind == "tuple" else [term]


def tuple_term(type_: CifType, parts: tuple[Term, ...]) -> Term:
    """A tuple of terms."""
    if all(part.is_static for part in parts):
        return static(type_, tuple(part.value for part in parts))
    found = dict.fromkeys(item for part in parts for item in part.problems)
    size, depth = sum(part.size for part in parts), max(part.depth for part in parts)
    return Term(type_, parts=parts, problems=tuple(found), size=size, depth=depth)


def retyped(term: Term, type_: CifType) -> Term:
    """A term as one of the type that is declared for it."""
    if "unknown" in (term.type.kind, type_.kind):
        return ERROR
    parts = tuple(retyped(part, expected) for part, expected in zip(term.parts, type_.parts, strict=bool(term.parts)))
    return replace(term, type=type_, parts=parts)


def values_of(type_: CifType, most: int) -> list[Any] | None:
    """Every value of a type; None if there may be more than `most`."""
    match type_.kind:
        case "bool":
            return [False, True]
        case "enum":
            return list(type_.names)
        case "int":
            low, high = type_.range
            return list(range(low, high + 1)) if high - low < most else None
        case "tuple":
            return _rows([values_of(part, most) for part in type_.parts], most)
        case "list" if type_.low is not None and type_.range[1] <= most:
            items = values_of(type_.parts[0], most)
            found: list[Any] = []
            for length in range(type_.low, type_.range[1] + 1):
                rows = _rows([items] * length, most)
                if rows is None or len(found) + len(rows) > most:
                    return None
                found += rows
            return found
        case _:
            return None


def _rows(columns: list[list[Any] | None], most: int) -> list[Any] | None:
    """Every combination of one value of each column."""
    known = [column for column in columns if column is not None]
    if len(known) < len(columns) or math.prod(map(len, known)) > most:
        return None
    return list(product(*known))


def enum_comparison(operator: str, left: Expression, right: Expression) -> Expression:
    """Comparison of two expressions of an enum: a choice between literals becomes one between truth values.

    The automata know an enum only by the variables that have it.
    """
    for one, other in ((left, right), (right, left)):
        if isinstance(one, Conditional):
            then = enum_comparison(operator, one.then, other)
            return Conditional(one.condition, then, enum_comparison(operator, one.otherwise, other))
    if isinstance(left, EnumValue) and isinstance(right, EnumValue):
        return Constant((left.value == right.value) is (operator == "="))
    return Binary("=" if operator == "=" else "!=", left, right)


def depth_of(expression: Expression) -> int:
    """Number of operators that are nested."""
    deepest, stack = 0, [(expression, 1)]
    while stack:
        node, depth = stack.pop()
        deepest = max(deepest, depth)
        stack += [(child, depth + 1) for child in children(node)]
    return deepest


def quotient(a: int, b: int) -> int:
    """The whole quotient, towards zero (ZeroDivisionError for a divisor of zero)."""
    found = abs(a) // abs(b)
    return found if (a < 0) == (b < 0) else -found


def remainder(a: int, b: int) -> int:
    """The remainder, with the sign of the dividend (ZeroDivisionError for a divisor of zero)."""
    return a - b * quotient(a, b)


def result_range(operator: str, left: tuple[int, int], right: tuple[int, int]) -> tuple[int, int]:
    """Least and greatest result of an operator on integers."""
    (a, b), (c, d) = left, right
    match operator:
        case "+":
            return a + c, b + d
        case "-":
            return a - d, b - c
        case "*":
            corners = (a * c, a * d, b * c, b * d)
            return min(corners), max(corners)
    divisors = {item for item in (c, d, *(near for near in (-2, -1, 1) if c <= near <= d)) if item}
    if operator == "div":
        # The least integer has no opposite: what divides it by -1 fails.
        dividends = {a, b, *(near for near in (MINIMUM_INTEGER + 1,) if a <= near <= b)}
        results = {quotient(*pair) for pair in product(dividends, divisors) if pair != (MINIMUM_INTEGER, -1)}
        return min(results), max(results)
    # Wider than it must be, as CIF has it.
    largest = max(abs(c), abs(d)) - 1
    return (-largest if a < 0 else 0), (largest if b >= 0 else 0)


def rounded(a: float) -> int:
    """The nearest integer, halves upwards."""
    return math.floor(a + 0.5)


MATHEMATICS: Mapping[str, Callable[[float], float]] = {
    name: getattr(math, name)
    for name in "acos acosh asin asinh atan atanh cos cosh sin sinh tan tanh exp sqrt cbrt".split()
} | {"ln": math.log, "log": math.log10}
"""Functions from real to real."""
