"""Paths into received data: their text, and the types of the parts that they lead to."""

from robosc.errors import InternalError
from robosc.expressions import ArrayType, ObjectType, Type
from robosc.model.received import Path
from robosc.model.structure import Model


def path_text(path: Path) -> str:
    """A path as a user writes it: `value.ranges[0]`."""
    return "value" + "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)


def path_type(model: Model, root: Type, path: Path) -> Type:
    """The type at the end of a path."""
    type_ = root
    for step in path:
        match type_, step:
            case ObjectType(name=name), str():
                type_ = next(item.type for item in model.object(name).properties if item.name == step)
            case ArrayType(element=element), int():
                type_ = element
            case _:
                raise InternalError(f"{path_text(path)} does not fit its type")
    return type_
