"""Steps: what events add to sets of states, whichever way the sets are closed under them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Step:
    """Contribution of one event to a set of states.

    Attributes:
        add: The states that it leads to from a set of states.
        names: The current-state variables that it reads or changes: all of them.
    """

    add: Callable[[Any], Any]
    names: frozenset[str]


def never_done(states: Any) -> bool:
    """Return False: the work is done only once all is found."""
    return False
