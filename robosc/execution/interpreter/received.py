"""Received data as a model sees it: properties, elements, ranges, enums.

Whatever the data is, nothing here raises but `MissingData`.
"""

from collections.abc import Iterable, Mapping
from typing import Any

from robosc.execution.interpreter.functions import Function, Path, function_of
from robosc.execution.runtime.given import given, given_boolean, given_integer
from robosc.execution.runtime.protocol import Reading
from robosc.expressions import (
    ArrayType,
    BooleanType,
    DoubleType,
    EnumType,
    IntegerType,
    ObjectType,
    StringType,
    Type,
    values,
)
from robosc.model.structure import EnumDefinition, Model

_NO_STATE: Mapping[Any, Any] = {}


class EnumChoice(str):
    """A value of an enum, given directly: the rules of the enum do not apply."""

    __slots__ = ()


class Reader:
    """Converter of received data of one model."""

    def __init__(self, model: Model) -> None:
        self._properties = {item.name: {part.name: part.type for part in item.properties} for item in model.objects}
        self._enums = {item.name: _CompiledEnum(item) for item in model.enums}

    def read(self, root: Type | None, paths: tuple[Path, ...], raw: Any) -> Reading:
        """Return the values of paths of received data.

        Args:
            root: The declared type of the data, or None if the event carries none.
            paths: Paths to read.
            raw: Data as it was received, of any type.
        """
        datum = _Datum(self, root, raw)
        found = {path: datum.value(path) for path in paths}
        return Reading(
            values=found,
            # Arrays can be long, and what is made of them is logged anyway.
            data={path_text(path): value for path, value in found.items() if not datum.is_array(path)},
            unknown=tuple(datum.unknown),
            enum_unknown=datum.enum_unknown,
        )

    def require(self, required: Iterable[tuple[Path, Type]], raw: Any) -> None:
        """Do nothing if the parts of data that cannot be unknown by their types are given.

        Raises:
            MissingData: One of them is not.
        """
        for path, type_ in required:
            value = _given_at(raw, path)
            match type_:
                case _ if isinstance(value, EnumChoice):
                    # A value of an enum is made of nothing.
                    pass
                case BooleanType():
                    given_boolean(value, path_text(path))
                case IntegerType():
                    given_integer(value, path_text(path))
                case _:
                    given(value, path_text(path))

    def step(self, type_: Type | None, step: str | int) -> Type | None:
        """The type of a part, or None if there is no such part."""
        match type_:
            case ObjectType(name=name) if isinstance(step, str):
                return self._properties[name].get(step)
            case ArrayType(element=element) if isinstance(step, int):
                return element
            case _:
                return None

    def properties(self, name: str) -> Mapping[str, Type]:
        """The properties of an object, by name."""
        return self._properties[name]

    def enum(self, name: str) -> "_CompiledEnum":
        """The definition of an enum."""
        return self._enums[name]


class _CompiledEnum:
    def __init__(self, definition: EnumDefinition) -> None:
        self.source = definition.source
        self.default = definition.default
        self.rules: tuple[tuple[Function, str], ...] = tuple(
            (function_of(rule.condition), rule.value) for rule in definition.rules
        )


class _Datum:
    """One received datum while it is read.

    Attributes:
        unknown: Parts that were unknown or moved into their range, in words.
        enum_unknown: True if an enum fell to its default although an earlier rule was unknown.
    """

    def __init__(self, reader: Reader, root: Type | None, raw: Any) -> None:
        self._reader = reader
        self._root = root
        self._raw = raw
        self._known: dict[Path, Any] = {}
        self.unknown: list[str] = []
        self.enum_unknown = False

    def value(self, path: Path) -> Any:
        """The value at a path, or None where it is unknown; each path is converted once."""
        if path not in self._known:
            raw, type_ = self._raw, self._root
            for step in path:
                raw, type_ = values.received_part(raw, step), self._reader.step(type_, step)
            self._known[path] = self._convert(raw, type_, path)
        return self._known[path]

    def is_array(self, path: Path) -> bool:
        """Return True if there is an array at a path."""
        type_ = self._root
        for step in path:
            type_ = self._reader.step(type_, step)
        return isinstance(type_, ArrayType)

    def _convert(self, raw: Any, type_: Type | None, path: Path) -> Any:
        if raw is values.ABSENT:
            return None
        match type_:
            case ArrayType(element=element):
                elements = whole_array(raw)
                if elements is None:
                    return None
                return [self._convert(item, element, (*path, index)) for index, item in enumerate(elements)]
            case ObjectType(name=name):
                parts = self._reader.properties(name)
                return {
                    part: self._convert(values.received_part(raw, part), inner, (*path, part))
                    for part, inner in parts.items()
                }
            case BooleanType():
                return values.read_boolean(raw)
            case IntegerType(low=int(low), high=int(high)):
                return self._in_range(values.read_whole(raw), low, high, path)
            case IntegerType():
                return values.read_integer(raw)
            case DoubleType():
                return values.read_double(raw)
            case StringType():
                return values.read_string(raw)
            case EnumType(name=name):
                return self._enum_value(raw, self._reader.enum(name), path)
            case _:
                return None

    def _in_range(self, value: int | None, low: int, high: int, path: Path) -> int | None:
        """A number of a declared range; a number outside is moved to the nearest bound."""
        if value is None:
            return None
        clamped = min(max(value, low), high)
        if clamped != value:
            self.unknown.append(f"{path_text(path)} is {value}, outside {low}..{high}")
        return clamped

    def _enum_value(self, raw: Any, enum: _CompiledEnum, path: Path) -> str:
        """The value of the first rule that is true, else the default."""
        if isinstance(raw, EnumChoice):
            return str(raw)
        source = _Datum(self._reader, enum.source, raw)
        value, was_unknown = enum.default, False
        for condition, result in enum.rules:
            outcome = condition(_NO_STATE, source.value)
            if outcome is True:
                value, was_unknown = result, False
                break
            was_unknown = was_unknown or outcome is None
        self.unknown += source.unknown
        self.enum_unknown = self.enum_unknown or source.enum_unknown or was_unknown
        if was_unknown:
            self.unknown.append(f"{path_text(path)} is {value} by default: an earlier rule is unknown")
        return value


def _given_at(raw: Any, path: Path) -> Any:
    """The raw datum at a path; an enum's value where one was given above it."""
    for step in path:
        if isinstance(raw, EnumChoice):
            break
        raw = values.received_part(raw, step)
    return raw


def whole_array(raw: Any) -> list[Any] | None:
    """The elements of a received array; None if the data is no array."""
    try:
        return values.array_part(raw)  # type: ignore[no-any-return]
    except Exception:
        # Foreign objects may do anything when they are asked for a part; to us it is then unknown.
        return None


def path_text(path: Path) -> str:
    """A path as a user writes it: `value.ranges[0]`."""
    return "value" + "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)
