"""RoboSC expressions as C text: native operators where nothing can be unknown, Kleene functions where it can.

What stands for unknown (language B.4): -1 for a boolean and an enum, INT64_MIN for an integer, NaN for a double, NULL
for a text. Integers are worked out in 64 bits, so that a result beyond 32 bits is noticed before it overflows; whether
it can occur is decided by interval arithmetic, as in the target `python`, whose readings of a condition (`truth`,
`falsity`, `value`) these are too.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from typing import assert_never

from robosc.errors import InternalError
from robosc.expressions import (
    MAXIMUM_INTEGER,
    MINIMUM_INTEGER,
    Binary,
    BooleanType,
    Call,
    Conditional,
    Constant,
    DoubleType,
    Element,
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    PathStep,
    Quantifier,
    Received,
    Reduction,
    StateTest,
    Type,
    Unary,
    VariableRead,
)
from robosc.expressions.bounds import call_bounds
from robosc.targets.arithmetic import arithmetic_bounds, is_safe_divisor
from robosc.targets.c99.text import string_literal


class Sort(Enum):
    """Sort of a value, with the C type that holds it where it may be unknown and the letter of its functions."""

    BOOLEAN = ("int", "b", "KLEENE_UNKNOWN")
    INTEGER = ("int64_t", "i", "INT64_MIN")
    DOUBLE = ("double", "d", "(double)NAN")
    ENUM = ("int", "e", "-1")
    TEXT = ("const char *", "t", "NULL")

    @property
    def c_type(self) -> str:
        """The C type."""
        return self.value[0]

    @property
    def letter(self) -> str:
        """Ending of the functions for it."""
        return self.value[1]

    @property
    def unknown(self) -> str:
        """Text that stands for unknown."""
        return self.value[2]


@dataclass(frozen=True, slots=True)
class Code:
    """A C expression and what is known about its value.

    Attributes:
        text: The expression.
        sort: Sort of the value that it yields.
        may_be_unknown: True if it can be unknown.
        is_atom: True if it needs no parentheses anywhere.
        operator: `&&` or `||`, if that is outermost.
        low: Least value of an integer.
        high: Greatest value of an integer.
        is_constant: True if it is a constant of which there are not two texts.
        tests: The tests of places against constants that it joins, or is: place, constant, True if they are equal.
    """

    text: str
    sort: Sort = Sort.BOOLEAN
    may_be_unknown: bool = False
    is_atom: bool = True
    operator: str = ""
    low: int = MINIMUM_INTEGER
    high: int = MAXIMUM_INTEGER
    is_constant: bool = False
    tests: frozenset[tuple[str, str, bool]] = frozenset()

    @property
    def atom(self) -> str:
        """The text, in parentheses unless it needs none."""
        return self.text if self.is_atom else f"({self.text})"


TRUE_CODE = Code("true")
FALSE_CODE = Code("false")


@dataclass(frozen=True)
class Scope:
    """Meanings of names.

    Attributes:
        variable: Text and type of a variable, given component and variable.
        in_state: Code that tests whether an automaton is in a location.
        enum_value: Text of a value of an enum.
        received: The code that reads received data of a path.
        element: The code of a part of a quantifier's element, given level and path.
        reduction: Function that writes a reduction.
        quantifier: Function that writes a quantifier.
    """

    variable: Callable[[str, str], tuple[str, Type]]
    in_state: Callable[[str, str], Code]
    enum_value: Callable[[str, str], str]
    received: Callable[[tuple[PathStep, ...]], Code]
    element: Callable[[int, tuple[PathStep, ...]], Code]
    reduction: Callable[[Reduction], Code]
    quantifier: Callable[[Quantifier], Code]


_NATIVE = {"=": "==", "!=": "!=", "<": "<", "<=": "<=", ">": ">", ">=": ">="}
_OPPOSITE = {"=": "!=", "!=": "=", "<": ">=", "<=": ">", ">": "<=", ">=": "<"}


def sort_of(type_: Type) -> Sort:
    """The sort of a type's values."""
    match type_:
        case BooleanType():
            return Sort.BOOLEAN
        case IntegerType():
            return Sort.INTEGER
        case DoubleType():
            return Sort.DOUBLE
        case EnumType():
            return Sort.ENUM
        case _:
            return Sort.TEXT


def code_for(text: str, type_: Type, may_be_unknown: bool = False, is_atom: bool = True) -> Code:
    """The code of a place that holds a value of a type."""
    low, high = MINIMUM_INTEGER, MAXIMUM_INTEGER
    if isinstance(type_, IntegerType) and type_.low is not None and type_.high is not None:
        low, high = type_.low, type_.high
    return Code(text, sort_of(type_), may_be_unknown, is_atom, low=low, high=high)


