"""Descriptions of all keys, read from the structures themselves, for the template and the documentation."""

from collections.abc import Iterator
from types import NoneType
from typing import Annotated, Any, get_args, get_origin

import msgspec

from robosc.model.structure import CommunicationKind
from robosc_bridge.configuration.channels import CHANNELS, Use, channel_name
from robosc_bridge.configuration.decoding import expected, is_struct, members
from robosc_bridge.configuration.problems import value_text
from robosc_bridge.configuration.shapes import Leaf, shape_text
from robosc_bridge.configuration.structure import Configuration


def summary(annotation: Any) -> str:
    """The description in an annotation, or an empty text."""
    if get_origin(annotation) is not Annotated:
        return ""
    return next((meta.description for meta in get_args(annotation)[1:] if meta.description), "")


def struct_of(annotation: Any) -> type[msgspec.Struct] | None:
    """The structure that a field holds, or may hold; None if it holds no structure."""
    plain = get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation
    found = [item for item in members(plain) if is_struct(item)]
    return found[0] if len(found) == 1 else None


def default_of(field: msgspec.structs.FieldInfo) -> Any:
    """The default of a field as a plain value; `msgspec.NODEFAULT` if it has none."""
    default = field.default if field.default_factory is msgspec.NODEFAULT else field.default_factory()
    return default if default is msgspec.NODEFAULT else msgspec.to_builtins(default)


def reference() -> str:
    """Tables in Markdown: every key of a configuration; every channel; the options and the data of channels."""
    parts = (
        ("| key | value | default | meaning |", _keys(Configuration, "")),
        ("| channel | for | meaning |", _channels()),
        ("| channel | option | value | default | meaning |", _options()),
        ("| channel | data |", _data()),
    )
    tables = ("\n".join((head, "|---" * (head.count("|") - 1) + "|", *rows)) for head, rows in parts)
    return "\n\n".join(tables) + "\n"


def _keys(target: type[msgspec.Struct], before: str) -> Iterator[str]:
    for field in msgspec.structs.fields(target):
        name, inner = f"{before}{field.name}", struct_of(field.type)
        default = default_of(field)
        if inner is None:
            yield f"| `{name}` | {_cell(expected(field.type))} | {_default(default)} | {_cell(summary(field.type))} |"
        else:
            shown_default = "required" if default is msgspec.NODEFAULT else "`null`" if default is None else "its own"
            value = " or ".join([*_others(field.type), "a section"])
            yield f"| `{name}` | {_cell(value)} | {shown_default} | {_cell(summary(field.type))} |"
            yield from _keys(inner, f"{name}.")


def _others(annotation: Any) -> list[str]:
    """Return descriptions of the values that a field may hold instead of a section."""
    plain = get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation
    return [expected(item) for item in members(plain) if item is not NoneType and not is_struct(item)]


def _default(default: Any) -> str:
    if default is msgspec.NODEFAULT:
        return "required"
    return f"`{'null' if default is None else default if default in ({}, []) else value_text(default)}`"


def _channels() -> Iterator[str]:
    for kind, info in CHANNELS.items():
        words = _cell(" ".join((kind.__doc__ or "").split()))
        yield f"| `{channel_name(kind)}` | {', '.join(info.uses)} | {words} |"


def _options() -> Iterator[str]:
    for kind in CHANNELS:
        for field in msgspec.structs.fields(kind):
            cells = (expected(field.type), _default(default_of(field)), summary(field.type))
            yield f"| `{channel_name(kind)}` | `{field.name}` | {' | '.join(map(_cell, cells))} |"


def _data() -> Iterator[str]:
    for kind, info in CHANNELS.items():
        for communication, use in info.uses.items():
            is_received = communication is CommunicationKind.OUTGOING_MESSAGE
            yield f"| `{channel_name(kind)}`, {communication} | {_use(use, is_received)} |"


def _use(use: Use, is_received: bool) -> str:
    if use.request is use.response is use.feedback:
        return f"`{shape_text(use.request)}`"
    if is_received:
        return f"`{shape_text(use.response)}`"
    parts = {"": use.request, "response ": use.response, "feedback ": use.feedback}
    return ", ".join(f"{name}`{shape_text(shape)}`" for name, shape in parts.items() if shape is not Leaf.NOTHING)


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
