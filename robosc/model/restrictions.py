"""Requirements, invariants and provided data of a robot, its own and those that imports bring (language B.7)."""

from collections.abc import Iterator, Mapping, Sequence

from robosc.errors import RelatedPlace
from robosc.language import syntax
from robosc.model.expressions import ExpressionChecker
from robosc.model.findings import Findings
from robosc.model.places import Places
from robosc.model.requirements import ProvideBuilder, build_invariant, build_requirement
from robosc.model.scope import Scopes
from robosc.model.structure import Communication, Invariant, Provide, Requirement
from robosc.model.types import Types
from robosc.model.units import Libraries, Part, Unit

_Item = syntax.Requirement | syntax.Invariant | syntax.Provide


class Restrictions:
    """Builds them in source order: what an import brings stands where the component is imported.

    Args:
        unit: The robot.
        parts: Its components.
        libraries: The libraries that they come from.
        scopes: What names mean.
        types: All types.
        findings: Where faults are reported.

    Attributes:
        requirements: Those that are sound.
        invariants: Those that are sound.
        provides: Those that are sound.
    """

    def __init__(
        self,
        unit: Unit,
        parts: Sequence[Part],
        libraries: Libraries,
        scopes: Scopes,
        types: Types,
        findings: Findings,
    ) -> None:
        self._unit = unit
        self._parts = {part.name: part for part in parts}
        self._libraries = libraries
        self._scopes = scopes
        self._types = types
        self._findings = findings
        self._builders: dict[Unit, tuple[ExpressionChecker, ProvideBuilder]] = {}
        self.requirements: list[Requirement] = []
        self.invariants: list[Invariant] = []
        self.provides: list[Provide] = []

    def build(self, communications: Mapping[str, Communication], places: Places) -> None:
        """Build all of them and note where they stand."""
        brought = set[int]()
        for item in self._unit.tree.items:
            if isinstance(item, syntax.Component):
                part = self._parts.get(item.name.text)
                if item.imported is None or part is None:
                    continue
                for unit, tree in self._brought_by(part, item, communications):
                    if id(tree) not in brought and self._is_readable(tree, unit, part):
                        brought.add(id(tree))
                        self._add(tree, unit, communications, places)
            elif isinstance(item, _Item):
                self._add(item, self._unit, communications, places)

    def _brought_by(
        self, part: Part, component: syntax.Component, communications: Mapping[str, Communication]
    ) -> Iterator[tuple[Unit, _Item]]:
        """What importing a component brings from each library on the way to its definition."""
        own = {name for name, item in communications.items() if item.component == part.name}
        for unit, name in self._libraries.chain(component):
            for item in unit.tree.items:
                match item:
                    case syntax.Requirement(communications=names):
                        if names and all(each.text in own for each in names):
                            yield unit, item
                    case syntax.Provide(communication=each):
                        if each.text in own:
                            yield unit, item
                    case syntax.Invariant(expression=expression):
                        read = _roots(expression) & unit.components.keys()
                        if name in read and read <= self._scopes.of(unit).components.keys():
                            yield unit, item

    def _is_readable(self, tree: _Item, unit: Unit, part: Part) -> bool:
        """Whether every component that it reads has been imported; else it is an error of the import."""
        scope = self._scopes.of(unit)
        missing = sorted((_roots_of(tree) & unit.components.keys()) - scope.components.keys())
        if missing:
            what = "provide statement" if isinstance(tree, syntax.Provide) else "requirement"
            self._findings.error(
                "unknown-name",
                f"importing '{part.tree.name.text}' brings a {what} that reads '{missing[0]}', which is not imported",
                part.place,
                f"Import '{missing[0]}' from '{unit.tree.name.text}' too.",
                RelatedPlace(f"'{missing[0]}' is read here", tree.location),
            )
        return not missing

    def _add(self, tree: _Item, unit: Unit, communications: Mapping[str, Communication], places: Places) -> None:
        if unit not in self._builders:
            checker = ExpressionChecker(self._scopes.of(unit), self._findings)
            self._builders[unit] = checker, ProvideBuilder(checker, self._types, self._findings, places.communications)
        checker, provide_builder = self._builders[unit]
        match tree:
            case syntax.Requirement():
                requirement = build_requirement(tree, checker, communications, self._findings)
                if requirement is not None:
                    self.requirements.append(requirement)
                    places.requirements.append(tree.location)
            case syntax.Invariant():
                invariant = build_invariant(tree, checker)
                if invariant is not None:
                    self.invariants.append(invariant)
                    places.invariants.append(tree.location)
            case syntax.Provide():
                provide = provide_builder.build(tree, communications)
                if provide is not None:
                    self.provides.append(provide)
                    places.provides.append(tree.location)


def _roots_of(tree: _Item) -> set[str]:
    if isinstance(tree, syntax.Provide):
        found = set[str]() if tree.condition is None else _roots(tree.condition)
        values = [tree.value]
        while values:
            value = values.pop()
            if isinstance(value, syntax.ObjectValue):
                values += [part for _, part in value.properties]
            else:
                found |= _roots(value)
        return found
    return _roots(tree.expression)


def _roots(expression: syntax.Expression) -> set[str]:
    """The first names of accesses with something behind them: what a component can be read by."""
    found = set[str]()
    stack = [expression]
    while stack:
        node = stack.pop()
        match node:
            case syntax.Access(root=root, steps=steps):
                if root is not None and steps:
                    found.add(root.text)
            case syntax.Unary(operand=operand):
                stack.append(operand)
            case syntax.Binary(left=left, right=right):
                stack += [left, right]
            case syntax.Conditional(condition=condition, then=then, otherwise=otherwise):
                stack += [condition, then, otherwise]
            case syntax.Call(arguments=arguments):
                stack += arguments
            case syntax.Quantifier(condition=condition):
                stack.append(condition)
    return found
