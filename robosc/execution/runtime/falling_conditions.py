"""
Conditions that held in some stable state and hold no longer.

They release messages and cancel goals.
"""

from __future__ import annotations

from typing import Tuple

Conditions = Tuple[bool, ...]
"""Truth values of conditions, in a fixed order."""


def have_fallen(held: Conditions, holds: Conditions) -> bool:
    """Return True if a condition that held earlier does not hold now."""
    pairs = zip(held, holds)  # Python 3.8
    return held != holds and any(before and not now for before, now in pairs)


def the_fallen(held: Conditions, holds: Conditions) -> Tuple[int, ...]:
    """Return the numbers, from 1, of the conditions that held earlier and do not hold now."""
    pairs = enumerate(zip(held, holds), 1)  # Python 3.8
    return tuple([number for number, (before, now) in pairs if before and not now])


def held_ever(held: Conditions, holds: Conditions) -> Conditions:
    """Return for each condition whether it held earlier or holds now."""
    return tuple([before or now for before, now in zip(held, holds)])  # Python 3.8
