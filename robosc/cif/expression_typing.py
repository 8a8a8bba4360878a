"""Types of CIF's expressions, their static values, and the expressions of automata that they become.

Where a real number is expected, a whole number that is written out is one. So the type that is expected goes down into
an expression, as a hint: into operands, branches, elements and arguments, each by rules of its own.
"""

from abc import ABC, abstractmethod
from typing import Any

from robosc.cif import syntax
from robosc.cif.functions import argument_hint, call
from robosc.cif.operators import Operators, of_type, value_text
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
    retyped,
    static,
    truth,
    tuple_parts,
    values_of,
)
from robosc.cif.types import AUTOMATON, BOOL, REAL, STRING, CifType, fits, is_compatible
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
        reads: Entities that the expressions of now read, with places.
        received: The value that an edge receives, in its updates.
        has_distributions: True in initial values of variables, which alone may be distributions.
    """

    def __init__(self, scopes: Scopes) -> None:
        self.scopes = scopes
        self.findings = scopes.findings
        self._operators = Operators(scopes.findings)
        self.reads: dict[Entity | Scope, Location] = {}
        self.received: Term | None = None
        self.has_distributions = False

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

    def real(self, node: syntax.Expression, scope: Scope) -> Term:
        """The term of a real number."""
        term = self.term(node, scope, REAL)
        if term.type.kind not in ("real", "unknown"):
            return self.mismatch(f"this must be a real number; it is {of_type(term.type)}", node.at)
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
        term = self.evaluated(node, scope, None)
        if term.type.kind == "unknown":
            return None
        if term.type.kind != "int":
            self.mismatch("this must be an integer that is known beforehand", node.at, "Use literals and constants.")
            return None
        return int(term.value)

    def evaluated(self, node: syntax.Expression, scope: Scope, hint: CifType | None) -> Term:
        """The term of an expression that is evaluated beforehand, which has a value or is one of an error."""
        outer, self._operators.is_evaluating = self._operators.is_evaluating, True
        term = self.term(node, scope, hint)
        self._operators.is_evaluating = outer
        if term.type.kind == "unknown" or term.is_static or term.type.kind == "func":
            return term
        for problem in term.problems:
            self.mismatch(problem.message, problem.location)
        return ERROR

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

    def term(self, node: syntax.Expression, scope: Scope, hint: CifType | None = None) -> Term:
        """The term of an expression.

        Args:
            node: The expression.
            scope: Scope that it is written in.
            hint: Type that is expected, if there is one.
        """
        match node:
            case syntax.Literal(value=value):
                return _literal(value, hint)
            case syntax.Name():
                return self._name(node, scope)
            case syntax.Unary(operator=operator):
                inner = hint if operator in ("-", "+") else None
                return self._operators.unary(node, self.term(node.operand, scope, inner))
            case syntax.Binary():
                left = self.term(node.left, scope, hint if node.operator in _HINTED else None)
                right = self.term(node.right, scope, _second_hint(node.operator, left.type, hint))
                return self._operators.binary(node, left, right)
            case syntax.If():
                return self._if(node, scope, hint)
            case syntax.Switch():
                return self._switch(node, scope, hint)
            case syntax.Group():
                return self._operators.group(node, self._elements(node, scope, hint), hint)
            case syntax.Index():
                return self._index(node, scope)
            case syntax.Slice():
                return self._slice(node, scope, hint)
            case syntax.Call():
                return self._call(node, scope, hint)
            case syntax.Cast():
                type_ = self.type(node.type, scope)
                is_plain = type_.kind in ("bool", "real", "string") or (type_.kind == "int" and type_.low is None)
                return self._operators.cast(node, type_, self.term(node.operand, scope, None if is_plain else type_))
            case syntax.Special():
                return self._special(node, scope)

    def _must_be_known(self, at: Location) -> Term:
        message = "the value of a constant must be known beforehand"
        return self.mismatch(message, at, "Use literals and other constants.")

    def _name(self, name: syntax.Name, scope: Scope) -> Term:
        found = self.scopes.resolve(name, scope)
        if found is None:
            return ERROR
        if scope.is_function and not (isinstance(found, Entity) and (
            found.scope is scope or isinstance(found.declaration, _KNOWN)
        )):  # fmt: skip
            return self.mismatch(f"a function does not use '{name}'", name.at, "Give it the value as an argument.")
        if isinstance(found, Scope) and found.is_automaton:
            self.reads.setdefault(found, name.at)
            return self._must_be_known(name.at) if self._operators.is_evaluating else Term(AUTOMATON, value=found)
        is_value = isinstance(found, Entity) and not (
            isinstance(found.declaration, syntax.TypeDeclaration | syntax.Event | syntax.Invariant)
            or (isinstance(found.declaration, syntax.Enum) and not found.is_literal)
        )
        if not is_value or not isinstance(found, Entity):
            self.scopes.wrong_kind(name, found, "a value")
            return ERROR
        if self._operators.is_evaluating and not isinstance(found.declaration, _KNOWN):
            return self._must_be_known(name.at)
        self.reads.setdefault(found, name.at)
        return self.entity(found)

    def _elements(self, node: syntax.Group, scope: Scope, hint: CifType | None) -> list[Term]:
        """The terms of a tuple, list, set or dictionary; the first of it says what the others are expected to be."""
        kinds = ("dict",) if node.kind == "dict" else (node.kind,)
        hints = list(hint.parts) if hint is not None and hint.kind in kinds else []
        found: list[Term] = []
        count = {"tuple": len(node.items), "dict": 2}.get(node.kind, 1)
        for place, item in enumerate(node.items):
            expected = found[place % count].type if place >= count else hints[place] if place < len(hints) else None
            found.append(self.term(item, scope, expected))
        return found

    def _if(self, node: syntax.If, scope: Scope, hint: CifType | None) -> Term:
        guards = [self.conjunction(guards, scope) for guards, _ in node.branches]
        values = [self.term(then, scope, hint) for _, then in node.branches]
        values.append(self.term(node.otherwise, scope, hint))
        return self._chosen(guards, values, node.at)

    def sent(self, node: syntax.Expression, scope: Scope, type_: CifType) -> Term:
        """The term of a value that is sent, of the channel's type; outside of what receives it."""
        outer, self.received = self.received, None
        term = self.term(node, scope, type_)
        self.received = outer
        return retyped(term, type_) if fits(term.type, type_) else ERROR

    def first(self, conditions: list[Term], values: list[Term], type_: CifType) -> Term:
        """The term of the value of the first condition that holds, or of the last; all are of one type."""
        found = values[-1]
        for condition, value in zip(reversed(conditions), reversed(values[:-1]), strict=True):
            found = self._operators.choice(condition, value, found, type_)
        return found

    def _chosen(self, conditions: list[Term], values: list[Term], at: Location) -> Term:
        """The term of the value of the first condition that holds, or of the last."""
        if any(term.type.kind == "unknown" for term in (*conditions, *values)):
            return ERROR
        type_ = self._operators.common(values, at, "the branches")
        if type_ is None:
            return ERROR
        return self.first(conditions, values, type_) if conditions else retyped(values[0], type_)

    def _switch(self, node: syntax.Switch, scope: Scope, hint: CifType | None) -> Term:
        subject = self.term(node.subject, scope)
        if subject.type.kind == "unknown":
            return ERROR
        if subject.type.kind != "automaton" and not subject.type.has_equality:
            return self.mismatch(f"values of type {subject.type} cannot be told apart", node.subject.at)
        covered: set[Any] = set()
        keys = [self._key(key, subject, scope, covered) for key, _ in node.cases]
        values: list[Term] = []
        for value in (*(value for _, value in node.cases), *([node.otherwise] if node.otherwise else [])):
            values.append(self.term(value, scope, values[0].type if values else hint))
        if any(key.type.kind == "unknown" for key in keys):
            return ERROR
        if node.otherwise is None:
            total = self._values_of(subject)
            if total is None or total - covered:
                message = "this switch leaves values out, and has no 'else'"
                return self.mismatch(message, node.at, "Write a case for each value, or 'else'.")
            keys.pop()
        return self._chosen(keys, values, node.at)

    def _values_of(self, subject: Term) -> set[Any] | None:
        """Every value that a switch must cover; None if there are too many to cover."""
        match subject.type.kind:
            case "automaton":
                places = [item for item in subject.value.body if isinstance(item, syntax.LocationDeclaration)]
                return {item.name.text if item.name is not None else NAMELESS for item in places}
            case _:
                found = values_of(subject.type, MAXIMUM_CASES)
                return None if found is None else set(found)

    def _key(self, key: syntax.Expression, subject: Term, scope: Scope, covered: set[Any]) -> Term:
        """The term that a subject has the value of one case."""
        if subject.type.kind == "automaton":
            automaton: Scope = subject.value
            if isinstance(key, syntax.Name) and len(key.parts) == 1 and key.root is syntax.Root.HERE:
                entry = None if key.parts[0] in automaton.parameters else automaton.entries.get(key.parts[0])
                if isinstance(entry, Entity) and isinstance(entry.declaration, syntax.LocationDeclaration):
                    self._cover(key.parts[0], str(key), key.at, covered)
                    return self.location(automaton, entry.declaration)
            return self.mismatch(f"a case must be a location of '{automaton.path}'", key.at, "Write its name alone.")
        value = self.term(key, scope, subject.type)
        if value.type.kind == "unknown":
            return ERROR
        if value.is_static and is_compatible(value.type, subject.type):
            self._cover(value.value, value_text(value.value, value.type), key.at, covered)
        return self.equality(subject, value, key.at)

    def _cover(self, value: Any, text: str, at: Location, covered: set[Any]) -> None:
        if value in covered:
            self.mismatch(f"there are two cases for {text}", at, "Remove one of them.")
        covered.add(value)

    def _index(self, node: syntax.Index, scope: Scope) -> Term:
        base = self.term(node.base, scope)
        if base.type.kind == "unknown":
            return ERROR
        if base.type.kind == "tuple":
            return self.field(node, base, scope)
        index = self.term(node.index, scope, base.type.parts[0] if base.type.kind == "dict" else None)
        if index.type.kind == "unknown":
            return ERROR
        if not self.has_index(base.type, index.type, node.at):
            return ERROR
        result = STRING if base.type.kind == "string" else base.type.parts[-1]
        if not (base.is_static and index.is_static):
            return broken(result, base, index, problem=Problem("an element is chosen by a state", node.at))
        try:
            values = dict(base.value) if base.type.kind == "dict" else base.value
            return static(result, values[index.value])
        except LookupError:
            return self._operators.failed(result, f"there is no element {index.value!r}", node.at)

    def has_index(self, base: CifType, index: CifType, at: Location) -> bool:
        """Return True if values of a type may have elements of an index; report it if not."""
        is_fit = is_compatible(index, base.parts[0]) if base.kind == "dict" else (
            base.kind in ("list", "string") and index.kind == "int"
        )  # fmt: skip
        if is_fit and base.kind == "list" and base.low is not None and index.low is not None:
            length = base.range[1]
            is_fit = index.low < length and index.range[1] >= -length
        if not is_fit:
            self.mismatch(f"{base} has no element {index}", at)
        return is_fit

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

    def _slice(self, node: syntax.Slice, scope: Scope, hint: CifType | None) -> Term:
        base = self.term(node.base, scope, hint)
        bounds = [self.term(item, scope) if item is not None else None for item in (node.low, node.high)]
        known = [item for item in bounds if item is not None]
        if "unknown" in (base.type.kind, *(item.type.kind for item in known)):
            return ERROR
        if base.type.kind not in ("list", "string"):
            return self.mismatch(f"{base.type} cannot be sliced", node.at)
        for item, bound in zip((node.low, node.high), bounds, strict=True):
            if item is not None and bound is not None and bound.type.kind != "int":
                return self.mismatch(f"this must be an integer; it is {of_type(bound.type)}", item.at)
        type_ = base.type
        if base.type.low is not None:
            limits = [None if item is None else item.type for item in bounds]
            type_ = CifType("list", *slice_lengths(base.type, *limits), base.type.parts)
        if not base.is_static or not all(item.is_static for item in known):
            return broken(type_, base, *known, problem=Problem("this slices a value of a state", node.at))
        low, high = (None if item is None else item.value for item in bounds)
        return static(type_, base.value[low:high])

    def _call(self, node: syntax.Call, scope: Scope, hint: CifType | None) -> Term:
        if isinstance(node.function, str):
            name = node.function
            hints = [argument_hint(name, place, hint) for place in range(len(node.arguments))]
            arguments = [self.term(item, scope, hints[place]) for place, item in enumerate(node.arguments)]
            if any(item.type.kind == "unknown" for item in arguments):
                return ERROR
            found = call(self._operators, node, arguments)
            if found.type.kind == "dist" and not self.has_distributions:
                return self.mismatch("a distribution is made in an initial value of a variable alone", node.at)
            return found
        function = self.term(node.function, scope)
        if function.type.kind == "unknown":
            return ERROR
        if function.type.kind != "func":
            return self.mismatch(f"a value {of_type(function.type)} cannot be called", node.at)
        result, *parameters = function.type.parts
        if len(parameters) != len(node.arguments):
            message = f"the function takes {len(parameters)} arguments, and is given {len(node.arguments)}"
            return self.mismatch(message, node.at, f"Give it {len(parameters)} arguments.")
        for item, type_ in zip(node.arguments, parameters, strict=True):
            if not fits((found := self.term(item, scope, type_)).type, type_):
                return self.mismatch(f"{found.type} does not fit {type_}", item.at)
        if self._operators.is_evaluating:
            return self._must_be_known(node.at)
        return broken(result, problem=Problem("this calls a function of the model", node.at))

    def _special(self, node: syntax.Special, scope: Scope) -> Term:
        if self._operators.is_evaluating:
            return self._must_be_known(node.at)
        match node.word:
            case "time" if scope.is_function:
                return self.mismatch("a function does not use 'time'", node.at, "Give it the value as an argument.")
            case "time":
                return broken(REAL, problem=Problem("'time' is a real number", node.at))
            case "self":
                if not scope.is_automaton:
                    return self.mismatch("'self' is the enclosing automaton, and there is none", node.at)
                self.reads.setdefault(scope, node.at)
                return Term(AUTOMATON, value=scope)
            case "?":
                if self.received is None or self.received.type.kind == "void":
                    return self.mismatch("this edge receives no value", node.at, "Receive one, as in 'edge e?'.")
                return self.received
        assert node.name is not None  # noqa: S101 - a derivative is one of something
        found = self.scopes.resolve(node.name, scope)
        if found is not None and not (isinstance(found, Entity) and isinstance(found.declaration, syntax.Continuous)):
            self.scopes.wrong_kind(node.name, found, "a continuous variable")
            return ERROR
        return broken(REAL, problem=Problem("a derivative is read", node.at)) if found is not None else ERROR


