"""Expressions and decision diagrams as functions of a state."""

from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence

from robosc.expressions import (
    Binary,
    Constant,
    EnumValue,
    Expression,
    PathStep,
    Received,
    StateTest,
    Unary,
    Value,
    VariableRead,
)
from robosc.expressions.evaluate import BINARY, UNARY
from robosc.supervisor.structure import DecisionDiagram, DecisionNode

Place = tuple[str, str | None]
"""An automaton's location (None), or one of its variables."""

State = Mapping[Place, Value]

Path = tuple[PathStep, ...]

Data = Callable[[Path], Value | None]
"""Received data by path; None where it is unknown."""

Function = Callable[[State, Data], Value | None]
"""The value of an expression; None where it is unknown."""


def no_data(path: Path) -> Value | None:
    """Nothing was received."""
    return None


def function_of(expression: Expression) -> Function:
    """An expression as a function, built once so that it need not be taken apart again."""
    # A long chain of operators leans to the left: it is as deep as it is long, so a loop goes down there.
    chain: list[Binary] = []
    node = expression
    while isinstance(node, Binary):
        chain.append(node)
        node = node.left
    first = _operand(node)
    if not chain:
        return first
    steps = [(BINARY[item.operator], function_of(item.right)) for item in reversed(chain)]

    def value(state: State, data: Data) -> Value | None:
        result = first(state, data)
        for apply, right in steps:
            result = apply(result, right(state, data))
        return result

    return value


def _operand(expression: Expression) -> Function:
    match expression:
        case Constant(value=value) | EnumValue(value=value):
            return lambda state, data: value
        case VariableRead(component=component, variable=variable):
            place = (component, variable)
            return lambda state, data: state[place]
        case StateTest(component=component, state=location):
            home = (component, None)
            return lambda state, data: state[home] == location
        case Received(path=path):
            return lambda state, data: data(path)
        case Unary(operator=operator, operand=operand):
            apply, inner = UNARY[operator], function_of(operand)
            return lambda state, data: apply(inner(state, data))
        case Binary():
            return function_of(expression)


def holds(function: Function, state: State) -> bool:
    """Whether a condition is true: neither false nor unknown."""
    return function(state, no_data) is True


def diagram_function(diagram: DecisionDiagram, domains: Mapping[Place, Sequence[Value]]) -> Callable[[State], bool]:
    """A decision diagram as a predicate.

    Args:
        diagram: The diagram.
        domains: All values of each place, in order.
    """

    def child(node: DecisionNode, state: State) -> int:
        place = (node.automaton, node.variable)
        return node.children[bisect_right(node.starts, domains[place].index(state[place])) - 1]

    def predicate(state: State) -> bool:
        reference = diagram.root
        while reference > 1:
            reference = child(diagram.nodes[reference - 2], state)
        return reference == 1

    return predicate
