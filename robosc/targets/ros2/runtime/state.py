"""
Parameter for the form in which a node publishes its state.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robosc.targets.ros.runtime.parameters import ParameterError, STATE_MESSAGE

JSON, TYPED, BOTH = 'json', 'typed', 'both'

__all__ = ['BOTH', 'JSON', 'STATE_MESSAGE', 'TYPED', 'valid_state_message']


def valid_state_message(given: Mapping[str, Any]) -> str:
    """
    Return the parameter's value.

    :param given: Value of every declared parameter.
    :raises ParameterError: It is none of the three.
    """
    value = given[STATE_MESSAGE.name]
    if value not in (JSON, TYPED, BOTH):
        raise ParameterError(
            f"parameter '{STATE_MESSAGE.name}' is {value!r}; it must be one of json, typed, both"
        )
    return str(value)
