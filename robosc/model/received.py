"""Parts of received data that are converted when an event happens: the same in every executor."""

from collections.abc import Iterator

from robosc.errors import InternalError
from robosc.expressions import ArrayType, EnumType, Expression, ObjectType, PathStep, Received, Type, leaves
from robosc.model.structure import EventKind, Model, is_tau

Path = tuple[PathStep, ...]


def converted_paths(model: Model, event: str) -> tuple[Path, ...]:
    """Return the parts that updates on an event read, then every other enum that it carries, each part once.

    An enum is converted whether an update reads it or not: only then is it noticed that a datum leaves it
    unknown. Elements of arrays, of which there may be any number, only count where they are read.
    """
    return tuple(dict.fromkeys((*_read_paths(model, event), *_enum_paths(model, event))))


def received_paths(expression: Expression) -> tuple[Path, ...]:
    """The parts of received data that an expression reads, each once."""
    return tuple(dict.fromkeys(leaf.path for leaf in leaves(expression) if isinstance(leaf, Received)))


def _read_paths(model: Model, event: str) -> Iterator[Path]:
    for component in model.components:
        for transition in component.behaviour.transitions if component.behaviour else ():
            if transition.event == event:
                for update in transition.updates:
                    yield from received_paths(update.expression)


def _enum_paths(model: Model, event: str) -> Iterator[Path]:
    if is_tau(event):
        return
    name, _, kind = event.partition(".")
    received = model.communication(name).received_type(EventKind(kind))
    if received is not None:
        yield from _enums_in(model, received, ())


def _enums_in(model: Model, type_: Type, path: Path) -> Iterator[Path]:
    match type_:
        case EnumType():
            yield path
        case ObjectType(name=name):
            for item in model.object(name).properties:
                yield from _enums_in(model, item.type, (*path, item.name))


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
