"""Ranges of the integers in a condition, in the states where the condition is true (interval arithmetic)."""

import math
from collections import Counter
from collections.abc import Mapping
from functools import reduce

from robosc.expressions import Binary, Expression, Unary, leaves
from robosc.expressions.tree import conjuncts
from robosc.model.typed import constant_value

Range = tuple[int, int]
Ranges = Mapping[Expression, Range]
"""The least and the greatest value of what is read."""

_MIRRORED = {"=": "=", "!=": "!=", "<": ">", "<=": ">=", ">": "<", ">=": "<="}
_OPPOSITE = {"=": "!=", "!=": "=", "<": ">=", "<=": ">", ">": "<=", ">=": "<"}


def narrowed(condition: Expression, ranges: Ranges) -> Ranges | None:
    """The ranges where a condition is true, or None if it never is.

    Comparisons of what is read with constants count; other parts of the condition may hold anywhere.

    Args:
        condition: Any condition.
        ranges: The ranges of what is read; what has none of them gets none.

    Returns:
        The ranges of what the condition reads.
    """
    found = {leaf: ranges[leaf] for leaf in leaves(condition) if leaf in ranges}
    holes: dict[Expression, set[int]] = {}
    for part in conjuncts(condition):
        comparison = _comparison(part)
        if comparison is not None and comparison[0] in found:
            read, operator, constant = comparison
            low, high = found[read]
            if operator == "!=":
                # A hole counts at an end of the range only, and where that lies is known once all parts are.
                holes.setdefault(read, set()).update({int(constant)} if constant == int(constant) else ())
            else:
                least, greatest = _satisfying(operator, constant)
                found[read] = max(low, least), min(high, greatest)
            continue
        choices = conjuncts(Unary("not", part))
        if len(choices) > 1:
            ways = [way for choice in choices if (way := narrowed(Unary("not", choice), found)) is not None]
            if not ways:
                return None
            # A read that some way leaves out can have any value there.
            spoken_of = Counter(read for way in ways for read in way)
            common = [read for read, count in spoken_of.items() if count == len(ways)]
            found |= {read: reduce(_hull, (way[read] for way in ways)) for read in common}
    for read, values in holes.items():
        low, high = found[read]
        while low in values:
            low += 1
        while high in values:
            high -= 1
        found[read] = low, high
    return None if any(low > high for low, high in found.values()) else found


def _hull(first: Range, second: Range) -> Range:
    return min(first[0], second[0]), max(first[1], second[1])


def _comparison(part: Expression) -> tuple[Expression, str, float] | None:
    """Return the expression read, the operator and the constant of a comparison; the comparison may be negated."""
    is_denied = isinstance(part, Unary) and part.operator == "not"
    if isinstance(part, Unary) and is_denied:
        part = part.operand
    if not isinstance(part, Binary) or part.operator not in _OPPOSITE:
        return None
    for read, other, operators in ((part.left, part.right, None), (part.right, part.left, _MIRRORED)):
        constant = constant_value(other)
        if isinstance(constant, int | float) and not isinstance(constant, bool):
            operator = operators[part.operator] if operators else str(part.operator)
            return read, _OPPOSITE[operator] if is_denied else operator, constant
    return None


def _satisfying(operator: str, constant: float) -> tuple[int, int]:
    """The least and the greatest integer that compares so; beyond every range where there is no such end."""
    below, above = math.floor(constant), math.ceil(constant)
    beyond = 2**40
    match operator:
        case "=":
            return above, below
        case "<":
            return -beyond, above - 1
        case "<=":
            return -beyond, below
        case ">":
            return below + 1, beyond
        case _:
            return above, beyond
