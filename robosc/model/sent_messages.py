"""Messages that a controller sends: headers without a stamp, and values that do not fit their fields."""

import re
from collections.abc import Iterator, Mapping, Sequence

from robosc.expressions import Constant
from robosc.interfaces import DISTRIBUTIONS, Field, Part
from robosc.interfaces.catalogue import Catalogue, FoundInterfaces
from robosc.language import syntax
from robosc.model.communications import middleware_type
from robosc.model.findings import Findings
from robosc.model.interfaces import KINDS, headers_of
from robosc.model.message_fields import basic_field
from robosc.model.structure import Communication, CommunicationKind, Limit, ObjectValue, Provide, ProvidedValue
from robosc.model.types import Types
from robosc.source import Location

_INTEGER = re.compile(r"(?P<unsigned>u?)int(?P<bits>8|16|32|64)\Z")
_SYNONYMS = {"byte": "uint8", "char": "uint8"}
_MAXIMUM_FLOAT32 = 3.4028234663852886e38
_STAMPED = (CommunicationKind.INCOMING_MESSAGE, CommunicationKind.ACTION)


class SentMessages:
    """Checker of what the requests of a robot send.

    Args:
        fitting: For each communication that fits the interface that it is linked to, the interfaces.
        provides: Provide statements with their places.
        limits: Limits with theirs.
        types: Types of the model.
        findings: Findings to which faults are reported.
    """

    def __init__(
        self,
        fitting: Mapping[str, Catalogue],
        provides: Sequence[tuple[Provide, Location]],
        limits: Sequence[tuple[Limit, Location]],
        types: Types,
        findings: Findings,
    ) -> None:
        self._fitting = fitting
        self._types = types
        self._findings = findings
        self._own = Catalogue(DISTRIBUTIONS[0], FoundInterfaces({}))
        self._provides: dict[str, list[tuple[Provide, Location]]] = {}
        for provide, place in provides:
            self._provides.setdefault(provide.communication, []).append((provide, place))
        self._limits = limits

    def check(self, item: Communication, tree: syntax.Communication, place: Location) -> None:
        """Report what is doubtful about the requests of a communication.

        Args:
            item: The communication.
            tree: Its declaration.
            place: Place where the robot's text speaks of it.
        """
        if item.kind is CommunicationKind.OUTGOING_MESSAGE:
            return
        catalogue = self._fitting.get(item.name) if item.interface else self._own
        package, _, type_ = middleware_type(item, self._types).partition("/")
        definition = catalogue.definition(KINDS[item.kind], package, type_) if catalogue else None
        if catalogue is None or definition is None:
            for provide, where in self._provides.get(item.name, ()):
                if item.frame is None and _leaves_frame_empty(provide.value):
                    self._report_empty(f"this leaves a frame of '{item.name}' empty", where)
            return
        if item.kind in _STAMPED:
            self._check_headers(item, tree, place, definition[0], catalogue)
        given = [(provide.value, where) for provide, where in self._provides.get(item.name, ())]
        given += [
            (value, where)
            for limit, where in self._limits
            if limit.communication == item.name
            for value in _ends(limit)
        ]
        for given_value, where in given:
            for field, value in _fields(given_value, definition[0], catalogue):
                reason = _misfit(field, value)
                if reason:
                    self._findings.warning(
                        "value-outside-field",
                        f"{value!r} does not fit into the field '{field.name}' of {package}/{type_}, {reason}: on ROS "
                        "this request is never made",
                        where,
                        "Provide a value that the field can hold.",
                    )

    def _check_headers(
        self, item: Communication, tree: syntax.Communication, place: Location, part: Part, catalogue: Catalogue
    ) -> None:
        headers = headers_of(part, catalogue, is_action=item.kind is CommunicationKind.ACTION)
        if not headers:
            return
        if item.frame is not None:
            if not item.frame:
                option = next(option for option in tree.options if option.key == "stamped")
                self._report_empty(f"'{item.name}' is stamped with an empty frame", option.location)
            return
        provides = self._provides.get(item.name, [])
        frames = [(where, _part(provide.value, (*path, "frame_id"))) for provide, where in provides for path in headers]
        if all(frame is None for _, frame in frames):
            self._findings.warning(
                "not-stamped",
                f"the header of '{item.name}' is never filled in: its time is 0 and its frame is empty",
                place,
                "Write 'stamped: \"base_link\"', with the frame that is meant, in its list; a supervision layer passes "
                "headers on and needs none.",
            )
            return
        for where, frame in frames:
            if frame is None or frame == Constant(""):
                self._report_empty(f"this leaves the frame in the header of '{item.name}' empty", where)

    def _report_empty(self, message: str, place: Location) -> None:
        self._findings.warning("empty-frame", message, place, 'Name the frame, such as "map" or "base_link".')


def _ends(limit: Limit) -> Iterator[ProvidedValue]:
    """Yield the ends of the ranges of a limit as a request could send them."""
    for bound in limit.bounds:
        for end in (bound.low, bound.high):
            value: ProvidedValue = Constant(end)
            for name in reversed(bound.path):
                value = ObjectValue(((name, value),))
            yield value


def _leaves_frame_empty(value: ProvidedValue) -> bool:
    """True if a provided value holds an empty frame; without a definition, a field counts as a frame by its name."""
    if not isinstance(value, ObjectValue):
        return False
    return any(
        part == Constant("") if name == "frame_id" else _leaves_frame_empty(part) for name, part in value.properties
    )


def _part(value: ProvidedValue, path: Sequence[str]) -> ProvidedValue | None:
    """The part of a provided value at a path; None where it is not given."""
    for name in path:
        if not isinstance(value, ObjectValue):
            return None
        found = dict(value.properties).get(name)
        if found is None:
            return None
        value = found
    return value


def _fields(value: ProvidedValue, part: Part, catalogue: Catalogue) -> Iterator[tuple[Field, bool | float | str]]:
    """Yield the fields that are given a constant, with it."""
    if isinstance(value, ObjectValue):
        for name, inner in value.properties:
            field = part.fields.get(name)
            if field is not None and isinstance(inner, ObjectValue):
                nested = catalogue.message(field.type)
                if nested is not None:
                    yield from _fields(inner, nested, catalogue)
            elif field is not None and isinstance(inner, Constant):
                yield field, inner.value
    elif isinstance(value, Constant):
        field = basic_field(part)
        if field is not None:
            yield field, value.value


def _misfit(field: Field, value: bool | float | str) -> str:
    """The reason why a field cannot hold a value; empty if it can."""
    match = _INTEGER.match(_SYNONYMS.get(field.type, field.type))
    if match is not None and type(value) is int:
        bits = int(match["bits"])
        low, high = (0, 2**bits - 1) if match["unsigned"] else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        return "" if low <= value <= high else f"{field.type}, from {low} to {high}"
    if field.type == "float32" and isinstance(value, float):
        return "" if abs(value) <= _MAXIMUM_FLOAT32 else f"float32, up to {_MAXIMUM_FLOAT32}"
    if field.bound is not None and isinstance(value, str):
        length = len(value.encode("utf-8", "surrogatepass"))
        return "" if length <= field.bound else f"a text of at most {field.bound} bytes"
    return ""
