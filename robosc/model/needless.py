"""Properties that nothing reads or fills, where the middleware type has no such field: the model goes without them.

Object types are shared, and a property that one communication needs may stand for no field in another, so that one gets
an object type of its own.
"""

from collections.abc import Iterable, Iterator, Mapping

import msgspec

from robosc.expressions import ArrayType, EnumType, ObjectType, Type
from robosc.expressions.tree import Element, Received
from robosc.model.structure import (
    Behaviour,
    Communication,
    EnumDefinition,
    Limit,
    ObjectDefinition,
    ObjectValue,
    Property,
    Provide,
)

LeftOut = frozenset[tuple[str, str]]
"""Properties by object type and name."""

_PARTS = ("request", "response", "feedback")


class PropertyUses:
    """Names of properties that the model reads or fills.

    Args:
        communications: Communications of the robot.
        behaviours: Behaviours, which read what is received.
        provides: Data of requests.
        limits: Bounds of numbers of requests.
        enums: Enums, whose rules read what they are made from.
        objects: Object types by name.
    """

    def __init__(
        self,
        communications: Iterable[Communication],
        behaviours: Iterable[Behaviour],
        provides: Iterable[Provide],
        limits: Iterable[Limit],
        enums: Iterable[EnumDefinition],
        objects: Mapping[str, ObjectDefinition],
    ) -> None:
        self._objects = objects
        self._enums = {item.name: item for item in enums}
        self._names: dict[str, set[str]] = {}
        self._types = {
            item.name: tuple(getattr(item, part) for part in _PARTS if getattr(item, part) is not None)
            for item in communications
        }
        for item in communications:
            self._add(item.name, item.when)
        for behaviour in behaviours:
            for transition in behaviour.transitions:
                self._add(transition.event.rpartition(".")[0], (transition.guard, transition.updates))
        for provide in provides:
            self._add(provide.communication, provide.value)
        for limit in limits:
            self._names.setdefault(limit.communication, set()).update(
                name for bound in limit.bounds for name in bound.path
            )

    def of(self, communication: str) -> frozenset[str]:
        """The names of properties that are read or filled in the data of a communication."""
        found = set(self._names.get(communication, ()))
        for type_ in self._types.get(communication, ()):
            for enum in self._enums_in(type_):
                found.update(_names_in(enum.rules))
        return frozenset(found)

    def _add(self, communication: str, tree: object) -> None:
        self._names.setdefault(communication, set()).update(_names_in(tree))

    def _enums_in(self, type_: Type) -> Iterator[EnumDefinition]:
        """The enums that data of a type contains; each type is looked at once."""
        stack, seen = [type_], set[Type]()
        while stack:
            inner = stack.pop()
            if inner in seen:
                continue
            seen.add(inner)
            match inner:
                case EnumType(name=name) if name in self._enums:
                    yield self._enums[name]
                    stack.append(self._enums[name].source)
                case ArrayType(element=element):
                    stack.append(element)
                case ObjectType(name=name):
                    stack += [item.type for item in self._objects[name].properties]
                case _:
                    pass


def _names_in(tree: object) -> Iterator[str]:
    """The names of properties in a tree of expressions or of provided data."""
    stack = [tree]
    while stack:
        node = stack.pop()
        if isinstance(node, Received | Element):
            yield from (step for step in node.path if isinstance(step, str))
        elif isinstance(node, ObjectValue):
            for name, inner in node.properties:
                yield name
                stack.append(inner)
        elif isinstance(node, tuple):
            stack += node
        elif isinstance(node, msgspec.Struct):
            stack += [getattr(node, name) for name in node.__struct_fields__]


class Needed(msgspec.Struct, frozen=True):
    """Parts of a model as they are without needless properties.

    Attributes:
        communications: The communications.
        enums: The enums.
        objects: The object types.
        origins: Name of the type in the text, by that of each type that was made from it.
    """

    communications: tuple[Communication, ...]
    enums: tuple[EnumDefinition, ...]
    objects: tuple[ObjectDefinition, ...]
    origins: Mapping[str, str] = msgspec.field(default_factory=dict)


def without(
    communications: Iterable[Communication],
    enums: Iterable[EnumDefinition],
    objects: Iterable[ObjectDefinition],
    left_out: Mapping[str, LeftOut],
) -> Needed:
    """Return the parts of a model without the properties that each communication leaves out, by its name."""
    communications, enums, objects = tuple(communications), tuple(enums), tuple(objects)
    if not any(left_out.values()):
        return Needed(communications, enums, objects)
    variants = _Variants(objects)
    made: dict[str, Communication] = {}
    # Those that need everything are first, and keep the names.
    for item in sorted(communications, key=lambda item: bool(left_out.get(item.name))):
        gone = left_out.get(item.name, LeftOut())
        types = {part: variants.of(getattr(item, part), item.name, gone) for part in _PARTS}
        made[item.name] = msgspec.structs.replace(item, **types)
    # Only its own rules read what an enum is made from.
    every = LeftOut().union(*left_out.values())
    read = {item.name: frozenset(_names_in(item.rules)) for item in enums}
    rebuilt = tuple(
        msgspec.structs.replace(
            item,
            source=variants.of(
                item.source, item.name, LeftOut(pair for pair in every if pair[1] not in read[item.name])
            ),
        )
        for item in enums
    )
    found, origins = variants.definitions()
    return Needed(tuple(made[item.name] for item in communications), rebuilt, found, origins)


class _Variants:
    """Object types with more or fewer properties."""

    def __init__(self, objects: tuple[ObjectDefinition, ...]) -> None:
        self._objects = {item.name: item for item in objects}
        self._made: dict[str, dict[tuple[Property, ...], str]] = {}
        self._taken = set(self._objects)

    def of(self, type_: Type | None, owner: str, gone: LeftOut) -> Type | None:
        """A type without some properties; `owner` is a part of the name of a new one."""
        match type_:
            case ArrayType(element=element):
                inner = self.of(element, owner, gone)
                return type_ if inner is None else ArrayType(inner)
            case ObjectType(name=name):
                return ObjectType(self._object(name, owner, gone))
            case _:
                return type_

    def _object(self, name: str, owner: str, gone: LeftOut) -> str:
        properties = []
        for item in self._objects[name].properties:
            inner = self.of(item.type, owner, gone)
            if inner is not None and (name, item.name) not in gone:
                properties.append(Property(item.name, inner))
        made = self._made.setdefault(name, {})
        key = tuple(properties)
        if key not in made:
            new, number = name if not made else f"{name}_{owner}", 2
            while made and new in self._taken:
                new, number = f"{name}_{owner}_{number}", number + 1
            self._taken.add(new)
            made[key] = new
        return made[key]

    def definitions(self) -> tuple[tuple[ObjectDefinition, ...], dict[str, str]]:
        """All types, each followed by those that were made from it; and the names of their origins."""
        found: list[ObjectDefinition] = []
        origins: dict[str, str] = {}
        for name, item in self._objects.items():
            made = self._made.get(name, {item.properties: name})
            found += [ObjectDefinition(new, properties) for properties, new in made.items()]
            origins.update((new, name) for new in made.values())
        return tuple(found), origins


__all__ = ["LeftOut", "Needed", "PropertyUses", "without"]
