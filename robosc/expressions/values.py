"""
The arithmetic and logic of RoboSC on run-time values, with unknown values as None.

Strong Kleene logic for `and`, `or`, `not` (S. C. Kleene, Introduction to Metamathematics, 1952,
sec. 64). Unknown are: integer results beyond 32 bits, division by zero, results that are not
finite, a comparison with NaN, and whatever is computed from something unknown.

This module imports nothing and runs on Python 3.8 and later: generated code carries a copy of it.
"""

from __future__ import annotations

import math
import numbers
from typing import Any

INFINITY = math.inf


def not_(a: Any) -> Any:
    """Kleene negation."""
    return None if a is None else not a


def and_(a: Any, b: Any) -> Any:
    """Kleene conjunction: false if either is false, else unknown if either is."""
    if a is False or b is False:
        return False
    return None if a is None or b is None else True


def or_(a: Any, b: Any) -> Any:
    """Kleene disjunction: true if either is true, else unknown if either is."""
    if a is True or b is True:
        return True
    return None if a is None or b is None else False


def implies(a: Any, b: Any) -> Any:
    """Kleene implication."""
    return or_(not_(a), b)


def _incomparable(a: Any, b: Any) -> bool:
    """Return True if an operand is unknown or NaN (the only value that differs from itself)."""
    return a is None or b is None or a != a or b != b


def equal(a: Any, b: Any) -> Any:
    """Return True if two values of one type are equal."""
    return None if _incomparable(a, b) else a == b


def unequal(a: Any, b: Any) -> Any:
    """Return True if two values of one type differ."""
    return None if _incomparable(a, b) else a != b


def less(a: Any, b: Any) -> Any:
    """Return the value of a < b."""
    return None if _incomparable(a, b) else a < b


def less_or_equal(a: Any, b: Any) -> Any:
    """Return the value of a <= b."""
    return None if _incomparable(a, b) else a <= b


def greater(a: Any, b: Any) -> Any:
    """Return the value of a > b."""
    return None if _incomparable(a, b) else a > b


def greater_or_equal(a: Any, b: Any) -> Any:
    """Return the value of a >= b."""
    return None if _incomparable(a, b) else a >= b


def _number(value: Any) -> Any:
    """Return a result of arithmetic; None where it is no 32-bit integer or finite double."""
    if isinstance(value, int):
        return value if -2147483648 <= value <= 2147483647 else None
    return value if -INFINITY < value < INFINITY else None


def add(a: Any, b: Any) -> Any:
    """Return the value of a + b."""
    return None if a is None or b is None else _number(a + b)


def subtract(a: Any, b: Any) -> Any:
    """Return the value of a - b."""
    return None if a is None or b is None else _number(a - b)


def multiply(a: Any, b: Any) -> Any:
    """Return the value of a * b."""
    return None if a is None or b is None else _number(a * b)


def divide(a: Any, b: Any) -> Any:
    """Return the value of a / b, always a double."""
    return None if a is None or b is None or b == 0 else _number(float(a) / float(b))


def negate(a: Any) -> Any:
    """Return the value of -a."""
    return None if a is None else _number(-a)


def conditional(condition: Any, then: Any, otherwise: Any) -> Any:
    """Return the value of `if condition then ... else ...`: unknown if the condition is."""
    if condition is None:
        return None
    return then if condition else otherwise


def absolute(a: Any) -> Any:
    """Return the value of abs(a)."""
    return None if a is None else _number(abs(a))


def minimum(a: Any, b: Any) -> Any:
    """Return the value of min(a, b); an infinity is an ordinary number."""
    if _incomparable(a, b):
        return None
    return a if a <= b else b


def maximum(a: Any, b: Any) -> Any:
    """Return the value of max(a, b); an infinity is an ordinary number."""
    if _incomparable(a, b):
        return None
    return a if a >= b else b


def clamp(a: Any, low: Any, high: Any) -> Any:
    """
    Return a number moved to the nearer of two bounds.

    Where they are the wrong way round, the upper one.
    """
    return minimum(maximum(a, low), high)


def to_integer(a: Any) -> Any:
    """
    Return the value of integer(a).

    Towards zero, and the nearest 32-bit integer for what is beyond.
    """
    if a is None or a != a:
        return None
    if a >= 2147483647:
        return 2147483647
    return -2147483648 if a <= -2147483648 else int(a)


def to_double(a: Any) -> Any:
    """Return the value of double(a)."""
    return None if a is None or a != a else float(a)


