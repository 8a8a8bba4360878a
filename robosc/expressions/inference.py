"""Types of resolved expressions, inferred from their variables, data and constants.

The front end of the language checks types in the text. This module is for expressions that come from elsewhere (a file,
another front end), which may be wrong.
"""

import math
from collections.abc import Mapping
from typing import assert_never

import msgspec

from robosc.errors import InvalidExpressionError
from robosc.expressions import (
    ARGUMENTS,
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
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    ObjectType,
    PathStep,
    Quantifier,
    Received,
    Reduction,
    StateTest,
    StringType,
    Type,
    Unary,
    Value,
    VariableRead,
    is_numeric,
    type_text,
)

_BOOLEAN, _INTEGER, _DOUBLE = BooleanType(), IntegerType(), DoubleType()
_LOGIC = frozenset({"or", "and", "implies"})
_ORDER = frozenset({"<", "<=", ">", ">="})


class Scope(msgspec.Struct, frozen=True):
    """Names that expressions may use.

    Attributes:
        variables: Type of each variable, by component and name.
        states: Every state, as component and name.
        enums: Every enum, by name.
        enum_values: Its values, for a quick look.
        objects: Types of each object's properties, by the object's name.
        data: Types of received data that are known by their paths.
        has_whole_division: True if there are `div` and `mod`.
    """

    variables: Mapping[tuple[str, str], Type]
    states: frozenset[tuple[str, str]]
    enums: Mapping[str, EnumType]
    enum_values: Mapping[str, frozenset[str]]
    objects: Mapping[str, Mapping[str, Type]]
    data: Mapping[tuple[PathStep, ...], Type] = msgspec.field(default_factory=dict)
    has_whole_division: bool = False

    def infer(self, expression: Expression, received: Type | None = None, elements: tuple[Type, ...] = ()) -> Type:
        """The type of an expression.

        Args:
            expression: Any expression, at most some hundreds of operators deep.
            received: Type of the received data it may read; None where there is none.
            elements: Types of what the quantifiers around it look at, the innermost first.

        Raises:
            InvalidExpressionError: It names something that is not there, or its types do not fit.
        """
        match expression:
            case Constant(value=value):
                return _constant_type(value)
            case EnumValue(enum=enum, value=value):
                return self._enum_value_type(enum, value)
            case VariableRead(component=component, variable=variable):
                if (component, variable) not in self.variables:
                    raise InvalidExpressionError(f"there is no variable {component}.{variable}")
                return self.variables[component, variable]
            case StateTest(component=component, state=state):
                if (component, state) not in self.states:
                    raise InvalidExpressionError(f"there is no state {component}.{state}")
                return _BOOLEAN
            case Received():
                return self.received_type(expression, received)
            case Unary(operator=operator, operand=operand):
                return _unary_type(operator, self.infer(operand, received, elements))
            case Binary():
                return self._chain_type(expression, received, elements)
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                # No generator: each of those that are open within each other takes a part of C's stack.
                parts = [self.infer(part, received, elements) for part in (condition, then, otherwise)]
                return _conditional_type(parts[0], parts[1], parts[2])
            case Call(function=function, arguments=arguments):
                return _call_type(function, [self.infer(item, received, elements) for item in arguments])
            case Element(level=level, path=path):
                if level >= len(elements):
                    raise InvalidExpressionError("an element is read outside the quantifier that looks at it")
                return self._part_type(elements[level], path)
            case Reduction(function=function, part=part):
                element = self._element_type(part, received, elements)
                if function != "length" and not is_numeric(element):
                    raise _unfit(function, element)
                return _INTEGER if function == "length" else element
            case Quantifier(part=part, condition=condition):
                element = self._element_type(part, received, elements)
                if not isinstance(self.infer(condition, received, (element, *elements)), BooleanType):
                    raise InvalidExpressionError("a quantifier needs a condition")
                return _BOOLEAN
        assert_never(expression)

    def _chain_type(self, expression: Binary, received: Type | None, elements: tuple[Type, ...]) -> Type:
        """The type of a binary expression: `a and b and ...` is as deep as it is long, leaning left, so a loop."""
        spine: list[Binary] = []
        node: Expression = expression
        while isinstance(node, Binary):
            spine.append(node)
            node = node.left
        found = self.infer(node, received, elements)
        for item in reversed(spine):
            if item.operator in ("div", "mod") and not self.has_whole_division:
                raise InvalidExpressionError(f"there is no operator '{item.operator}'")
            found = _binary_type(item.operator, found, self.infer(item.right, received, elements))
        return found

    def _element_type(self, part: ArrayPart, received: Type | None, elements: tuple[Type, ...]) -> Type:
        if (part.low is None) is not (part.high is None):
            raise InvalidExpressionError("a slice has one end only")
        type_ = self.infer(part.array, received, elements)
        if not isinstance(type_, ArrayType):
            raise InvalidExpressionError(f"{type_text(type_)} has no elements")
        return type_.element

    def received_type(self, read: Received, received: Type | None) -> Type:
        """The type of the part of `received` that a path reads.

        Raises:
            InvalidExpressionError: Nothing is received here, or it has no such part.
        """
        if read.path in self.data:
            return self.data[read.path]
        if received is None:
            raise InvalidExpressionError("received data is read where none is")
        return self._part_type(received, read.path)

    def _part_type(self, type_: Type, path: tuple[PathStep, ...]) -> Type:
        for step in path:
            match type_, step:
                case ObjectType(name=name), str() if step in self.objects.get(name, {}):
                    type_ = self.objects[name][step]
                case ArrayType(element=element), int():
                    type_ = element
                case _:
                    raise InvalidExpressionError(f"{type_text(type_)} has no part {step!r}")
        return type_

    def _enum_value_type(self, enum: str, value: str) -> EnumType:
        if enum not in self.enums:
            raise InvalidExpressionError(f"there is no enum {enum}")
        if value not in self.enum_values[enum]:
            raise InvalidExpressionError(f"the enum {enum} has no value {value}")
        return self.enums[enum]


