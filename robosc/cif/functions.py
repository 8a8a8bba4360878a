"""Functions of CIF: evaluated for static values; over a state, synthesis supports some of those of integers."""

import math
from collections.abc import Callable, Mapping

from robosc.cif import syntax
from robosc.cif.operators import Operators
from robosc.cif.terms import MATHEMATICS, Problem, Term, broken, made, number, rounded, static, truth
from robosc.cif.types import BOOL, REAL, STRING, UNKNOWN, CifType, integer
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
                return static(REAL, MATHEMATICS[name](float(values[0])))
            case "size" if kinds in (["list"], ["set"], ["dict"], ["string"]):
                return number(len(values[0])) if is_static else _broken(_INTEGER, node, arguments)
            case "empty" if kinds in (["list"], ["set"], ["dict"]):
                return truth(not values[0]) if is_static else _broken(BOOL, node, arguments)
    except (ValueError, OverflowError):
        return operators.mismatch(f"'{name}' has no value here", node.at)
    if name in ("fmt", "scale", "pop", "del") or name not in _CHECKED:
        result = {"fmt": STRING, "scale": REAL}.get(name, UNKNOWN)
        if result.kind == "unknown":
            operators.error("cif-unsupported", f"synthesis does not know the function '{name}'", node.at,
                         "Write its value instead.")  # fmt: skip
        return _broken(result, node, arguments)
    types = " and ".join(str(item.type) for item in arguments) or "nothing"
    return operators.mismatch(f"'{name}' does not take {types}", node.at)


_CHECKED = frozenset({*_WHOLE, *MATHEMATICS, "abs", "min", "max", "sign", "pow", "size", "empty"})


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
        return static(REAL, math.pow(base.value, exponent.value))
    if abs(base.value) > 1 and exponent.value > 31:
        return operators.mismatch("the result leaves 32 bits", node.at)
    parity = exponent.value if abs(base.value) > 1 else min(exponent.value, 2 + exponent.value % 2)
    return _whole(operators, node, base.value**parity)
