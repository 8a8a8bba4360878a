"""Functions of CIF: evaluated for static values; over a state, synthesis supports some of those of integers."""

import math
from collections.abc import Callable, Mapping

from robosc.cif import syntax
from robosc.cif.operators import Operators, value_text
from robosc.cif.terms import MATHEMATICS, Problem, Term, broken, made, number, rounded, static, truth
from robosc.cif.text_patterns import formatted
from robosc.cif.types import BOOL, REAL, STRING, CifType, integer
from robosc.expressions import MAXIMUM_INTEGER, MINIMUM_INTEGER, Call
from robosc.expressions.bounds import call_bounds

_INTEGER = CifType("int")
_WHOLE: Mapping[str, Callable[[float], int]] = {"ceil": math.ceil, "floor": math.floor, "round": rounded}


def call(operators: Operators, node: syntax.Call, arguments: list[Term]) -> Term:
    """The term of a call of one of the language's functions."""
    name = str(node.function)
    kinds = [item.type.kind for item in arguments]
    is_static = all(item.is_static for item in arguments)
    values = [item.value for item in arguments]
    numbers = all(kind in ("int", "real") for kind in kinds)
    try:
        match name:
            case "ceil" | "floor" | "round" if kinds == ["real"]:
                return (
                    _whole(operators, node, _WHOLE[name](values[0]))
                    if is_static
                    else _broken(_INTEGER, node, arguments)
                )
            case "abs" if len(kinds) == 1 and numbers:
                return _of_numbers(operators, node, arguments, abs)
            case "min" | "max" if len(kinds) == 2 and numbers:
                return _of_numbers(operators, node, arguments, min if name == "min" else max)
            case "sign" if len(kinds) == 1 and numbers:
                if not is_static:
                    return _broken(integer(-1, 1), node, arguments)
                return number((values[0] > 0) - (values[0] < 0))
            case "pow" if len(kinds) == 2 and numbers:
                return _power(operators, node, arguments)
            case _ if name in MATHEMATICS and len(kinds) == 1 and numbers:
                if not is_static:
                    return _broken(REAL, node, arguments)
                return operators.real(MATHEMATICS[name](float(values[0])), node.at)
            case "size" if kinds in (["list"], ["set"], ["dict"], ["string"]):
                return number(len(values[0])) if is_static else _broken(_INTEGER, node, arguments)
            case "empty" if kinds in (["list"], ["set"], ["dict"]):
                return truth(not values[0]) if is_static else _broken(BOOL, node, arguments)
            case "fmt" if kinds[:1] == ["string"]:
                return _formatted(operators, node, arguments)
            case "scale" if len(kinds) == 5 and numbers:
                if not is_static:
                    return _broken(REAL, node, arguments)
                return _scaled(operators, node, [float(value) for value in values])
            case "pop" if kinds == ["list"]:
                return _popped(operators, node, arguments[0])
            case "del" if kinds == ["list", "int"]:
                return _deleted(operators, node, arguments)
            case _ if name in _DISTRIBUTIONS and (name == "constant" or numbers):
                kind = _DISTRIBUTIONS[name] or (REAL if "real" in kinds else arguments[0].type if kinds else REAL)
                problem = Problem("this makes a distribution", node.at)
                return broken(CifType("dist", parts=(kind,)), *arguments, problem=problem)
    except (ValueError, OverflowError):
        return operators.mismatch(f"'{name}' has no value here", node.at)
    types = " and ".join(str(item.type) for item in arguments) or "nothing"
    return operators.mismatch(f"'{name}' does not take {types}", node.at)


_DISTRIBUTIONS: Mapping[str, CifType | None] = (
    dict.fromkeys("beta erlang exponential gamma lognormal normal random triangle weibull".split(), REAL)
    | dict.fromkeys(("binomial", "geometric", "poisson"), _INTEGER)
    | {"bernoulli": BOOL, "uniform": None, "constant": None}
)
"""Type of the samples of each distribution; None: that of its parameters."""


