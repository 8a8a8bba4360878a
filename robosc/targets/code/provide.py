"""Statements that choose the data of a request: that of the first provide statement whose condition is true."""

from collections.abc import Callable, Iterable

from robosc.model.structure import Provide, ProvidedValue
from robosc.targets.code.expression_writer import ExpressionWriter
from robosc.targets.code.expressions import TRUE_CODE
from robosc.targets.code.statements import Block, Comment, Return, Statement, when
from robosc.targets.text import provide_text


def first_provided(
    statements: Iterable[Provide], scope: ExpressionWriter, give: Callable[[ProvidedValue], Block], default: Return
) -> Block:
    """Return what is done for the first statement whose condition is true; the default where there is none.

    Args:
        statements: The provide statements of one communication, in source order.
        scope: Writes expressions over the state.
        give: The statements that return a value.
        default: The end where no condition is true.
    """
    found: list[Statement] = []
    for statement in statements:
        condition = TRUE_CODE if statement.condition is None else scope.truth(statement.condition)
        found.append(Comment(provide_text(statement)))
        if condition == TRUE_CODE:
            return [*found, *give(statement.value)]
        found.append(when(condition, *give(statement.value)))
    return [*found, default]
