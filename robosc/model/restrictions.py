"""Requirements, invariants, provided data and limits of a robot, its own and imported ones."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence

import msgspec

from robosc.errors import RelatedPlace
from robosc.language import syntax
from robosc.model.expression_checker import ExpressionChecker
from robosc.model.findings import Findings
from robosc.model.limits import LimitBuilder
from robosc.model.places import Places
from robosc.model.requirements import ProvideBuilder, build_invariant, build_requirement
from robosc.model.robot_scopes import RobotScopes
from robosc.model.structure import Communication, Invariant, Limit, Provide, Requirement
from robosc.model.types import Types
from robosc.model.units import Libraries, Part, Unit

_Item = syntax.Requirement | syntax.Invariant | syntax.Provide | syntax.Limit


class _Offer(msgspec.Struct, frozen=True):
    """Items that a library may bring, by what a component must have for it; with each item its place in the text.

    Attributes:
        by_communication: Requirements by their first communication, provide statements and limits by theirs.
        by_component: State invariants by each component that they read.
        read: The components that each invariant reads, by its place.
    """

    by_communication: defaultdict[str, list[tuple[int, syntax.Requirement | syntax.Provide | syntax.Limit]]] = (
        msgspec.field(default_factory=lambda: defaultdict(list))
    )
    by_component: defaultdict[str, list[tuple[int, syntax.Invariant]]] = msgspec.field(
        default_factory=lambda: defaultdict(list)
    )
    read: dict[int, frozenset[str]] = msgspec.field(default_factory=dict)

    @classmethod
    def of(cls, unit: Unit) -> "_Offer":
        """Return the items that a library may bring."""
        offer = cls()
        for place, item in enumerate(unit.tree.items):
            match item:
                case syntax.Requirement(communications=names) if names:
                    offer.by_communication[names[0].text].append((place, item))
                case syntax.Provide(communication=name) | syntax.Limit(communication=name):
                    offer.by_communication[name.text].append((place, item))
                case syntax.Invariant(expression=expression):
                    offer.read[place] = frozenset(_roots(expression) & unit.components.keys())
                    for component in offer.read[place]:
                        offer.by_component[component].append((place, item))
        return offer


class Restrictions:
    """Builder of restrictions in source order: what an import brings stands where the component is imported.

    Args:
        unit: The robot.
        parts: Its components.
        libraries: The libraries that they come from.
        scopes: Meanings of names.
        types: All types.
        findings: Findings to which faults are reported.

    Attributes:
        requirements: Those that are sound.
        invariants: Those that are sound.
        provides: Those that are sound.
        limits: Those that are sound.
    """

    def __init__(
        self,
        unit: Unit,
        parts: Sequence[Part],
        libraries: Libraries,
        scopes: RobotScopes,
        types: Types,
        findings: Findings,
    ) -> None:
        self._unit = unit
        self._parts = {part.name: part for part in parts}
        self._libraries = libraries
        self._scopes = scopes
        self._types = types
        self._findings = findings
        self._offers: dict[Unit, _Offer] = {}
        self._builders: dict[Unit, tuple[ExpressionChecker, ProvideBuilder, LimitBuilder]] = {}
        self.requirements: list[Requirement] = []
        self.invariants: list[Invariant] = []
        self.provides: list[Provide] = []
        self.limits: list[Limit] = []

    def build(self, communications: Mapping[str, Communication], places: Places) -> None:
        """Build all of them and note where they stand."""
        brought = set[int]()
        own: defaultdict[str, list[str]] = defaultdict(list)
        for communication in communications.values():
            own[communication.component].append(communication.name)
        for item in self._unit.tree.items:
            if isinstance(item, syntax.Component):
                part = self._parts.get(item.name.text)
                if item.imported is None or part is None:
                    continue
                for unit, tree in self._brought_by(item, own[part.name]):
                    if id(tree) not in brought and self._is_readable(tree, unit, part):
                        brought.add(id(tree))
                        self._add(tree, unit, communications, places)
            elif isinstance(item, _Item):
                self._add(item, self._unit, communications, places)

    def _brought_by(self, component: syntax.Component, own: Sequence[str]) -> Iterator[tuple[Unit, _Item]]:
        """Yield what importing a component with some communications brings.

        The items come from each library on the way to the component's definition.
        """
        names = set(own)
        for unit, name in self._libraries.chain(component):
            offer = self._offers.get(unit) or self._offers.setdefault(unit, _Offer.of(unit))
            found: dict[int, _Item] = {}
            for each in own:
                for place, item in offer.by_communication.get(each, ()):
                    if isinstance(item, syntax.Provide | syntax.Limit) or all(
                        other.text in names for other in item.communications
                    ):
                        found[place] = item
            imported = self._scopes.of(unit).components.keys()
            found |= {place: item for place, item in offer.by_component.get(name, ()) if offer.read[place] <= imported}
            for place in sorted(found):
                yield unit, found[place]

    def _is_readable(self, tree: _Item, unit: Unit, part: Part) -> bool:
        """Return True if every component that an item reads has been imported.

        Otherwise reports an error of the import.
        """
        scope = self._scopes.of(unit)
        missing = sorted((_roots_of(tree) & unit.components.keys()) - scope.components.keys())
        if missing:
            what = _WHAT.get(type(tree), "requirement")
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
            self._builders[unit] = (
                checker,
                ProvideBuilder(checker, self._types, self._findings, places.communications),
                LimitBuilder(checker, self._types, self._findings),
            )
        checker, provide_builder, limit_builder = self._builders[unit]
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
            case syntax.Limit():
                limit = limit_builder.build(tree, communications)
                if limit is not None:
                    self.limits.append(limit)
                    places.limits.append(tree.location)


_WHAT: dict[type[_Item], str] = {syntax.Provide: "provide statement", syntax.Limit: "limit"}


def _roots_of(tree: _Item) -> set[str]:
    if isinstance(tree, syntax.Limit):
        # Bounds are constant.
        return set() if tree.condition is None else _roots(tree.condition)
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
            case syntax.Quantifier(array=array, condition=condition):
                stack += [array, condition]
    return found
