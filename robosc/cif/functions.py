"""Functions of CIF: evaluated for static values; over a state, synthesis supports some of those of integers."""

import math
from collections.abc import Callable, Mapping

from robosc.cif import syntax
from robosc.cif.operators import Operators, value_text
from robosc.cif.terms import MATHEMATICS, Problem, Term, broken, made, rounded, static, truth
from robosc.cif.text_patterns import formatted
from robosc.cif.types import BOOL, REAL, STRING, CifType, integer
from robosc.expressions import MAXIMUM_INTEGER, MINIMUM_INTEGER, Call
from robosc.expressions.bounds import call_bounds

_INTEGER = CifType("int")
_WHOLE: Mapping[str, Callable[[float], int]] = {"ceil": math.ceil, "floor": math.floor, "round": rounded}
_ARGUMENTS: Mapping[str, int] = (
    dict.fromkeys("bernoulli constant exponential geometric poisson abs sign size empty pop".split(), 1)
    | dict.fromkeys("beta binomial erlang gamma lognormal normal uniform weibull min max pow del".split(), 2)
    | dict.fromkeys((*MATHEMATICS, *_WHOLE), 1)
    | {"random": 0, "triangle": 3, "scale": 5}
)
"""Number of arguments of each function but `fmt`."""

_DISTRIBUTIONS: Mapping[str, CifType | None] = (
    dict.fromkeys("beta erlang exponential gamma lognormal normal random triangle weibull".split(), REAL)
    | dict.fromkeys(("binomial", "geometric", "poisson"), _INTEGER)
    | {"bernoulli": BOOL, "uniform": None, "constant": None}
)
"""Type of the samples of each distribution; None: that of its arguments."""

_INTEGER_ARGUMENTS = {("binomial", 1), ("erlang", 0)}
"""Arguments of distributions that are integers."""


def argument_hint(name: str, place: int, hint: CifType | None) -> CifType | None:
    """The type that is expected of an argument of a function, of which a value of the type `hint` is expected."""
    match name:
        case "abs" | "min" | "max" | "pow" | "uniform":
            return hint
        case "del":
            return hint if place == 0 else None
        case "pop" if hint is not None and hint.kind == "tuple" and len(hint.parts) == 2:
            return hint.parts[1]
        case "constant" if hint is not None and hint.kind == "dist":
            return hint.parts[0]
        case _ if name in MATHEMATICS or name in _WHOLE:
            return REAL
        case _ if _DISTRIBUTIONS.get(name) is not None and (name, place) not in _INTEGER_ARGUMENTS:
            return REAL
    return None


def call(operators: Operators, node: syntax.Call, arguments: list[Term]) -> Term:
    """The term of a call of one of the language's functions."""
    name = str(node.function)
    kinds = [item.type.kind for item in arguments]
    numbers = all(kind in ("int", "real") for kind in kinds)
    if len(kinds) != _ARGUMENTS.get(name, len(kinds)):
        message = f"'{name}' takes {_ARGUMENTS[name]} arguments, and is given {len(kinds)}"
        return operators.mismatch(message, node.at, f"Give it {_ARGUMENTS[name]} arguments.")
    match name:
        case "ceil" | "floor" | "round" if kinds == ["real"]:
            return _valued(operators, node, arguments, _INTEGER, lambda: _WHOLE[name](arguments[0].value))
        case _ if name in MATHEMATICS and kinds == ["real"]:
            return _valued(operators, node, arguments, REAL, lambda: MATHEMATICS[name](arguments[0].value))
        case "abs" | "min" | "max" if numbers:
            return _of_numbers(operators, node, arguments)
        case "sign" if numbers:
            (value,) = arguments
            is_ranged = value.type.kind == "int" and value.type.low is not None
            low, high = map(_sign, value.type.range) if is_ranged else (-1, 1)
            return _valued(operators, node, arguments, integer(low, high), lambda: _sign(value.value))
        case "pow" if numbers:
            return _power(operators, node, arguments)
        case "scale" if numbers:
            return _valued(operators, node, arguments, REAL, lambda: _scaled([float(item.value) for item in arguments]))
        case "size" if kinds[0] in ("list", "set", "dict", "string"):
            type_ = arguments[0].type
            length = integer(*type_.range) if type_.kind == "list" and type_.low is not None else _INTEGER
            return _valued(operators, node, arguments, length, lambda: len(arguments[0].value))
        case "empty" if kinds[0] in ("list", "set", "dict"):
            return truth(not arguments[0].value) if arguments[0].is_static else _broken(BOOL, node, arguments)
        case "fmt" if kinds[:1] == ["string"]:
            return _formatted(operators, node, arguments)
        case "pop" if kinds == ["list"]:
            return _popped(operators, node, arguments[0])
        case "del" if kinds == ["list", "int"]:
            return _deleted(operators, node, arguments)
        case _ if name in _DISTRIBUTIONS:
            samples = _samples(name, [item.type for item in arguments])
            if samples is not None:
                problem = Problem("this makes a distribution", node.at)
                return broken(CifType("dist", parts=(samples,)), *arguments, problem=problem)
    types = " and ".join(str(item.type) for item in arguments) or "nothing"
    return operators.mismatch(f"'{name}' does not take {types}", node.at)


def _sign(value: float) -> int:
    return (value > 0) - (value < 0)


def _valued(
    operators: Operators, node: syntax.Call, arguments: list[Term], type_: CifType, value: Callable[[], float]
) -> Term:
    """The term of a call that has a value where its arguments have one."""
    if not all(item.is_static for item in arguments):
        return _broken(type_, node, arguments)
    try:
        found = value()
    except (ValueError, OverflowError, ZeroDivisionError):
        return operators.failed(type_, f"'{node.function}' has no value here", node.at)
    return operators.real(found, node.at) if type_.kind == "real" else operators.integer(type_, int(found), node.at)


