"""Wheel commands in messages of a model, read from their plain data."""

import math
from collections.abc import Iterator
from typing import Any

from robosc.execution.runtime.protocol import DataDoesNotFit
from robosc_bridge.devices.interface import Velocity


def velocity_of(message: Any) -> Velocity:
    """The velocity that a message of the channel `drive` asks for; what is left out is 0."""
    twist = message if isinstance(message, dict) else {}
    twist = twist.get("twist", twist) or {}
    linear, angular = twist.get("linear") or {}, twist.get("angular") or {}
    return Velocity(float(linear.get("x") or 0.0), float(angular.get("z") or 0.0))


def angle_of(message: Any) -> float:
    """The angle that a message, call or goal of the channel `rotate` asks for, in its unit."""
    if isinstance(message, dict):
        message = message.get("data", message.get("angle"))
    return float(message or 0.0)


def finite(communication: str, data: Any) -> Any:
    """The data itself.

    Raises:
        DataDoesNotFit: A number of it is not finite.
    """
    for number in _numbers(data):
        if not math.isfinite(number):
            raise DataDoesNotFit(f"'{communication}' has a number that is not finite")
    return data


def _numbers(data: Any) -> Iterator[float]:
    if isinstance(data, dict):
        for part in data.values():
            yield from _numbers(part)
    elif isinstance(data, list | tuple):
        for part in data:
            yield from _numbers(part)
    elif isinstance(data, float):
        yield data


def is_default(data: Any) -> bool:
    """Return True if every part is zero, empty or left out."""
    if isinstance(data, dict):
        return all(is_default(part) for part in data.values())
    return not data
