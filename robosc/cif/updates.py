"""Updates of CIF's edges: the new value of every variable that they assign, or of every field of one."""

from dataclasses import dataclass

from robosc.cif import syntax
from robosc.cif.scopes import Entity, Scope
from robosc.cif.terms import ERROR, Term, broken, conditional, flat, retyped, tuple_parts, tuple_term
from robosc.cif.types import CifType, overlaps
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
                own = self._addressed(item.address, scope)
                term = self.typing.term(item.value, scope, own.type)
                is_fit = "unknown" in (own.type.kind, term.type.kind) or overlaps(term.type, own.type)
                if not is_fit:
                    self.typing.mismatch(f"{term.type} does not fit {own.type}", item.address.at)
                made = self._assigned(item.address, own, term if is_fit else ERROR)
            else:
                made = self._if_update(item, scope)
            self._join(found, made)
        return found

    def _join(self, found: dict[str, New], made: dict[str, New]) -> None:
        """Add assignments to others, unless they assign the same."""
        both = [made[name] for name in made if name in found]
        for text, at in dict.fromkeys((new.text, new.at) for new in both):
            self._assigned_twice(text, at)
        found.update(made)

    def _assigned_twice(self, text: str, at: Location) -> None:
        self.typing.error("cif-assignment", f"'{text}' is assigned twice", at, "Assign it once.")

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

    def _assigned(self, address: syntax.Expression, own: Term, term: Term) -> dict[str, New]:
        """The variables of an address, with their values."""
        if "unknown" in (own.type.kind, term.type.kind):
            return {}
        found: dict[str, New] = {}
        if isinstance(address, syntax.Group):
            for item, old, new in zip(address.items, tuple_parts(own), tuple_parts(term), strict=True):
                self._join(found, self._assigned(item, old, new))
            return found
        if own.problems:
            # A variable that synthesis does not take has been reported where it is declared.
            return {}
        for old, new in zip(flat(own), flat(retyped(term, own.type)), strict=True):
            assert isinstance(old.expression, VariableRead)  # noqa: S101 - a variable, or a field of one
            found[old.expression.variable] = New(new, address.at, old, _text(address))
        return found

    def _addressed(self, address: syntax.Expression, scope: Scope) -> Term:
        """The variable that is assigned, the part of one, or several."""
        if isinstance(address, syntax.Group):
            items = tuple(self._addressed(item, scope) for item in address.items)
            # Variables that synthesis does not take have no values to join.
            known: set[str] = set()
            for item, term in zip(address.items, items, strict=True):
                if isinstance(item, syntax.Name) and term.problems:
                    if str(item) in known:
                        self._assigned_twice(str(item), item.at)
                    known.add(str(item))
            if any(item.type.kind == "unknown" for item in items):
                return ERROR
            return tuple_term(CifType("tuple", parts=tuple(item.type for item in items)), items)
        if isinstance(address, syntax.Index):
            base = self._addressed(address.base, scope)
            if base.type.kind == "tuple":
                return self.typing.field(address, base, scope)
            index = self.typing.term(address.index, scope, base.type.parts[0] if base.type.kind == "dict" else None)
            if "unknown" in (base.type.kind, index.type.kind):
                return ERROR
            if base.type.kind == "string":
                return self.typing.mismatch("a part of a text cannot be assigned", address.at, "Assign all of it.")
            is_fit = self.typing.has_index(base.type, index.type, address.at)
            return broken(base.type.parts[-1], base) if is_fit else ERROR
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