def _formatted(operators: Operators, node: syntax.Call, arguments: list[Term]) -> Term:
    pattern = node.arguments[0]
    if not isinstance(pattern, syntax.Literal):
        return operators.mismatch("the pattern of 'fmt' must be written out", pattern.at, "Write a text in quotes.")
    if not all(item.is_static for item in arguments):
        return _broken(STRING, node, arguments)
    try:
        return static(STRING, formatted(str(pattern.value), arguments[1:], value_text))
    except ValueError as error:
        return operators.mismatch(str(error), pattern.at, "Write a specifier that fits for each value.")


def _scaled(operators: Operators, node: syntax.Call, values: list[float]) -> Term:
    value, low, high, least, greatest = values
    if low == high:
        return operators.mismatch("'scale' has no value here", node.at)
    return operators.real(least + (value - low) / (high - low) * (greatest - least), node.at)


def _popped(operators: Operators, node: syntax.Call, term: Term) -> Term:
    """The first element of a list, and the others."""
    element = term.type.parts[0]
    type_ = CifType("tuple", parts=(element, CifType("list", parts=(element,))))
    if not term.is_static:
        return _broken(type_, node, [term])
    if not term.value:
        return operators.mismatch("'pop' has no value here", node.at)
    return static(type_, (term.value[0], term.value[1:]))


def _deleted(operators: Operators, node: syntax.Call, arguments: list[Term]) -> Term:
    """A list without the element of an index."""
    type_ = CifType("list", parts=arguments[0].type.parts)
    if not all(item.is_static for item in arguments):
        return _broken(type_, node, arguments)
    items, index = arguments[0].value, arguments[1].value
    if not -len(items) <= index < len(items):
        return operators.mismatch(f"there is no element {index}", node.at)
    index %= len(items)
    return static(type_, (*items[:index], *items[index + 1 :]))


def _broken(type_: CifType, node: syntax.Call, arguments: list[Term]) -> Term:
    return broken(type_, *arguments, problem=Problem(f"'{node.function}' has a value of a state", node.at))


def _whole(operators: Operators, node: syntax.Call, value: int) -> Term:
    if not MINIMUM_INTEGER <= value <= MAXIMUM_INTEGER:
        return operators.mismatch("the result leaves 32 bits", node.at)
    return number(value)


def _of_numbers(operators: Operators, node: syntax.Call, arguments: list[Term], function: object) -> Term:
    """The least, greatest or absolute value of numbers."""
    assert callable(function)  # noqa: S101 - one of Python's own
    if any(item.type.kind == "real" for item in arguments):
        if not all(item.is_static for item in arguments):
            return _broken(REAL, node, arguments)
        return static(REAL, float(function(*(item.value for item in arguments))))
    if all(item.is_static for item in arguments):
        return _whole(operators, node, function(*(item.value for item in arguments)))
    low, high = call_bounds(str(node.function), [item.type.range for item in arguments])
    type_ = integer(low, min(high, MAXIMUM_INTEGER))
    if not all(item.is_usable for item in arguments):
        return broken(type_, *arguments)
    core = tuple(item.core for item in arguments)
    return made(type_, Call(str(node.function), core), *arguments)  # type: ignore[arg-type]


def _power(operators: Operators, node: syntax.Call, arguments: list[Term]) -> Term:
    base, exponent = arguments
    is_whole = base.type.kind == exponent.type.kind == "int" and exponent.type.range[0] >= 0
    if not (base.is_static and exponent.is_static):
        return _broken(_INTEGER if is_whole else REAL, node, arguments)
    if not is_whole:
        return operators.real(math.pow(base.value, exponent.value), node.at)
    if abs(base.value) > 1 and exponent.value > 31:
        return operators.mismatch("the result leaves 32 bits", node.at)
    parity = exponent.value if abs(base.value) > 1 else min(exponent.value, 2 + exponent.value % 2)
    return _whole(operators, node, base.value**parity)
