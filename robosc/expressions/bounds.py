"""Least and greatest results of integer functions (interval arithmetic)."""

from collections.abc import Sequence


def call_bounds(function: str, bounds: Sequence[tuple[int, int]]) -> tuple[int, int]:
    """Least and greatest result of abs, min, max or clamp.

    Args:
        function: Its name.
        bounds: Least and greatest value of each argument.
    """
    low, high = bounds[0]
    match function:
        case "abs":
            return (0 if low <= 0 <= high else min(abs(low), abs(high))), max(abs(low), abs(high))
        case "min":
            return min(least for least, _ in bounds), min(greatest for _, greatest in bounds)
        case "max":
            return max(least for least, _ in bounds), max(greatest for _, greatest in bounds)
    (_, _), (least, top), (most, greatest) = bounds
    return min(max(low, least), most), min(max(high, top), greatest)
