"""What a name can mean at one place of a model (language A.4)."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from robosc.expressions import EnumType, Type
from robosc.model.types import Types


@dataclass(frozen=True, slots=True)
class ComponentNames:
    """What can be read of a component from outside.

    Attributes:
        name: Its name in the robot.
        states: Names of its states.
        variables: Types of its variables; None for one whose type is broken.
    """

    name: str
    states: frozenset[str]
    variables: Mapping[str, Type | None]


@dataclass(frozen=True, slots=True)
class Scope:
    """The names of one place.

    Attributes:
        types: All types.
        components: Components by the name they have here.
        enums: Enums whose values can be named here, by the name they have here.
        own: The component whose behaviour this is, if any.
        received: Type of `value`, or None where there is no received data.
    """

    types: Types
    components: Mapping[str, ComponentNames]
    enums: Mapping[str, EnumType]
    own: ComponentNames | None = None
    received: Type | None = None
    _values: dict[str, tuple[EnumType, ...]] = field(default_factory=dict)

    def with_received(self, received: Type | None) -> "Scope":
        """The same names, with `value` of another type."""
        return Scope(self.types, self.components, self.enums, self.own, received, self._values)

    def enums_with(self, value: str) -> tuple[EnumType, ...]:
        """The enums that have a value."""
        if not self._values:
            found: dict[str, list[EnumType]] = {}
            for enum in dict.fromkeys(self.enums.values()):
                for name in enum.values:
                    found.setdefault(name, []).append(enum)
            self._values.update({name: tuple(enums) for name, enums in found.items()})
        return self._values.get(value, ())

    def known_names(self) -> Iterable[str]:
        """Every name that an expression may begin with."""
        own = self.own.variables if self.own else ()
        return [*self.components, *own, *(value for enum in self.enums.values() for value in enum.values)]
