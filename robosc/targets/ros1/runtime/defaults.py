"""
Test whether all fields of a message have their defaults.

The header does not count.

Messages are compared field by field, because received messages have tuples and bytes where a new
message has lists.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from typing import Any

_HEADER = 'std_msgs/Header'


def is_default(message: Any) -> bool:
    """Return True if every field of a message, its header apart, has its default."""
    default = type(message)()
    return all(
        _is_same(getattr(message, name), getattr(default, name))
        for index, name in enumerate(message.__slots__)
        if message._slot_types[index] != _HEADER
    )


def _is_same(left: Any, right: Any) -> bool:
    if hasattr(left, '_slot_types'):
        return all(_is_same(getattr(left, name), getattr(right, name)) for name in left.__slots__)
    if isinstance(left, (str, bytes)) or not hasattr(left, '__len__'):
        return bool(left == right)
    return len(left) == len(right) and all(map(_is_same, left, right))