def has_type(value: Value, type_: Type) -> bool:
    """Return True if a value is one of a type's; an integer is also a double."""
    match type_:
        case BooleanType():
            return isinstance(value, bool)
        case IntegerType(low=low, high=high):
            lowest = MINIMUM_INTEGER if low is None else low
            highest = MAXIMUM_INTEGER if high is None else high
            return isinstance(value, int) and not isinstance(value, bool) and lowest <= value <= highest
        case DoubleType():
            return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < math.inf
        case StringType():
            return isinstance(value, str)
        case EnumType(values=values):
            return isinstance(value, str) and value in values
        case _:
            return False


def is_assignable(type_: Type, to: Type) -> bool:
    """Return True if an expression of one type may stand where another is wanted; ranges are for run time.

    Enums of one name are one enum: that its values are the same wherever it occurs is checked beforehand.
    """
    match type_, to:
        case IntegerType(), IntegerType() | DoubleType():
            return True
        case DoubleType(), DoubleType():
            return True
        case BooleanType(), BooleanType():
            return True
        case StringType(), StringType():
            return True
        case EnumType(), EnumType():
            return type_.name == to.name
        case _:
            return False


def _constant_type(value: Value) -> Type:
    if isinstance(value, bool):
        return _BOOLEAN
    if isinstance(value, int):
        if not MINIMUM_INTEGER <= value <= MAXIMUM_INTEGER:
            raise InvalidExpressionError("an integer is beyond 32 bits")
        return _INTEGER
    return _DOUBLE if isinstance(value, float) else StringType()


def _unary_type(operator: str, operand: Type) -> Type:
    if operator == "-":
        if not is_numeric(operand):
            raise _unfit(operator, operand)
        return _DOUBLE if isinstance(operand, DoubleType) else _INTEGER
    if not isinstance(operand, BooleanType):
        raise _unfit(operator, operand)
    return _BOOLEAN


def _binary_type(operator: str, left: Type, right: Type) -> Type:
    if operator in _LOGIC:
        if not (isinstance(left, BooleanType) and isinstance(right, BooleanType)):
            raise _unfit(operator, left, right)
        return _BOOLEAN
    if operator in ("=", "!="):
        if not (is_assignable(left, right) or is_assignable(right, left)):
            raise _unfit(operator, left, right)
        return _BOOLEAN
    if not (is_numeric(left) and is_numeric(right)):
        raise _unfit(operator, left, right)
    if operator in _ORDER:
        return _BOOLEAN
    if operator in ("div", "mod") and (isinstance(left, DoubleType) or isinstance(right, DoubleType)):
        raise _unfit(operator, left, right)
    is_double = operator == "/" or isinstance(left, DoubleType) or isinstance(right, DoubleType)
    return _DOUBLE if is_double else _INTEGER


def _conditional_type(condition: Type, then: Type, otherwise: Type) -> Type:
    if not isinstance(condition, BooleanType):
        raise _unfit("if", condition)
    if is_assignable(otherwise, then):
        return then
    if not is_assignable(then, otherwise):
        raise _unfit("if", then, otherwise)
    return otherwise


def _call_type(function: str, arguments: list[Type]) -> Type:
    if len(arguments) != ARGUMENTS[function] or not all(map(is_numeric, arguments)):
        raise _unfit(function, *arguments)
    if function in ("integer", "double"):
        return _INTEGER if function == "integer" else _DOUBLE
    return _DOUBLE if any(isinstance(type_, DoubleType) for type_ in arguments) else _INTEGER


def _unfit(operator: str, *operands: Type) -> InvalidExpressionError:
    return InvalidExpressionError(f"'{operator}' does not take {' and '.join(map(type_text, operands))}")
