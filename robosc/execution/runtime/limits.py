"""
Limits: bounds into which numbers of a request are moved before it goes out.

All limits that apply hold: each number goes to the nearest one that is within the bounds of all of
them. A message is changed in a copy.
"""

from __future__ import annotations

import copy
import math
import numbers
from typing import Any, Dict, Mapping, NamedTuple, Optional, Sequence, Tuple

Bound = Tuple[Tuple[str, ...], float, float]
"""Properties that lead to a number, its lower and its upper bound."""

_NOT_GIVEN = object()


class Limited(NamedTuple):
    """
    A message whose numbers are within their bounds.

    :ivar message: The message; the one that was given if nothing was moved.
    :ivar moved: Descriptions of the numbers that were moved, such as `linear.x: 0.5 -> 0.1`.
    """

    message: Any
    moved: Tuple[str, ...]


def limited(message: Any, bounds: Sequence[Bound]) -> Optional[Limited]:
    """
    Return a message with its numbers moved into their bounds.

    A number that is not given is 0, as in a message of the middleware.

    :param message: Mapping or object with the properties, a plain number, or None for no data.
    :param bounds: Bounds that apply; several of one number may be among them.
    :returns: None if no number is within the bounds of all, or what should be a number is none.
    """
    moved = []
    for path, (low, high) in _joint_bounds(bounds).items():
        given = _number_at(message, path)
        value = 0 if given is _NOT_GIVEN or given is None else given
        if low > high or not _is_finite_number(value):
            return None
        if not low <= value <= high:
            target = low if value < low else high
            message = _with_number(message, path, target)
            moved.append('{}: {} -> {}'.format('.'.join(path) or 'value', value, target))
    return Limited(message, tuple(moved))


def is_within(message: Any, bounds: Sequence[Bound]) -> bool:
    """Return True if all numbers of a message are within their bounds."""
    found = limited(message, bounds)
    return found is not None and not found.moved


def _joint_bounds(bounds: Sequence[Bound]) -> Dict[Tuple[str, ...], Tuple[float, float]]:
    """Return the bounds that hold together for each number."""
    found: Dict[Tuple[str, ...], Tuple[float, float]] = {}
    for path, low, high in bounds:
        lowest, highest = found.get(path, (low, high))
        found[path] = (max(low, lowest), min(high, highest))
    return found


def _is_finite_number(value: Any) -> bool:
    return isinstance(value, numbers.Real) and not isinstance(value, bool) and math.isfinite(value)


def _number_at(message: Any, path: Tuple[str, ...]) -> Any:
    for name in path:
        if message is None or message is _NOT_GIVEN:
            return _NOT_GIVEN
        if isinstance(message, Mapping):
            message = message.get(name, _NOT_GIVEN)
        else:
            message = getattr(message, name, _NOT_GIVEN)
    return message


def _with_number(message: Any, path: Tuple[str, ...], value: float) -> Any:
    """Return a copy of a message with another number at a path; what is beside it is shared."""
    if not path:
        return value
    name, rest = path[0], path[1:]
    if message is None or isinstance(message, Mapping):
        part = None if message is None else message.get(name)
        return {**(message or {}), name: _with_number(part, rest, value)}
    changed = copy.copy(message)
    part = getattr(message, name)
    if isinstance(part, float):
        value = float(value)  # A message of ROS takes nothing else, whatever the model says.
    setattr(changed, name, _with_number(part, rest, value))
    return changed
