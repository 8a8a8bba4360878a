"""Expressions as closures over flat state tuples: the evaluator of the explicit algorithms.

Means the same as `robosc.expressions.evaluate`, for many states of one system.
"""

from collections.abc import Callable, Mapping

from robosc.automata.state import Subject
from robosc.errors import InternalError
from robosc.expressions import (
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
    leaves,
)
from robosc.expressions.evaluate import BINARY, CALL, UNARY
from robosc.expressions.text import expression_text
from robosc.expressions.values import conditional

State = tuple[Value, ...]
"""A global state, in the order of `subjects`."""

Path = tuple[PathStep, ...]

Data = Mapping[Path, Value | None]
"""Received data of one occurrence of an event: a value for each path, None where it is unknown."""

Carried = tuple[tuple[Path, Value | None], ...]
"""The same as pairs, which can be looked up."""

Function = Callable[[State, Data], Value | None]
"""An expression's value in a state, with received data; None where it is unknown."""

NO_DATA: Data = {}


def subjects_read(expression: Expression) -> frozenset[Subject]:
    """The locations and variables that an expression reads."""
    found = set[Subject]()
    for leaf in leaves(expression):
        match leaf:
            case VariableRead(component=component, variable=variable):
                found.add(Subject(component, variable))
            case StateTest(component=component):
                found.add(Subject(component))
    return frozenset(found)


def paths_read(expression: Expression) -> tuple[Path, ...]:
    """The received paths that an expression reads, each once, left to right."""
    return tuple(dict.fromkeys(leaf.path for leaf in leaves(expression) if isinstance(leaf, Received)))


def compile_expression(expression: Expression, places: Mapping[Subject, int]) -> Function:
    """Return the expression as a function of state and received data.

    Args:
        expression: A resolved expression.
        places: Place of each subject in a state tuple.
    """
    # A chain such as `a and b and c ...` is a tree as deep as it is long, leaning left: a loop takes it.
    spine: list[Binary] = []
    node = expression
    while isinstance(node, Binary):
        spine.append(node)
        node = node.left
    first = _compile_operand(node, places)
    if not spine:
        return first
    # No generators here and below: each of those that are open within each other takes a part of C's stack.
    steps = [(BINARY[item.operator], compile_expression(item.right, places)) for item in reversed(spine)]

    def fold(state: State, data: Data) -> Value | None:
        value = first(state, data)
        for function, right in steps:
            value = function(value, right(state, data))
        return value

    return fold


def _compile_operand(expression: Expression, places: Mapping[Subject, int]) -> Function:
    match expression:
        case Constant(value=value) | EnumValue(value=value):
            return lambda state, data: value
        case VariableRead(component=component, variable=variable):
            place = places[Subject(component, variable)]
            return lambda state, data: state[place]
        case StateTest(component=component, state=location):
            place = places[Subject(component)]
            return lambda state, data: state[place] == location
        case Received(path=path):
            return lambda state, data: data[path]
        case Unary(operator=operator, operand=operand):
            function, inner = UNARY[operator], compile_expression(operand, places)
            return lambda state, data: function(inner(state, data))
        case Conditional(condition=condition, then=then, otherwise=otherwise):
            test, yes, no = [compile_expression(item, places) for item in (condition, then, otherwise)]
            return lambda state, data: conditional(test(state, data), yes(state, data), no(state, data))
        case Call(function=name, arguments=arguments):
            apply, inners = CALL[name], [compile_expression(item, places) for item in arguments]
            return lambda state, data: apply(*[inner(state, data) for inner in inners])
        case Binary():
            return compile_expression(expression, places)
        case Element() | Reduction() | Quantifier():
            # Arrays have infinitely many values, so no synthesis variable is fed by one.
            raise InternalError(f"an array in a synthesis problem: {expression_text(expression)}")
