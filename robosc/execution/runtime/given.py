"""
Received data that cannot be unknown by its type: whoever gives an event must give it.

Every message has a boolean, an integer of a declared range, and what an enum is made of.
"""

from __future__ import annotations

import numbers
from typing import Any

from robosc.execution.runtime.protocol import MissingData


def given(value: Any, path: str) -> Any:
    """
    Return what an enum is made of.

    :param value: Received value.
    :param path: Place of the value, in words.
    :raises MissingData: There is none.
    """
    if value is None:
        raise MissingData('{} is missing, and cannot be unknown'.format(path))
    return value


def given_boolean(value: Any, path: str) -> Any:
    """
    Return a received boolean.

    :raises MissingData: Something else came, or nothing.
    """
    if value is True or value is False:
        return value
    raise _not(given(value, path), path, 'a boolean')


def given_integer(value: Any, path: str) -> Any:
    """
    Return a received integer of any size, for a declared range.

    :raises MissingData: Something else came, or nothing.
    """
    if type(value) is int:
        return value
    if value is True or value is False or not isinstance(value, numbers.Integral):
        raise _not(given(value, path), path, 'an integer')
    return int(value)


def _not(value: Any, path: str, wanted: str) -> MissingData:
    return MissingData('{} is {!r:.100}, and must be {}'.format(path, value, wanted))
