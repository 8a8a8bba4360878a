"""Checks of the plain data that programs send: its kind, and its fit to the model and the channel."""

import sys
from collections.abc import Iterator
from typing import Any

from robosc.expressions import (
    ArrayType,
    BooleanType,
    DoubleType,
    EnumType,
    IntegerType,
    ObjectType,
    StringType,
    Type,
)
from robosc.model.structure import Model
from robosc_bridge.configuration.shapes import Array, Direction, Fields, Leaf, OneOf, Shape, mismatches, shape_text

_WORDS: dict[type, str] = {
    BooleanType: "true or false",
    IntegerType: "a whole number",
    DoubleType: "a number",
    StringType: "a text",
}
_DEFAULTS: dict[type, Any] = {BooleanType: False, IntegerType: 0, DoubleType: 0.0, StringType: ""}

MAXIMUM_PARTS = 20_000
MAXIMUM_DEPTH = 20
MAXIMUM_TEXT = 65_536
"""Characters of one text."""
_MAXIMUM_BITS = 64


def why_not_plain(data: Any) -> str:
    """Return the reason why data of a program is refused as a whole.

    One sentence; empty: the data is plain and of a reasonable size.
    """
    waiting, parts = [(data, 0)], 0
    while waiting:
        value, depth = waiting.pop()
        parts += 1
        if parts > MAXIMUM_PARTS:
            return f"the data has more than {MAXIMUM_PARTS} parts"
        if depth > MAXIMUM_DEPTH:
            return f"the data is nested more than {MAXIMUM_DEPTH} deep"
        if isinstance(value, dict):
            if not all(isinstance(key, str) and len(key) <= MAXIMUM_TEXT for key in value):
                return f"the data has a name that is not a text of at most {MAXIMUM_TEXT} characters"
            waiting.extend((part, depth + 1) for part in value.values())
        elif isinstance(value, list):
            waiting.extend((part, depth + 1) for part in value)
        elif isinstance(value, str):
            if len(value) > MAXIMUM_TEXT:
                return f"the data has a text of more than {MAXIMUM_TEXT} characters"
        elif isinstance(value, int):
            if value.bit_length() > _MAXIMUM_BITS:
                return f"the data has a number of more than {_MAXIMUM_BITS} bits"
        elif value is not None and not isinstance(value, float):
            return "the data is not plain"
    return ""


def weight_bytes(data: Any) -> int:
    """Return the memory that plain data takes, in bytes; parts that are the same object count each time."""
    waiting, found = [data], 0
    while waiting:
        value = waiting.pop()
        found += sys.getsizeof(value)
        if isinstance(value, dict):
            waiting.extend(value)
            waiting.extend(value.values())
        elif isinstance(value, list | tuple):
            waiting.extend(value)
    return found


def why_not_shaped(shape: Shape, data: Any) -> str:
    """Return the reason why data does not have the shape of a channel, one sentence; empty: it has.

    A part that is left out, or None, is the default.

    Args:
        shape: Shape of the channel.
        data: Plain data.
    """
    return next(_misshaped(shape, data, ""), "")


def why_not_typed(model: Model, type_: Type | None, data: Any) -> str:
    """Return the reason why data does not have the type that a model expects, one sentence; empty: it has.

    Parts that the model does not name are not judged.

    Args:
        model: Model that the type belongs to.
        type_: Type that is expected; None: nothing, so that no data is wrong.
        data: Plain data.
    """
    return next(_mistyped(model, type_, data, ""), "")


def completed(model: Model, type_: Type | None, data: Any) -> Any:
    """Return the same data with the parts that a model names and the data leaves out: zero, false, empty.

    Args:
        model: Model that the type belongs to.
        type_: Type that is expected.
        data: Plain data of that type.
    """
    match type_:
        case EnumType(name=name):
            return completed(model, model.enum(name).source, data)
        case ObjectType(name=name):
            given = data or {}
            named = {
                item.name: completed(model, item.type, given.get(item.name)) for item in model.object(name).properties
            }
            return {**given, **named}
        case ArrayType(element=element):
            return [completed(model, element, part) for part in data or ()]
    return _DEFAULTS.get(type(type_)) if data is None else data


def accepted(model: Model, type_: Type | None, shape: Shape) -> Shape:
    """Return the shape of a channel that the type of a model has, if the channel accepts several shapes.

    So the wheels act on the same data that the model reads.

    Args:
        model: Model that the type belongs to.
        type_: Type that the model reads.
        shape: Shape of the channel.
    """
    if isinstance(shape, OneOf) and type_ is not None:
        return OneOf(tuple(item for item in shape.shapes if not mismatches(model, type_, item, Direction.TO_ROBOT)))
    return shape


def _misshaped(shape: Shape, data: Any, path: str) -> Iterator[str]:
    if data is None or shape is Leaf.ANYTHING:
        return
    match shape:
        case OneOf(shapes=shapes):
            found = [next(_misshaped(item, data, path), None) for item in shapes]
            if all(found):
                yield found[0] if len(set(found)) == 1 and found[0] else _wrong(path, shape_text(shape))
        case Fields(parts=parts) if isinstance(data, dict):
            for name, part in data.items():
                if name in parts:
                    yield from _misshaped(parts[name], part, _joined(path, name))
                else:
                    yield f"there is no field '{_joined(path, name):.200}'; there is {', '.join(parts)}"
        case Array(element=element) if isinstance(data, list):
            for place, part in enumerate(data):
                yield from _misshaped(element, part, f"{path}[{place}]")
        case Leaf() if _is_leaf(shape, data):
            return
        case _:
            yield _wrong(path, shape_text(shape))


def _is_leaf(leaf: Leaf, data: Any) -> bool:
    match leaf:
        case Leaf.NUMBER:
            return is_number(data)
        case Leaf.BOOLEAN:
            return isinstance(data, bool)
        case Leaf.TEXT:
            return isinstance(data, str)
    return leaf is Leaf.NOTHING and data == {}


def _mistyped(model: Model, type_: Type | None, data: Any, path: str) -> Iterator[str]:
    if data is None:
        return
    match type_:
        case EnumType(name=name):
            yield from _mistyped(model, model.enum(name).source, data, path)
        case ObjectType(name=name) if isinstance(data, dict):
            for item in model.object(name).properties:
                yield from _mistyped(model, item.type, data.get(item.name), _joined(path, item.name))
        case ArrayType(element=element) if isinstance(data, list):
            for place, part in enumerate(data):
                yield from _mistyped(model, element, part, f"{path}[{place}]")
        case _ if not _is_value(type_, data):
            yield _wrong(path, _words(model, type_))


def _is_value(type_: Type | None, data: Any) -> bool:
    match type_:
        case BooleanType():
            return isinstance(data, bool)
        case IntegerType():
            return isinstance(data, int) and not isinstance(data, bool)
        case DoubleType():
            return is_number(data)
        case StringType():
            return isinstance(data, str)
    return not isinstance(type_, ObjectType | ArrayType)


def _words(model: Model, type_: Type | None) -> str:
    match type_:
        case ObjectType(name=name):
            return "{" + ", ".join(item.name for item in model.object(name).properties) + "}"
        case ArrayType():
            return "a list"
        case _:
            return _WORDS[type(type_)]


def is_number(data: Any) -> bool:
    """Return True if data is a number; booleans are no numbers."""
    return isinstance(data, int | float) and not isinstance(data, bool)


def _joined(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def _wrong(path: str, expected: str) -> str:
    return f"'{path:.200}' must be {expected}" if path else f"the data must be {expected}"
