"""The definitions of a file: everything that has a name."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import msgspec

from robosc.language import syntax
from robosc.source import Location


class DefinitionKind(StrEnum):
    """Kind of thing that a name can stand for."""

    ROBOT = "robot"
    LIBRARY = "library"
    COMPONENT = "component"
    INCOMING = "incoming message"
    OUTGOING = "outgoing message"
    SERVICE = "service"
    ACTION = "action"
    INTERFACE = "interface"
    OBJECT = "object"
    PROPERTY = "property"
    ENUM = "enum"
    ENUM_VALUE = "enum value"
    CONSTANT = "constant"
    STATE = "state"
    VARIABLE = "variable"
    ELEMENT = "element"
    MISSION = "mission"


COMMUNICATIONS = frozenset(
    {DefinitionKind.INCOMING, DefinitionKind.OUTGOING, DefinitionKind.SERVICE, DefinitionKind.ACTION}
)


@dataclass(frozen=True, slots=True)
class Definition:
    """A name where it is given.

    Attributes:
        kind: Kind of thing that it stands for.
        name: The name, without a `^`.
        location: The name's place.
        tree: Tree of the thing that is defined.
        owner: The name of what it is part of; empty at the top.
    """

    kind: DefinitionKind
    name: str
    location: Location
    tree: object
    owner: str = ""


_COMMUNICATION_KINDS = {syntax.Service: DefinitionKind.SERVICE, syntax.Action: DefinitionKind.ACTION}
_ITEM_KINDS = {
    syntax.Interface: DefinitionKind.INTERFACE,
    syntax.Constant: DefinitionKind.CONSTANT,
    syntax.Mission: DefinitionKind.MISSION,
}


def definitions(file: syntax.File) -> Iterator[Definition]:
    """Every definition of a file, in the order of the text but for those inside others, which follow them."""
    kind = DefinitionKind.LIBRARY if file.is_library else DefinitionKind.ROBOT
    yield _defined(kind, file.name, file)
    for item in file.items:
        match item:
            case syntax.Component():
                yield _defined(DefinitionKind.COMPONENT, item.name, item)
                yield from _inside_component(item)
            case syntax.ObjectDefinition():
                yield _defined(DefinitionKind.OBJECT, item.name, item)
                for part in item.properties:
                    yield _defined(DefinitionKind.PROPERTY, part.name, part, item.name.text)
            case syntax.EnumDefinition():
                yield _defined(DefinitionKind.ENUM, item.name, item)
                for rule in item.rules:
                    yield _defined(DefinitionKind.ENUM_VALUE, rule.value, item, item.name.text)
            case syntax.Interface() | syntax.Constant() | syntax.Mission():
                yield _defined(_ITEM_KINDS[type(item)], item.name, item)
    for node in walk(file):
        if isinstance(node, syntax.Quantifier):
            yield _defined(DefinitionKind.ELEMENT, node.variable, node)


def _inside_component(component: syntax.Component) -> Iterator[Definition]:
    owner = component.name.text
    for item in component.items:
        if isinstance(item, syntax.Message):
            is_incoming = item.direction is syntax.Direction.INCOMING
            kind = DefinitionKind.INCOMING if is_incoming else DefinitionKind.OUTGOING
            yield _defined(kind, item.name, item, owner)
        elif isinstance(item, syntax.Behaviour):
            for part in item.items:
                if isinstance(part, syntax.State):
                    yield _defined(DefinitionKind.STATE, part.name, part, owner)
                elif isinstance(part, syntax.Variable):
                    yield _defined(DefinitionKind.VARIABLE, part.name, part, owner)
        else:
            yield _defined(_COMMUNICATION_KINDS[type(item)], item.name, item, owner)


def _defined(kind: DefinitionKind, name: syntax.Name, tree: object, owner: str = "") -> Definition:
    return Definition(kind, name.text, name.location, tree, owner)


def walk(tree: object) -> Iterator[object]:
    """A tree and everything in it, in the order of the text."""
    stack = [tree]
    while stack:
        node = stack.pop()
        if isinstance(node, tuple):
            stack += reversed(node)
        elif isinstance(node, msgspec.Struct) and not isinstance(node, Location):
            yield node
            stack += (getattr(node, field) for field in reversed(node.__struct_fields__))
