"""The scopes of a robot: which names each of its files can use."""

from collections.abc import Mapping, Sequence

from msgspec.structs import replace

from robosc.expressions import Type
from robosc.language import syntax
from robosc.model.constants import Constants
from robosc.model.outcomes import Outcome
from robosc.model.scope import ComponentNames, Scope, enums_of
from robosc.model.types import Types
from robosc.model.units import Libraries, Part, Unit


class RobotScopes:
    """The scopes of a robot: one for each of its files, shared by all behaviours in it.

    Args:
        main: The robot, or the library that is checked.
        types: All types, already resolved.
        parts: The components of the robot.
        libraries: The libraries that they come from.
        names: Names that can be read of each component, by its name in the robot.
        constants: Resolver of constants.
        outcomes: Outcomes of the communications.
    """

    def __init__(
        self,
        main: Unit,
        types: Types,
        parts: Sequence[Part],
        libraries: Libraries,
        names: Mapping[str, ComponentNames],
        constants: Constants,
        outcomes: Mapping[str, Outcome],
    ) -> None:
        self._outcomes = outcomes
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
            scope = Scope(self._types, components, enums_of(unit, self._types, self._libraries), absent=absent)
            constants = self._constants.visible_in(unit)
            shared = {**self._shared_types(unit), **constants.ambiguous}
            self._scopes[unit] = replace(
                scope,
                constants=constants,
                ambiguous=shared,
                component_places={name: tree.name.location for name, tree in unit.components.items()},
                constant_places=constants.places,
                outcomes=self._outcomes,
            )
        return self._scopes[unit]

    def _shared_types(self, unit: Unit) -> dict[str, tuple[str, ...]]:
        """Names of enums that several libraries define, with the libraries' names; the file itself defines none."""
        homes: dict[str, list[str]] = {}
        for home in self._libraries.all_of(unit):
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
