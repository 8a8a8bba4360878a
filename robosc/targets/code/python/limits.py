"""Generated methods that give the bounds of a request's numbers in a state."""

from robosc.model.structure import Limit
from robosc.targets.code.expressions import FALSE_CODE, TRUE_CODE, variable
from robosc.targets.code.python.expressions import constant
from robosc.targets.code.python.statements import method
from robosc.targets.code.python.writer import Writer
from robosc.targets.code.statements import Assign, Comment, Let, Return, Statement, when
from robosc.targets.text import limit_text

_FOUND = variable("found")


def limits_method(writer: Writer, communication: str) -> list[str]:
    """The method that gives the bounds of all limits of a communication whose condition is not false."""
    body: list[Statement] = [Let(_FOUND, constant(()))]
    for limit in writer.model.limits_for(communication):
        is_out = FALSE_CODE if limit.condition is None else writer.scope.falsity(limit.condition)
        applies = writer.scope.negated(is_out)
        add = Assign(_FOUND, constant(_bounds(limit)), "+")
        body.append(Comment(limit_text(limit)))
        body.append(add if applies == TRUE_CODE else when(applies, add))
    words = f"Return bounds of numbers of {communication} that apply now: (path, low, high)."
    return method(writer.layout.methods["limits", communication], words, [*body, Return(_FOUND)])


def _bounds(limit: Limit) -> tuple[tuple[tuple[str, ...], float, float], ...]:
    return tuple((bound.path, bound.low, bound.high) for bound in limit.bounds)
