"""Meanings that a name can have at one place of a model (language A.4)."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from robosc.expressions import EnumType, Type
from robosc.language import syntax
from robosc.model.types import Types
from robosc.model.units import Libraries, Part, Unit
from robosc.source import Location

if TYPE_CHECKING:
    from robosc.model.constants import Constants
    from robosc.model.typed import Typed


@dataclass(frozen=True, slots=True)
class ComponentNames:
    """Names that can be read of a component from outside.

    Attributes:
        name: Its name in the robot.
        states: Names of its states.
        variables: Types of its variables; None for one whose type is broken.
        declared: Place where the type of each variable is written.
        places: Place where each state and variable is defined.
    """

    name: str
    states: frozenset[str]
    variables: Mapping[str, Type | None]
    declared: Mapping[str, Location] = field(default_factory=dict)
    places: Mapping[str, Location] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Scope:
    """The names of one place.

    Attributes:
        types: All types.
        components: Components by the name they have here.
        enums: Enums whose values can be named here, by the name they have here.
        own: The component whose behaviour this is, if any.
        received: Type of `value`, or None where there is no received data.
        absent: Components whose import has failed, which has been reported.
        constants: Constants by name; None for one that is broken, which has been reported.
        ambiguous: Names of constants and enums that several libraries define, with the libraries' names.
        component_places: Place where each component has the name that it has here.
        constant_places: Place where each constant is defined.
    """

    types: Types
    components: Mapping[str, ComponentNames]
    enums: Mapping[str, EnumType]
    own: ComponentNames | None = None
    received: Type | None = None
    absent: frozenset[str] = frozenset()
    constants: Mapping[str, "Typed | None"] = field(default_factory=dict)
    ambiguous: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    component_places: Mapping[str, Location] = field(default_factory=dict)
    constant_places: Mapping[str, Location] = field(default_factory=dict)
    _values: dict[str, tuple[EnumType, ...]] = field(default_factory=dict)

    def with_received(self, received: Type | None) -> "Scope":
        """The same names, with `value` of another type."""
        return replace(self, received=received)

    def enums_with(self, value: str) -> tuple[EnumType, ...]:
        """The enums that have a value."""
        if not self._values:
            found: dict[str, list[EnumType]] = {}
            for enum in dict.fromkeys(self.enums.values()):
                for name in enum.values:
                    found.setdefault(name, []).append(enum)
            self._values.update({name: tuple(enums) for name, enums in found.items()})
        return self._values.get(value, ())

    def known_names(self) -> Iterator[str]:
        """Every name that an expression may begin with."""
        yield from self.components
        yield from self.constants
        yield from self.own.variables if self.own else ()
        for enum in self.enums.values():
            yield from enum.values


class Scopes:
    """The scopes of a robot: one for each of its files, shared by all behaviours in it.

    Args:
        main: The robot, or the library that is checked.
        types: All types, already resolved.
        parts: The components of the robot.
        libraries: The libraries that they come from.
        names: Names that can be read of each component, by its name in the robot.
        constants: Resolver of constants.
    """

    def __init__(
        self,
        main: Unit,
        types: Types,
        parts: Sequence[Part],
        libraries: Libraries,
        names: Mapping[str, ComponentNames],
        constants: "Constants",
    ) -> None:
        self._main = main
        self._constants = constants
        self._types = types
        self._libraries = libraries
        self._names = names
        self._parts = {(part.unit, part.tree.name.text): part.name for part in parts}
        self._scopes: dict[Unit, Scope] = {}

    def of(self, unit: Unit) -> Scope:
        """The names of a file, outside every behaviour."""
        if unit not in self._scopes:
            components = self._components(unit)
            absent = frozenset(unit.components.keys() - components) if unit is self._main else frozenset()
            scope = Scope(self._types, components, self._enums(unit), absent=absent)
            constants = self._constants.visible_in(unit, self)
            shared = {**self._shared_types(unit), **constants.ambiguous}
            self._scopes[unit] = replace(
                scope,
                constants=constants,
                ambiguous=shared,
                component_places={name: tree.name.location for name, tree in unit.components.items()},
                constant_places=constants.places,
            )
        return self._scopes[unit]

    def of_constants(self, unit: Unit) -> Scope:
        """The names in the constants of a file, other constants aside."""
        return Scope(self._types, {}, self._enums(unit))

    def tiers_of(self, unit: Unit) -> tuple[tuple[Unit, ...], tuple[Unit, ...]]:
        """The libraries that a file imports from, and those that they in turn have the components from."""
        nearest: dict[Unit, None] = {}
        further: dict[Unit, None] = {}
        for component in unit.components.values():
            for place, (library, _) in enumerate(self._libraries.chain(component)):
                (further if place else nearest)[library] = None
        direct = tuple(library for library in nearest if library is not unit)
        return direct, tuple(library for library in further if library is not unit and library not in nearest)

    def libraries_of(self, unit: Unit) -> tuple[Unit, ...]:
        """Every library that the imported components of a file come from or through."""
        direct, further = self.tiers_of(unit)
        return (*direct, *further)

    def _shared_types(self, unit: Unit) -> dict[str, tuple[str, ...]]:
        """Names of enums that several libraries define, with the libraries' names; the file itself defines none."""
        homes: dict[str, list[str]] = {}
        for home in self.libraries_of(unit):
            for name, tree in home.types.items():
                if isinstance(tree, syntax.EnumDefinition) and name not in unit.types:
                    homes.setdefault(name, []).append(home.tree.name.text)
        return {name: tuple(sorted(found)) for name, found in homes.items() if len(found) > 1}

    def inside(self, part: Part) -> Scope:
        """The names in the behaviour of a component."""
        return replace(self.of(part.unit), own=self._names[part.name])

    def for_rules(self, unit: Unit, source: Type) -> Scope:
        """The names in the rules of an enum: received data, and values of other enums in it."""
        return replace(self.of(unit), components={}, received=source)

    def _components(self, unit: Unit) -> dict[str, ComponentNames]:
        """The components of the robot by what a file calls them, whichever way they came into the robot."""
        found: dict[str, ComponentNames] = {}
        for name in unit.components:
            origin = self._libraries.origin(unit, name)
            if origin in self._parts:
                found[name] = self._names[self._parts[origin]]
        return found

    def _enums(self, unit: Unit) -> dict[str, EnumType]:
        """The enums of a file by name, and those of the files that its imported components come from.

        One of the latter whose name is not unique here goes by a name that no text can write: its values can be used.
        """
        origins = [self._libraries.origin(unit, name) for name in unit.components]
        visible = {origin[0] for origin in origins if origin is not None}
        found: dict[str, EnumType] = {}
        imported: dict[str, list[EnumType]] = {}
        for enum, home, tree in self._types.enums.values():
            if home is unit:
                found[tree.name.text] = enum
            elif home in visible:
                imported.setdefault(tree.name.text, []).append(enum)
        for name, enums in imported.items():
            if len(enums) == 1 and name not in unit.types:
                found[name] = enums[0]
            else:
                found |= {enum.name: enum for enum in enums}
        return found
