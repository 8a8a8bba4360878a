"""Resolved expressions, shared by the checked model, the automata, the supervisor and the targets.

Every name in them is already bound: a variable or state is given with the component (automaton) it
belongs to. A condition *holds* only when it is true; it may also be unknown (language B.4). The
operator `holds` turns unknown into false, for the one place where the semantics asks for it inside
an expression (the cancel of an action).
"""

from typing import Annotated, Literal

import msgspec

from robosc.expressions.types import Name, ScopedName, Value

UnaryOperator = Literal["not", "-", "holds"]
BinaryOperator = Literal["or", "and", "implies", "=", "!=", "<", "<=", ">", ">=", "+", "-", "*", "/"]

PathStep = Name | Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)]


class Constant(msgspec.Struct, frozen=True, tag_field="node", tag="constant"):
    """A literal that is not an enum value."""

    value: Value


class EnumValue(msgspec.Struct, frozen=True, tag_field="node", tag="enum"):
    """A value of an enum."""

    enum: ScopedName
    value: Name


class VariableRead(msgspec.Struct, frozen=True, tag_field="node", tag="variable"):
    """The value of a component's variable."""

    component: Name
    variable: Name


class StateTest(msgspec.Struct, frozen=True, tag_field="node", tag="state"):
    """Whether a component is in a state."""

    component: Name
    state: Name


class Received(msgspec.Struct, frozen=True, tag_field="node", tag="received"):
    """Received data, or a part of it: property names and array indices, outermost first."""

    path: tuple[PathStep, ...] = ()


class Unary(msgspec.Struct, frozen=True, tag_field="node", tag="unary"):
    """An operator before one operand."""

    operator: UnaryOperator
    operand: "Expression"


class Binary(msgspec.Struct, frozen=True, tag_field="node", tag="binary"):
    """An operator between two operands."""

    operator: BinaryOperator
    left: "Expression"
    right: "Expression"


Expression = Constant | EnumValue | VariableRead | StateTest | Received | Unary | Binary

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
        case _:
            return ()


def leaves(expression: Expression) -> tuple[Expression, ...]:
    """Every leaf, left to right."""
    stack, result = [expression], []
    while stack:
        node = stack.pop()
        below = children(node)
        if below:
            stack.extend(reversed(below))
        else:
            result.append(node)
    return tuple(result)
