"""The arithmetic and logic of RoboSC on run-time values, with unknown values as None.

Strong Kleene logic for `and`, `or`, `not` (S. C. Kleene, Introduction to Metamathematics, 1952, sec. 64).
Unknown are: integer results beyond 32 bits, division by zero, results that are not finite, a
comparison with NaN, and whatever is computed from something unknown (language A.5 and B.4).

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
    """Whether an operand is unknown or NaN (the only value that differs from itself)."""
    return a is None or b is None or a != a or b != b


def equal(a: Any, b: Any) -> Any:
    """Whether two values of one type are equal."""
    return None if _incomparable(a, b) else a == b


def unequal(a: Any, b: Any) -> Any:
    """Whether two values of one type differ."""
    return None if _incomparable(a, b) else a != b


def less(a: Any, b: Any) -> Any:
    """The value of a < b."""
    return None if _incomparable(a, b) else a < b


def less_or_equal(a: Any, b: Any) -> Any:
    """The value of a <= b."""
    return None if _incomparable(a, b) else a <= b


def greater(a: Any, b: Any) -> Any:
    """The value of a > b."""
    return None if _incomparable(a, b) else a > b


def greater_or_equal(a: Any, b: Any) -> Any:
    """The value of a >= b."""
    return None if _incomparable(a, b) else a >= b


def _number(value: Any) -> Any:
    """A result of arithmetic, or None where it is no 32-bit integer and no finite double."""
    if isinstance(value, int):
        return value if -2147483648 <= value <= 2147483647 else None
    return value if -INFINITY < value < INFINITY else None


def add(a: Any, b: Any) -> Any:
    """The value of a + b."""
    return None if a is None or b is None else _number(a + b)


def subtract(a: Any, b: Any) -> Any:
    """The value of a - b."""
    return None if a is None or b is None else _number(a - b)


def multiply(a: Any, b: Any) -> Any:
    """The value of a * b."""
    return None if a is None or b is None else _number(a * b)


def divide(a: Any, b: Any) -> Any:
    """The value of a / b, always a double."""
    return None if a is None or b is None or b == 0 else _number(float(a) / float(b))


def negate(a: Any) -> Any:
    """The value of -a."""
    return None if a is None else _number(-a)


def read_boolean(value: Any) -> Any:
    """A received boolean; None where something else came."""
    return value if value is True or value is False else None


def read_whole(value: Any) -> Any:
    """A received integer of any size; None where something else came.

    Numbers of array libraries (an element of a fixed-size array of a ROS message is one) count as well.
    """
    if type(value) is int:
        return value
    if value is True or value is False or not isinstance(value, numbers.Integral):
        return None
    return int(value)


def read_integer(value: Any) -> Any:
    """A received integer; None where something else came or it needs more than 32 bits."""
    value = read_whole(value)
    return value if value is not None and -2147483648 <= value <= 2147483647 else None


def read_double(value: Any) -> Any:
    """A received number as a double, NaN and infinities included; None where something else came.

    A received infinity is an ordinary number in comparisons; arithmetic on it and assigning it are not.
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
    """A received text; None where something else came."""
    return value if isinstance(value, str) else None


def read_element(values: Any, index: int) -> Any:
    """An array's element; None outside the array."""
    try:
        return values[index] if 0 <= index < len(values) else None
    except (TypeError, LookupError):
        return None


def read_property(value: Any, name: str) -> Any:
    """A property of received data, whether a mapping or an object with attributes; None if it has none."""
    if isinstance(value, dict):
        return value.get(name)
    return getattr(value, name, None)


def assignable_integer(value: Any, low: int, high: int) -> Any:
    """What a code-only integer variable takes; None (skip the update) outside its range."""
    return value if value is not None and low <= value <= high else None


def assignable_double(value: Any) -> Any:
    """What a double variable takes; None (skip the update) for NaN and infinities."""
    if value is None:
        return None
    value = float(value)
    return value if -INFINITY < value < INFINITY else None
