"""RoboSC expressions as Python text: native operators where nothing can be unknown, Kleene functions where it can.

Three readings of one boolean expression: `truth` (is it true?), `falsity` (is it false?) and `value`
(true, false or unknown). Conditions hold only when they are true (language B.4), so that most of the
generated code needs `truth` alone and stays ordinary Python even over data that may be unknown.

Unknown is None, except that an unknown *number* read from received data is NaN: the comparisons of
IEEE 754 are false for it, as `truth` and `falsity` want, and every function of `values` takes NaN as
unknown. Whether an integer result can leave 32 bits is decided by interval arithmetic.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from typing import assert_never

from robosc.errors import InternalError
from robosc.expressions import (
    MAXIMUM_INTEGER,
    MINIMUM_INTEGER,
    ArrayPart,
    ArrayType,
    Binary,
    BooleanType,
    Call,
    Conditional,
    Constant,
    DoubleType,
    Element,
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


class Precedence(Enum):
    """Binding strength of a piece of Python; a larger number binds tighter."""

    OR = 1
    AND = 2
    NOT = 3
    COMPARISON = 4
    SUM = 5
    PRODUCT = 6
    SIGN = 7
    ATOM = 8


class Unknown(Enum):
    """Way in which a value can be unknown at run time."""

    NEVER = "never"
    NAN = "as NaN"
    NONE = "as None"


class Sort(Enum):
    """Sort of a value, as far as the choice of operators goes."""

    BOOLEAN = "boolean"
    INTEGER = "integer"
    DOUBLE = "double"
    TEXT = "text"


@dataclass(frozen=True, slots=True)
class Code:
    """A Python expression and what is known about its value.

    Attributes:
        text: The expression.
        precedence: Precedence of its outermost operator.
        sort: Sort of the value that it yields.
        unknown: Way in which it can be unknown.
        low: Least value of an integer.
        high: Greatest value of an integer.
    """

    text: str
    precedence: Precedence = Precedence.ATOM
    sort: Sort = Sort.BOOLEAN
    unknown: Unknown = Unknown.NEVER
    low: int = MINIMUM_INTEGER
    high: int = MAXIMUM_INTEGER

    def within(self, precedence: Precedence) -> str:
        """The text, in parentheses unless it binds at least as tightly as `precedence`."""
        return self.text if self.precedence.value >= precedence.value else f"({self.text})"

    @property
    def is_number(self) -> bool:
        """True if it is an integer or a double."""
        return self.sort in (Sort.INTEGER, Sort.DOUBLE)


@dataclass(frozen=True, slots=True)
class Scope:
    """Meanings of names in the generated code.

    Attributes:
        variable: Text and type of a variable, given component and variable.
        location: Text of an automaton's current location.
        received: The code that reads received data of a path.
        used: Function called with the name of each function of `values` that the code needs.
        received_type: The type of received data of a path.
        type_below: The type of a part of a type.
        elements: Local name and type of what the quantifiers around look at, the innermost first.
    """

    variable: Callable[[str, str], tuple[str, Type]]
    location: Callable[[str], str]
    received: Callable[[tuple[PathStep, ...]], Code]
    used: Callable[[str], None]
    received_type: Callable[[tuple[PathStep, ...]], Type]
    type_below: Callable[[Type, tuple[PathStep, ...]], Type]
    elements: tuple[tuple[str, Type], ...] = ()


_KLEENE = {
    "or": "or_",
    "and": "and_",
    "implies": "implies",
    "=": "equal",
    "!=": "unequal",
    "<": "less",
    "<=": "less_or_equal",
    ">": "greater",
    ">=": "greater_or_equal",
    "+": "add",
    "-": "subtract",
    "*": "multiply",
    "/": "divide",
}
_NATIVE = {"=": "==", "!=": "!=", "<": "<", "<=": "<=", ">": ">", ">=": ">="}
_OPPOSITE = {"=": "!=", "!=": "=", "<": ">=", "<=": ">", ">": "<=", ">=": "<"}

TRUE_CODE = Code("True")
FALSE_CODE = Code("False")


def code_for(text: str, type_: Type, unknown: Unknown = Unknown.NEVER) -> Code:
    """The code of a place (an attribute or a local variable) that holds a value of a type."""
    match type_:
        case BooleanType():
            return Code(text, unknown=unknown)
        case IntegerType(low=int(low), high=int(high)):
            return Code(text, sort=Sort.INTEGER, unknown=unknown, low=low, high=high)
        case IntegerType():
            return Code(text, sort=Sort.INTEGER, unknown=unknown)
        case DoubleType():
            return Code(text, sort=Sort.DOUBLE, unknown=unknown)
        case _:
            return Code(text, sort=Sort.TEXT, unknown=unknown)


def value(expression: Expression, scope: Scope) -> Code:
    """The value of an expression."""
    match expression:
        case Constant(value=constant):
            return _constant(constant)
        case EnumValue(value=name):
            return Code(repr(name), sort=Sort.TEXT)
        case VariableRead(component=component, variable=variable):
            return code_for(*scope.variable(component, variable))
        case StateTest(component=component, state=state):
            return Code(f"{scope.location(component)} == {state!r}", Precedence.COMPARISON)
        case Received(path=path):
            return scope.received(path)
        case Unary(operator="holds", operand=operand):
            return truth(operand, scope)
        case Unary(operator="not", operand=operand):
            return _not(value(operand, scope), scope)
        case Unary(operator="-", operand=operand):
            return _negate(value(operand, scope), scope)
        case Binary(operator=operator, left=left, right=right):
            return _binary(operator, value(left, scope), value(right, scope), right, scope)
        case Conditional(condition=condition, then=then, otherwise=otherwise):
            return _conditional(value(condition, scope), value(then, scope), value(otherwise, scope), scope)
        case Call(function=function, arguments=arguments):
            return _function(function, [value(item, scope) for item in arguments], scope)
        case Element(level=level, path=path):
            return _element(level, path, scope)
        case Reduction(function=function, part=part):
            return _reduction(function, part, scope)
        case Quantifier():
            return _quantifier(expression, scope)
    raise InternalError(f"no Python for {expression!r}")


def _conditional(condition: Code, then: Code, otherwise: Code, scope: Scope) -> Code:
    """A conditional expression; both branches are pure, so it does not matter whether both are worked out."""
    unknown = then.unknown if then.unknown is otherwise.unknown else Unknown.NONE
    low, high = min(then.low, otherwise.low), max(then.high, otherwise.high)
    if condition.unknown is Unknown.NEVER:
        text = f"({then.text} if {condition.text} else {otherwise.text})"
        return Code(text, Precedence.ATOM, then.sort, unknown, low, high)
    code = _call("conditional", condition, then, otherwise, sort=then.sort, scope=scope)
    return replace(code, low=low, high=high)


_FUNCTIONS = {
    "abs": "absolute",
    "min": "minimum",
    "max": "maximum",
    "clamp": "clamp",
    "integer": "to_integer",
    "double": "to_double",
}


def _function(function: str, arguments: list[Code], scope: Scope) -> Code:
    """A function of numbers: known wherever its arguments are, unless an absolute value leaves 32 bits."""
    sort = {"integer": Sort.INTEGER, "double": Sort.DOUBLE}.get(function, arguments[0].sort)
    code = _call(_FUNCTIONS[function], *arguments, sort=sort, scope=scope)
    low, high = MINIMUM_INTEGER, MAXIMUM_INTEGER
    if function == "integer" and arguments[0].sort is Sort.INTEGER:
        low, high = arguments[0].low, arguments[0].high
    elif function != "double" and all(item.sort is Sort.INTEGER for item in arguments):
        low, high = call_bounds(function, [(item.low, item.high) for item in arguments])
    is_known = all(item.unknown is Unknown.NEVER for item in arguments) and high <= MAXIMUM_INTEGER
    unknown = Unknown.NEVER if is_known else Unknown.NONE
    return replace(code, unknown=unknown, low=low, high=min(high, MAXIMUM_INTEGER))


def _element(level: int, path: tuple[PathStep, ...], scope: Scope) -> Code:
    """A converted element of an array, or a part of it; None where it is unknown."""
    name, type_ = scope.elements[level]
    text = name
    for step in path:
        function = "read_element" if isinstance(step, int) else "read_property"
        scope.used(function)
        text = f"{function}({text}, {step!r})"
    return code_for(text, scope.type_below(type_, path), Unknown.NONE)


def _array(part: ArrayPart, scope: Scope) -> tuple[str, Type]:
    """Text of the elements that are looked at, and their type."""
    match part.array:
        case Received(path=path):
            text, type_ = scope.received(path).text, scope.received_type(path)
        case Element(level=level, path=path):
            text, type_ = _element(level, path, scope).text, scope.type_below(scope.elements[level][1], path)
    if not isinstance(type_, ArrayType):
        raise InternalError(f"{text} is no array")
    if part.low is not None:
        scope.used("array_part")
        text = f"array_part({text}, {part.low}, {part.high})"
    return text, type_.element


_REDUCTIONS = {"length": "array_length", "min": "least", "max": "greatest"}


def _reduction(function: str, part: ArrayPart, scope: Scope) -> Code:
    text, element = _array(part, scope)
    scope.used(_REDUCTIONS[function])
    call = f"{_REDUCTIONS[function]}({text})"
    if function == "length":
        return Code(call, sort=Sort.INTEGER, unknown=Unknown.NONE, low=0)
    return code_for(call, element, Unknown.NONE)


def _quantifier(expression: Quantifier, scope: Scope) -> Code:
    text, element = _array(expression.part, scope)
    name = f"x{len(scope.elements) + 1}"
    inner = replace(scope, elements=((name, element), *scope.elements))
    function = f"{expression.word}_of"
    scope.used(function)
    condition = value(expression.condition, inner)
    return Code(f"{function}({text}, lambda {name}: {condition.text})", unknown=Unknown.NONE)


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
            return _comparison_is(operator, value(left, scope), value(right, scope), True, scope)
    return _is(value(expression, scope), True)


def falsity(expression: Expression, scope: Scope) -> Code:
    """Return the code that tests whether a boolean expression is false; never unknown."""
    match expression:
        case Unary(operator="not", operand=operand):
            return truth(operand, scope)
        case Unary(operator="holds", operand=operand):
            return negated(truth(operand, scope))
        case StateTest(component=component, state=state):
            return Code(f"{scope.location(component)} != {state!r}", Precedence.COMPARISON)
        case Binary(operator="and", left=left, right=right):
            return either(falsity(left, scope), falsity(right, scope))
        case Binary(operator="or", left=left, right=right):
            return both(falsity(left, scope), falsity(right, scope))
        case Binary(operator="implies", left=left, right=right):
            return both(truth(left, scope), falsity(right, scope))
        case Binary(operator=operator, left=left, right=right) if operator in _NATIVE:
            return _comparison_is(operator, value(left, scope), value(right, scope), False, scope)
    return _is(value(expression, scope), False)


def both(left: Code, right: Code) -> Code:
    """Native conjunction of two known conditions, simplified."""
    if FALSE_CODE in (left, right):
        return FALSE_CODE
    if TRUE_CODE in (left, right):
        return right if left == TRUE_CODE else left
    return Code(f"{left.within(Precedence.AND)} and {right.within(Precedence.AND)}", Precedence.AND)


def either(left: Code, right: Code) -> Code:
    """Native disjunction of two known conditions, simplified."""
    if TRUE_CODE in (left, right):
        return TRUE_CODE
    if FALSE_CODE in (left, right):
        return right if left == FALSE_CODE else left
    return Code(f"{left.within(Precedence.OR)} or {right.within(Precedence.OR)}", Precedence.OR)


def negated(code: Code) -> Code:
    """Native negation of a known condition, simplified."""
    if code in (TRUE_CODE, FALSE_CODE):
        return FALSE_CODE if code == TRUE_CODE else TRUE_CODE
    return Code(f"not {code.within(Precedence.NOT)}", Precedence.NOT)


def _constant(constant: bool | int | float | str) -> Code:
    match constant:
        case bool():
            return TRUE_CODE if constant else FALSE_CODE
        case int():
            precedence = Precedence.ATOM if constant >= 0 else Precedence.SIGN
            return Code(repr(constant), precedence, Sort.INTEGER, low=constant, high=constant)
        case float():
            return Code(repr(constant), Precedence.ATOM if constant >= 0 else Precedence.SIGN, Sort.DOUBLE)
        case str():
            return Code(ascii(constant), sort=Sort.TEXT)
    assert_never(constant)


def _call(function: str, *arguments: Code, sort: Sort = Sort.BOOLEAN, scope: Scope) -> Code:
    """A call of a function of `values`; its result may be unknown."""
    scope.used(function)
    return Code(f"{function}({', '.join(item.text for item in arguments)})", sort=sort, unknown=Unknown.NONE)


def _not(operand: Code, scope: Scope) -> Code:
    if operand.unknown is Unknown.NEVER:
        return negated(operand)
    return _call("not_", operand, scope=scope)


def _negate(operand: Code, scope: Scope) -> Code:
    low, high = -operand.high, -operand.low
    # Minus a received infinity is unknown, as is minus the least integer.
    native_integer = operand.sort is Sort.INTEGER and operand.unknown is not Unknown.NONE and high <= MAXIMUM_INTEGER
    if not native_integer and (operand.sort is Sort.INTEGER or operand.unknown is not Unknown.NEVER):
        return _call("negate", operand, sort=operand.sort, scope=scope)
    return Code(f"-{operand.within(Precedence.SIGN)}", Precedence.SIGN, operand.sort, operand.unknown, low, high)


def _binary(operator: str, left: Code, right: Code, divisor: Expression, scope: Scope) -> Code:
    if operator in _NATIVE:
        if Unknown.NEVER is left.unknown is right.unknown:
            return _compare(_NATIVE[operator], left, right)
        return _call(_KLEENE[operator], left, right, scope=scope)
    if operator in ("and", "or", "implies"):
        return _logic(operator, left, right, scope)
    return _arithmetic(operator, left, right, divisor, scope)


def _logic(operator: str, left: Code, right: Code, scope: Scope) -> Code:
    if Unknown.NEVER is not left.unknown or Unknown.NEVER is not right.unknown:
        return _call(_KLEENE[operator], left, right, scope=scope)
    if operator == "and":
        return both(left, right)
    return either(negated(left) if operator == "implies" else left, right)


def _arithmetic(operator: str, left: Code, right: Code, divisor: Expression, scope: Scope) -> Code:
    is_integer = left.sort is right.sort is Sort.INTEGER and operator != "/"
    sort = Sort.INTEGER if is_integer else Sort.DOUBLE
    unknown = Unknown.NAN if Unknown.NAN in (left.unknown, right.unknown) else Unknown.NEVER
    product = Precedence.PRODUCT if operator in "*/" else Precedence.SUM
    # The right operand of - and / keeps its parentheses; so do + and *, to leave the order as written.
    tighter = Precedence(product.value + 1)
    text = f"{left.within(product)} {operator} {right.within(tighter)}"
    if Unknown.NONE not in (left.unknown, right.unknown):
        if is_integer:
            low, high = arithmetic_bounds(operator, (left.low, left.high), (right.low, right.high))
            if low >= MINIMUM_INTEGER and high <= MAXIMUM_INTEGER:
                return Code(text, product, sort, unknown, low, high)
        if operator == "/" and left.sort is Sort.INTEGER and is_safe_divisor(divisor):
            return Code(text, product, sort, unknown)
    return _call(_KLEENE[operator], left, right, sort=sort, scope=scope)


def _compare(operator: str, left: Code, right: Code) -> Code:
    tighter = Precedence.SUM  # Comparisons would chain without parentheses.
    return Code(f"{left.within(tighter)} {operator} {right.within(tighter)}", Precedence.COMPARISON)


def _comparison_is(operator: str, left: Code, right: Code, wanted: bool, scope: Scope) -> Code:
    """Return a test that a comparison is `wanted`, with native operators wherever NaN stands for unknown."""
    wanted_operator = operator if wanted else _OPPOSITE[operator]
    if Unknown.NEVER is left.unknown is right.unknown:
        return _compare(_NATIVE[wanted_operator], left, right)
    if Unknown.NONE not in (left.unknown, right.unknown) and left.is_number:
        if wanted_operator == "!=":  # `!=` is true for NaN.
            return either(_compare("<", left, right), _compare(">", left, right))
        return _compare(_NATIVE[wanted_operator], left, right)
    return _is(_call(_KLEENE[operator], left, right, scope=scope), wanted)


def _is(code: Code, wanted: bool) -> Code:
    """Return a test that a boolean value is `wanted`."""
    if code.unknown is Unknown.NEVER:
        return code if wanted else negated(code)
    return Code(f"{code.within(Precedence.SUM)} is {wanted}", Precedence.COMPARISON)
