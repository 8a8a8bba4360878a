"""Types of CIF's expressions, their static values, and the expressions of automata that they become."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from operator import add, mul, sub
from typing import Any

from robosc.cif import syntax
from robosc.cif.functions import call
from robosc.cif.scopes import Entity, RobotScopes, Scope
from robosc.cif.terms import (
    ERROR,
    MAXIMUM_DEPTH,
    MAXIMUM_SIZE,
    Problem,
    Term,
    broken,
    conditional,
    enum_comparison,
    logic,
    made,
    negation,
    number,
    quotient,
    remainder,
    result_range,
    static,
    truth,
    tuple_parts,
    tuple_term,
)
from robosc.cif.types import (
    AUTOMATON,
    BOOL,
    REAL,
    STRING,
    UNKNOWN,
    CifType,
    fits,
    integer,
    is_compatible,
    joined,
)
from robosc.expressions import MAXIMUM_INTEGER, MINIMUM_INTEGER, Binary, StateTest, Unary, VariableRead
from robosc.source import Location

MAXIMUM_ELEMENTS = 100_000
"""Elements of a list or dictionary, or characters of a text, beyond which a constant is refused."""

MAXIMUM_PARTS = 1000
"""Types that a type may be made of."""

NAMELESS = "*"
"""Name of a location that has none; no identifier can be it."""


class Typing:
    """Meaning of expressions and types in the scopes of a specification."""

    def __init__(self, scopes: RobotScopes) -> None:
        self.scopes = scopes
        self.findings = scopes.findings
        self._terms: dict[Entity, Term | None] = {}
        self._types: dict[Entity, CifType | None] = {}
        self._enums: dict[tuple[str, ...], str] = {}

    # Types

    def type(self, written: syntax.Type, scope: Scope) -> CifType:
        """The type that is written."""
        parts = tuple(self.type(part, scope) for part in written.parts)
        match written.kind:
            case "name":
                assert written.name is not None  # noqa: S101 - a named type has a name
                return self._named(written.name, scope)
            case "int" | "list" if written.bounds:
                bounds = [self.static_integer(bound, scope) for bound in written.bounds]
                low, high = bounds[0], bounds[-1]
                if low is None or high is None:
                    return UNKNOWN
                if low > high or (written.kind == "list" and low < 0):
                    self.error(
                        "cif-type", f"the range {low}..{high} is empty", written.at, "Write the lower one first."
                    )
                    return UNKNOWN
                return CifType(written.kind, low, high, parts)
        fields = tuple(item.text for item in written.fields)
        return self._sized(CifType(written.kind, parts=parts, names=fields), written.at)

    def _sized(self, type_: CifType, at: Location) -> CifType:
        """Return a type unless it is too large to work with, which is reported."""
        if type_.size <= MAXIMUM_PARTS:
            return type_
        self.error("cif-too-large", f"this type has more than {MAXIMUM_PARTS} parts", at, "Use a smaller type.")
        return UNKNOWN

    def _named(self, name: syntax.Name, scope: Scope) -> CifType:
        found = self.scopes.resolve(name, scope)
        if found is None:
            return UNKNOWN
        if isinstance(found, Entity) and isinstance(found.declaration, syntax.Enum) and not found.is_literal:
            return self.enum(found)
        if not isinstance(found, Entity) or not isinstance(found.declaration, syntax.TypeDeclaration):
            if isinstance(found, Scope):
                return AUTOMATON
            self.scopes.wrong_kind(name, found, "a type")
            return UNKNOWN
        if found in self._types:
            known = self._types[found]
            if known is None:
                self._cycle("the type", found)
            return known or UNKNOWN
        self._types[found] = None
        self._types[found] = self.type(found.declaration.type, found.scope)
        return self._types[found] or UNKNOWN

    def enum(self, entity: Entity) -> CifType:
        """The type of an enum; enums with the same literals in the same order are one."""
        assert isinstance(entity.declaration, syntax.Enum)  # noqa: S101 - asked of enums only
        literals = tuple(item.text for item in entity.declaration.literals)
        name = entity.scope.absolute(entity.declaration.name.text)
        return CifType("enum", names=literals, name=self._enums.setdefault(literals, name))

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

    # Findings

    def error(self, code: str, message: str, location: Location, fix: str) -> None:
        """Report an error."""
        self.findings.error(code, message, location, fix)

    def _cycle(self, what: str, entity: Entity) -> None:
        self.error("cif-cycle", f"{what} '{entity.name}' is defined by itself", entity.at, "Break the circle.")

    def mismatch(self, message: str, at: Location, fix: str = "") -> Term:
        """Report that types do not fit; the term of an error."""
        self.error("cif-type", message, at, fix or "Use an expression of a type that fits.")
        return ERROR

    def check(self, entity: Entity) -> None:
        """Work out what is declared, so that its errors are told whether it is used or not."""
        match entity.declaration:
            case syntax.TypeDeclaration(name=name):
                self._named(syntax.Name((name.text,), syntax.Root.HERE, name.at), entity.scope)
            case syntax.Event(data=syntax.Type() as data):
                self.type(data, entity.scope)
            case syntax.Event() | syntax.Invariant() | syntax.LocationDeclaration():
                pass
            case _:
                self.entity(entity)

    # Checked kinds of terms

    def predicate(self, node: syntax.Expression, scope: Scope) -> Term:
        """The term of a boolean."""
        term = self.term(node, scope)
        if term.type.kind not in ("bool", "unknown"):
            return self.mismatch(f"this must be a boolean; it is {_a(term.type)}", node.at)
        return term

    def conjunction(self, nodes: tuple[syntax.Expression, ...], scope: Scope) -> Term:
        """The term of predicates that all must hold."""
        found = truth(True)
        for node in nodes:
            found = logic("and", found, self.predicate(node, scope))
        return found

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

    # Entities

    def entity(self, entity: Entity) -> Term:
        """The term of something declared."""
        if entity not in self._terms:
            self._terms[entity] = None
            self._terms[entity] = self._declared(entity)
        found = self._terms[entity]
        if found is None:
            self._cycle("the value of", entity)
            self._terms[entity] = ERROR
            return ERROR
        return found

    def _declared(self, entity: Entity) -> Term:
        declaration, scope = entity.declaration, entity.scope
        match declaration:
            case syntax.Enum():
                return static(self.enum(entity), entity.identifier.text)
            case syntax.Constant(type=type_, value=value):
                return self._constant(self.type(type_, scope), value, scope)
            case syntax.Algebraic():
                return self._algebraic(entity, declaration)
            case syntax.Discrete(type=written) | syntax.Input(type=written):
                return self._variable(entity, self.type(written, scope))
            case syntax.LocationDeclaration():
                return made(BOOL, StateTest(scope.path, entity.identifier.text))
            case syntax.Continuous():
                return broken(REAL, problem=Problem(f"'{entity.name}' is a continuous variable", entity.at))
            case syntax.Function():
                parts = tuple(self.type(item, scope) for item in declaration.results)
                result = parts[0] if len(parts) == 1 else CifType("tuple", parts=parts)
                parameters = tuple(self.type(item, scope) for _, item in declaration.parameters)
                problem = Problem(f"'{entity.name}' is a function of the model", entity.at)
                return broken(CifType("func", parts=(result, *parameters)), problem=problem)
        raise AssertionError(declaration)

    def _constant(self, type_: CifType, value: syntax.Expression, scope: Scope) -> Term:
        term = self.term(value, scope)
        if term.type.kind == "unknown":
            return ERROR
        if not fits(term.type, type_):
            return self.mismatch(f"{term.type} does not fit {type_}", value.at)
        if term.problems:
            return broken(type_, term)
        if not term.is_static:
            return self.mismatch("the value of a constant must be known beforehand", value.at,
                                 "Use literals and other constants.")  # fmt: skip
        # Its own value is as narrow a type as there is.
        return term if term.type.kind in ("int", "enum") else static(type_, term.value)

    def _variable(self, entity: Entity, type_: CifType) -> Term:
        scope, name = entity.scope, entity.identifier.text
        if type_.kind == "unknown":
            return ERROR
        if not type_.is_finite:
            return broken(type_, problem=Problem(f"'{entity.name}' has the type {type_}", entity.at))
        if isinstance(entity.declaration, syntax.Input):
            return made(type_, VariableRead(entity.name, "value"))
        return made(type_, VariableRead(scope.path, name))

    def _algebraic(self, entity: Entity, declaration: syntax.Algebraic) -> Term:
        scope = entity.scope
        # The type of a parameter is one of the definition's words; its argument is one of the instance's.
        type_ = self.type(declaration.type, scope)
        if entity.value_scope is not None:
            if entity.value is None:
                # A parameter of a definition that nobody instantiates: any value.
                return broken(type_, problem=Problem(f"'{entity.name}' has no value", entity.at))
            return self._fitted(self.term(entity.value, entity.value_scope), type_, entity.value.at)
        values = [(None, declaration.value)] if declaration.value is not None else []
        values += [(None, item.value) for item in scope.body
                   if isinstance(item, syntax.Equation) and item.name.text == entity.identifier.text]  # fmt: skip
        places = [item for item in scope.body if isinstance(item, syntax.LocationDeclaration)]
        located = [(place, item.value) for place in places for item in place.equations
                   if item.name.text == entity.identifier.text]  # fmt: skip
        fix = "Define it once: where it is declared, in one equation, or in one of every location."
        if len(values) + bool(located) != 1 or (located and [place for place, _ in located] != places):
            count = "no value" if not values and not located else "values in too many or too few places"
            self.error("cif-structure", f"the algebraic variable '{entity.name}' has {count}", entity.at, fix)
            return ERROR
        if values:
            return self._fitted(self.term(values[0][1], scope), type_, values[0][1].at)
        terms = [(place, self._fitted(self.term(value, scope), type_, value.at)) for place, value in located]
        found = terms[-1][1]
        for place, term in reversed(terms[:-1]):
            found = self._choice(self.location(scope, place), term, found, place.at)
        return found

    def location(self, scope: Scope, place: syntax.LocationDeclaration) -> Term:
        """The term that is true in a location of an automaton."""
        if place.name is None or sum(isinstance(item, syntax.LocationDeclaration) for item in scope.body) == 1:
            return truth(True)
        return made(BOOL, StateTest(scope.path, place.name.text))

    def _fitted(self, term: Term, type_: CifType, at: Location) -> Term:
        if "unknown" in (term.type.kind, type_.kind):
            return ERROR
        if not fits(term.type, type_):
            return self.mismatch(f"{term.type} does not fit {type_}", at)
        # A tuple has the names of its fields from the declaration.
        return replace(term, type=type_) if type_.kind == "tuple" else term

    # Expressions

    def term(self, node: syntax.Expression, scope: Scope) -> Term:
        """The term of an expression."""
        match node:
            case syntax.Literal(value=value):
                return _literal(value)
            case syntax.Name():
                return self._name(node, scope)
            case syntax.Unary():
                return self._unary(node, scope)
            case syntax.Binary():
                return self._binary(node, self.term(node.left, scope), self.term(node.right, scope))
            case syntax.If():
                found = self.term(node.otherwise, scope)
                for guards, then in reversed(node.branches):
                    found = self._choice(self.conjunction(guards, scope), self.term(then, scope), found, node.at)
                return found
            case syntax.Switch():
                return self._switch(node, scope)
            case syntax.Group():
                return self._group(node, [self.term(item, scope) for item in node.items])
            case syntax.Index():
                return self._index(node, scope)
            case syntax.Slice():
                return self._slice(node, scope)
            case syntax.Call():
                return self._call(node, scope)
            case syntax.Cast():
                return self._cast(node, self.type(node.type, scope), scope)
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

    def _unary(self, node: syntax.Unary, scope: Scope) -> Term:
        term = self.term(node.operand, scope)
        if term.type.kind == "unknown":
            return ERROR
        if node.operator == "not":
            if term.type.kind != "bool":
                return self.mismatch(f"'not' needs a boolean; this is {_a(term.type)}", node.at)
            return negation(term)
        if node.operator == "sample":
            return broken(term.type.parts[0] if term.type.parts else UNKNOWN, term,
                          problem=Problem("a distribution is sampled", node.at))  # fmt: skip
        if not term.type.is_number:
            return self.mismatch(f"'{node.operator}' needs a number; this is {_a(term.type)}", node.at)
        if node.operator == "+":
            return term
        if term.type.kind == "real":
            return static(REAL, -term.value) if term.is_static else broken(REAL, term)
        low, high = term.type.range
        if low == MINIMUM_INTEGER:
            if term.type.low is not None:
                return self.mismatch("the result may leave 32 bits", node.at)
            low += 1
        type_ = integer(-high, -low)
        if term.is_static:
            return number(-term.value)
        return made(type_, Unary("-", term.core), term) if term.is_usable else broken(type_, term)

    def _binary(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        operator = node.operator
        if "unknown" in (left.type.kind, right.type.kind):
            return ERROR
        if operator in ("and", "or", "=>", "<=>"):
            if left.type.kind == right.type.kind == "bool":
                return logic(operator, left, right)
            if operator in ("and", "or") and left.type.kind == right.type.kind == "set":
                return self._sets(node, left, right)
            return self._unfit(node, left, right)
        if operator in ("=", "!="):
            return self._equality(node, left, right)
        if operator in ("in", "sub"):
            return self._membership(node, left, right)
        if left.type.is_number and right.type.is_number:
            if operator in ("<", "<=", ">", ">="):
                return self._order(node, left, right)
            return self._arithmetic(node, left, right)
        if operator in ("+", "-") and left.type.kind == right.type.kind:
            return self._collections(node, left, right)
        return self._unfit(node, left, right)

    def _unfit(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        return self.mismatch(f"'{node.operator}' does not take {left.type} and {right.type}", node.at)

    def _equality(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        if not is_compatible(left.type, right.type) or left.type.kind in ("automaton", "func", "dist"):
            return self._unfit(node, left, right)
        if left.is_static and right.is_static and left.type.kind in ("bool", "int", "enum"):
            return truth((left.value == right.value) is (node.operator == "="))
        if left.type.kind == "bool":
            return logic(node.operator, left, right)
        if left.type.kind not in ("int", "enum"):
            return broken(BOOL, left, right, problem=Problem(f"values of type {left.type} are compared", node.at))
        if not (left.is_usable and right.is_usable):
            return broken(BOOL, left, right)
        if left.type.kind == "enum":
            return made(BOOL, enum_comparison(node.operator, left.core, right.core), left, right)
        return made(BOOL, Binary("=" if node.operator == "=" else "!=", left.core, right.core), left, right)

    def _order(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        if "real" in (left.type.kind, right.type.kind):
            return broken(BOOL, left, right, problem=Problem("real numbers are compared", node.at))
        if left.is_static and right.is_static:
            a, b = left.value, right.value
            return truth({"<": a < b, "<=": a <= b, ">": a > b, ">=": a >= b}[node.operator])
        if not (left.is_usable and right.is_usable):
            return broken(BOOL, left, right)
        return made(BOOL, Binary(node.operator, left.core, right.core), left, right)  # type: ignore[arg-type]

    def _arithmetic(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        operator = node.operator
        if operator == "/" or (operator in ("+", "-", "*") and "real" in (left.type.kind, right.type.kind)):
            return self._real(node, left, right)
        if "real" in (left.type.kind, right.type.kind):
            return self._unfit(node, left, right)
        if operator in ("div", "mod") and right.is_static and right.value == 0:
            return self.mismatch("this divides by zero", node.at)
        low, high = result_range(operator, left.type.range, right.type.range)
        is_ranged = left.type.low is not None and right.type.low is not None
        if low < MINIMUM_INTEGER or high > MAXIMUM_INTEGER:
            if is_ranged:
                return self.mismatch("the result may leave 32 bits", node.at)
            low, high = max(low, MINIMUM_INTEGER), min(high, MAXIMUM_INTEGER)
        type_ = integer(low, high) if is_ranged else CifType("int")
        if left.is_static and right.is_static:
            a, b = left.value, right.value
            return number(_ARITHMETIC[operator](a, b))
        if not (left.is_usable and right.is_usable):
            return broken(type_, left, right)
        if operator in ("div", "mod") and not (right.is_static and right.value > 0):
            problem = Problem(f"'{operator}' has a divisor that is not a constant above zero", node.at)
            return broken(type_, left, right, problem=problem)
        return made(type_, Binary(operator, left.core, right.core), left, right)  # type: ignore[arg-type]

    def _real(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        if not (left.is_static and right.is_static):
            return broken(REAL, left, right, problem=Problem("this computes with real numbers", node.at))
        a, b = float(left.value), float(right.value)
        try:
            value = {"+": lambda: a + b, "-": lambda: a - b, "*": lambda: a * b, "/": lambda: a / b}[node.operator]()
        except ZeroDivisionError:
            return self.mismatch("this divides by zero", node.at)
        return static(REAL, value)

    def _sets(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        type_ = joined(left.type, right.type)
        if type_ is None:
            return self._unfit(node, left, right)
        if not (left.is_static and right.is_static):
            return broken(type_, left, right, problem=Problem("this computes with sets", node.at))
        return static(type_, left.value & right.value if node.operator == "and" else left.value | right.value)

    def _collections(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        """Join or subtract strings, lists, sets or dictionaries."""
        kind = left.type.kind
        type_ = joined(left.type, right.type)
        is_known = kind in ("string", "list", "dict") if node.operator == "+" else kind in ("set", "dict")
        if type_ is None or not is_known:
            return self._unfit(node, left, right)
        if not (left.is_static and right.is_static):
            return broken(type_, left, right, problem=Problem(f"this computes with values of type {type_}", node.at))
        if node.operator == "-":
            return static(type_, left.value - right.value)
        if len(left.value) + len(right.value) > MAXIMUM_ELEMENTS:
            message = f"this has more than {MAXIMUM_ELEMENTS} elements"
            self.error("cif-too-large", message, node.at, "Use fewer elements.")
            return ERROR
        if kind == "dict":
            return static(type_, frozenset((dict(left.value) | dict(right.value)).items()))
        value = left.value + right.value
        if kind == "list":
            type_ = CifType("list", len(value), len(value), type_.parts)
        return static(type_, value)

    def _membership(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        if node.operator == "sub":
            if left.type.kind != "set" or not is_compatible(left.type, right.type):
                return self._unfit(node, left, right)
        elif right.type.kind not in ("list", "set", "dict") or not is_compatible(left.type, right.type.parts[0]):
            return self._unfit(node, left, right)
        if not (left.is_static and right.is_static):
            return broken(BOOL, left, right, problem=Problem(f"'{node.operator}' has a value of a state", node.at))
        if node.operator == "sub":
            return truth(left.value <= right.value)
        return truth(left.value in (dict(right.value) if right.type.kind == "dict" else right.value))

    def _choice(self, condition: Term, then: Term, otherwise: Term, at: Location) -> Term:
        """`if condition: then else otherwise end`."""
        if "unknown" in (condition.type.kind, then.type.kind, otherwise.type.kind):
            return ERROR
        type_ = joined(then.type, otherwise.type)
        if type_ is None or type_.kind == "automaton":
            return self.mismatch(f"the branches have types that do not fit: {then.type} and {otherwise.type}", at)
        return conditional(condition, then, otherwise, type_)

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
            found = self._choice(term, value, found, node.at)
        return found

    def _values_of(self, subject: Term) -> set[Any] | None:
        """Every value that a switch must cover; None if there are too many to cover."""
        match subject.type.kind:
            case "bool":
                return {False, True}
            case "enum":
                return set(subject.type.names)
            case "int" if subject.type.low is not None and subject.type.range[1] - subject.type.low < 100_000:
                return set(range(subject.type.low, subject.type.range[1] + 1))
            case "automaton":
                places = [item for item in subject.value.body if isinstance(item, syntax.LocationDeclaration)]
                return {item.name.text if item.name is not None else NAMELESS for item in places}
            case _:
                return None

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
        if value.is_static and value.type.kind in ("bool", "int", "enum"):
            covered.add(value.value)
        return self._equality(syntax.Binary("=", node.subject, key, key.at), subject, value)

    def _group(self, node: syntax.Group, items: list[Term]) -> Term:
        if any(item.type.kind == "unknown" for item in items):
            return ERROR
        if node.kind == "tuple":
            whole = self._sized(CifType("tuple", parts=tuple(item.type for item in items)), node.at)
            return ERROR if whole.kind == "unknown" else tuple_term(whole, tuple(items))
        groups = [items[::2], items[1::2]] if node.kind == "dict" else [items]
        parts = []
        for group in groups:
            part: CifType | None = UNKNOWN
            for item in group:
                part = joined(part, item.type) if part is not None else None
            if part is None:
                return self.mismatch("the elements have types that do not fit each other", node.at)
            parts.append(part)
        length = len(items) if node.kind == "list" else None
        type_ = CifType(node.kind, length, length, tuple(parts))
        if not all(item.is_static for item in items):
            return broken(type_, *items, problem=Problem(f"this makes a {node.kind} of values of a state", node.at))
        values = [item.value for item in items]
        if node.kind == "dict":
            return static(type_, frozenset(zip(values[::2], values[1::2], strict=True)))
        return static(type_, tuple(values) if node.kind == "list" else frozenset(values))

    def _index(self, node: syntax.Index, scope: Scope) -> Term:
        base = self.term(node.base, scope)
        if base.type.kind == "unknown":
            return ERROR
        if base.type.kind == "tuple":
            return self._field(node, base, scope)
        index = self.term(node.index, scope)
        if index.type.kind == "unknown":
            return ERROR
        is_key = base.type.kind == "dict" and is_compatible(index.type, base.type.parts[0])
        if not is_key and (base.type.kind not in ("list", "string") or index.type.kind != "int"):
            return self.mismatch(f"{base.type} has no element {index.type}", node.at)
        result = STRING if base.type.kind == "string" else base.type.parts[-1]
        if not (base.is_static and index.is_static):
            return broken(result, base, index, problem=Problem("an element is chosen by a state", node.at))
        try:
            values = dict(base.value) if is_key else base.value
            return _narrowed(result, values[index.value])
        except LookupError:
            return self.mismatch(f"there is no element {index.value!r}", node.at)

    def _field(self, node: syntax.Index, base: Term, scope: Scope) -> Term:
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
            return call(self, node, arguments)
        function = self.term(node.function, scope)
        if function.type.kind == "unknown":
            return ERROR
        if function.type.kind != "func":
            return self.mismatch(f"a value {_a(function.type)} cannot be called", node.at)
        result, *parameters = function.type.parts
        if len(parameters) != len(arguments) or not all(
            fits(item.type, type_) for item, type_ in zip(arguments, parameters, strict=False)
        ):
            return self.mismatch("the arguments do not fit the function's parameters", node.at)
        return broken(result, problem=Problem("this calls a function of the model", node.at))

    def _cast(self, node: syntax.Cast, type_: CifType, scope: Scope) -> Term:
        term = self.term(node.operand, scope)
        if "unknown" in (term.type.kind, type_.kind):
            return ERROR
        if is_compatible(term.type, type_) and term.type.kind != "automaton":
            return term
        pairs = {("int", "real"), ("bool", "string"), ("int", "string"), ("real", "string"), ("automaton", "string"),
                 ("string", "bool"), ("string", "int"), ("string", "real")}  # fmt: skip
        if (term.type.kind, type_.kind) not in pairs:
            return self.mismatch(f"{term.type} cannot be cast to {type_}", node.at)
        if not term.is_static:
            return broken(type_, term, problem=Problem(f"a value of a state is cast to {type_}", node.at))
        try:
            return _cast_value(term, type_)
        except ValueError:
            return self.mismatch(f"{term.value!r} is not {type_}", node.at)

    def _special(self, node: syntax.Special, scope: Scope) -> Term:
        match node.word:
            case "time":
                return broken(REAL, problem=Problem("'time' is a real number", node.at))
            case "self":
                if not scope.is_automaton:
                    return self.mismatch("'self' is the enclosing automaton, and there is none", node.at)
                return Term(AUTOMATON, value=scope)
            case "?":
                return broken(UNKNOWN, problem=Problem("a value is received from a channel", node.at))
        if node.name is not None:
            self.term(node.name, scope)
        return broken(REAL, problem=Problem("a derivative is read", node.at))


_ARITHMETIC: Mapping[str, Callable[[int, int], int]] = {
    "+": add, "-": sub, "*": mul, "div": quotient, "mod": remainder,
}  # fmt: skip
_UNSUPPORTED = (
    "Leave it out, or write it with booleans, enums and integers of a range, whose values a state determines."
)


def _a(type_: CifType) -> str:
    return f"of type {type_}"


def _literal(value: bool | int | float | str) -> Term:
    if isinstance(value, bool):
        return truth(value)
    if isinstance(value, int):
        return number(value)
    return static(REAL if isinstance(value, float) else STRING, value)


def _narrowed(type_: CifType, value: Any) -> Term:
    return number(value) if type_.kind == "int" else static(type_, value)


def _cast_value(term: Term, type_: CifType) -> Term:
    value = term.value
    match type_.kind:
        case "real":
            return static(REAL, float(value))
        case "string":
            return static(STRING, str(value).lower() if isinstance(value, bool) else str(value))
        case "bool":
            if value not in ("true", "false"):
                raise ValueError(value)
            return truth(value == "true")
    found = int(value)
    if not MINIMUM_INTEGER <= found <= MAXIMUM_INTEGER:
        raise ValueError(value)
    return number(found)


__all__ = ["NAMELESS", "Typing"]
