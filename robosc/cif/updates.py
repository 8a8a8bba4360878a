"""Updates of CIF's edges: the new value of every variable that they assign, or of every field of one."""

from dataclasses import dataclass

from robosc.cif import syntax
from robosc.cif.scopes import Entity, Scope
from robosc.cif.terms import ERROR, Term, broken, conditional, flat, tuple_parts, widened
from robosc.cif.types import overlaps
from robosc.cif.typing import Typing
from robosc.expressions import VariableRead
from robosc.source import Location


@dataclass(frozen=True, slots=True)
class New:
    """A new value of a variable.

    Attributes:
        term: The value.
        at: Place of the address.
        old: The variable.
        text: The address, as it is written.
    """

    term: Term
    at: Location
    old: Term
    text: str


class Updates:
    """Reader of updates.

    Args:
        typing: Meaning of expressions.
    """

    def __init__(self, typing: Typing) -> None:
        self.typing = typing
        self.scopes = typing.scopes

    def assigned(self, items: tuple[syntax.Update, ...], scope: Scope) -> dict[str, New]:
        """The new value of every variable that is assigned, by its name in the automaton."""
        found: dict[str, New] = {}
        for item in items:
            if isinstance(item, syntax.Assignment):
                term = self.typing.term(item.value, scope)
                made = self._assigned(item.address, term, scope)
            else:
                made = self._if_update(item, scope)
            self._join(found, made)
        return found

    def _join(self, found: dict[str, New], made: dict[str, New]) -> None:
        """Add assignments to others, unless they assign the same."""
        both = [made[name] for name in made if name in found]
        for text, at in dict.fromkeys((new.text, new.at) for new in both):
            self.typing.error("cif-assignment", f"'{text}' is assigned twice", at, "Assign it once.")
        found.update(made)

    def _if_update(self, item: syntax.IfUpdate, scope: Scope) -> dict[str, New]:
        branches = [(self.typing.conjunction(guards, scope), self.assigned(updates, scope))
                    for guards, updates in item.branches]  # fmt: skip
        otherwise = self.assigned(item.otherwise, scope)
        found: dict[str, New] = {}
        for name in dict.fromkeys(name for part in (*(part for _, part in branches), otherwise) for name in part):
            first = next(part[name] for part in (otherwise, *(part for _, part in reversed(branches))) if name in part)
            term, at = otherwise[name].term if name in otherwise else first.old, first.at
            for guard, part in reversed(branches):
                new = part[name].term if name in part else first.old
                at = part[name].at if name in part else at
                kinds = (guard.type.kind, new.type.kind, term.type.kind)
                term = ERROR if "unknown" in kinds else conditional(guard, new, term, first.old.type)
            found[name] = New(term, at, first.old, first.text)
        return found

    def _assigned(self, address: syntax.Expression, term: Term, scope: Scope) -> dict[str, New]:
        """The variables of an address, with their values."""
        if isinstance(address, syntax.Group):
            return self._several(address.items, term, scope, address.at)
        own = self._addressed(address, scope)
        if "unknown" in (own.type.kind, term.type.kind):
            return {}
        if not overlaps(term.type, own.type):
            self.typing.mismatch(f"{term.type} does not fit {own.type}", address.at)
            return {}
        if own.problems:
            # A variable that synthesis does not take has been reported where it is declared.
            return {}
        found = {}
        for old, new in zip(flat(own), flat(widened(term, own.type)), strict=True):
            assert isinstance(old.expression, VariableRead)  # noqa: S101 - a variable, or a field of one
            found[old.expression.variable] = New(new, address.at, old, _text(address))
        return found

    def _several(self, items: tuple[syntax.Expression, ...], term: Term, scope: Scope, at: Location) -> dict[str, New]:
        if term.type.kind == "tuple" and len(term.type.parts) == len(items):
            parts = tuple_parts(term)
        else:
            if term.type.kind != "unknown":
                self.typing.mismatch(f"{term.type} has not {len(items)} parts", at)
            parts = tuple(ERROR for _ in items)
        found: dict[str, New] = {}
        for item, part in zip(items, parts, strict=True):
            self._join(found, self._assigned(item, part, scope))
        return found

    def _addressed(self, address: syntax.Expression, scope: Scope) -> Term:
        """The variable that is assigned, or the part of one."""
        if isinstance(address, syntax.Index):
            base = self._addressed(address.base, scope)
            if base.type.kind == "tuple":
                return self.typing.field(address, base, scope)
            index = self.typing.term(address.index, scope)
            is_list = base.type.kind == "list" and index.type.kind in ("int", "unknown")
            is_entry = base.type.kind == "dict" and overlaps(index.type, base.type.parts[0])
            if base.type.kind == "unknown" or is_list or is_entry:
                return broken(base.type.parts[-1], base) if base.type.parts else ERROR
            return self.typing.mismatch(f"{base.type} has no element {index.type}", address.at)
        assert isinstance(address, syntax.Name)  # noqa: S101 - there are no other addresses
        entity = self.scopes.resolve(address, scope)
        if entity is None:
            return ERROR
        is_variable = isinstance(entity, Entity) and isinstance(entity.declaration, syntax.Discrete | syntax.Continuous)
        if not is_variable or not isinstance(entity, Entity):
            self.scopes.wrong_kind(address, entity, "a discrete variable")
            return ERROR
        if entity.scope is not scope:
            message = f"'{address}' is a variable of '{entity.scope.path}', which alone may assign it"
            fix = "Let that automaton assign it on an edge of the same event."
            self.typing.error("cif-assignment", message, address.at, fix)
            return ERROR
        return self.typing.entity(entity)


def _text(address: syntax.Expression) -> str:
    """A variable or part of one, as it is written."""
    if isinstance(address, syntax.Index):
        index = address.index
        shown = index if isinstance(index, syntax.Name) else index.value if isinstance(index, syntax.Literal) else "..."
        return f"{_text(address.base)}[{shown}]"
    return str(address)
