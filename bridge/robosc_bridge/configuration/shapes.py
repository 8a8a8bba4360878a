"""Shapes of data, and whether the types of a model fit them: the fields that it names must be there."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum

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
from robosc.model.structure import Model


class Leaf(StrEnum):
    """Data without parts."""

    NUMBER = "number"
    BOOLEAN = "boolean"
    TEXT = "text"
    NOTHING = "nothing"
    ANYTHING = "anything"


@dataclass(frozen=True, slots=True)
class Fields:
    """Data with named parts."""

    parts: Mapping[str, "Shape"]


@dataclass(frozen=True, slots=True)
class Array:
    """Any number of equal parts."""

    element: "Shape"


@dataclass(frozen=True, slots=True)
class OneOf:
    """Data that can be given in several shapes, the usual one first."""

    shapes: tuple["Shape", ...]


Shape = Leaf | Fields | Array | OneOf


class Direction(StrEnum):
    """Direction in which data goes."""

    TO_MODEL = "to the model"
    TO_ROBOT = "to the robot"


def mismatches(model: Model, type_: Type, shape: Shape, direction: Direction) -> tuple[str, ...]:
    """Return the reasons why a type does not fit a shape, part by part; empty: it fits.

    Args:
        model: Model that the type belongs to.
        type_: Type that the model reads or gives. A message without data can be reported by any data, but not the
            reverse.
        shape: Shape of the data that the channel has or takes.
        direction: Direction of the data. Numbers of the model may be integers on the way to the robot; the reverse
            would cut them.
    """
    if direction is Direction.TO_MODEL and isinstance(type_, NoneType):
        return ()
    return tuple(_mismatches(model, type_, shape, direction, ""))


def shape_text(shape: Shape) -> str:
    """A shape for a person: `{linear: {x: number}}`."""
    match shape:
        case Fields(parts=parts):
            return "{" + ", ".join(f"{name}: {shape_text(part)}" for name, part in parts.items()) + "}"
        case Array(element=element):
            return f"array of {shape_text(element)}"
        case OneOf(shapes=shapes):
            return " or ".join(map(shape_text, shapes))
    return str(shape)


def _mismatches(model: Model, type_: Type, shape: Shape, direction: Direction, path: str) -> Iterator[str]:
    if shape is Leaf.ANYTHING:
        return
    if isinstance(shape, OneOf):
        found = [tuple(_mismatches(model, type_, item, direction, path)) for item in shape.shapes]
        if all(found):
            yield from found[0]
        return
    match type_, shape:
        case EnumType(name=name), _ if direction is Direction.TO_MODEL:
            yield from _mismatches(model, model.enum(name).source, shape, direction, path)
        case ObjectType(name=name), Fields(parts=parts):
            for item in model.object(name).properties:
                place = f"{path}.{item.name}" if path else item.name
                if item.name in parts:
                    yield from _mismatches(model, item.type, parts[item.name], direction, place)
                else:
                    yield f"has no field '{place}'; there is {', '.join(parts)}"
        case ArrayType(element=element), Array(element=inner):
            yield from _mismatches(model, element, inner, direction, f"{path}[]")
        case _ if not _is_same(type_, shape, direction):
            place = f"'{path}' is {shape_text(shape)}" if path else f"the data is {shape_text(shape)}"
            yield f"{place}, not {_text(model, type_)}"


def _is_same(type_: Type, shape: Shape, direction: Direction) -> bool:
    match type_:
        case BooleanType():
            return shape is Leaf.BOOLEAN
        case IntegerType():
            return shape is Leaf.NUMBER and direction is Direction.TO_ROBOT
        case DoubleType():
            return shape is Leaf.NUMBER
        case StringType():
            return shape is Leaf.TEXT
        case NoneType():
            return shape is Leaf.NOTHING
    return False


def _text(model: Model, type_: Type) -> str:
    if isinstance(type_, ObjectType):
        return "{" + ", ".join(item.name for item in model.object(type_.name).properties) + "}"
    return "nothing" if isinstance(type_, NoneType) else type_text(type_)
