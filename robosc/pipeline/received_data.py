"""Data of events: checked when a person gives it, drawn at random, and described for a form."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from random import Random
from typing import Any

import msgspec

from robosc.errors import RoboscError
from robosc.execution.interpreter.received import EnumChoice
from robosc.expressions import (
    MAXIMUM_INTEGER,
    MINIMUM_INTEGER,
    ArrayPart,
    ArrayType,
    BooleanType,
    Constant,
    DoubleType,
    EnumType,
    IntegerType,
    NoneType,
    ObjectType,
    PathStep,
    Received,
    StringType,
    Type,
    type_text,
    values,
)
from robosc.model.findings import did_you_mean
from robosc.model.received import converted_paths, required_parts
from robosc.model.structure import EventKind, Model, is_tau

_BOOLEANS = ("false", "true")

MAXIMUM_ELEMENTS = 1000
"""Number of elements of a random array: elements beyond it are unknown."""


class DataError(RoboscError, ValueError):
    """Data that does not fit an event; the message says which data fits."""


class _NoData:
    """Placeholder for data that was not given; None means unknown data."""

    def __repr__(self) -> str:
        return "NO_DATA"


NO_DATA = _NoData()


def received_type(model: Model, event: str) -> Type | None:
    """The declared type of the data that comes with an event, or None."""
    if is_tau(event):
        return None
    name, _, kind = event.partition(".")
    type_ = model.communication(name).received_type(EventKind(kind))
    return None if isinstance(type_, NoneType) else type_


@dataclass(frozen=True, slots=True)
class DataField:
    """A part of the data that comes with an event, which a person can enter.

    Attributes:
        path: Names of the properties that lead to it; empty for the whole data.
        type: Its declared type, in the model's words.
        choices: Names of its values, for an enum or boolean; else empty.
        is_number: True if it is a number.
        is_read: True if the model reads it.
        is_required: True if it cannot be unknown: data without it is refused.
    """

    path: tuple[str, ...]
    type: str
    choices: tuple[str, ...]
    is_number: bool
    is_read: bool
    is_required: bool

    @property
    def name(self) -> str:
        """Its name in the data: `value.front`."""
        return ".".join(("value", *self.path))

    def as_json(self) -> dict[str, object]:
        """Description for a form as JSON values."""
        return {
            "path": list(self.path),
            "type": self.type,
            "choices": list(self.choices),
            "is_boolean": self.choices == _BOOLEANS,
            "is_required": self.is_required,
        }


def data_fields(model: Model, event: str) -> tuple[DataField, ...]:
    """The parts of the data of an event, in the model's order; none if it carries no data."""
    type_ = received_type(model, event)
    if type_ is None:
        return ()
    read = {tuple(step for step in path if isinstance(step, str)) for path in converted_paths(model, event)}
    required = {path for path, _ in required_parts(model, event)}
    return tuple(
        data_field(path, part, is_read=any(other[: len(path)] == path for other in read), is_required=path in required)
        for path, part in _parts(model, type_, ())
    )


def _parts(model: Model, type_: Type, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Type]]:
    match type_:
        case ObjectType(name=name):
            for item in model.object(name).properties:
                yield from _parts(model, item.type, (*path, item.name))
        case _:
            yield path, type_


def data_field(
    path: tuple[str, ...],
    type_: Type,
    *,
    is_read: bool,
    is_required: bool,
    text: Callable[[Type], str] = type_text,
) -> DataField:
    """Return the part of a datum at a path, whose type has no parts itself; `text` writes the type."""
    match type_:
        case EnumType(values=names):
            choices = tuple(names)
        case BooleanType():
            choices = _BOOLEANS
        case _:
            choices = ()
    return DataField(path, text(type_), choices, isinstance(type_, IntegerType | DoubleType), is_read, is_required)


def one_datum(event: str, data: object, fields: Mapping[str, object]) -> object:
    """Return the data of an event that was given as one value or as keywords.

    Raises:
        DataError: Both were given.
    """
    if fields and data is not NO_DATA:
        raise DataError(f"the data of '{event}' is given either as one value or as keywords, not as both")
    return fields or data


