"""Meaning of a model on the topics, services and actions of ROS, and the parts of it without a meaning there."""

import re
from dataclasses import dataclass

from robosc.errors import UnsupportedModelError
from robosc.expressions import (
    ArrayType,
    BooleanType,
    DoubleType,
    EnumType,
    IntegerType,
    NoneType,
    ObjectType,
    StringType,
    Type,
    type_text,
)
from robosc.model.structure import (
    Communication,
    CommunicationKind,
    Deployment,
    Interface,
    Model,
    ObjectValue,
    ProvidedValue,
)

Shape = None | str | dict[str, "Shape"] | list["Shape"]
"""See `robosc.targets.ros.runtime.messages`."""

_BASIC_INTERFACES: dict[type[Type], Interface] = {
    NoneType: Interface("Empty", "std_msgs"),
    BooleanType: Interface("Bool", "std_msgs"),
    StringType: Interface("String", "std_msgs"),
    IntegerType: Interface("Int16", "std_msgs"),
    DoubleType: Interface("Float32", "std_msgs"),
}
"""Interface for each type that crosses the middleware without `links`."""

_BASIC_SHAPES: dict[type[Type], str] = {
    BooleanType: "boolean",
    StringType: "string",
    IntegerType: "integer",
    DoubleType: "double",
}

_SERVER_KINDS = (CommunicationKind.SERVICE, CommunicationKind.ACTION)

_PARTS: dict[CommunicationKind, tuple[str, ...]] = {
    CommunicationKind.INCOMING_MESSAGE: ("request",),
    CommunicationKind.OUTGOING_MESSAGE: ("response",),
    CommunicationKind.SERVICE: ("request", "response"),
    CommunicationKind.ACTION: ("request", "response", "feedback"),
}
"""The events of each that carry data."""

_TOPIC = re.compile(r"(~/|/)?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*\Z")
_MAXIMUM_TOPIC = 200  # rmw takes 247 characters; the rest is left for a namespace.
_PACKAGE = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*\Z")
_MESSAGE = re.compile(r"[A-Z][A-Za-z0-9]*\Z")


@dataclass(frozen=True, slots=True)
class Topic:
    """One identifier.

    Attributes:
        identifier: Topic name, as in the model.
        interface: Its message type.
        published: Communications whose requests are published on it, in source order.
        received: Communications that it stands for, in source order.
    """

    identifier: str
    interface: Interface
    published: tuple[Communication, ...]
    received: tuple[Communication, ...]

    @property
    def frames(self) -> dict[str, str]:
        """The frame of each published message whose header is filled in."""
        return {item.name: item.frame for item in self.published if item.frame is not None}

    @property
    def publisher_quality(self) -> tuple[str, int] | None:
        """Quality of service and depth of what is published, if anything is."""
        return _quality(self.published)

    @property
    def subscription_quality(self) -> tuple[str, int] | None:
        """Quality of service and depth of what is received, if anything is."""
        return _quality(self.received)


def _quality(items: tuple[Communication, ...]) -> tuple[str, int] | None:
    return (items[0].effective_quality, items[0].effective_depth) if items else None


def topics(model: Model) -> tuple[Topic, ...]:
    """Every topic, in source order of first use.

    Raises:
        UnsupportedModelError: The model has something that has no meaning on ROS; the message names it.
    """
    by_identifier: dict[str, list[Communication]] = {}
    for communication in model.communications:
        _require_valid(communication)
        if communication.kind not in _SERVER_KINDS:
            by_identifier.setdefault(communication.identifier, []).append(communication)
    return tuple(_topic(model, identifier, items) for identifier, items in by_identifier.items())


def servers(model: Model) -> tuple[Communication, ...]:
    """Every service and action, in source order.

    Raises:
        UnsupportedModelError: One has no link to a type, or two types share a name.
    """
    found: dict[tuple[CommunicationKind, str], Communication] = {}
    asked = tuple(item for item in model.communications if item.kind in _SERVER_KINDS)
    for item in asked:
        if item.interface is None:
            raise UnsupportedModelError(f"'{item.name}' needs a link to the type of its {item.kind}")
        first = found.setdefault((item.kind, item.identifier), item)
        if first.interface is not None and first.interface != item.interface:
            raise UnsupportedModelError(
                f"the {item.kind} {item.identifier} has two types: "
                f"{first.interface.package}/{first.interface.type} for '{first.name}' and "
                f"{item.interface.package}/{item.interface.type} for '{item.name}'"
            )
    return asked