def value(expression: Expression, scope: Scope) -> Code:
    """The value of an expression."""
    match expression:
        case Constant(value=constant):
            return _constant(constant)
        case EnumValue(enum=enum, value=name):
            return Code(scope.enum_value(enum, name), Sort.ENUM, is_constant=True)
        case VariableRead(component=component, variable=variable):
            text, type_ = scope.variable(component, variable)
            if isinstance(type_, IntegerType):  # Small members would be added as `int`, which may have 16 bits.
                return code_for(f"(int64_t){text}", type_, is_atom=False)
            if isinstance(type_, BooleanType):
                return Code(text, tests=frozenset({(text, "true", True)}))
            return code_for(text, type_)
        case StateTest(component=component, state=state):
            return scope.in_state(component, state)
        case Received(path=path):
            return scope.received(path)
        case Unary(operator="holds", operand=operand):
            return truth(operand, scope)
        case Unary(operator="not", operand=operand):
            return _not(value(operand, scope))
        case Unary(operator="-", operand=operand):
            return _negate(value(operand, scope))
        case Binary(operator=operator, left=left, right=right):
            return _binary(operator, value(left, scope), value(right, scope), right)
        case Conditional(condition=condition, then=then, otherwise=otherwise):
            return _conditional(value(condition, scope), value(then, scope), value(otherwise, scope))
        case Call(function=function, arguments=arguments):
            return _function(function, [value(item, scope) for item in arguments])
        case Element(level=level, path=path):
            return scope.element(level, path)
        case Reduction():
            return scope.reduction(expression)
        case Quantifier():
            return scope.quantifier(expression)
    raise InternalError(f"no C for {expression!r}")


def _conditional(condition: Code, then: Code, otherwise: Code) -> Code:
    then, otherwise = _alike(then, otherwise)
    low, high = min(then.low, otherwise.low), max(then.high, otherwise.high)
    if not condition.may_be_unknown:
        unknown = then.may_be_unknown or otherwise.may_be_unknown
        text = f"{condition.atom} ? {then.atom} : {otherwise.atom}"
        return Code(text, then.sort, unknown, is_atom=False, low=low, high=high)
    code = _call(f"choose_{then.sort.letter}", condition, then, otherwise, sort=then.sort)
    return replace(code, low=low, high=high)


def _function(function: str, arguments: list[Code]) -> Code:
    """A function of numbers: known wherever its arguments are, unless an absolute value leaves 32 bits."""
    is_known = not any(item.may_be_unknown for item in arguments)
    first = arguments[0]
    if function == "double":
        return as_double(first)
    if function == "integer":
        if first.sort is Sort.INTEGER:
            return first
        return replace(_call("integer_of", first, sort=Sort.INTEGER), may_be_unknown=not is_known)
    is_integer = all(item.sort is Sort.INTEGER for item in arguments)
    sort = Sort.INTEGER if is_integer else Sort.DOUBLE
    codes = arguments if is_integer else [as_double(item) for item in arguments]
    code = _call(f"{function}_{sort.letter}", *codes, sort=sort)
    low, high = MINIMUM_INTEGER, MAXIMUM_INTEGER
    if is_integer:
        low, high = call_bounds(function, [(item.low, item.high) for item in arguments])
    unknown = not (is_known and high <= MAXIMUM_INTEGER)
    return replace(code, may_be_unknown=unknown, low=low, high=min(high, MAXIMUM_INTEGER))


def as_double(code: Code) -> Code:
    """A number as a double."""
    if code.sort is Sort.DOUBLE:
        return code
    if code.may_be_unknown:
        return _call("double_of", code, sort=Sort.DOUBLE)
    return Code(f"(double){code.atom}", Sort.DOUBLE, is_atom=False)


def _alike(left: Code, right: Code) -> tuple[Code, Code]:
    """Two codes of one sort: where one is a double, both are."""
    if left.sort is right.sort or Sort.DOUBLE not in (left.sort, right.sort):
        return left, right
    return as_double(left), as_double(right)


def truth(expression: Expression, scope: Scope) -> Code:
    """Return the code that tests whether a boolean expression is true; never unknown."""
    match expression:
        case Unary(operator="not", operand=operand):
            return falsity(operand, scope)
        case Unary(operator="holds", operand=operand):
            return truth(operand, scope)
        case Binary(operator="and", left=left, right=right):
            return both(truth(left, scope), truth(right, scope))
        case Binary(operator="or", left=left, right=right):
            return either(truth(left, scope), truth(right, scope))
        case Binary(operator="implies", left=left, right=right):
            return either(falsity(left, scope), truth(right, scope))
        case Binary(operator=operator, left=left, right=right) if operator in _NATIVE:
            return _comparison_is(operator, value(left, scope), value(right, scope), True)
    return _is(value(expression, scope), True)


