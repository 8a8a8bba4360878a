"""Use of expressions of a specification: in an instance they must be ones that synthesis takes."""

import msgspec

from robosc.cif.scopes import Scope, Scopes
from robosc.cif.terms import Term
from robosc.cif.typing import Typing
from robosc.expressions import TRUE, Expression
from robosc.source import Location


class Usage(msgspec.Struct):
    """Users of expressions.

    Attributes:
        scopes: Components of the specification.
        typing: Meaning of their expressions.
        plant_reads: Expressions of plants, with the places where they are.
    """

    scopes: Scopes
    typing: Typing
    plant_reads: list[tuple[Expression, Location]] = msgspec.field(default_factory=list)

    def error(self, code: str, message: str, location: Location, fix: str) -> None:
        """Report an error."""
        self.typing.error(code, message, location, fix)

    def unsupported(self, scope: Scope, message: str, location: Location, fix: str) -> None:
        """Report what synthesis does not take, unless it stands in a definition without an instance."""
        if scope.is_real:
            self.error("cif-unsupported", message, location, fix)

    def used(self, term: Term, scope: Scope, at: Location) -> Expression:
        """The expression of a term that is used; `true` after an error."""
        if not scope.is_real or not self.typing.usable(term, at):
            return TRUE
        return term.core

    def used_by(self, role: str | None, term: Term, scope: Scope, at: Location) -> Expression:
        """The expression of a term that a plant or a requirement uses."""
        found = self.used(term, scope, at)
        if role == "plant":
            self.plant_reads.append((found, at))
        return found
