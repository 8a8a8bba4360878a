"""Builds and checks the communications of a robot, and what crosses the middleware."""

from collections.abc import Iterable, Mapping, Sequence

import msgspec
from msgspec.structs import replace

from robosc.errors import RelatedPlace
from robosc.expressions import BooleanType, DoubleType, EnumType, IntegerType, NoneType, ObjectType, StringType, Type
from robosc.language import syntax
from robosc.model.expression_checker import ExpressionChecker
from robosc.model.findings import Findings
from robosc.model.identifiers import identifier_fault
from robosc.model.options import build_options
from robosc.model.robot_scopes import RobotScopes
from robosc.model.structure import Communication, CommunicationKind, Interface
from robosc.model.types import Types
from robosc.model.units import Part, unique
from robosc.source import Location

STANDARD_INTERFACES: dict[type, str] = {
    NoneType: "Empty",
    BooleanType: "Bool",
    StringType: "String",
    IntegerType: "Int16",
    DoubleType: "Float32",
}
"""Types of std_msgs that basic types become without `links`."""

_INCOMING = CommunicationKind.INCOMING_MESSAGE

_DIRECTIONS = {
    syntax.Direction.INCOMING: CommunicationKind.INCOMING_MESSAGE,
    syntax.Direction.OUTGOING: CommunicationKind.OUTGOING_MESSAGE,
}


class CommunicationTree(msgspec.Struct, frozen=True):
    """A communication as written, and the component that it belongs to."""

    part: Part
    tree: syntax.Communication

    @property
    def location(self) -> Location:
        """Place where the robot's text speaks of it: its own name, or the import that brings it."""
        return self.part.place if self.part.is_imported else self.tree.name.location

    @property
    def identifier_location(self) -> Location:
        """Place where the name of its topic, service or action is written."""
        return self.tree.identifier.location if self.tree.identifier else self.tree.name.location


def communication_trees(parts: Sequence[Part], findings: Findings) -> tuple[CommunicationTree, ...]:
    """Every communication in source order; reports names that are given twice."""
    trees = [
        CommunicationTree(part, item)
        for part in parts
        for item in part.tree.items
        if not isinstance(item, syntax.Behaviour)
    ]
    names = [syntax.Name(item.tree.name.text, item.location) for item in trees]
    unique(names, "duplicate-communication", "communication", findings)
    for item in trees:
        findings.bindings.communications.setdefault(item.tree.name.text, item.tree.name.location)
    return tuple(trees)


def build_communication(item: CommunicationTree, types: Types, findings: Findings) -> Communication | None:
    """A communication of the model, or None where a type of it is broken."""
    tree, part = item.tree, item.part
    link = _interface(tree.link, part, findings)
    parts: dict[str, syntax.Type] = {}
    match tree:
        case syntax.Message(direction=direction, type=type_):
            kind = _DIRECTIONS[direction]
            parts["request" if kind is CommunicationKind.INCOMING_MESSAGE else "response"] = type_
        case syntax.Service(request=request, response=response):
            kind = CommunicationKind.SERVICE
            parts |= {"request": request, "response": response}
        case syntax.Action(request=request, response=response, feedback=feedback):
            kind = CommunicationKind.ACTION
            parts |= {"request": request, "response": response, "feedback": feedback}
    resolved = {name: types.resolve(type_, part.unit) for name, type_ in parts.items()}
    if tree.link is None:
        _check_link(tree, kind, zip(resolved.values(), parts.values(), strict=True), types, findings)
    if any(type_ is None for type_ in resolved.values()):
        return None
    identifier = tree.identifier.value if tree.identifier else tree.name.text
    if len(identifier) > 255:
        findings.error(
            "name-too-long",
            "the identifier has more than 255 characters",
            tree.identifier.location if tree.identifier else tree.name.location,
            "Write the name of the topic, service or action.",
        )
        return None
    if not identifier.isprintable():
        findings.error(
            "unprintable-identifier",
            f"the identifier has characters that cannot be seen: {identifier!a}",
            item.identifier_location,
            "Write the name without them: terminals and editors obey such characters instead of showing them.",
        )
        return None
    options = build_options(tree, kind, findings)
    _check_identifier(identifier, item.identifier_location, findings)
    return Communication(
        name=tree.name.text,
        component=part.name,
        kind=kind,
        identifier=identifier,
        request=resolved.get("request"),
        response=resolved.get("response"),
        feedback=resolved.get("feedback"),
        interface=link,
        **options,  # type: ignore[arg-type]  # each of its own type
    )


