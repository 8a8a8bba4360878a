"""Numbers that a person types, for commands and options: finite, and within bounds that the simulators can bear."""

import argparse
import math
from collections.abc import Callable

MOST_SEED = 2**31 - 1
FARTHEST_M = 1000.0
"""Maximum magnitude of any coordinate, in metres."""

_HIGHEST_V = 60.0
_MOST_RAD = 1000.0


def number(text: str, least: float, most: float) -> float:
    """Read a number within bounds.

    Args:
        text: Text as it was typed.
        least: Smallest number that it may be.
        most: Largest number that it may be.

    Raises:
        ValueError: It is none, or beyond them; says what is needed.
    """
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    if not least <= found <= most:
        raise ValueError(f"a number from {least:g} to {most:g} is needed, not {text!r}")
    return found


def whole_number(text: str, least: int, most: int) -> int:
    """A whole number within bounds; see `number`."""
    try:
        found = int(text)
    except ValueError:
        found = None
    if found is None or not least <= found <= most:
        raise ValueError(f"a whole number from {least} to {most} is needed, not {text!r}")
    return found


def coordinate(text: str) -> float:
    """Return a coordinate, in metres."""
    return number(text, -FARTHEST_M, FARTHEST_M)


def angle(text: str) -> float:
    """Return an angle, in radians."""
    return number(text, -_MOST_RAD, _MOST_RAD)


def voltage(text: str) -> float:
    """Return a voltage, in volts."""
    return number(text, 0.0, _HIGHEST_V)


def seed(text: str) -> int:
    """Return the seed of all that comes by chance, within the bounds of a scene file."""
    return whole_number(text, 0, MOST_SEED)


def option[T](read: Callable[[str], T]) -> Callable[[str], T]:
    """A reader for `argparse`, whose errors say which value is needed."""

    def read_option(text: str) -> T:
        try:
            return read(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return read_option


def number_tuple[T](reads: tuple[Callable[[str], T], ...], separator: str) -> Callable[[str], tuple[T, ...]]:
    """A reader of several numbers with a separator between them."""

    def read_all(text: str) -> tuple[T, ...]:
        words = text.split(separator)
        if len(words) != len(reads):
            raise ValueError(f"{len(reads)} numbers with `{separator}` between them are needed, not {text!r}")
        return tuple(read(word) for read, word in zip(reads, words, strict=True))

    return read_all