def _require_valid(communication: Communication) -> None:
    identifier, interface = communication.identifier, communication.interface
    if not _TOPIC.match(identifier) or len(identifier) > _MAXIMUM_TOPIC:
        raise UnsupportedModelError(
            f"the identifier {_quoted(identifier)} of '{communication.name}' is no ROS name: "
            "letters, digits and underscores between slashes, no part starting with a digit"
        )
    if interface and not (_PACKAGE.match(interface.package) and _MESSAGE.match(interface.type)):
        raise UnsupportedModelError(
            f"{interface.type} from {interface.package}, linked by '{communication.name}', is not a name of "
            "a ROS type such as Twist from geometry_msgs"
        )


def _quoted(text: str) -> str:
    return ascii(text if len(text) <= _MAXIMUM_TOPIC else text[:_MAXIMUM_TOPIC] + "...")


def message_data_type(communication: Communication) -> Type:
    """The type of what a message carries."""
    is_incoming = communication.kind is CommunicationKind.INCOMING_MESSAGE
    type_ = communication.request if is_incoming else communication.response
    return NoneType() if type_ is None else type_


def message_interface(model: Model, communication: Communication) -> Interface:
    """The message type of a communication: the linked one, else the one for its basic type."""
    if communication.interface is not None:
        return communication.interface
    type_ = message_data_type(communication)
    source = model.enum(type_.name).source if isinstance(type_, EnumType) else type_
    if type(source) not in _BASIC_INTERFACES:
        raise UnsupportedModelError(f"'{communication.name}' of type {type_text(type_)} needs a link to a message type")
    return _BASIC_INTERFACES[type(source)]


def _topic(model: Model, identifier: str, items: list[Communication]) -> Topic:
    interface = message_interface(model, items[0])
    for item in items[1:]:
        other = message_interface(model, item)
        if other != interface:
            raise UnsupportedModelError(
                f"the topic {identifier} has two types: {interface.package}/{interface.type} for "
                f"'{items[0].name}' and {other.package}/{other.type} for '{item.name}'"
            )
    topic = Topic(
        identifier,
        interface,
        tuple(item for item in items if item.kind is CommunicationKind.INCOMING_MESSAGE),
        tuple(item for item in items if item.kind is CommunicationKind.OUTGOING_MESSAGE),
    )
    _require_one_quality(identifier, items)
    return topic


def _require_one_quality(identifier: str, items: list[Communication]) -> None:
    """All messages on a topic travel alike; where the model says nothing of any, each way has a default of its own."""
    if all(item.quality is None and item.depth is None for item in items):
        return
    first = items[0]
    for item in items[1:]:
        if _quality((item,)) != _quality((first,)):
            raise UnsupportedModelError(
                f"the topic {identifier} has two qualities of service: {first.effective_quality} with "
                f"depth {first.effective_depth} for '{first.name}' and {item.effective_quality} with depth "
                f"{item.effective_depth} for '{item.name}'"
            )


def shapes_of(
    model: Model, communication: Communication, deployment: Deployment = Deployment.CONTROLLER
) -> dict[str, Shape]:
    """Return the shapes of the model's data, by the event that carries it: every property that its types declare.

    A controller makes the data of its requests; a layer receives it from an existing controller.

    Raises:
        UnsupportedModelError: A request sends an enum, or an object type contains itself.
    """
    return {
        f"{communication.name}.{part}": _shape(
            model,
            communication,
            getattr(communication, part) or NoneType(),
            (),
            part == "request" and deployment is Deployment.CONTROLLER,
        )
        for part in _PARTS[communication.kind]
    }


def _shape(model: Model, communication: Communication, type_: Type, inside: tuple[str, ...], sends: bool) -> Shape:
    match type_:
        case NoneType():
            return None
        case EnumType(name=name) if sends:
            raise UnsupportedModelError(
                f"'{communication.name}' sends the enum {name}, which is made from received data and "
                "cannot be turned back into it"
            )
        case EnumType(name=name):
            return _shape(model, communication, model.enum(name).source, inside, sends)
        case ArrayType(element=element):
            return [_shape(model, communication, element, inside, sends)]
        case ObjectType(name=name):
            if name in inside:
                raise UnsupportedModelError(f"the object type {name} contains itself, as no message can")
            return {
                item.name: _shape(model, communication, item.type, (*inside, name), sends)
                for item in model.object(name).properties
            }
        case _:
            return _BASIC_SHAPES[type(type_)]


def sent_paths(model: Model, communication: Communication) -> tuple[tuple[str, ...], ...]:
    """Every property that some provide statement or limit sets, sorted; the empty path for a basic type."""
    provided = {path for item in model.provides_for(communication.name) for path in _paths(item.value)}
    limited = {bound.path for item in model.limits_for(communication.name) for bound in item.bounds}
    return tuple(sorted(provided | limited))


def _paths(value: ProvidedValue) -> list[tuple[str, ...]]:
    if isinstance(value, ObjectValue):
        return [(name, *path) for name, inner in value.properties for path in _paths(inner)]
    return [()]