def with_conditions(
    trees: Iterable[CommunicationTree],
    communications: Mapping[str, Communication],
    scopes: RobotScopes,
    findings: Findings,
) -> dict[str, Communication]:
    """The communications with the conditions (`when`) that distinguish requests on one identifier."""
    found = dict(communications)
    for item in trees:
        communication = found.get(item.tree.name.text)
        for option in item.tree.options:
            if option.key != "when" or communication is None or communication.request is None:
                continue
            if isinstance(option.value, syntax.Name):
                found[communication.name] = msgspec.structs.replace(communication, is_when_default=True)
                continue
            scope = replace(scopes.of(item.part.unit), components={}, received=communication.request)
            condition = ExpressionChecker(scope, findings).condition(option.value)  # type: ignore[arg-type]  # as parsed
            if condition is not None:
                found[communication.name] = msgspec.structs.replace(communication, when=condition)
    return found


def _check_identifier(identifier: str, location: Location, findings: Findings) -> None:
    fault = identifier_fault(identifier)
    if fault is not None:
        findings.warning(
            "invalid-identifier",
            f"ROS cannot use the name '{identifier}': {fault}",
            location,
            "Use letters, digits, '_' and '/', such as '/robot/scan'; nothing can be generated for ROS otherwise.",
        )


def _interface(link: syntax.Name | None, part: Part, findings: Findings) -> Interface | None:
    if link is None:
        return None
    found = part.unit.interfaces.get(link.text)
    if found is None:
        findings.unknown("interface", link.text, link.location, part.unit.interfaces)
        return None
    findings.bindings.bind(link, found.name.location)
    return Interface(found.type.text, found.package.text)


def _check_link(
    tree: syntax.Communication,
    kind: CommunicationKind,
    parts: Iterable[tuple[Type | None, syntax.Type]],
    types: Types,
    findings: Findings,
) -> None:
    """Objects, enums made from objects, services and actions need `links`."""
    fix = "Define 'interface x use Type from ros_package' and write 'links x'."
    if kind in (CommunicationKind.SERVICE, CommunicationKind.ACTION):
        message = f"the {kind} '{tree.name.text}' needs a middleware type"
        findings.error("links-required", message, tree.name.location, fix)
        return
    for type_, type_tree in parts:
        crossing = types.sources[type_.name] if isinstance(type_, EnumType) else type_
        if isinstance(crossing, ObjectType):
            reason = "an enum made from an object" if isinstance(type_, EnumType) else "an object"
            findings.error("links-required", f"{reason} needs a middleware type", type_tree.location, fix)


def middleware_type(communication: Communication, types: Types) -> str:
    """The middleware type that crosses, as `package/Type`."""
    if communication.interface is not None:
        return f"{communication.interface.package}/{communication.interface.type}"
    type_ = communication.request if communication.request is not None else communication.response
    crossing = types.sources[type_.name] if isinstance(type_, EnumType) else type_
    return f"std_msgs/{STANDARD_INTERFACES.get(type(crossing), 'Empty')}"


def _agree(first: Communication, second: Communication) -> bool:
    """Return True if two messages on one topic travel alike.

    Where the model is silent, each way has its own default.
    """
    if all(item.quality is None and item.depth is None for item in (first, second)):
        return True
    transports = {(item.effective_quality, item.effective_depth) for item in (first, second)}
    return len(transports) == 1


def _quality_text(communication: Communication) -> str:
    return f"qos: {communication.effective_quality}, depth: {communication.effective_depth}"


def check_topics(
    communications: Iterable[Communication], places: dict[str, Location], types: Types, findings: Findings
) -> None:
    """Check shared identifiers: one middleware type on each, and one component that publishes on it."""
    first: dict[tuple[str, str], Communication] = {}
    for item in communications:
        is_topic = item.kind in (CommunicationKind.INCOMING_MESSAGE, CommunicationKind.OUTGOING_MESSAGE)
        if not is_topic and item.interface is None:
            continue  # Its missing link has been reported; without one there is nothing to compare.
        # Topics, services and actions have name spaces of their own.
        other = first.setdefault(("topic" if is_topic else item.kind, item.identifier), item)
        if other is not item and middleware_type(other, types) != middleware_type(item, types):
            findings.warning(
                "conflicting-topic",
                f"'{item.identifier}' carries {middleware_type(other, types)} and {middleware_type(item, types)}",
                places[item.name],
                "Use one middleware type on one identifier; nothing can be generated otherwise.",
                RelatedPlace("the other type is used here", places[other.name]),
            )
        elif other is not item and is_topic and not _agree(other, item):
            findings.warning(
                "conflicting-topic",
                f"'{item.identifier}' is '{_quality_text(other)}' for '{other.name}' and '{_quality_text(item)}' here",
                places[item.name],
                "Give both the same 'qos' and 'depth'; nothing can be generated otherwise.",
                RelatedPlace(f"'{other.name}' is here", places[other.name]),
            )
        if item.kind is CommunicationKind.OUTGOING_MESSAGE:
            speaker = first.setdefault(("speaker", item.identifier), item)
            if speaker.component != item.component:
                findings.warning(
                    "shared-topic",
                    f"'{item.component}' and '{speaker.component}' both publish on '{item.identifier}'",
                    places[item.name],
                    "Give each its own identifier: a receiver cannot tell which component sent a message.",
                    RelatedPlace("the other one is here", places[speaker.name]),
                )
