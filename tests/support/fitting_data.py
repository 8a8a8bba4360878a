"""Random data that fits the types of a model."""

from random import Random
from typing import Any

from robosc.expressions import ArrayType, BooleanType, DoubleType, EnumType, IntegerType, ObjectType, StringType, Type
from robosc.model.structure import EventKind, Model, is_tau


def fitting(dice: Random, model: Model, type_: Type | None, *, complete: bool = False) -> Any:
    """Data of a type, as a sensor would send it.

    Args:
        dice: Dice that choose it.
        model: Model that has the type.
        type_: The type; None: there is no data.
        complete: True if objects have all their properties.
    """

    def part_of(type_: Type) -> Any:
        return fitting(dice, model, type_, complete=complete)

    match type_:
        case ObjectType(name=name):
            parts = next(item.properties for item in model.objects if item.name == name)
            return {part.name: part_of(part.type) for part in parts if complete or dice.random() < 0.9}
        case ArrayType(element=element):
            return [part_of(element) for _ in range(dice.randint(0, 3))]
        case EnumType(name=name):
            return part_of(next(item.source for item in model.enums if item.name == name))
        case BooleanType():
            return dice.random() < 0.5
        case IntegerType():
            return dice.choice([-1, 0, 1, 2, 3, 7, 100])
        case DoubleType():
            return dice.choice([0.0, 0.5, -1.5, 3, 1e9])
        case StringType():
            return dice.choice(["x", "other words", ""])
        case _:
            return None


def received(model: Model, event: str) -> Type | None:
    """The type of an event's data; None: it has none."""
    if is_tau(event):
        return None
    name, _, kind = event.partition(".")
    return model.communication(name).received_type(EventKind(kind))
