"""Expressions and decision diagrams as functions of a state."""

from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from typing import Any, assert_never

from robosc.expressions import (
    ArrayPart,
    Binary,
    Call,
    Conditional,
    Constant,
    Element,
    EnumValue,
    Expression,
    PathStep,
    Quantifier,
    Received,
    Reduction,
    StateTest,
    Unary,
    Value,
    VariableRead,
)
from robosc.expressions.evaluate import BINARY, CALL, QUANTIFIER, REDUCTION, UNARY
from robosc.expressions.values import array_part, conditional, part_at
from robosc.supervisor import DecisionDiagram, DecisionNode

Place = tuple[str, str | None]
"""An automaton's location (None), or one of its variables."""

State = Mapping[Place, Value]

Path = tuple[PathStep, ...]

Data = Callable[[Path], Any]
"""Received data by path; None where it is unknown. Arrays are lists, and objects in them mappings."""

Elements = tuple[Any, ...]
"""Current elements of the quantifiers around an expression, the innermost first."""

Function = Callable[[State, Data], Any]
"""The value of an expression; None where it is unknown."""

Inner = Callable[[State, Data, Elements], Any]
"""The value of an expression inside quantifiers; None if it is unknown."""


def no_data(path: Path) -> Any:
    """Return None: no data was received."""
    return None


def function_of(expression: Expression) -> Function:
    """An expression as a function, so that each evaluation need not traverse the tree."""
    inner = _inner(expression)
    return lambda state, data: inner(state, data, ())


def _inner(expression: Expression) -> Inner:
    # A long chain of operators leans to the left: it is as deep as it is long, so a loop goes down there.
    chain: list[Binary] = []
    node = expression
    while isinstance(node, Binary):
        chain.append(node)
        node = node.left
    first = _operand(node)
    if not chain:
        return first
    steps = [(BINARY[item.operator], _inner(item.right)) for item in reversed(chain)]

    def value(state: State, data: Data, elements: Elements) -> Any:
        result = first(state, data, elements)
        for apply, right in steps:
            result = apply(result, right(state, data, elements))
        return result

    return value


def _operand(expression: Expression) -> Inner:
    match expression:
        case Constant(value=value) | EnumValue(value=value):
            return lambda state, data, elements: value
        case VariableRead(component=component, variable=variable):
            place = (component, variable)
            return lambda state, data, elements: state[place]
        case StateTest(component=component, state=location):
            home = (component, None)
            return lambda state, data, elements: state[home] == location
        case Received(path=path):
            return lambda state, data, elements: data(path)
        case Element(level=level, path=path):
            return lambda state, data, elements: part_at(elements[level], path)
        case Unary(operator=operator, operand=operand):
            apply, inner = UNARY[operator], _inner(operand)
            return lambda state, data, elements: apply(inner(state, data, elements))
        case Binary():
            return _inner(expression)
        case Conditional(condition=condition, then=then, otherwise=otherwise):
            return _call(conditional, [_inner(item) for item in (condition, then, otherwise)])
        case Call(function=name, arguments=arguments):
            return _call(CALL[name], [_inner(item) for item in arguments])
        case Reduction(function=name, part=part):
            return _reduction(REDUCTION[name], _inner(part.array), part)
        case Quantifier(word=word, part=part, condition=condition):
            return _quantifier(QUANTIFIER[word], _inner(part.array), part, _inner(condition))
    assert_never(expression)


def _call(apply: Callable[..., Any], arguments: list[Inner]) -> Inner:
    return lambda state, data, elements: apply(*[item(state, data, elements) for item in arguments])


def _reduction(apply: Callable[[Any], Any], array: Inner, part: ArrayPart) -> Inner:
    return lambda state, data, elements: apply(array_part(array(state, data, elements), part.low, part.high))


def _quantifier(apply: Callable[[Any, Any], Any], array: Inner, part: ArrayPart, condition: Inner) -> Inner:
    def value(state: State, data: Data, elements: Elements) -> Any:
        found = array_part(array(state, data, elements), part.low, part.high)
        return apply(found, lambda element: condition(state, data, (element, *elements)))

    return value


def holds(function: Function, state: State) -> bool:
    """Return True if a condition is true: neither false nor unknown."""
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
