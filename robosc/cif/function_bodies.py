"""Bodies of functions that a user defines: their names and types are checked, and that they return.

Synthesis takes no calls of them, so nothing comes of a body.
"""

from robosc.cif import syntax
from robosc.cif.scopes import Scope
from robosc.cif.types import CifType, fits
from robosc.cif.typing import Typing
from robosc.cif.updates import Updates


def check_function(typing: Typing, function: syntax.Function, around: Scope) -> None:
    """Report what is wrong in a function.

    Args:
        typing: Meaning of expressions.
        function: The function.
        around: Scope that it stands in.
    """
    scope = typing.scopes.function(function, around)
    for _, written, value in function.variables:
        type_ = typing.type(written, scope)
        if value is not None:
            _check_value(typing, value, scope, type_)
    for _, written in function.parameters:
        typing.type(written, around)
    results = tuple(typing.type(item, around) for item in function.results)
    result = results[0] if len(results) == 1 else CifType("tuple", parts=results)
    _Body(typing, scope, result).check(function.statements, in_loop=False)
    if function.statements:
        _check_end(typing, function.statements)


def _check_value(typing: Typing, value: syntax.Expression, scope: Scope, type_: CifType) -> None:
    term = typing.term(value, scope, type_)
    if not fits(term.type, type_):
        typing.mismatch(f"{term.type} does not fit {type_}", value.at)


def _check_end(typing: Typing, statements: tuple[syntax.Statement, ...]) -> None:
    """Report that a function may end without a result."""
    last = statements[-1]
    if isinstance(last, syntax.Return):
        return
    if isinstance(last, syntax.Block) and last.is_choice and last.otherwise:
        for part in (*(part for _, part in last.branches), last.otherwise):
            _check_end(typing, part)
        return
    typing.error("cif-structure", "the function may end here without a result", last.at, "Return one.")


class _Body:
    """Checker of statements.

    Args:
        typing: Meaning of expressions.
        scope: Scope of the function.
        result: Type of what it returns.
    """

    def __init__(self, typing: Typing, scope: Scope, result: CifType) -> None:
        self._typing, self._scope, self._result = typing, scope, result

    def check(self, statements: tuple[syntax.Statement, ...], *, in_loop: bool) -> None:
        """Report what is wrong in statements."""
        typing, scope = self._typing, self._scope
        for item in statements:
            match item:
                case syntax.Assignment():
                    Updates(typing).assigned((item,), scope)
                case syntax.Return():
                    _check_value(typing, item.value, scope, self._result)
                case syntax.Leave(word=word) if not in_loop:
                    typing.error("cif-structure", f"'{word}' stands in no 'while'", item.at, "Remove it.")
                case syntax.Block():
                    for guards, part in item.branches:
                        typing.conjunction(guards, scope)
                        self.check(part, in_loop=in_loop or not item.is_choice)
                    self.check(item.otherwise, in_loop=in_loop)
