"""Meanings that a name can have at one place of a model."""

from collections.abc import Iterator, Mapping

import msgspec
from msgspec.structs import replace

from robosc.expressions import EnumType, Type
from robosc.model.outcomes import Outcome
from robosc.model.typed import Typed
from robosc.model.types import Types
from robosc.model.units import Libraries, Unit
from robosc.source import Location


class ComponentNames(msgspec.Struct, frozen=True):
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
    declared: Mapping[str, Location] = msgspec.field(default_factory=dict)
    places: Mapping[str, Location] = msgspec.field(default_factory=dict)


class Scope(msgspec.Struct, frozen=True):
    """The names of one place.

    Attributes:
        types: All types.
        components: Components by the name they have here.
        enums: Enums whose values can be named here, by the name they have here.
        own: The component whose behaviour this is, if any.
        received: Type of `value`, or None where there is no received data.
        sender: Communication that `value` comes from, or empty.
        outcomes: Outcomes of the robot's communications.
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
    sender: str = ""
    outcomes: Mapping[str, Outcome] = msgspec.field(default_factory=dict)
    absent: frozenset[str] = frozenset()
    constants: Mapping[str, Typed | None] = msgspec.field(default_factory=dict)
    ambiguous: Mapping[str, tuple[str, ...]] = msgspec.field(default_factory=dict)
    component_places: Mapping[str, Location] = msgspec.field(default_factory=dict)
    constant_places: Mapping[str, Location] = msgspec.field(default_factory=dict)
    _values: dict[str, tuple[EnumType, ...]] = msgspec.field(default_factory=dict)

    def with_received(self, received: Type | None, sender: str = "") -> "Scope":
        """The same names, with `value` of another type and communication."""
        return replace(self, received=received, sender=sender)

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


def enums_of(unit: Unit, types: Types, libraries: Libraries) -> dict[str, EnumType]:
    """The enums of a file by name, and those of the files that its imported components come from.

    One of the latter whose name is not unique here goes by a name that no text can write: its values can be used.
    """
    origins = [libraries.origin(unit, name) for name in unit.components]
    visible = {origin[0] for origin in origins if origin is not None}
    found: dict[str, EnumType] = {}
    imported: dict[str, list[EnumType]] = {}
    for enum, home, tree in types.enums.values():
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
