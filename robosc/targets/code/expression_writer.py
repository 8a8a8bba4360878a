"""RoboSC expressions as code: native operations if no operand can be unknown, else Kleene functions.

A boolean expression can be written in three ways: `truth` (is it true?), `falsity` (is it false?) and `value` (true,
false or unknown). Conditions hold only if they are true, so most of the generated code needs only
`truth`, and stays ordinary code even over data that may be unknown.

A number that is unknown as NaN is compared natively: the comparisons of IEEE 754 are false for it, as `truth` and
`falsity` want. Whether an integer result can leave 32 bits is decided by interval arithmetic.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, NoReturn

from robosc.errors import InternalError, UnsupportedModelError
from robosc.expressions import (
    MAXIMUM_INTEGER,
    MINIMUM_INTEGER,
    ArrayPart,
    ArrayType,
    Binary,
    Call,
    Conditional,
    Constant,
    Element,
    EnumValue,
    Expression,
    Quantifier,
    Received,
    Reduction,
    StateTest,
    Type,
    Unary,
    VariableRead,
    children,
)
from robosc.expressions.bounds import call_bounds
from robosc.model.received import Path, path_type
from robosc.model.structure import Model
from robosc.targets.acceptance import Condition, InOneOf, StaysInRange
from robosc.targets.code.expressions import FALSE_CODE, TRUE_CODE, Code, Kind, Sort, Unknown, bounds_of, operation

_ARITHMETIC = frozenset({"+", "-", "*", "/"})
COMPARISONS = ("=", "!=", "<", "<=", ">", ">=")
OPPOSITE = {"=": "!=", "!=": "=", "<": ">=", "<=": ">", ">": "<=", ">=": "<"}

_LEAST_NATIVE_DIVISOR = 1e-6
"""A 32-bit integer divided by something this large or larger stays finite."""


def read_nothing(*what: object) -> NoReturn:
    """The meaning of what cannot be read at a place of the generated code.

    Raises:
        InternalError: Always.
    """
    raise InternalError(f"an expression reads what it cannot: {what}")


def may_compute(conditions: Iterable[Expression]) -> bool:
    """Return True if a condition reads received data or computes: even constants can leave 32 bits."""
    stack = list(conditions)
    while stack:
        node = stack.pop()
        if isinstance(node, Received | Call) or getattr(node, "operator", None) in _ARITHMETIC:
            return True
        stack.extend(children(node))
    return False


class ExpressionWriter(ABC):
    """Writes expressions in one language, at one place of the generated code.

    Attributes:
        received: The code that reads received data of a path.
        root: Type of the received data, or None where there is none.
        elements: Place and type of what the quantifiers around look at, the innermost first.
    """

    received: Callable[[Path], Code]
    root: Type | None
    elements: tuple[tuple[Any, Type], ...]

    # Reads of the expressions

    @property
    @abstractmethod
    def model(self) -> Model:
        """The model, for the types of parts."""

    @abstractmethod
    def _constant_code(self, constant: bool | int | float | str) -> Code:
        """The code of a constant."""

    @abstractmethod
    def _enum_code(self, enum: str, value: str) -> Code:
        """The code of an enum's value."""

    @abstractmethod
    def variable_place(self, component: str, variable: str) -> Code:
        """The place of a variable."""

    @abstractmethod
    def location_place(self, automaton: str) -> Code:
        """The place of an automaton's location."""

    @abstractmethod
    def location_code(self, automaton: str, location: str) -> Code:
        """The code of a location."""

    def variable_code(self, component: str, variable: str) -> Code:
        """The code that reads a variable."""
        return self.variable_place(component, variable)

    def state_code(self, automaton: str, state: str, is_in: bool = True) -> Code:
        """Return the code that tests whether an automaton is in a location, or is not."""
        return operation("=" if is_in else "!=", self.location_place(automaton), self.location_code(automaton, state))

    @abstractmethod
    def _element_code(self, level: int, path: Path) -> Code:
        """The code of a part of a quantifier's element."""

    @abstractmethod
    def _reduction_code(self, expression: Reduction) -> Code:
        """The code of a reduction."""

    @abstractmethod
    def _quantifier_code(self, expression: Quantifier) -> Code:
        """The code of a quantifier."""

    # Code that differs by language

    @abstractmethod
    def _kleene_call(self, function: str, *arguments: Code, sort: Sort = Sort.BOOLEAN) -> Code:
        """A call of a Kleene function, named like the operator or function of RoboSC; its result may be unknown."""

    @abstractmethod
    def _function_code(self, function: str, arguments: list[Code]) -> Code:
        """The code of a function of numbers: known wherever its arguments are, unless it leaves 32 bits."""

    @abstractmethod
    def _stays_in_range(self, code: Code, low: int, high: int) -> Code:
        """Return the code that tests whether an integer is in a range; an unknown one leaves its variable alone."""

    @abstractmethod
    def _nan_comparison(self, operator: str, left: Code, right: Code) -> Code | None:
        """A native comparison that is false where a number is NaN, or None if there is none."""

    def _in_one_type(self, left: Code, right: Code) -> tuple[Code, Code]:
        """Two operands as native operations take them."""
        return left, right

    def as_double(self, code: Code) -> Code:
        """A number as an operation on doubles takes it."""
        return code

    def _divided(self, operator: str, left: Code, right: Code) -> Code:
        """Native `div` or `mod`, towards zero."""
        return operation(operator, left, right)

    def _joined_unknown(self, left: Code, right: Code) -> Unknown:
        """Way in which something is unknown that is one of two codes."""
        return left.unknown if left.unknown is right.unknown else Unknown.VALUE

    def _compare(self, operator: str, left: Code, right: Code) -> Code:
        """A native comparison of known values."""
        return operation(operator, left, right)

    def _join(self, operator: str, operands: tuple[Code, ...]) -> Code:
        """A native conjunction or disjunction of known conditions, none of which is constant."""
        return operation(operator, *operands)

    def _negate_condition(self, code: Code) -> Code:
        """Native negation of a known condition that is not constant."""
        return operation("not", code)

    def _kleene_comparison(self, operator: str, left: Code, right: Code) -> Code:
        """A comparison of values that may be unknown."""
        return self._kleene_call(operator, left, right)

    def _kleene_implication(self, left: Code, right: Code) -> Code:
        """An implication between conditions that may be unknown."""
        return self._kleene_call("implies", left, right)

    def received_type(self, path: Path) -> Type:
        """The type of received data of a path."""
        assert self.root is not None  # noqa: S101  # Paths exist only where data comes.
        return path_type(self.model, self.root, path)

    def _array(self, part: ArrayPart) -> tuple[Code, ArrayType]:
        """The array that is looked at a part of, and its type."""
        match part.array:
            case Received(path=path):
                code, type_ = self.received(path), self.received_type(path)
            case Element(level=level, path=path):
                code, type_ = self._element_code(level, path), path_type(self.model, self.elements[level][1], path)
        if not isinstance(type_, ArrayType):
            raise InternalError(f"{code.word} is not an array")
        return code, type_

    # The three readings

    def value(self, expression: Expression) -> Code:
        """The value of an expression."""
        match expression:
            case Constant(value=constant):
                return self._constant_code(constant)
            case EnumValue(enum=enum, value=name):
                return self._enum_code(enum, name)
            case VariableRead(component=component, variable=variable):
                return self.variable_code(component, variable)
            case StateTest(component=component, state=state):
                return self.state_code(component, state)
            case Received(path=path):
                return self.received(path)
            case Unary(operator="holds", operand=operand):
                return self.truth(operand)
            case Unary(operator="not", operand=operand):
                return self._kleene_not(self.value(operand))
            case Unary(operand=operand):
                return self._negate(self.value(operand))
            case Binary(operator=operator, left=left, right=right):
                return self._binary(operator, self.value(left), self.value(right), right)
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                return self._conditional(self.value(condition), self.value(then), self.value(otherwise))
            case Call(function=function, arguments=arguments):
                return self._function_code(function, [self.value(item) for item in arguments])
            case Element(level=level, path=path):
                return self._element_code(level, path)
            case Reduction():
                return self._reduction_code(expression)
            case Quantifier():
                return self._quantifier_code(expression)

    def truth(self, expression: Expression) -> Code:
        """Return the code that tests whether a boolean expression is true; never unknown."""
        return self._test(expression, True)

    def falsity(self, expression: Expression) -> Code:
        """Return the code that tests whether a boolean expression is false; never unknown."""
        return self._test(expression, False)

    def _test(self, expression: Expression, wanted: bool) -> Code:
        """Return the code that tests whether a boolean expression is `wanted`."""
        match expression:
            case Unary(operator="not", operand=operand):
                return self._test(operand, not wanted)
            case Unary(operator="holds", operand=operand):
                return self.truth(operand) if wanted else self.negated(self.truth(operand))
            case StateTest(component=component, state=state):
                return self.state_code(component, state, wanted)
            case Binary(operator="and" | "or" | "implies" as operator, left=left, right=right):
                join = self.both if (operator == "and") is wanted else self.either
                return join(self._test(left, wanted is not (operator == "implies")), self._test(right, wanted))
            case Binary(operator=operator, left=left, right=right) if operator in COMPARISONS:
                return self._comparison_is(operator, self.value(left), self.value(right), wanted)
        return self._is(self.value(expression), wanted)

    # Conditions

    def both(self, left: Code, right: Code) -> Code:
        """Native conjunction of two known conditions, simplified."""
        return self._joined("and", left, right, TRUE_CODE, FALSE_CODE)

    def either(self, left: Code, right: Code) -> Code:
        """Native disjunction of two known conditions, simplified."""
        return self._joined("or", left, right, FALSE_CODE, TRUE_CODE)

    def _joined(self, operator: str, left: Code, right: Code, neutral: Code, decisive: Code) -> Code:
        if decisive in (left, right):
            return decisive
        if neutral in (left, right):
            return right if left == neutral else left
        sides = (item.operands if _is_chain(item, operator) else (item,) for item in (left, right))
        return self._join(operator, tuple(operand for side in sides for operand in side))

    def negated(self, code: Code) -> Code:
        """Native negation of a known condition, simplified."""
        if code in (TRUE_CODE, FALSE_CODE):
            return FALSE_CODE if code == TRUE_CODE else TRUE_CODE
        return self._negate_condition(code)

    def _kleene_not(self, operand: Code) -> Code:
        """Negation of a condition that may be unknown."""
        return self.negated(operand) if operand.is_known else self._kleene_call("not", operand)

    def _is(self, code: Code, wanted: bool) -> Code:
        """Return a test that a boolean value is `wanted`."""
        if code.is_known:
            return code if wanted else self.negated(code)
        return operation("is true" if wanted else "is false", code)

    def _comparison_is(self, operator: str, left: Code, right: Code, wanted: bool) -> Code:
        """Return a test that a comparison is `wanted`, with native operators wherever NaN stands for unknown."""
        left, right = self._in_one_type(left, right)
        wanted_operator = operator if wanted else OPPOSITE[operator]
        if left.is_known and right.is_known:
            return self._compare(wanted_operator, left, right)
        if Unknown.VALUE not in (left.unknown, right.unknown):
            native = self._nan_comparison(wanted_operator, left, right)
            if native is not None:
                return native
        return self._is(self._kleene_comparison(operator, left, right), wanted)

    def condition(self, condition: Condition) -> Code:
        """Return the code that tests whether a condition for an event holds."""
        match condition:
            case InOneOf(automaton=automaton, locations=locations):
                return self.in_one_of(automaton, locations)
            case StaysInRange(component=component, state=state, expression=expression, type=type_):
                code, (low, high) = self.value(expression), bounds_of(type_)
                fits = TRUE_CODE if code.is_within(low, high) else self._stays_in_range(code, low, high)
                if fits == TRUE_CODE or state is None:
                    return fits
                return self.either(self.state_code(component, state, False), fits)
            case _:
                return self.truth(condition)

    def in_one_of(self, automaton: str, locations: tuple[str, ...], is_in: bool = True) -> Code:
        """Return the code that tests whether an automaton is in one of some locations, or is in none."""
        result = FALSE_CODE
        for location in locations:
            result = self.either(result, self.state_code(automaton, location))
        return result if is_in else self.negated(result)

    # Values

    def _conditional(self, condition: Code, then: Code, otherwise: Code) -> Code:
        """A conditional expression; both branches are pure, so it does not matter whether both are worked out."""
        then, otherwise = self._in_one_type(then, otherwise)
        if condition.is_known:
            unknown = self._joined_unknown(then, otherwise)
            code = operation("if", condition, then, otherwise, sort=then.sort, unknown=unknown)
        else:
            code = self._kleene_call("if", condition, then, otherwise, sort=then.sort)
        return replace(code, low=min(then.low, otherwise.low), high=max(then.high, otherwise.high))

    def _bounded_call(self, function: str, arguments: list[Code], code: Code) -> Code:
        """The call of a function with what is known about its result."""
        low, high = MINIMUM_INTEGER, MAXIMUM_INTEGER
        if all(item.sort is Sort.INTEGER for item in arguments):
            low, high = call_bounds(function, [(item.low, item.high) for item in arguments])
        is_known = all(item.is_known for item in arguments) and high <= MAXIMUM_INTEGER
        unknown = Unknown.NEVER if is_known else code.unknown
        return replace(code, unknown=unknown, low=low, high=min(high, MAXIMUM_INTEGER))

    def _negate(self, operand: Code) -> Code:
        low, high = -operand.high, -operand.low
        # Minus a received infinity is unknown, as is minus the least integer.
        if operand.sort is Sort.INTEGER:
            is_native = operand.unknown is not Unknown.VALUE and high <= MAXIMUM_INTEGER
        else:
            is_native = operand.is_known
        if not is_native:
            return self._kleene_call("negate", operand, sort=operand.sort)
        return Code(Kind.OPERATION, "negate", (operand,), operand.sort, operand.unknown, low, high)

    def _binary(self, operator: str, left: Code, right: Code, divisor: Expression) -> Code:
        is_known = left.is_known and right.is_known
        if operator in COMPARISONS:
            left, right = self._in_one_type(left, right)
            return (self._compare if is_known else self._kleene_comparison)(operator, left, right)
        if operator in ("div", "mod"):
            return self._whole(operator, left, right)
        if operator not in ("and", "or", "implies"):
            return self._arithmetic(operator, left, right, divisor)
        if not is_known:
            return (
                self._kleene_implication(left, right)
                if operator == "implies"
                else self._kleene_call(operator, left, right)
            )
        if operator == "and":
            return self.both(left, right)
        return self.either(self.negated(left) if operator == "implies" else left, right)

    def _arithmetic(self, operator: str, left: Code, right: Code, divisor: Expression) -> Code:
        is_integer = left.sort is right.sort is Sort.INTEGER and operator != "/"
        is_native = Unknown.VALUE not in (left.unknown, right.unknown)
        unknown = Unknown.NAN if Unknown.NAN in (left.unknown, right.unknown) else Unknown.NEVER
        low, high = MINIMUM_INTEGER, MAXIMUM_INTEGER
        if is_integer:
            low, high = arithmetic_bounds(operator, (left.low, left.high), (right.low, right.high))
            is_native = is_native and low >= MINIMUM_INTEGER and high <= MAXIMUM_INTEGER
        else:
            is_native = is_native and operator == "/" and left.sort is Sort.INTEGER and _is_safe_divisor(divisor)
            left, right = self.as_double(left), self.as_double(right)
        sort = Sort.INTEGER if is_integer else Sort.DOUBLE
        if not is_native:
            return self._kleene_call(operator, left, right, sort=sort)
        return Code(Kind.OPERATION, operator, (left, right), sort, unknown, low, high)

    def _whole(self, operator: str, left: Code, right: Code) -> Code:
        """The whole quotient, towards zero, or the remainder of a division by a constant above zero."""
        if not (left.is_known and right.is_literal and right.low > 0):
            raise UnsupportedModelError(f"{operator} has code only where it divides by a constant above zero")
        low, high = (-(-item // right.low) if item < 0 else item // right.low for item in (left.low, left.high))
        if operator == "mod":
            most = right.low - 1
            low, high = max(min(left.low, 0), -most), min(max(left.high, 0), most)
        return replace(self._divided(operator, left, right), sort=Sort.INTEGER, low=low, high=high)


def _is_chain(code: Code, operator: str) -> bool:
    return code.kind is Kind.OPERATION and code.word == operator


def _is_safe_divisor(divisor: Expression) -> bool:
    """Return True if every 32-bit integer divided by it is a finite number."""
    match divisor:
        case Constant(value=int() | float() as constant):
            return abs(constant) >= _LEAST_NATIVE_DIVISOR
        case _:
            return False


def arithmetic_bounds(operator: str, left: tuple[int, int], right: tuple[int, int]) -> tuple[int, int]:
    """Least and greatest result of `+`, `-` or `*` on integers."""
    match operator:
        case "+":
            return left[0] + right[0], left[1] + right[1]
        case "-":
            return left[0] - right[1], left[1] - right[0]
        case _:
            products = [a * b for a in left for b in right]
            return min(products), max(products)
