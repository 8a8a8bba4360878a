"""Requests that a strategy makes for other goals while one of its modes waits for the surroundings.

The distance from a goal is 0 where it is true, else the number of the step in which the search for it found the
position. While a mode waits for an assumption, the request of another mode is taken along where

- it stays among the positions in which this step waits for that assumption, so that the mode loses nothing: there the
  assumption fails at each turn at which the mode makes no progress;
- it leads nearer to the goal of the other mode; and
- it leads farther from none of the goals whose turn would come before that one.

Of the distances from the other goals, in the order of their turn, such a request lowers the first one that changes.
Tuples of numbers have no infinite descent in this order, so that between two moves of the surroundings only finitely
many requests are taken along.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from robosc.strategies.arena import ControllerArena
from robosc.strategies.modes import ModeGame, Requests


class Meanwhile:
    """Requests that modes take along for others.

    Args:
        arena: The game.
        modes: All modes.
        waiting: For each mode the positions in which it requests nothing by itself.
        awaited: Numbers of the assumptions, in the order in which they are waited for: of several that can be waited
            for in a position, the first counts.
        near: For some assumptions, the positions that are not to be left while they are waited for.
        false: The predicate that is true nowhere.
    """

    def __init__(
        self,
        arena: ControllerArena,
        modes: Sequence[ModeGame],
        waiting: Sequence[Any],
        awaited: Sequence[int],
        near: Mapping[int, Any],
        false: Any,
    ) -> None:
        self._arena = arena
        self._modes = modes
        self._awaited = awaited
        self._near = near
        self._false = false
        wanted: Requests = {}
        for mode in modes:
            for event, approaching in mode.approaching.items():
                wanted[event] = wanted.get(event, false) | approaching
        self._staying = [
            {event: self._stays(mode, event, here & where) for event, where in wanted.items()}
            for mode, here in zip(modes, waiting, strict=True)
        ]
        """For each mode the positions in which it can take a request along without any loss."""
        self._harmless = dict.fromkeys(wanted, false)
        """For each request the positions in which some mode can take it along."""
        for staying in self._staying:
            for event, here in staying.items():
                self._harmless[event] = self._harmless[event] | here
        self._keeping: dict[tuple[int, str], Any] = {}

    def of(self, number: int) -> Requests:
        """Return what a mode requests for others, each request with the positions in which it does.

        Args:
            number: Number of the mode.
        """
        found: Requests = {}
        left = dict(self._staying[number])
        count = len(self._modes)
        for other in (item % count for item in range(number + 1, number + count)):
            for event, approaching in self._modes[other].approaching.items():
                here = left[event] & approaching
                if here != self._false:
                    found[event] = found.get(event, self._false) | here
                    left = {item: within & ~here for item, within in left.items()}
            # Goals whose turn comes later must not lead farther from this one.
            for event, within in left.items():
                if within != self._false:
                    left[event] = within & self._keeps(other, event)
        return found

    def _stays(self, mode: ModeGame, event: str, here: Any) -> Any:
        """Return those of some positions in which a request leads to where a mode waits for the same as before."""
        found = self._false
        if here == self._false:
            return found
        for step in mode.steps:
            fresh = here & step.positions & ~step.nearer
            for assumption in self._awaited:
                within = step.waiting[assumption] & ~mode.interrupted
                if assumption in self._near:
                    within = within & self._near[assumption]
                if (fresh & within) != self._false:
                    found = found | (fresh & within & self._arena.choice(event, within))
                fresh = fresh & ~step.waiting[assumption]
        return found

    def _keeps(self, number: int, event: str) -> Any:
        """Return the positions in which a request does not lead farther from the goal of a mode."""
        if (number, event) not in self._keeping:
            mode, here = self._modes[number], self._harmless[event]
            found = self._false
            at_goal = here & mode.goal
            if at_goal != self._false:
                found = at_goal & self._arena.choice(event, mode.goal)
            for step in mode.steps:
                fresh = here & step.positions & ~step.nearer & ~mode.goal
                if fresh != self._false:
                    found = found | (fresh & self._arena.choice(event, step.positions | mode.goal))
            self._keeping[number, event] = found
        return self._keeping[number, event]
