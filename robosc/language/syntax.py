"""The syntax tree of RoboSC: what was written, with places, before any name is bound.

Frozen values with tuples inside; textX objects end where these begin.
"""

from dataclasses import dataclass
from enum import StrEnum

from robosc.source import Location


@dataclass(frozen=True, slots=True)
class Name:
    """A name where it is defined or used; a leading `^` is taken off."""

    text: str
    location: Location


# Expressions


@dataclass(frozen=True, slots=True)
class Literal:
    """A number, text, true or false. An integer beyond 32 bits keeps its value."""

    value: bool | int | float | str
    location: Location


@dataclass(frozen=True, slots=True)
class Index:
    """`[INT]` of an access."""

    value: int
    location: Location


@dataclass(frozen=True, slots=True)
class Access:
    """`value` or a name, followed by properties, states, variables and indices.

    Attributes:
        root: The first name; None stands for the word `value`.
        steps: What follows.
        location: The whole of it.
    """

    root: Name | None
    steps: tuple[Name | Index, ...]
    location: Location


@dataclass(frozen=True, slots=True)
class Unary:
    """`!` or `-` before an operand."""

    operator: str
    operand: "Expression"
    location: Location


@dataclass(frozen=True, slots=True)
class Binary:
    """An operator between operands; `location` is the operator's."""

    operator: str
    left: "Expression"
    right: "Expression"
    location: Location


Expression = Literal | Access | Unary | Binary


# Types


class BasicTypeName(StrEnum):
    """Types that have no definition."""

    STRING = "string"
    BOOLEAN = "boolean"
    DOUBLE = "double"
    NONE = "none"
    INTEGER = "integer"


@dataclass(frozen=True, slots=True)
class BasicType:
    """A basic type, an integer perhaps with bounds."""

    name: BasicTypeName
    low: int | None
    high: int | None
    location: Location


@dataclass(frozen=True, slots=True)
class ArrayType:
    """`array(T)`."""

    element: "Type"
    location: Location


@dataclass(frozen=True, slots=True)
class NamedType:
    """A use of a data type."""

    name: Name

    @property
    def location(self) -> Location:
        """Where it is used."""
        return self.name.location


Type = BasicType | ArrayType | NamedType


@dataclass(frozen=True, slots=True)
class Property:
    """A property of an object type."""

    name: Name
    type: Type


@dataclass(frozen=True, slots=True)
class ObjectDefinition:
    """`datatype object`."""

    name: Name
    properties: tuple[Property, ...]


@dataclass(frozen=True, slots=True)
class EnumRule:
    """`condition -> value`; without a condition, the default."""

    condition: Expression | None
    value: Name


@dataclass(frozen=True, slots=True)
class EnumDefinition:
    """`datatype enum`."""

    name: Name
    source: Type
    rules: tuple[EnumRule, ...]


@dataclass(frozen=True, slots=True)
class Interface:
    """`interface name use type from package`."""

    name: Name
    type: Name
    package: Name


# Components


class Direction(StrEnum):
    """Direction of a message as the component sees it."""

    INCOMING = "incoming"
    OUTGOING = "outgoing"


@dataclass(frozen=True, slots=True)
class Text:
    """A string where it is written."""

    value: str
    location: Location


@dataclass(frozen=True, slots=True)
class Message:
    """A message."""

    direction: Direction
    name: Name
    identifier: Text | None
    type: Type
    link: Name | None


@dataclass(frozen=True, slots=True)
class Service:
    """A service."""

    name: Name
    identifier: Text | None
    request: Type
    response: Type
    link: Name | None


@dataclass(frozen=True, slots=True)
class Action:
    """An action."""

    name: Name
    identifier: Text | None
    request: Type
    response: Type
    feedback: Type
    link: Name | None


Communication = Message | Service | Action


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable with its written initial value, if any."""

    name: Name
    type: Type
    initial: Literal | Access | None


@dataclass(frozen=True, slots=True)
class Update:
    """`target := value`."""

    target: Access
    value: Expression


@dataclass(frozen=True, slots=True)
class CommunicationTransition:
    """`on kind from|to communication ...`."""

    kind: str
    preposition: Name
    communication: Name
    updates: tuple[Update, ...]
    target: Name | None
    location: Location


@dataclass(frozen=True, slots=True)
class TauTransition:
    """`transition ...`."""

    guard: Expression | None
    target: Name | None
    location: Location


Transition = CommunicationTransition | TauTransition


@dataclass(frozen=True, slots=True)
class State:
    """A state with the transitions written in it."""

    name: Name
    is_initial: bool
    is_marked: bool
    transitions: tuple[Transition, ...]


@dataclass(frozen=True, slots=True)
class Behaviour:
    """A behaviour: its parts in the order of the text."""

    items: tuple[Variable | State | Transition, ...]
    location: Location


@dataclass(frozen=True, slots=True)
class Import:
    """`from library import component`."""

    library: Name
    component: Name


@dataclass(frozen=True, slots=True)
class Component:
    """A component with its parts, or imported."""

    name: Name
    items: tuple[Communication | Behaviour, ...]
    imported: Import | None


# Requirements and data


@dataclass(frozen=True, slots=True)
class Requirement:
    """`R needs E` (`disables` false) or `E disables R`."""

    communications: tuple[Name, ...]
    disables: bool
    expression: Expression
    location: Location


@dataclass(frozen=True, slots=True)
class ObjectValue:
    """`{ property: value, ... }`."""

    properties: tuple[tuple[Name, "ObjectValue | Expression"], ...]
    location: Location


@dataclass(frozen=True, slots=True)
class Provide:
    """`provide communication with value if condition`."""

    communication: Name
    value: ObjectValue | Expression
    condition: Expression | None
    location: Location


Item = Component | ObjectDefinition | EnumDefinition | Interface | Requirement | Provide


@dataclass(frozen=True, slots=True)
class File:
    """A robot or a library.

    Attributes:
        is_library: Which of the two.
        name: Its name.
        items: Its definitions in the order of the text.
    """

    is_library: bool
    name: Name
    items: tuple[Item, ...]
