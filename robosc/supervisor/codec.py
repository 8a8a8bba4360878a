"""The canonical JSON form of a supervisor (`.rsup`): it is written from our values, and read as untrusted input.

The form is one line of UTF-8 JSON with sorted keys and no blanks, and a line end. Equal supervisors give equal bytes,
so a digest or signature of the file is also one of the value. Reading accepts any layout of the same document.
"""

import json
from dataclasses import fields, is_dataclass
from typing import NoReturn

import msgspec

from robosc.errors import InvalidSupervisorError, UnsupportedModelError
from robosc.supervisor.structure import FORMAT, FORMAT_VERSION, Supervisor
from robosc.supervisor.validation import validate

MAXIMUM_BYTES = 16 * 2**20
"""Largest file that is read or written."""

MAXIMUM_EXPRESSION_DEPTH = 400
"""Deepest nesting of expressions: every later stage may recurse over them."""

# Levels around the deepest expression: document, supervisor, model, component, behaviour, transition, update, and the
# arrays between them.
_MAXIMUM_NESTING = MAXIMUM_EXPRESSION_DEPTH + 14


class _Document(msgspec.Struct, frozen=True):
    """The outermost object of the file."""

    format: str
    version: int
    supervisor: Supervisor


_ENCODER = msgspec.json.Encoder(order="sorted")
_DECODER = msgspec.json.Decoder(_Document, strict=True)


_KINDS = {
    "supervisor": "the supervisor of a model, which robosc.Supervisor.read reads",
    "system_supervisor": "the supervisor of automata without a model, which robosc.SystemSupervisor.read reads",
}
"""The contents that such files have, by the field that holds them."""


def encode(supervisor: Supervisor) -> bytes:
    """The canonical bytes of a supervisor; `decode` reads whatever this writes.

    Raises:
        UnsupportedModelError: An expression is nested too deeply, or the file would become too large.
    """
    return encode_document(_Document(FORMAT, FORMAT_VERSION, supervisor))


def encode_document(document: msgspec.Struct) -> bytes:
    """The canonical bytes of a document: the format, its version, and one of the contents; errors as of `encode`."""
    try:
        content = _ENCODER.encode(document) + b"\n"
        # A nested value is a row of openings somewhere, so few of them settle it without a walk.
        too_deep = content.count(b"{") > MAXIMUM_EXPRESSION_DEPTH and _nesting(json.loads(content)) > _MAXIMUM_NESTING
    except RecursionError:
        too_deep = True
    if too_deep:
        raise UnsupportedModelError(
            f"an expression is nested more than {MAXIMUM_EXPRESSION_DEPTH} operators deep: name parts of it with enums"
        )
    if len(content) > MAXIMUM_BYTES:
        raise UnsupportedModelError(
            f"the supervisor needs {len(content)} bytes, more than the {MAXIMUM_BYTES} that a supervisor file may have"
        )
    return content


def decode(data: bytes) -> Supervisor:
    """The supervisor in a file's bytes, consistent in itself; it is not verified against a model here.

    Raises:
        InvalidSupervisorError: The bytes are no supervisor of a known version; says where in one sentence.
    """
    supervisor = decode_document(data, _DECODER).supervisor
    validate(supervisor)
    return supervisor


def decode_document[D: msgspec.Struct](data: bytes, decoder: msgspec.json.Decoder[D]) -> D:
    """The document in a file's bytes, of which only the form was looked at.

    Args:
        data: The bytes.
        decoder: Decoder of documents whose last field is the content.

    Raises:
        InvalidSupervisorError: It has not that form; says where in one sentence.
    """
    if len(data) > MAXIMUM_BYTES:
        raise InvalidSupervisorError(f"a supervisor file has at most {MAXIMUM_BYTES} bytes, this one {len(data)}")
    raw = _raw(data)
    _require_known_version(raw, decoder.type.__struct_fields__[-1])
    try:
        document = decoder.decode(data)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise InvalidSupervisorError(f"the supervisor file is malformed: {one_line(error)}") from error
    _require_known_fields(raw, document, "$")
    return document


def _raw(data: bytes) -> object:
    """The file as plain JSON values, no deeper than every later step can bear."""
    try:
        raw = json.loads(data.decode("utf-8"), object_pairs_hook=_unique, parse_constant=_refuse_constant)
    except RecursionError:
        raise _too_deep() from None
    except ValueError as error:
        raise InvalidSupervisorError(f"the supervisor file is not UTF-8 JSON: {one_line(error)}") from error
    if _nesting(raw) > _MAXIMUM_NESTING:
        raise _too_deep()
    return raw


def _unique(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """A JSON object whose keys occur once; other readers may disagree on which of two counts."""
    result: dict[str, object] = {}
    for key, value in pairs:
        if key in result:
            raise InvalidSupervisorError(f"the supervisor file is malformed: the field {key[:80]!r} stands twice")
        result[key] = value
    return result


def _refuse_constant(text: str) -> NoReturn:
    raise ValueError(f"{text} is not a JSON number")


def _nesting(raw: object) -> int:
    """Return the nesting depth of objects and arrays, without recursion."""
    depth, level = 0, [raw]
    while level := [item for item in level if isinstance(item, dict | list)]:
        depth += 1
        level = [inner for item in level for inner in (item.values() if isinstance(item, dict) else item)]
    return depth


def _too_deep() -> InvalidSupervisorError:
    return InvalidSupervisorError(
        f"the supervisor file is nested too deeply: expressions have at most {MAXIMUM_EXPRESSION_DEPTH} levels"
    )


def _require_known_version(raw: object, wanted: str) -> None:
    if not isinstance(raw, dict) or raw.get("format") != FORMAT:
        raise InvalidSupervisorError(f"this is not a supervisor file: its field 'format' is not {FORMAT!r}")
    version = raw.get("version")
    if version != FORMAT_VERSION or isinstance(version, bool):
        raise InvalidSupervisorError(
            f"this RoboSC reads supervisor files of version {FORMAT_VERSION}, this one has version {str(version)[:40]}"
        )
    for content, meaning in _KINDS.items():
        if content in raw and content != wanted:
            raise InvalidSupervisorError(f"the supervisor file holds {meaning}")


def _require_known_fields(raw: object, value: object, place: str) -> None:
    """Refuse fields that decoding passed over; `raw` and `value` have one shape, no deeper than `_nesting` allows."""
    known = _fields(value)
    if isinstance(raw, dict) and known:
        for key, inner in raw.items():
            if key not in known:
                raise InvalidSupervisorError(f"the supervisor file is malformed: unknown field {key!r} at {place}")
            if isinstance(inner, dict | list):
                _require_known_fields(inner, getattr(value, key), f"{place}.{key}")
    elif isinstance(raw, list) and isinstance(value, tuple):
        for index, (inner, part) in enumerate(zip(raw, value, strict=True)):
            if isinstance(inner, dict | list):
                _require_known_fields(inner, part, f"{place}[{index}]")


def _fields(value: object) -> set[str | None]:
    """Return the names that the fields of a value have in a file."""
    if isinstance(value, msgspec.Struct):
        return {*value.__struct_encode_fields__, value.__struct_config__.tag_field}
    return {field.name for field in fields(value)} if is_dataclass(value) else set()


def one_line(error: Exception) -> str:
    """Return an error's text as one line that is not long."""
    return " ".join(str(error).split())[:300]
