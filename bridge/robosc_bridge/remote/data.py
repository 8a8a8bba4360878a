"""Conversion of plain data to `google.protobuf.Value` and back, within bounds.

All numbers of a `Value` are doubles. A double that is exactly a whole number becomes a whole number here, since whole
numbers of models have 32 bits; a model that reads a double accepts a whole number as well
(`robosc.expressions.values`). NaN and infinities stay.
"""

import math
from typing import Any

from google.protobuf.struct_pb2 import NULL_VALUE, ListValue, Struct, Value

MAXIMUM_DEPTH = 20
MAXIMUM_VALUES = 20_000
MAXIMUM_NAME = 255
"""Bytes of the name of a field."""

_LARGEST_EXACT = 2.0**53


class DataError(ValueError):
    """Data that is refused; one sentence for its sender."""


def plain_of(value: Value) -> Any:
    """Return the plain data of a value: None, booleans, numbers, texts, lists, dicts with texts as keys.

    Raises:
        DataError: The data is nested too deeply, has too many parts or a name that is too long.
    """
    return _Reader().value(value, 0)


class _Reader:
    def __init__(self) -> None:
        self._left = MAXIMUM_VALUES

    def value(self, value: Value, depth: int) -> Any:
        self._left -= 1
        if self._left < 0:
            raise DataError(f"the data has more than {MAXIMUM_VALUES} values")
        match value.WhichOneof("kind"):
            case "number_value":
                return _number(value.number_value)
            case "string_value":
                return value.string_value
            case "bool_value":
                return value.bool_value
            case "list_value":
                self._look_at_depth(depth)
                return [self.value(item, depth + 1) for item in value.list_value.values]
            case "struct_value":
                self._look_at_depth(depth)
                return {_name(name): self.value(item, depth + 1) for name, item in value.struct_value.fields.items()}
            case _:
                return None

    @staticmethod
    def _look_at_depth(depth: int) -> None:
        if depth >= MAXIMUM_DEPTH:
            raise DataError(f"the data is nested deeper than {MAXIMUM_DEPTH} levels")


def _number(value: float) -> float | int:
    return int(value) if -_LARGEST_EXACT <= value <= _LARGEST_EXACT and value.is_integer() else value


def _name(name: str) -> str:
    if len(name.encode()) > MAXIMUM_NAME:
        raise DataError(f"the data has a name of more than {MAXIMUM_NAME} bytes")
    return name


def value_of(data: Any) -> Value:
    """Return the value of plain data.

    Raises:
        TypeError: The data is not plain.
    """
    value = Value()
    _fill(value, data)
    return value


def struct_of(data: dict[str, Any]) -> Struct:
    """Return the struct of plain data; raises as `value_of`."""
    struct = Struct()
    _fill_struct(struct, data)
    return struct


def _fill(value: Value, data: Any) -> None:
    if data is None:
        value.null_value = NULL_VALUE
    elif isinstance(data, bool):
        value.bool_value = data
    elif isinstance(data, int | float):
        value.number_value = _double(data)
    elif isinstance(data, str):
        value.string_value = text_of(data)
    elif isinstance(data, dict):
        _fill_struct(value.struct_value, data)
    elif isinstance(data, list | tuple):
        _fill_list(value.list_value, data)
    else:
        raise TypeError(f"{type(data).__name__} is not plain data")


def _fill_struct(struct: Struct, data: dict[str, Any]) -> None:
    # Also an empty one is to be there.
    struct.SetInParent()
    for name, item in data.items():
        _fill(struct.fields[text_of(name)], item)


def _fill_list(values: ListValue, data: list[Any] | tuple[Any, ...]) -> None:
    values.SetInParent()
    for item in data:
        _fill(values.values.add(), item)


def _double(number: float) -> float:
    try:
        return float(number)
    except OverflowError:
        return math.inf if number > 0 else -math.inf


def text_of(text: str) -> str:
    """Return a text that protobuf accepts: halves of surrogate pairs, as in names of files, become question marks."""
    return text if text.isascii() else text.encode("utf-8", "replace").decode()