class GivenData:
    """Check of data from a person against the types of the model.

    Args:
        model: The model.
        event: An event of it.
    """

    def __init__(self, model: Model, event: str) -> None:
        self._objects = {item.name: {part.name: part.type for part in item.properties} for item in model.objects}
        self._enums = {item.name: item for item in model.enums}
        self._event = event

    def value(self, type_: Type, given: object, path: str = "value") -> object:
        """A value in the form that the interpreter reads.

        Args:
            type_: Its declared type.
            given: The value as it was given; None: unknown.
            path: Its place in the data, for messages.

        Raises:
            DataError: The value does not have that type.
        """
        if given is None:
            return None
        match type_:
            case ObjectType(name=name):
                return self._object(type_, self._objects[name], given, path)
            case ArrayType(element=element):
                return self._array(type_, element, given, path)
            case EnumType(name=name):
                return self._enum(type_, self._enums[name].source, given, path)
            case BooleanType():
                fits = values.read_boolean(given) is not None
            case IntegerType():
                fits = values.read_whole(given) is not None
            case DoubleType():
                fits = values.read_double(given) is not None
            case StringType():
                fits = values.read_string(given) is not None
            case _:
                fits = False
        if not fits:
            raise self._wrong(type_, given, path)
        return given

    def _object(self, type_: Type, parts: Mapping[str, Type], given: object, path: str) -> object:
        if not isinstance(given, Mapping):
            raise self._wrong(type_, given, path)
        for name in given:
            if name not in parts:
                near = did_you_mean(str(name), parts)
                hint = f"did you mean '{near}'?" if near else f"there are {', '.join(parts)}"
                raise DataError(f"{path} of '{self._event}' has no property '{name}'; {hint}")
        return {name: self.value(parts[name], item, f"{path}.{name}") for name, item in given.items()}

    def _array(self, type_: Type, element: Type, given: object, path: str) -> object:
        if isinstance(given, str | bytes | Mapping):
            raise self._wrong(type_, given, path)
        try:
            elements = list(given)  # type: ignore[call-overload]  # whatever it is, it is asked for its elements
        except TypeError:
            raise self._wrong(type_, given, path) from None
        return [self.value(element, item, f"{path}[{index}]") for index, item in enumerate(elements)]

    def _enum(self, type_: EnumType, source: Type, given: object, path: str) -> object:
        if isinstance(given, str):
            if given in type_.values:
                return EnumChoice(given)
            if not isinstance(source, StringType):
                near = did_you_mean(given, type_.values)
                hint = f"did you mean '{near}'?" if near else f"there are {', '.join(type_.values)}"
                raise DataError(f"{path} of '{self._event}' is {given!r:.100}, which is not {type_text(type_)}; {hint}")
        try:
            return self.value(source, given, path)
        except DataError as error:
            raise DataError(f"{error}, or one of {', '.join(type_.values)}") from None

    def _wrong(self, type_: Type, given: object, path: str) -> DataError:
        parts = self._objects.get(type_.name) if isinstance(type_, ObjectType) else None
        wanted = type_text(type_) + (f" with {', '.join(parts)}" if parts else "")
        return DataError(f"{path} of '{self._event}' is {given!r:.100}, and must be {wanted}")


class RandomData:
    """Random data of events, in which every part that the model reads is known.

    For an enum, one of its values is drawn. For a number, one near to a constant of the model is drawn, because
    comparisons change there.

    Args:
        model: The model.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        constants = [node.value for node in _nodes(model) if isinstance(node, Constant)]
        numbers = {item for item in constants if isinstance(item, int | float) and not isinstance(item, bool)}
        self._doubles = sorted({0.0, *(float(item) + step for item in numbers for step in (-0.5, 0.0, 0.5))})
        near = {0, *(int(item) + step for item in numbers for step in (-1, 0, 1))}
        self._integers = sorted(item for item in near if MINIMUM_INTEGER <= item <= MAXIMUM_INTEGER)
        self._strings = sorted({"", *(item for item in constants if isinstance(item, str))})
        self._length = min(max(_indices(model), default=0) + 1, MAXIMUM_ELEMENTS)

    def draw(self, event: str, dice: Random) -> object:
        """Data of an event, in the form that a person would give it; NO_DATA if the model reads none."""
        type_ = received_type(self._model, event)
        paths = converted_paths(self._model, event)
        return NO_DATA if type_ is None or not paths else self._draw(type_, paths, dice)

    def _draw(self, type_: Type, paths: Sequence[tuple[PathStep, ...]], dice: Random) -> object:
        """A value whose parts at some paths are known; an empty path means the whole value."""
        match type_:
            case ObjectType(name=name):
                found = {}
                for item in self._model.object(name).properties:
                    below = [path[1:] for path in paths if not path or path[0] == item.name]
                    if below:
                        found[item.name] = self._draw(item.type, below, dice)
                return found
            case ArrayType(element=element):
                below = [path[1:] for path in paths]
                return [self._draw(element, below, dice) for _ in range(self._length + dice.randrange(3))]
            case EnumType(values=names):
                return dice.choice(names)
            case BooleanType():
                return dice.random() < 0.5
            case IntegerType(low=int(low), high=int(high)):
                return dice.randint(low, high)
            case IntegerType():
                return dice.choice(self._integers)
            case DoubleType():
                return dice.choice(self._doubles)
            case _:
                return dice.choice(self._strings)


def _indices(model: Model) -> Iterator[int]:
    """Every index of an array that the model names."""
    for node in _nodes(model):
        match node:
            case Received(path=path):
                yield from (step for step in path if isinstance(step, int))
            case ArrayPart(low=low, high=high):
                yield from (index for index in (low, high) if index is not None)


def _nodes(model: Model) -> Iterator[Any]:
    """Every part of a model, itself included."""
    stack: list[Any] = [model]
    while stack:
        node = stack.pop()
        if isinstance(node, tuple):
            stack += node
        elif isinstance(node, msgspec.Struct):
            yield node
            stack += (getattr(node, name) for name in node.__struct_fields__)
