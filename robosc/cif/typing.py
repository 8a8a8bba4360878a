"""Types of CIF's names: the type of each declaration, with its static value or the expression that it becomes."""

from collections.abc import Iterator
from contextlib import contextmanager

from robosc.cif import syntax
from robosc.cif.expression_typing import NAMELESS, ExpressionTyping
from robosc.cif.scopes import Entity, Scope, Scopes
from robosc.cif.terms import ERROR, Problem, Term, broken, made, retyped, static, tuple_term
from robosc.cif.types import BOOL, REAL, UNKNOWN, CifType, declared, fits
from robosc.expressions import ITSELF, StateTest, VariableRead
from robosc.source import Location


class Typing(ExpressionTyping):
    """Meaning of names and types, and of expressions, in the scopes of a specification.

    Args:
        scopes: The scopes.

    Attributes:
        depends: Entities that the value of an algebraic variable reads, or that decide how something begins
            or whether a location is initial, with the places where that is read.
    """

    def __init__(self, scopes: Scopes) -> None:
        super().__init__(scopes)
        self._terms: dict[Entity, Term | None] = {}
        self._types: dict[Entity, CifType | None] = {}
        self._fields: dict[Scope, set[str]] = {}
        self._enums: dict[tuple[str, ...], str] = {}
        self.depends: dict[Entity | Scope, dict[Entity | Scope, Location]] = {}

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
        if written.kind == "tuple":
            for index, item in enumerate(written.fields):
                if item.text in fields[:index]:
                    self.error("cif-duplicate-name", f"the tuple has two fields '{item.text}'", item.at,
                               "Rename one of the two.")  # fmt: skip
            if len(fields) < 2:
                self.error("cif-type", "a tuple has two fields or more", written.at,
                           "Write the type of its field alone, or add a field.")  # fmt: skip
                return UNKNOWN
        if written.kind in ("set", "dict") and not (parts[0].has_equality or parts[0].kind == "unknown"):
            self.error("cif-type", f"values of type {parts[0]} cannot be told apart", written.at, "Use another type.")
            return UNKNOWN
        if written.kind == "dist" and parts[0] not in (BOOL, CifType("int"), REAL, UNKNOWN):
            self.error("cif-type", f"distributions have no samples of type {parts[0]}", written.at,
                       "Use 'bool', 'int' or 'real'.")  # fmt: skip
            return UNKNOWN
        return self._operators.sized(CifType(written.kind, parts=parts, names=fields), written.at)

    def _named(self, name: syntax.Name, scope: Scope) -> CifType:
        found = self.scopes.resolve(name, scope)
        if found is None:
            return UNKNOWN
        if isinstance(found, Entity) and isinstance(found.declaration, syntax.Enum) and not found.is_literal:
            return self.enum(found)
        if not isinstance(found, Entity) or not isinstance(found.declaration, syntax.TypeDeclaration):
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

    # Entities

    def check(self, entity: Entity) -> None:
        """Check a declaration, so that its errors are reported whether it is used or not."""
        match entity.declaration:
            case syntax.TypeDeclaration(name=name):
                self._named(syntax.Name((name.text,), syntax.Root.HERE, name.at), entity.scope)
            case syntax.Event(data=syntax.Type() as data):
                is_parameter = entity.identifier.text in entity.scope.parameters
                self.type(data, (entity.scope.parent if is_parameter else None) or entity.scope)
            case syntax.Event() | syntax.Invariant() | syntax.LocationDeclaration():
                pass
            case _:
                self.entity(entity)

    def entity(self, entity: Entity) -> Term:
        """The term of something declared."""
        if entity not in self._terms:
            self._terms[entity] = None
            with self.depending(entity):
                self._terms[entity] = self._declared(entity)
        found = self._terms[entity]
        if found is None:
            # Without an instance, a circle of algebraic variables is none yet.
            if entity.scope.is_real or not isinstance(entity.declaration, syntax.Algebraic):
                self._cycle("the value of", entity)
            self._terms[entity] = ERROR
            return ERROR
        return found

    @contextmanager
    def depending(self, node: Entity | Scope) -> Iterator[None]:
        """Remember what expressions read as what a node depends on."""
        outer, self.reads = self.reads, self.depends.setdefault(node, {})
        yield
        self.reads = outer

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
        return self._fitted(self.evaluated(value, scope, type_), type_, value.at)

    def _variable(self, entity: Entity, type_: CifType) -> Term:
        scope, name = entity.scope, entity.identifier.text
        if type_.kind == "unknown":
            return ERROR
        if not type_.is_finite:
            return broken(type_, problem=Problem(f"'{entity.name}' has the type {type_}", entity.at))
        if isinstance(entity.declaration, syntax.Input):
            if type_.kind == "tuple":
                return broken(type_, problem=Problem(f"'{entity.name}' has the type {type_}", entity.at))
            return made(type_, VariableRead(entity.name, ITSELF))
        return self._stored(scope, name, type_)

    def _stored(self, scope: Scope, name: str, type_: CifType) -> Term:
        """The term of a variable; a tuple is stored as a variable for each field, such as `t_a` for `t[a]`."""
        if type_.kind != "tuple":
            return made(type_, VariableRead(scope.path, name))
        taken = self._fields.setdefault(scope, set(scope.entries))
        parts = []
        for field, part in zip(type_.names, type_.parts, strict=True):
            free = f"{name}_{field}"
            while free in taken:
                free += "_"
            taken.add(free)
            parts.append(self._stored(scope, free, part))
        return tuple_term(type_, tuple(parts))

    def _algebraic(self, entity: Entity, declaration: syntax.Algebraic) -> Term:
        scope = entity.scope
        # The type of a parameter is written around the definition; its argument is one of the instance's words.
        is_parameter = entity.value_scope is not None and scope.parent is not None
        type_ = self.type(declaration.type, scope.parent if is_parameter and scope.parent else scope)
        if entity.value_scope is not None:
            if entity.value is None:
                # A parameter of a definition without an instance: any value.
                return broken(type_, problem=Problem(f"'{entity.name}' has no value", entity.at))
            return self._fitted(self.term(entity.value, entity.value_scope, type_), type_, entity.value.at)
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
            return self._fitted(self.term(values[0][1], scope, type_), type_, values[0][1].at)
        self.reads.setdefault(scope, entity.at)
        terms = [self._fitted(self.term(value, scope, type_), type_, value.at) for _, value in located]
        return self._chosen([self.location(scope, place) for place, _ in located[:-1]], terms, entity.at)

    def _fitted(self, term: Term, type_: CifType, at: Location) -> Term:
        if "unknown" in (term.type.kind, type_.kind):
            return ERROR
        if not fits(term.type, type_):
            return self.mismatch(f"{term.type} does not fit {type_}", at)
        return retyped(term, declared(type_, term.type))

    def _cycle(self, what: str, entity: Entity) -> None:
        self.error("cif-cycle", f"{what} '{entity.name}' is defined by itself", entity.at, "Break the circle.")


__all__ = ["NAMELESS", "Typing"]
