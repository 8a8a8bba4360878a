"""
Check of the parameter that says who starts a node: the node itself, or its lifecycle manager.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from typing import Any

from robosc.targets.ros.runtime.parameters import AUTOSTART, ParameterError

__all__ = ['AUTOSTART', 'valid_autostart']


def valid_autostart(value: Any) -> bool:
    """Return the parameter's value; raise ParameterError if there is none."""
    if not isinstance(value, bool):
        raise ParameterError(
            f"parameter '{AUTOSTART.name}' is {value!r}; it must be true or false"
        )
    return value