def falsity(expression: Expression, scope: Scope) -> Code:
    """Return the code that tests whether a boolean expression is false; never unknown."""
    match expression:
        case Unary(operator="not", operand=operand):
            return truth(operand, scope)
        case Unary(operator="holds", operand=operand):
            return negated(truth(operand, scope))
        case Binary(operator="and", left=left, right=right):
            return either(falsity(left, scope), falsity(right, scope))
        case Binary(operator="or", left=left, right=right):
            return both(falsity(left, scope), falsity(right, scope))
        case Binary(operator="implies", left=left, right=right):
            return both(truth(left, scope), falsity(right, scope))
        case Binary(operator=operator, left=left, right=right) if operator in _NATIVE:
            return _comparison_is(operator, value(left, scope), value(right, scope), False)
    return _is(value(expression, scope), False)


def equality(place: str, constant: str, is_equal: bool) -> Code:
    """The test of a place against a constant."""
    operator = "==" if is_equal else "!="
    return Code(f"{place} {operator} {constant}", is_atom=False, tests=frozenset({(place, constant, is_equal)}))


def _is_decided(operator: str, tests: frozenset[tuple[str, str, bool]]) -> bool:
    """Return True if tests joined by an operator say nothing, as compilers warn: never all true, or always one."""
    # Of a conjunction at most one equality of a place can be true, of a disjunction at most one inequality false.
    told = {(place, constant) for place, constant, is_equal in tests if is_equal is (operator == "&&")}
    others = {(place, constant) for place, constant, is_equal in tests if is_equal is not (operator == "&&")}
    return len({place for place, _ in told}) < len(told) or bool(told & others)


def _joined(operator: str, left: Code, right: Code) -> Code:
    tests = frozenset().union(*(item.tests for item in (left, right) if item.operator in ("", operator)))
    if _is_decided(operator, tests):
        return FALSE_CODE if operator == "&&" else TRUE_CODE
    sides = [item.text if item.operator == operator else item.atom for item in (left, right)]
    return Code(f" {operator} ".join(sides), is_atom=False, operator=operator, tests=tests)


def both(left: Code, right: Code) -> Code:
    """Native conjunction of two known conditions, simplified."""
    if FALSE_CODE in (left, right):
        return FALSE_CODE
    if TRUE_CODE in (left, right):
        return right if left == TRUE_CODE else left
    return _joined("&&", left, right)


def either(left: Code, right: Code) -> Code:
    """Native disjunction of two known conditions, simplified."""
    if TRUE_CODE in (left, right):
        return TRUE_CODE
    if FALSE_CODE in (left, right):
        return right if left == FALSE_CODE else left
    return _joined("||", left, right)


def negated(code: Code) -> Code:
    """Native negation of a known condition, simplified."""
    if code in (TRUE_CODE, FALSE_CODE):
        return FALSE_CODE if code == TRUE_CODE else TRUE_CODE
    if not code.operator and code.tests:
        ((place, constant, is_equal),) = code.tests
        if constant == "true":
            tests = frozenset({(place, constant, not is_equal)})
            return Code(f"!{place}" if is_equal else place, is_atom=not is_equal, tests=tests)
        return equality(place, constant, not is_equal)
    return Code(f"!{code.atom}", is_atom=False)


def _constant(constant: bool | int | float | str) -> Code:
    match constant:
        case bool():
            return TRUE_CODE if constant else FALSE_CODE
        case int():
            text = str(constant) if constant > MINIMUM_INTEGER else "-2147483647 - 1"
            code = Code(f"INT64_C({text})", Sort.INTEGER, low=constant, high=constant, is_constant=True)
            return code if constant >= 0 else replace(code, text=text, is_atom=False)
        case float():
            return Code(repr(constant), Sort.DOUBLE, is_atom=not repr(constant).startswith("-"))
        case str():
            return Code(string_literal(constant), Sort.TEXT)
    assert_never(constant)


def _call(function: str, *arguments: Code, sort: Sort = Sort.BOOLEAN) -> Code:
    """A call of a function of the unit; its result may be unknown."""
    return Code(f"{function}({', '.join(item.text for item in arguments)})", sort, may_be_unknown=True)


def _not(operand: Code) -> Code:
    return _call("not_b", operand) if operand.may_be_unknown else negated(operand)


def _negate(operand: Code) -> Code:
    low, high = -operand.high, -operand.low
    if operand.may_be_unknown or (operand.sort is Sort.INTEGER and high > MAXIMUM_INTEGER):
        return _call(f"negate_{operand.sort.letter}", operand, sort=operand.sort)
    return Code(f"-{operand.atom}", operand.sort, is_atom=False, low=low, high=high)


