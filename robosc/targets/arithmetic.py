"""Arithmetic that code generators know about before they write any."""

from robosc.expressions import Constant, Expression

_LEAST_NATIVE_DIVISOR = 1e-6
"""A 32-bit integer divided by something this large or larger stays finite."""

Bounds = tuple[int, int]
"""Least and greatest value."""


def is_safe_divisor(divisor: Expression) -> bool:
    """Return True if every 32-bit integer divided by it is a finite number."""
    match divisor:
        case Constant(value=int() | float() as constant):
            return abs(constant) >= _LEAST_NATIVE_DIVISOR
        case _:
            return False


def arithmetic_bounds(operator: str, left: Bounds, right: Bounds) -> Bounds:
    """Least and greatest result of `+`, `-` or `*` on integers."""
    match operator:
        case "+":
            return left[0] + right[0], left[1] + right[1]
        case "-":
            return left[0] - right[1], left[1] - right[0]
        case _:
            products = [a * b for a in left for b in right]
            return min(products), max(products)
