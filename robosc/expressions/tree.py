"""Resolved expressions, shared by the checked model, the automata, the supervisor and the targets.

Every name in them is bound: a variable or state is given with its component (automaton). A condition *holds* only if it
is true; it may also be unknown. The operator `holds` turns unknown into false. The semantics needs it
inside an expression in only one place, the cancel of an action.
"""

from typing import Annotated, Literal

import msgspec

from robosc.expressions.types import Name, PartName, QualifiedName, Value

UnaryOperator = Literal["not", "-", "holds"]
BinaryOperator = Literal["or", "and", "implies", "=", "!=", "<", "<=", ">", ">=", "+", "-", "*", "/", "div", "mod"]
"""`div` and `mod`, the whole quotient towards zero and what is left, are of automata only: RoboSC has no such words."""

PathStep = Name | Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)]


class Constant(msgspec.Struct, frozen=True, gc=False, tag_field="node", tag="constant"):
    """A literal that is not an enum value."""

    value: Value


class EnumValue(msgspec.Struct, frozen=True, gc=False, tag_field="node", tag="enum"):
    """A value of an enum."""

    enum: QualifiedName
    value: Name


ITSELF = "*"
"""Name of the variable of an automaton that is nothing but this variable, such as an input variable.

No identifier can be it, and texts have the automaton's name alone.
"""


class VariableRead(msgspec.Struct, frozen=True, gc=False, tag_field="node", tag="variable"):
    """The value of a component's variable."""

    component: PartName
    variable: PartName


class StateTest(msgspec.Struct, frozen=True, gc=False, tag_field="node", tag="state"):
    """Test of whether a component is in a state."""

    component: PartName
    state: PartName


class Received(msgspec.Struct, frozen=True, gc=False, tag_field="node", tag="received"):
    """Received data, or a part of it: property names and array indices, outermost first."""

    path: tuple[PathStep, ...] = ()


class Unary(msgspec.Struct, frozen=True, gc=False, tag_field="node", tag="unary"):
    """An operator before one operand."""

    operator: UnaryOperator
    operand: "Expression"


class Binary(msgspec.Struct, frozen=True, gc=False, tag_field="node", tag="binary"):
    """An operator between two operands."""

    operator: BinaryOperator
    left: "Expression"
    right: "Expression"


class Conditional(msgspec.Struct, frozen=True, gc=False, tag_field="node", tag="if"):
    """`then` where the condition is true, `otherwise` where it is false; unknown where that is unknown."""

    condition: "Expression"
    then: "Expression"
    otherwise: "Expression"


Function = Literal["abs", "min", "max", "clamp", "integer", "double"]

ARGUMENTS: dict[str, int] = {"abs": 1, "min": 2, "max": 2, "clamp": 3, "integer": 1, "double": 1}
"""Number of arguments that each function takes."""


class Call(msgspec.Struct, frozen=True, gc=False, tag_field="node", tag="call"):
    """A function of numbers: clamp takes value, least, greatest; the other names speak for themselves."""

    function: Function
    arguments: Annotated[tuple["Expression", ...], msgspec.Meta(max_length=3)]


class Element(msgspec.Struct, frozen=True, gc=False, tag_field="node", tag="element"):
    """The element that a quantifier looks at, or a part of it.

    Attributes:
        level: Number of quantifiers between: 0 is the innermost one around it.
        path: Property names and array indices, outermost first.
    """

    level: Annotated[int, msgspec.Meta(ge=0, le=255)]
    path: tuple[PathStep, ...] = ()


class ArrayPart(msgspec.Struct, frozen=True, gc=False):
    """The elements of an array that something looks at.

    Attributes:
        array: Received data, or a part of an element, that is an array.
        low: Index of the first element, or None for all of the array.
        high: Index of the last one; with low > high they go on at the array's beginning. Indices outside the
            array have no element.
    """

    array: "Received | Element"
    low: Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)] | None = None
    high: Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)] | None = None


class Reduction(msgspec.Struct, frozen=True, gc=False, tag_field="node", tag="reduction"):
    """Number of elements, or the least or greatest of them; NaN entries do not count for the latter two."""

    function: Literal["length", "min", "max"]
    part: ArrayPart


class Quantifier(msgspec.Struct, frozen=True, gc=False, tag_field="node", tag="quantifier"):
    """Test of whether a condition over `Element` is true for any, or for all, elements; unknown if there are none."""

    word: Literal["any", "all"]
    part: ArrayPart
    condition: "Expression"


Expression = (
    Constant
    | EnumValue
    | VariableRead
    | StateTest
    | Received
    | Unary
    | Binary
    | Conditional
    | Call
    | Element
    | Reduction
    | Quantifier
)

TRUE = Constant(True)
FALSE = Constant(False)


def conjunction(*conditions: Expression) -> Expression:
    """All of `conditions`; `true` for none."""
    result: Expression = TRUE
    for condition in conditions:
        if condition != TRUE:
            result = condition if result == TRUE else Binary("and", result, condition)
    return result


def conjuncts(condition: Expression) -> tuple[Expression, ...]:
    """The top-level conjuncts of a condition, looking through negated disjunctions and double negation."""
    found: list[Expression] = []
    stack = [condition]
    while stack:
        node = stack.pop()
        match node:
            case Binary(operator="and", left=left, right=right):
                stack += [right, left]
            case Unary(operator="not", operand=Binary(operator="or", left=left, right=right)):
                stack += [Unary("not", right), Unary("not", left)]
            case Unary(operator="not", operand=Unary(operator="not", operand=operand)):
                stack.append(operand)
            case _:
                found.append(node)
    return tuple(found)


def children(expression: Expression) -> tuple[Expression, ...]:
    """The direct operands."""
    match expression:
        case Unary(operand=operand):
            return (operand,)
        case Binary(left=left, right=right):
            return (left, right)
        case Conditional(condition=condition, then=then, otherwise=otherwise):
            return (condition, then, otherwise)
        case Call(arguments=arguments):
            return arguments
        case Reduction(part=part):
            return (part.array,)
        case Quantifier(part=part, condition=condition):
            return (part.array, condition)
        case _:
            return ()


def levels(expression: Expression) -> int:
    """Return the number of operators that stand in each other, and one more for the innermost operand."""
    level, found = [expression], 0
    while level:
        found += 1
        level = list({id(child): child for node in level for child in children(node)}.values())
    return found


def leaves(expression: Expression) -> tuple[Expression, ...]:
    """Every leaf, left to right; the array that a reduction or quantifier looks at is one."""
    stack, result = [expression], []
    while stack:
        node = stack.pop()
        below = children(node)
        if below:
            stack.extend(reversed(below))
        else:
            result.append(node)
    return tuple(result)


def simple_parts(condition: Expression) -> tuple[Expression, ...]:
    """Return the parts of a condition that logical operators join, without the operators, left to right."""
    stack, result = [condition], []
    while stack:
        match stack.pop():
            case Binary(operator="and" | "or" | "implies", left=left, right=right):
                stack += [right, left]
            case Unary(operator="not" | "holds", operand=operand):
                stack.append(operand)
            case part:
                result.append(part)
    return tuple(result)