def _samples(name: str, types: list[CifType]) -> CifType | None:
    """The type of the samples of a distribution; None if its arguments do not fit."""
    kinds = [type_.kind for type_ in types]
    fixed = _DISTRIBUTIONS[name]
    if fixed is not None:
        wanted = ["int" if (name, place) in _INTEGER_ARGUMENTS else "real" for place in range(len(kinds))]
        return fixed if kinds == wanted else None
    if len(set(kinds)) > 1 or kinds[0] not in (("bool", "int", "real") if name == "constant" else ("int", "real")):
        return None
    return CifType(kinds[0])


def _formatted(operators: Operators, node: syntax.Call, arguments: list[Term]) -> Term:
    pattern = node.arguments[0]
    if not isinstance(pattern, syntax.Literal):
        return operators.mismatch("the pattern of 'fmt' must be written out", pattern.at, "Write a text in quotes.")
    try:
        found = formatted(str(pattern.value), arguments[1:], value_text)
    except ValueError as error:
        return operators.mismatch(str(error), pattern.at, "Write a specifier that fits for each value.")
    return _broken(STRING, node, arguments) if found is None else static(STRING, found)


def _scaled(values: list[float]) -> float:
    value, low, high, least, greatest = values
    return least + (value - low) / (high - low) * (greatest - least)


def _popped(operators: Operators, node: syntax.Call, term: Term) -> Term:
    """The first element of a list, and the others."""
    type_ = CifType("tuple", parts=(term.type.parts[0], _shorter(term.type)))
    if not term.is_static:
        return _broken(type_, node, [term])
    if not term.value:
        return operators.failed(type_, "'pop' has no value here", node.at)
    return static(type_, (term.value[0], term.value[1:]))


def _deleted(operators: Operators, node: syntax.Call, arguments: list[Term]) -> Term:
    """A list without the element of an index."""
    type_ = _shorter(arguments[0].type)
    low = arguments[1].type.low
    if low is not None and low >= 0 and arguments[0].type.low is not None and low >= arguments[0].type.range[1]:
        return operators.mismatch(f"{arguments[0].type} has no element {low}", node.at)
    if not all(item.is_static for item in arguments):
        return _broken(type_, node, arguments)
    items, index = arguments[0].value, arguments[1].value
    if not -len(items) <= index < len(items):
        return operators.failed(type_, f"there is no element {index}", node.at)
    index %= len(items)
    return static(type_, (*items[:index], *items[index + 1 :]))


def _shorter(type_: CifType) -> CifType:
    """The type of a list with one element less."""
    if type_.low is None:
        return type_
    low, high = type_.range
    return CifType("list", max(0, low - 1), max(0, high - 1), type_.parts)


def _broken(type_: CifType, node: syntax.Call, arguments: list[Term]) -> Term:
    return broken(type_, *arguments, problem=Problem(f"'{node.function}' has a value of a state", node.at))


def _of_numbers(operators: Operators, node: syntax.Call, arguments: list[Term]) -> Term:
    """The least, greatest or absolute value of numbers."""
    name = str(node.function)
    functions: Mapping[str, Callable[..., float]] = {"abs": abs, "min": min, "max": max}
    function = functions[name]
    types = [item.type for item in arguments]
    if any(type_.kind == "real" for type_ in types):
        return _valued(operators, node, arguments, REAL, lambda: float(function(*(item.value for item in arguments))))
    low, high = call_bounds(name, [type_.range for type_ in types])
    is_ranged = all(type_.low is not None for type_ in types)
    if is_ranged and high > MAXIMUM_INTEGER:
        return operators.mismatch("the result may leave 32 bits", node.at)
    type_ = integer(low, high) if is_ranged else _INTEGER
    if all(item.is_static for item in arguments):
        return operators.integer(type_, int(function(*(item.value for item in arguments))), node.at)
    if not all(item.is_usable for item in arguments):
        return broken(type_, *arguments)
    core = tuple(item.core for item in arguments)
    return made(type_, Call(name, core), *arguments)  # type: ignore[arg-type]


def _power(operators: Operators, node: syntax.Call, arguments: list[Term]) -> Term:
    base, exponent = arguments
    if any(item.type.low is None for item in arguments) or exponent.type.range[0] < 0:
        return _valued(operators, node, arguments, REAL, lambda: math.pow(base.value, exponent.value))
    (a, b), (c, d) = base.type.range, exponent.type.range
    if c > 1 and any(_clipped_power(item, c) != _clipped_power(item, c, limit=False) for item in (a, b)):
        return operators.mismatch("the result may leave 32 bits", node.at)
    bases = {a, b, *(near for near in (0, a + 1, b - 1) if a <= near <= b)}
    exponents = {c, d, *(near for near in (c + 1, d - 1) if c <= near <= d)}
    results = [_clipped_power(x, y) for x in bases for y in exponents]
    type_ = integer(min(results), max(results))
    return _valued(operators, node, arguments, type_, lambda: _clipped_power(base.value, exponent.value, limit=False))


def _clipped_power(base: int, exponent: int, *, limit: bool = True) -> int:
    """A power, at most (or, without a limit, beyond) the largest integer."""
    # A power of more than 40 is beyond all limits, or decided by the parity of its exponent.
    found: int = base ** (exponent if exponent < 40 else 40 + exponent % 2)
    return max(MINIMUM_INTEGER, min(found, MAXIMUM_INTEGER)) if limit else found