_KNOWN = syntax.Constant | syntax.Enum | syntax.Function
"""Entities that have the same value in every state."""

_HINTED = frozenset({"and", "or", "+", "-", "*", "div", "mod"})
"""Operators whose first operand is expected to be what the result is."""


def _second_hint(operator: str, first: CifType, hint: CifType | None) -> CifType | None:
    """The type that is expected of a second operand."""
    is_number = hint is not None and hint.is_number
    if operator in ("=", "!=", "and", "or", "=>", "<=>", "sub"):
        return first
    if operator == "+" or (operator == "-" and (hint is None or hint.kind != "dict")):
        return hint if is_number else first
    return hint if operator in ("*", "div", "mod") or (operator == "-" and is_number) else None


def slice_lengths(base: CifType, begin: CifType | None, end: CifType | None) -> tuple[int, int]:
    """Least and greatest length of a slice of a list with a length, by the types of its bounds."""
    low, high = base.range
    for bound in (begin, end):
        is_exact = bound is None or (bound.low is not None and bound.low == bound.high)
        if not is_exact or (bound is not None and low < high and not 0 <= bound.range[0] <= low):
            return 0, high
    bounds = slice(*(None if bound is None else bound.low for bound in (begin, end)))
    lengths = [len(range(length)[bounds]) for length in (low, high)]
    return min(lengths), max(lengths)


def _literal(value: bool | int | float | str, hint: CifType | None) -> Term:
    if isinstance(value, bool):
        return truth(value)
    if isinstance(value, int):
        return static(REAL, float(value)) if hint is not None and hint.kind == "real" else number(value)
    return static(REAL if isinstance(value, float) else STRING, value)
