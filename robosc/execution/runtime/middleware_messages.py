"""
Messages of a middleware of any class.

The functions return the fields of a message, and whether every number in it is finite. A message
may be a mapping, an object, a plain value or anything made of these.
"""

from __future__ import annotations

import math
import numbers
from typing import Any, Dict, Iterable, Mapping

MAXIMUM_PARTS = 1000000
"""Maximum number of parts of a message that is examined; a larger one counts as not finite."""

_HARMLESS = (bool, int, str, bytes, bytearray)
_INTEGER_FORMATS = '?cbBhHiIlLqQnN'


def fields_of(message: Any) -> Dict[str, Any]:
    """Return the fields of an object by name; none if it has none, or cannot be asked."""
    try:
        return {name: getattr(message, name) for name in _field_names(message)}
    except Exception:
        return {}


def is_finite(message: Any) -> bool:
    """
    Return True if there is neither a NaN nor an infinity anywhere in a message.

    A message that cannot be examined counts as not finite.
    """
    try:
        return _is_finite(message)
    except Exception:
        # Foreign objects may do anything when they are asked for their parts.
        return False


def _is_finite(message: Any) -> bool:
    waiting = [message]
    # Kept by identity, and kept alive: parts that are made on demand must not share one.
    seen: Dict[int, Any] = {}
    parts = 0
    while waiting:
        value = waiting.pop()
        parts += 1
        if parts > MAXIMUM_PARTS:
            return False
        if value is None or isinstance(value, _HARMLESS):
            continue
        if isinstance(value, numbers.Number):
            if not math.isfinite(value):  # type: ignore[arg-type]  # anything else raises
                return False
        elif id(value) not in seen:
            seen[id(value)] = value
            waiting.extend(_parts(value))
    return True


def _parts(value: Any) -> Iterable[Any]:
    """Return the parts of a value."""
    if isinstance(value, Mapping):
        return value.values()
    if isinstance(value, (list, tuple, set, frozenset)):
        return value
    try:
        view = memoryview(value)
    except TypeError:
        return list(value) if hasattr(type(value), '__iter__') else _required_fields(value)
    # Long arrays of whole numbers, such as pictures, need not be looked through.
    return () if view.format.lstrip('@=<>!') in _INTEGER_FORMATS else value.tolist()


def _required_fields(message: Any) -> Iterable[Any]:
    return [getattr(message, name) for name in _field_names(message)]


def _field_names(message: Any) -> Iterable[str]:
    """Names of the fields of a message: as ROS lists them, else its attributes."""
    kind = type(message)
    if hasattr(kind, 'get_fields_and_field_types'):
        return tuple(kind.get_fields_and_field_types())
    slots = [name for base in kind.__mro__ for name in _slots(base)]
    return tuple(
        name for name in (*getattr(message, '__dict__', ()), *slots) if hasattr(message, name)
    )


def _slots(kind: Any) -> Iterable[str]:
    slots = kind.__dict__.get('__slots__', ())
    names = (slots,) if isinstance(slots, str) else tuple(slots)
    return tuple(name for name in names if not name.startswith('__'))
