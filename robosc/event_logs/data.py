"""Data that log entries hold in JSON, as values of the model's types."""

import math
from typing import Any, Final

from robosc.execution.interpreter.received import Reader
from robosc.expressions import (
    BooleanType,
    DoubleType,
    EnumType,
    IntegerType,
    PathStep,
    StringType,
    Type,
    Value,
)
from robosc.model.received import converted_paths
from robosc.model.structure import EventKind, Model, is_tau

Path = tuple[PathStep, ...]

_NOT_FINITE = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}
"""Notation of logs for numbers that JSON lacks."""

_CLOSE = 1e-9
"""Relative difference up to which two doubles are the same: C and Python round differently in the last place."""


class Misfit:
    """Mark for data in the log that is not a value of the type."""


MISFIT: Final = Misfit()


def path_text(path: Path) -> str:
    """Return the name by which a log calls a part of received data: `value.ranges[0]`."""
    return "value" + "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)


def value_of(logged: object, type_: Type | None) -> Value | Misfit | None:
    """A value as the model has it, None if it is unknown, MISFIT if it is none of its type."""
    if logged is None:
        return None
    match type_:
        case BooleanType() if isinstance(logged, bool):
            return logged
        case IntegerType(low=low, high=high) if isinstance(logged, int) and not isinstance(logged, bool):
            is_inside = (low is None or low <= logged) and (high is None or logged <= high)
            return logged if is_inside else MISFIT
        case DoubleType() if isinstance(logged, int | float) and not isinstance(logged, bool):
            return float(logged)
        case DoubleType() if isinstance(logged, str) and logged in _NOT_FINITE:
            return _NOT_FINITE[logged]
        case StringType() if isinstance(logged, str):
            return logged
        case EnumType(values=names) if isinstance(logged, str) and logged in names:
            return logged
    return MISFIT


def is_same(logged: object, value: Value | None, type_: Type | None) -> bool:
    """Return True if a log reports exactly this value."""
    found = value_of(logged, type_)
    if isinstance(found, float) and isinstance(value, float):
        return found == value or math.isclose(found, value, rel_tol=_CLOSE, abs_tol=1e-300)
    return type(found) is type(value) and found == value


def is_provided(logged: object, data: object) -> bool:
    """Return True if a log reports exactly this data of a request, property by property.

    Args:
        logged: Data in the log.
        data: Data that the model provides: a value, properties by name, or None.
    """
    if isinstance(data, dict):
        return (
            isinstance(logged, dict)
            and logged.keys() == data.keys()
            and all(is_provided(logged[name], part) for name, part in data.items())
        )
    if isinstance(data, int | float) and not isinstance(data, bool):
        found = _NOT_FINITE.get(logged) if isinstance(logged, str) else logged
        if not isinstance(found, int | float) or isinstance(found, bool):
            return False
        both_nan = math.isnan(found) and math.isnan(data)
        return both_nan or found == data or math.isclose(found, data, rel_tol=_CLOSE, abs_tol=1e-300)
    return type(logged) is type(data) and logged == data


class NotLogged:
    """The log says nothing about it."""


NOT_TOLD: Final = NotLogged()


class Received:
    """Data that events of a model carry, by the entries of a log.

    Executors in Python log the parts that the model reads, converted; nodes in C++ log the message as it came.

    Args:
        model: The model.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self._reader = Reader(model)
        self._paths: dict[str, tuple[Path, ...]] = {}
        self._texts: dict[str, frozenset[str]] = {}

    def value(self, event: str, data: Any, path: Path) -> Any:
        """Return a part of the data that an event carries.

        Args:
            event: An event of the model.
            data: Data in its entry.
            path: Path of the part; one that the model reads.

        Returns:
            The value as the model has it, None if it is unknown, MISFIT if it is none of its type, NOT_TOLD if the
            log leaves it out.
        """
        if event not in self._paths:
            self._paths[event] = converted_paths(self._model, event)
            self._texts[event] = frozenset(map(path_text, self._paths[event]))
        root = self._root(event)
        if isinstance(data, dict) and data.keys() <= self._texts[event]:
            text = path_text(path)
            return value_of(data[text], self._type_at(root, path)) if text in data else NOT_TOLD
        return self._reader.read(root, (path,), _with_numbers(data)).values[path]

    def _root(self, event: str) -> Type | None:
        if is_tau(event):
            return None
        name, _, kind = event.rpartition(".")
        return self._model.communication(name).received_type(EventKind(kind))

    def _type_at(self, root: Type | None, path: Path) -> Type | None:
        for step in path:
            root = self._reader.step(root, step)
        return root


def _with_numbers(data: Any) -> Any:
    """A logged message with the numbers that JSON has none for."""
    if isinstance(data, dict):
        return {name: _with_numbers(part) for name, part in data.items()}
    if isinstance(data, list):
        return [_with_numbers(part) for part in data]
    return _NOT_FINITE.get(data, data) if isinstance(data, str) else data
