"""Communications against the definitions of their middleware types, where those are at hand (language A.5)."""

from collections.abc import Iterable, Iterator, Mapping
from itertools import chain

from robosc.expressions import EnumType, NoneType, ObjectType, Type, type_text
from robosc.model.findings import Findings
from robosc.model.structure import Communication, CommunicationKind
from robosc.model.types import Types
from robosc.source import Location, SourceFile

_MAXIMUM_SHOWN = 6

_ENDINGS = {
    CommunicationKind.INCOMING_MESSAGE: "msg",
    CommunicationKind.OUTGOING_MESSAGE: "msg",
    CommunicationKind.SERVICE: "srv",
    CommunicationKind.ACTION: "action",
}


def fields_of(text: str) -> tuple[tuple[str, ...], ...]:
    """The field names of each part of a definition: one part of a message, two of a service, three of an action."""
    parts: list[list[str]] = [[]]
    for line in text.splitlines():
        words = line.partition("#")[0].split()
        if words and words[0].startswith("---"):
            parts.append([])
        # A constant is `type NAME=value`, a field with a default `type name value`.
        elif len(words) >= 2 and "=" not in words[1] and words[2:3] != ["="]:
            parts[-1].append(words[1])
    return tuple(map(tuple, parts))


def check_fields(
    communications: Iterable[Communication],
    interfaces: Iterable[SourceFile],
    places: Mapping[str, Location],
    types: Types,
    findings: Findings,
) -> None:
    """A basic type stands for the field `data`, else for the only field: report where that leaves a doubt."""
    texts = {file.name: file.text for file in interfaces}
    for item in communications:
        if item.interface is None:
            continue
        ending = _ENDINGS[item.kind]
        text = texts.get(f"{item.interface.package}/{ending}/{item.interface.type}.{ending}")
        parts = () if text is None else fields_of(text)
        for type_, fields in zip(_types_sent(item), chain(parts), strict=False):
            basic = types.sources[type_.name] if isinstance(type_, EnumType) else type_
            if basic is None or isinstance(basic, ObjectType | NoneType) or "data" in fields or len(fields) == 1:
                continue
            has = f"the fields {', '.join(fields[:_MAXIMUM_SHOWN])}" if fields else "no field"
            more = ", ..." if len(fields) > _MAXIMUM_SHOWN else ""
            findings.error(
                "ambiguous-field",
                f"{type_text(basic)} could be any part of {item.interface.package}/{item.interface.type}, which has "
                f"{has}{more}",
                places[item.name],
                "Make an object type with the field that is meant as its property.",
            )


def _types_sent(communication: Communication) -> Iterator[Type | None]:
    """The types of a communication in the order of its definition's parts."""
    if communication.kind in (CommunicationKind.INCOMING_MESSAGE, CommunicationKind.OUTGOING_MESSAGE):
        yield communication.request if communication.request is not None else communication.response
    else:
        yield communication.request
        yield communication.response
        yield communication.feedback
