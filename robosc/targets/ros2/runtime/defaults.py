"""
Test whether all fields of a message have their defaults.

The header does not count.

Messages are compared field by field, because rclpy's own comparison of fixed-size arrays is not
reliable.

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
        for name, field_type in message.get_fields_and_field_types().items()
        if field_type != _HEADER
    )


def _is_same(left: Any, right: Any) -> bool:
    if hasattr(left, 'get_fields_and_field_types'):
        return all(
            _is_same(getattr(left, name), getattr(right, name))
            for name in left.get_fields_and_field_types()
        )
    if isinstance(left, (str, bytes)) or not hasattr(left, '__len__'):
        return bool(left == right)
    return len(left) == len(right) and all(map(_is_same, left, right))
