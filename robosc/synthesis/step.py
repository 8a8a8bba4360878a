"""Steps: the states that events add to a set of states, for every kind of closure."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any


@dataclass(eq=False, slots=True)
class Step:
    """Contribution of one event to a set of states.

    Attributes:
        add: The states that it leads to from a set of states; from two sets, what it leads to from each of them.
        names: The current-state variables that it reads or changes: all of them.
        room: Predicate over these variables that is true of all that it ever leads to; None if there is none.
        compiled: The step for the kernel, with the predicates that are in it, once it has been made; many closures
            have the same steps.
    """

    add: Callable[[Any], Any]
    names: frozenset[str]
    room: Any = None
    compiled: tuple[tuple[object, ...], tuple[Any, ...]] | None = field(default=None, init=False, repr=False)

    def added(self, states: Any, within: Any) -> Any:
        """Return what the event leads to from some states, within a predicate; the states if they are all there is."""
        # The image is expensive, and mostly all that it could hold is there already.
        if self.room is not None and states | (within & self.room) == states:
            return states
        return within & self.add(states)


def is_enough(states: Any, until: Any) -> bool:
    """Return True if all states of a set are found; without a set, never: everything is to be found."""
    return until is not None and bool(states | until == states)