def _binary(operator: str, left: Code, right: Code, divisor: Expression) -> Code:
    if operator in _NATIVE:
        left, right = _alike(left, right)
        if not left.may_be_unknown and not right.may_be_unknown:
            return _compare(operator, left, right)
        return _kleene_comparison(operator, left, right)
    if operator in ("and", "or", "implies"):
        return _logic(operator, left, right)
    return _arithmetic(operator, left, right, divisor)


def _logic(operator: str, left: Code, right: Code) -> Code:
    if operator == "implies":
        operator, left = "or", _not(left)
    if left.may_be_unknown or right.may_be_unknown:
        return _call(f"{operator}_b", left, right)
    return both(left, right) if operator == "and" else either(left, right)


def _arithmetic(operator: str, left: Code, right: Code, divisor: Expression) -> Code:
    is_integer = left.sort is right.sort is Sort.INTEGER and operator != "/"
    is_known = not left.may_be_unknown and not right.may_be_unknown
    name = {"+": "add", "-": "subtract", "*": "multiply", "/": "divide"}[operator]
    if is_integer:
        low, high = arithmetic_bounds(operator, (left.low, left.high), (right.low, right.high))
        if is_known and low >= MINIMUM_INTEGER and high <= MAXIMUM_INTEGER:
            return Code(f"{left.atom} {operator} {right.atom}", Sort.INTEGER, False, False, "", low, high)
        return _call(f"{name}_i", left, right, sort=Sort.INTEGER)
    is_native = is_known and operator == "/" and left.sort is Sort.INTEGER and is_safe_divisor(divisor)
    left, right = as_double(left), as_double(right)
    if is_native:
        return Code(f"{left.atom} / {right.atom}", Sort.DOUBLE, is_atom=False)
    return _call(f"{name}_d", left, right, sort=Sort.DOUBLE)


def _compare(operator: str, left: Code, right: Code) -> Code:
    """A native comparison of known values."""
    if left.text == right.text:  # Compilers warn about a comparison of something with itself.
        return TRUE_CODE if operator in ("=", "<=", ">=") else FALSE_CODE
    if left.sort is Sort.INTEGER and (decided := _by_bounds(operator, left, right)) is not None:
        return decided
    if left.sort is Sort.TEXT:
        return Code(f"strcmp({left.text}, {right.text}) {_NATIVE[operator]} 0", is_atom=False)
    if operator in ("=", "!=") and right.is_constant:
        return equality(left.atom, right.atom, operator == "=")
    return Code(f"{left.atom} {_NATIVE[operator]} {right.atom}", is_atom=False)


def _by_bounds(operator: str, left: Code, right: Code) -> Code | None:
    """A comparison of integers that their bounds decide, if they do."""
    match operator:
        case "=" | "!=":
            is_decided = left.high < right.low or right.high < left.low
            return (TRUE_CODE if operator == "!=" else FALSE_CODE) if is_decided else None
        case ">" | ">=":
            return _by_bounds({">": "<", ">=": "<="}[operator], right, left)
        case "<":
            return TRUE_CODE if left.high < right.low else FALSE_CODE if left.low >= right.high else None
        case _:
            return TRUE_CODE if left.high <= right.low else FALSE_CODE if left.low > right.high else None


def _kleene_comparison(operator: str, left: Code, right: Code) -> Code:
    letter = left.sort.letter
    match operator:
        case "=":
            return _call(f"equal_{letter}", left, right)
        case "!=":
            return _not(_call(f"equal_{letter}", left, right))
        case "<":
            return _call(f"less_{letter}", left, right)
        case "<=":
            return _call(f"at_most_{letter}", left, right)
        case ">":
            return _call(f"less_{letter}", right, left)
        case ">=":
            return _call(f"at_most_{letter}", right, left)
    raise InternalError(f"no comparison {operator}")


def _comparison_is(operator: str, left: Code, right: Code, wanted: bool) -> Code:
    """Return a test that a comparison is `wanted`, with native operators wherever NaN stands for unknown."""
    left, right = _alike(left, right)
    wanted_operator = operator if wanted else _OPPOSITE[operator]
    if not left.may_be_unknown and not right.may_be_unknown:
        return _compare(wanted_operator, left, right)
    if left.sort is Sort.DOUBLE and wanted_operator != "!=" and left.text != right.text:  # `!=` is true for NaN.
        return Code(f"{left.atom} {_NATIVE[wanted_operator]} {right.atom}", is_atom=False)
    return _is(_kleene_comparison(operator, left, right), wanted)


def _is(code: Code, wanted: bool) -> Code:
    """Return a test that a boolean value is `wanted`."""
    if not code.may_be_unknown:
        return code if wanted else negated(code)
    return Code(f"{code.atom} == {int(wanted)}", is_atom=False)
