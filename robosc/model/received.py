"""Parts of received data that are converted when an event happens: the same in every executor."""

from collections.abc import Iterator, Mapping

from robosc.errors import InternalError
from robosc.expressions import (
    ArrayType,
    Binary,
    BooleanType,
    Conditional,
    Constant,
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    ObjectType,
    PathStep,
    Received,
    StateTest,
    Type,
    Unary,
    VariableRead,
    leaves,
)
from robosc.model.structure import EventKind, Model, Update, is_tau

Path = tuple[PathStep, ...]


def converted_paths(model: Model, event: str) -> tuple[Path, ...]:
    """Return the parts that updates on an event read, then every other enum that it carries, each part once.

    An enum is converted whether an update reads it or not: only then is it noticed that a datum leaves it
    unknown. Elements of arrays, of which there may be any number, only count where they are read.
    """
    return tuple(dict.fromkeys((*_read_paths(model, event), *_enum_paths(model, event))))


def required_parts(model: Model, event: str) -> tuple[tuple[Path, Type], ...]:
    """Return the converted parts of an event's data that cannot be unknown by their types, with these types.

    Every message has a boolean, an integer of a range and what an enum is made of; with the latter, such parts that the
    rules of the enum read. A number may be no number, or too large for an integer, and an element may lie outside its
    array: elements, and what they are made of, are left out.
    """
    if is_tau(event):
        return ()
    name, _, kind = event.partition(".")
    received = model.communication(name).received_type(EventKind(kind))
    if received is None:
        return ()
    paths = converted_paths(model, event)
    return tuple(dict.fromkeys(part for path in paths for part in required_at(model, received, path)))


def required_at(model: Model, root: Type, path: Path, base: Path = ()) -> Iterator[tuple[Path, Type]]:
    """Yield the parts that cannot be unknown and that the value at a path of a datum is made of, itself included.

    Args:
        model: The model.
        root: Type of the datum.
        path: The path.
        base: Path of the datum itself, with which the result's paths begin.
    """
    if any(isinstance(step, int) for step in path):
        return
    type_ = path_type(model, root, path)
    match type_:
        case BooleanType():
            yield (*base, *path), type_
        case IntegerType() if type_.is_bounded:
            yield (*base, *path), type_
        case EnumType(name=enum):
            yield (*base, *path), type_
            definition = model.enum(enum)
            for rule in definition.rules:
                for part in received_paths(rule.condition):
                    yield from required_at(model, definition.source, part, (*base, *path))


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


def sure_updates(model: Model) -> tuple[tuple[str, str], ...]:
    """Return the updates of synthesis variables by received data that is never unknown: event and variable.

    Synthesis counts on them: the variable is named with its component.
    """
    found: dict[tuple[str, str], bool] = {}
    for component in model.components:
        behaviour = component.behaviour
        kept = {item.name: item.type for item in behaviour.variables if item.is_synthesis} if behaviour else {}
        for transition in behaviour.transitions if behaviour else ():
            for update in transition.updates:
                if update.variable in kept and received_paths(update.expression):
                    key = transition.event, f"{component.name}.{update.variable}"
                    is_sure = _is_sure(update.expression) and _fits(model, transition.event, update, kept)
                    found[key] = found.get(key, True) and is_sure
    return tuple(key for key, is_sure in found.items() if is_sure)


def _is_sure(expression: Expression) -> bool:
    """Return True if an expression over finite data is known by its form: it copies, compares, or joins conditions."""
    match expression:
        case Received(path=path):
            return not any(isinstance(step, int) for step in path)
        case Unary(operator="not" | "holds", operand=operand):
            return _is_sure(operand)
        case Binary(operator="and" | "or" | "implies" | "=" | "!=" | "<" | "<=" | ">" | ">="):
            return _is_sure(expression.left) and _is_sure(expression.right)
        case Conditional(condition=condition, then=then, otherwise=otherwise):
            return all(map(_is_sure, (condition, then, otherwise)))
        case _:
            return isinstance(expression, Constant | EnumValue | VariableRead | StateTest)


def _fits(model: Model, event: str, update: Update, types: Mapping[str, Type]) -> bool:
    """Return True if no value leaves the variable's range; in doubt False."""
    wanted = types[update.variable]
    if not isinstance(wanted, IntegerType):
        return True
    name, _, kind = event.partition(".")
    root = model.communication(name).received_type(EventKind(kind))
    if root is None or not isinstance(update.expression, Received):
        return False
    match wanted, path_type(model, root, update.expression.path):
        case IntegerType(low=int(low), high=int(high)), IntegerType(low=int(least), high=int(greatest)):
            return low <= least and greatest <= high
        case _:
            return False


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
