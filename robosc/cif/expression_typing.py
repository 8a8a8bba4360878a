"""Types of CIF's expressions, their static values, and the expressions of automata that they become."""

from abc import ABC, abstractmethod
from typing import Any

from robosc.cif import syntax
from robosc.cif.functions import call
from robosc.cif.operators import Operators, of_type
from robosc.cif.scopes import Entity, Scope, Scopes
from robosc.cif.terms import (
    ERROR,
    MAXIMUM_DEPTH,
    MAXIMUM_SIZE,
    Problem,
    Term,
    broken,
    logic,
    made,
    number,
    static,
    truth,
    tuple_parts,
    values_of,
    widened,
)
from robosc.cif.types import AUTOMATON, BOOL, REAL, STRING, CifType, fits, overlaps
from robosc.expressions import StateTest
from robosc.source import Location

MAXIMUM_CASES = 100_000
"""Values of a type beyond which a switch over it needs `else`."""

NAMELESS = "*"
"""Name of a location that has none; no identifier can be it."""

_UNSUPPORTED = (
    "Leave it out, or write it with booleans, enums and integers of a range, whose values a state determines."
)


class ExpressionTyping(ABC):
    """Meaning of expressions in the scopes of a specification, by that of the names in them.

    Args:
        scopes: The scopes.

    Attributes:
        is_receiving: True in the updates of an edge that receives a value.
    """

    def __init__(self, scopes: Scopes) -> None:
        self.scopes = scopes
        self.findings = scopes.findings
        self._operators = Operators(scopes.findings)
        self.is_receiving = False

    @abstractmethod
    def type(self, written: syntax.Type, scope: Scope) -> CifType:
        """The type that is written."""

    @abstractmethod
    def entity(self, entity: Entity) -> Term:
        """The term of something declared."""

    # Findings

    def error(self, code: str, message: str, location: Location, fix: str) -> None:
        """Report an error."""
        self._operators.error(code, message, location, fix)

    def mismatch(self, message: str, at: Location, fix: str = "") -> Term:
        """Report that types do not fit; the term of an error."""
        return self._operators.mismatch(message, at, fix)

    # Checked kinds of terms

    def predicate(self, node: syntax.Expression, scope: Scope) -> Term:
        """The term of a boolean."""
        term = self.term(node, scope)
        if term.type.kind not in ("bool", "unknown"):
            return self.mismatch(f"this must be a boolean; it is {of_type(term.type)}", node.at)
        return term

    def equality(self, left: Term, right: Term, at: Location) -> Term:
        """The term that two terms have the same value."""
        return self._operators.equality("=", at, left, right)

    def conjunction(self, nodes: tuple[syntax.Expression, ...], scope: Scope) -> Term:
        """The term of predicates that all must hold."""
        found = truth(True)
        for node in nodes:
            found = logic("and", found, self.predicate(node, scope))
        return found

    def static_integer(self, node: syntax.Expression, scope: Scope) -> int | None:
        """The value of an integer that must be known beforehand; None if it is none, which has been reported."""
        term = self.term(node, scope)
        if term.type.kind == "unknown":
            return None
        if term.type.kind != "int" or not term.is_static:
            self.error("cif-type", "this must be an integer that is known beforehand", node.at,
                       "Use literals and constants.")  # fmt: skip
            return None
        return int(term.value)

    def usable(self, term: Term, at: Location) -> bool:
        """Return True if automata can take a term; report what they cannot."""
        if term.type.kind == "unknown":
            return False
        for problem in term.problems:
            self.error("cif-unsupported", problem.message, problem.location, _UNSUPPORTED)
        if term.problems:
            return False
        if not term.is_usable and not term.parts:
            self.error("cif-unsupported", f"synthesis has no values of type {term.type}", at, _UNSUPPORTED)
            return False
        if term.size > MAXIMUM_SIZE or term.depth > MAXIMUM_DEPTH:
            message = "this becomes too large with its algebraic variables written out"
            self.error("cif-too-large", message, at, "Split it, or use a discrete variable.")
            return False
        return True

    def location(self, scope: Scope, place: syntax.LocationDeclaration) -> Term:
        """The term that is true in a location of an automaton."""
        if place.name is None or sum(isinstance(item, syntax.LocationDeclaration) for item in scope.body) == 1:
            return truth(True)
        return made(BOOL, StateTest(scope.path, place.name.text))

    # Expressions

    def term(self, node: syntax.Expression, scope: Scope) -> Term:
        """The term of an expression."""
        match node:
            case syntax.Literal(value=value):
                return _literal(value)
            case syntax.Name():
                return self._name(node, scope)
            case syntax.Unary():
                return self._operators.unary(node, self.term(node.operand, scope))
            case syntax.Binary():
                return self._operators.binary(node, self.term(node.left, scope), self.term(node.right, scope))
            case syntax.If():
                found = self.term(node.otherwise, scope)
                for guards, then in reversed(node.branches):
                    guard = self.conjunction(guards, scope)
                    found = self._operators.choice(guard, self.term(then, scope), found, node.at)
                return found
            case syntax.Switch():
                return self._switch(node, scope)
            case syntax.Group():
                return self._operators.group(node, [self.term(item, scope) for item in node.items])
            case syntax.Index():
                return self._index(node, scope)
            case syntax.Slice():
                return self._slice(node, scope)
            case syntax.Call():
                return self._call(node, scope)
            case syntax.Cast():
                return self._operators.cast(node, self.type(node.type, scope), self.term(node.operand, scope))
            case syntax.Special():
                return self._special(node, scope)

    def _name(self, name: syntax.Name, scope: Scope) -> Term:
        found = self.scopes.resolve(name, scope)
        if found is None:
            return ERROR
        if isinstance(found, Scope) and found.is_automaton:
            return Term(AUTOMATON, value=found)
        is_value = isinstance(found, Entity) and not (
            isinstance(found.declaration, syntax.TypeDeclaration | syntax.Event | syntax.Invariant)
            or (isinstance(found.declaration, syntax.Enum) and not found.is_literal)
        )
        if not is_value or not isinstance(found, Entity):
            self.scopes.wrong_kind(name, found, "a value")
            return ERROR
        return self.entity(found)

    def _switch(self, node: syntax.Switch, scope: Scope) -> Term:
        subject = self.term(node.subject, scope)
        if subject.type.kind == "unknown":
            return ERROR
        keys: list[Term] = []
        covered: set[Any] = set()
        for key, _ in node.cases:
            keys.append(self._key(node, key, subject, scope, covered))
        values = [self.term(value, scope) for _, value in node.cases]
        if node.otherwise is not None:
            found = self.term(node.otherwise, scope)
        else:
            total = self._values_of(subject)
            if total is None or total - covered:
                message = "this switch leaves values out, and has no 'else'"
                return self.mismatch(message, node.at, "Write a case for each value, or 'else'.")
            found = values.pop()
            keys.pop()
        for term, value in zip(reversed(keys), reversed(values), strict=True):
            found = self._operators.choice(term, value, found, node.at)
        return found

    def _values_of(self, subject: Term) -> set[Any] | None:
        """Every value that a switch must cover; None if there are too many to cover."""
        match subject.type.kind:
            case "automaton":
                places = [item for item in subject.value.body if isinstance(item, syntax.LocationDeclaration)]
                return {item.name.text if item.name is not None else NAMELESS for item in places}
            case _:
                found = values_of(subject.type, MAXIMUM_CASES)
                return None if found is None else set(found)

    def _key(self, node: syntax.Switch, key: syntax.Expression, subject: Term, scope: Scope, covered: set[Any]) -> Term:
        """The term that a subject has the value of one case."""
        if subject.type.kind == "automaton":
            automaton: Scope = subject.value
            if isinstance(key, syntax.Name) and len(key.parts) == 1:
                entry = automaton.entries.get(key.parts[0])
                if isinstance(entry, Entity) and isinstance(entry.declaration, syntax.LocationDeclaration):
                    covered.add(key.parts[0])
                    return self.location(automaton, entry.declaration)
            return self.mismatch(f"a case must be a location of '{automaton.path}'", key.at, "Write its name alone.")
        value = self.term(key, scope)
        if value.type.kind == "unknown":
            return ERROR
        if value.is_static and overlaps(value.type, subject.type):
            covered.add(widened(value, subject.type).value)
        return self.equality(subject, value, key.at)

    def _index(self, node: syntax.Index, scope: Scope) -> Term:
        base = self.term(node.base, scope)
        if base.type.kind == "unknown":
            return ERROR
        if base.type.kind == "tuple":
            return self.field(node, base, scope)
        index = self.term(node.index, scope)
        if index.type.kind == "unknown":
            return ERROR
        is_key = base.type.kind == "dict" and overlaps(index.type, base.type.parts[0])
        if not is_key and (base.type.kind not in ("list", "string") or index.type.kind != "int"):
            return self.mismatch(f"{base.type} has no element {index.type}", node.at)
        result = STRING if base.type.kind == "string" else base.type.parts[-1]
        if not (base.is_static and index.is_static):
            return broken(result, base, index, problem=Problem("an element is chosen by a state", node.at))
        try:
            values = dict(base.value) if is_key else base.value
            return static(result, values[index.value])
        except LookupError:
            return self.mismatch(f"there is no element {index.value!r}", node.at)

    def field(self, node: syntax.Index, base: Term, scope: Scope) -> Term:
        """The term of a field of a tuple, by its name or number."""
        parts = tuple_parts(base)
        if isinstance(node.index, syntax.Name) and str(node.index) in base.type.names:
            return parts[base.type.names.index(str(node.index))]
        place = self.static_integer(node.index, scope)
        if place is None:
            return ERROR
        if not 0 <= place < len(parts):
            return self.mismatch(f"the tuple has no field {place}", node.at)
        return parts[place]

    def _slice(self, node: syntax.Slice, scope: Scope) -> Term:
        base = self.term(node.base, scope)
        bounds = [self.term(item, scope) if item is not None else None for item in (node.low, node.high)]
        if base.type.kind == "unknown" or any(item is not None and item.type.kind == "unknown" for item in bounds):
            return ERROR
        if base.type.kind not in ("list", "string"):
            return self.mismatch(f"{base.type} cannot be sliced", node.at)
        for item, bound in zip((node.low, node.high), bounds, strict=True):
            if item is not None and bound is not None and bound.type.kind != "int":
                return self.mismatch(f"this must be an integer; it is {of_type(bound.type)}", item.at)
        type_ = STRING if base.type.kind == "string" else CifType("list", parts=base.type.parts)
        known = [item for item in bounds if item is not None]
        if not base.is_static or not all(item.is_static for item in known):
            return broken(type_, base, *known, problem=Problem("this slices a value of a state", node.at))
        low, high = (None if item is None else item.value for item in bounds)
        return static(type_, base.value[low:high])

    def _call(self, node: syntax.Call, scope: Scope) -> Term:
        arguments = [self.term(item, scope) for item in node.arguments]
        if any(item.type.kind == "unknown" for item in arguments):
            return ERROR
        if isinstance(node.function, str):
            return call(self._operators, node, arguments)
        function = self.term(node.function, scope)
        if function.type.kind == "unknown":
            return ERROR
        if function.type.kind != "func":
            return self.mismatch(f"a value {of_type(function.type)} cannot be called", node.at)
        result, *parameters = function.type.parts
        if len(parameters) != len(arguments) or not all(
            fits(item.type, type_) for item, type_ in zip(arguments, parameters, strict=False)
        ):
            return self.mismatch("the arguments do not fit the function's parameters", node.at)
        return broken(result, problem=Problem("this calls a function of the model", node.at))

    def _special(self, node: syntax.Special, scope: Scope) -> Term:
        match node.word:
            case "time":
                return broken(REAL, problem=Problem("'time' is a real number", node.at))
            case "self":
                if not scope.is_automaton:
                    return self.mismatch("'self' is the enclosing automaton, and there is none", node.at)
                return Term(AUTOMATON, value=scope)
            case "?":
                # That an edge receives anything is reported where its channel is declared.
                return ERROR if self.is_receiving else self.mismatch("this edge receives no value", node.at,
                                                                     "Receive one, as in 'edge e?'.")  # fmt: skip
        if node.name is not None:
            self.term(node.name, scope)
        return broken(REAL, problem=Problem("a derivative is read", node.at))


def _literal(value: bool | int | float | str) -> Term:
    if isinstance(value, bool):
        return truth(value)
    if isinstance(value, int):
        return number(value)
    return static(REAL if isinstance(value, float) else STRING, value)
