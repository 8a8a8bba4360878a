"""
Received numbers, with NaN for whatever is unknown.

Comparisons with NaN are false, so conditions stay plain Python.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from itertools import compress
from typing import Any

from robosc.expressions.values import array_part, read_double, read_integer, read_whole

NAN = float('nan')


def array(value: Any) -> Any:
    """Return the elements of a received array; None where something else came."""
    try:
        return array_part(value)
    except Exception:  # Foreign objects may do anything when they are asked for a part.
        return None


def elements(value: Any, path: str, notes: Any, convert: Any) -> Any:
    """
    Return a received array with every element converted; None where something else came.

    :param value: Received value.
    :param path: Place of the value, in words.
    :param notes: A list that takes what was unknown, as texts and a flag.
    :param convert: Function that takes an element, its path and the notes.
    """
    found = array(value)
    if found is None:
        return None
    return [convert(item, f'{path}[{index}]', notes) for index, item in enumerate(found)]


def plain_elements(value: Any, convert: Any) -> Any:
    """Return the same where there is nothing to note: `convert` takes an element alone."""
    found = array(value)
    return None if found is None else [convert(item) for item in found]


def noted_integer(value: Any, path: str, notes: Any, low: int, high: int) -> Any:
    """
    Return a received integer moved into its declared range, noted if it was.

    None where something else came.
    """
    value = read_whole(value)
    if value is None:
        return None
    notes.append((moved(path, value, low, high), False))
    return clamped(value, low, high)


def noted_enum(converted: Any, notes: Any) -> Any:
    """Return the value of an enum from what its converter returned; what was unknown is noted."""
    value, words, is_unknown = converted
    notes.append((words, is_unknown))
    return value


def words_of(notes: Any) -> Any:
    """Every text that was noted."""
    return tuple(text for texts, _ in notes for text in texts)


def flag_of(notes: Any) -> bool:
    """Return True if an enum fell to its default past an unknown rule."""
    return any(flag for _, flag in notes)


def number(value: Any) -> Any:
    """Return a received number as a double; NaN where something else came."""
    if type(value) is float:
        return value
    result = read_double(value)
    return NAN if result is None else result


def number_at(array: Any, index: int) -> Any:
    """
    Return an element of a received array as a double.

    NaN outside the array or where something else came.
    """
    try:
        value = array[index] if index < len(array) else None
    except Exception:  # Arrays of a message class may raise any error, as above.
        return NAN
    return value if type(value) is float else number(value)


def integer(value: Any) -> Any:
    """Return a received integer; NaN where something else came or it needs more than 32 bits."""
    result = read_integer(value)
    return NAN if result is None else result


def whole(value: Any) -> Any:
    """Return a received integer of any size, for a declared range; NaN for anything else."""
    result = read_whole(value)
    return NAN if result is None else result


def clamped(value: Any, low: int, high: int) -> Any:
    """Return a received integer moved into its declared range; NaN stays NaN."""
    if value < low:
        return low
    return high if value > high else value


def moved(path: str, value: Any, low: int, high: int) -> Any:
    """Say that a received integer was moved into its declared range; '' if it was not."""
    if value < low or value > high:
        return (f'{path} is {value}, outside {low}..{high}',)
    return ()


def known(value: Any) -> Any:
    """Return a received integer as the rest of the world sees it: None where it is unknown."""
    return None if value != value else value


def numbers_of(flags: Any) -> Any:
    """Return the places of the flags that are set, from 0."""
    return tuple(compress(range(len(flags)), flags))


def turned(before: Any, flags: Any) -> Any:
    """Return the places, from 0, where flags are not what they were before."""
    return numbers_of([old is not new for old, new in zip(before, flags)])


def stays_in_range(value: Any, low: int, high: int) -> bool:
    """
    Return True if assigning a value does not leave a range.

    An unknown value is not assigned at all.
    """
    return value is None or not (value < low or value > high)