def array_part(value: Any, low: Any = None, high: Any = None) -> Any:
    """
    Return the elements of a received array from `low` to `high`, both included.

    None where it is not an array.

    :param value: Received value.
    :param low: Index of the first element; None for the whole array.
    :param high: Index of the last element; if it is less than `low`, the array's end is followed
        by its beginning.
    """
    if isinstance(value, (str, dict)):
        return None
    try:
        if low is None:
            return list(value[:])
        end = high + 1
        if low < end:
            return list(value[low:end])
        return list(value[low:]) + list(value[:end])
    except (TypeError, LookupError):
        return None


def array_length(elements: Any) -> Any:
    """Return the number of elements."""
    return None if elements is None else len(elements)


def least(elements: Any) -> Any:
    """Return the least of numbers, NaN aside; unknown if one of them is, or if none is left."""
    return _extreme(elements, min)


def greatest(elements: Any) -> Any:
    """Return the greatest of numbers, NaN aside; unknown if one of them is, or if none is left."""
    return _extreme(elements, max)


def _extreme(elements: Any, choose: Any) -> Any:
    if elements is None:
        return None
    numbers = [element for element in elements if element is None or element == element]
    return None if not numbers or None in numbers else choose(numbers)


def any_of(elements: Any, condition: Any) -> Any:
    """
    Kleene disjunction of a condition over elements, up to the first that is true.

    Unknown if there are none.
    """
    return _quantified(elements, condition, True)


def all_of(elements: Any, condition: Any) -> Any:
    """
    Kleene conjunction of a condition over elements, up to the first that is false.

    Unknown if there are none.
    """
    return _quantified(elements, condition, False)


def _quantified(elements: Any, condition: Any, decisive: Any) -> Any:
    if not elements:
        return None
    result: Any = not decisive
    for element in elements:
        outcome = condition(element)
        if outcome is decisive:
            return decisive
        if outcome is None:
            result = None
    return result


def read_boolean(value: Any) -> Any:
    """Return a received boolean; None where something else came."""
    return value if value is True or value is False else None


def read_whole(value: Any) -> Any:
    """
    Return a received integer of any size; None where something else came.

    Numbers of array libraries (an element of a fixed-size array of a ROS message is one) count as
    well.
    """
    if type(value) is int:
        return value
    if value is True or value is False or not isinstance(value, numbers.Integral):
        return None
    return int(value)


def read_integer(value: Any) -> Any:
    """Return a received integer; None where something else came or it needs more than 32 bits."""
    value = read_whole(value)
    return value if value is not None and -2147483648 <= value <= 2147483647 else None


def read_double(value: Any) -> Any:
    """
    Return a received number as a double, NaN and infinities included.

    None where something else came.

    A received infinity is an ordinary number in comparisons; arithmetic on it and assigning it are
    not.
    """
    if type(value) is float:
        return value
    if value is True or value is False or not isinstance(value, numbers.Real):
        return None
    try:
        return float(value)
    except OverflowError:
        return None


def read_string(value: Any) -> Any:
    """Return a received text; None where something else came."""
    return value if isinstance(value, str) else None


def read_element(values: Any, index: int) -> Any:
    """Return an array's element; None outside the array."""
    try:
        return values[index] if 0 <= index < len(values) else None
    except (TypeError, LookupError):
        return None


class Absent:
    """
    Mark of a part of received data that has no place.

    Beyond the end of an array, and below that.
    """


ABSENT = Absent()


def received_part(value: Any, step: Any) -> Any:
    """
    Return a part of received data: an element (`step` is an index) or a property.

    `ABSENT` outside an array.

    An element that is there but does not fit is something else: an enum is made of it by its
    rules, while one of an element that is absent is unknown.
    """
    if value is ABSENT:
        return ABSENT
    try:
        if isinstance(step, str):
            return read_property(value, step)
        return value[step] if 0 <= step < len(value) else ABSENT
    except Exception:  # Foreign objects may do anything when they are asked for a part.
        return None if isinstance(step, str) else ABSENT


def read_property(value: Any, name: str) -> Any:
    """
    Return a property of received data, whether a mapping or an object with attributes.

    None if it has none.
    """
    if isinstance(value, dict):
        return value.get(name)
    return getattr(value, name, None)


def part_at(value: Any, path: Any) -> Any:
    """Return a part of an array's element: property names and indices, outermost first."""
    for step in path:
        value = read_element(value, step) if isinstance(step, int) else read_property(value, step)
    return value


def assignable_integer(value: Any, low: int, high: int) -> Any:
    """
    Return the value that a code-only integer variable takes.

    None (skip the update) outside its range.
    """
    return value if value is not None and low <= value <= high else None


def assignable_double(value: Any) -> Any:
    """Return the value that a double variable takes; None (no update) for NaN and infinities."""
    if value is None:
        return None
    value = float(value)
    return value if -INFINITY < value < INFINITY else None
