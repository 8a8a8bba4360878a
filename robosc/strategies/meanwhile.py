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

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from robosc.strategies.arena import ControllerArena
from robosc.strategies.gr1 import Approach

Requests = dict[str, Any]
"""For each request the positions in which it is chosen."""


@dataclass(frozen=True, slots=True)
class ModeGame:
    """A mode of the strategy, on positions.

    Attributes:
        goal: Positions in which its goal is true.
        interrupted: Positions in which its visit is not asked for.
        steps: Steps towards the goal, the nearest first.
        chosen: Choices of the mode by itself.
        nearer: The part of them by which the controller gets nearer to the goal, and does not interrupt a visit.
    """

    goal: Any
    interrupted: Any
    steps: Sequence[Approach]
    chosen: Requests
    nearer: Requests


class Meanwhile:
    """Requests that modes take along for others.

    Args:
        arena: The game.
        requests: Events of requests, in the order in which they are tried.
        modes: All modes.
        places: Numbers of the assumptions, in the order in which they are waited for: of several that can be waited for
            in a position, the first counts.
        near: For some assumptions, the positions that are not to be left while they are waited for.
        false: The predicate that is true nowhere.
    """

    def __init__(
        self,
        arena: ControllerArena,
        requests: Sequence[str],
        modes: Sequence[ModeGame],
        places: Sequence[int],
        near: Mapping[int, Any],
        false: Any,
    ) -> None:
        self._arena = arena
        self._requests = requests
        self._modes = modes
        self._places = places
        self._near = near
        self._false = false

    def of(self, number: int, waiting: Any) -> Requests:
        """Return what a mode requests for others.

        Args:
            number: Number of the mode.
            waiting: Positions in which it requests nothing by itself.
        """
        found: Requests = {}
        earlier: list[ModeGame] = []
        for other in (*self._modes[number + 1 :], *self._modes[:number]):
            for event in self._requests:
                here = waiting & other.nearer.get(event, self._false)
                for kept in self._kept(event, self._modes[number], earlier, here):
                    here = kept
                    if here == self._false:
                        break
                if here != self._false:
                    found[event] = found.get(event, self._false) | here
                    waiting = waiting & ~here
            earlier.append(other)
        return found

    def _kept(self, event: str, mode: ModeGame, earlier: Iterable[ModeGame], here: Any) -> Iterator[Any]:
        """Yield ever fewer of some positions: at last those in which a request for a later mode may be taken along."""
        if here != self._false:
            here = self._staying(event, mode, here)
            yield here
        for item in earlier:
            here = self._no_farther(event, item, here)
            yield here

    def _staying(self, event: str, mode: ModeGame, here: Any) -> Any:
        """Return those of some positions in which a request leads to where the mode waits for the same as before."""
        found = self._false
        for step in mode.steps:
            fresh = here & step.positions & ~step.nearer
            for place in self._places:
                within = step.waiting[place] & ~mode.interrupted
                if place in self._near:
                    within = within & self._near[place]
                if (fresh & within) != self._false:
                    found = found | (fresh & within & self._arena.choice(event, within))
                fresh = fresh & ~step.waiting[place]
        return found

    def _no_farther(self, event: str, mode: ModeGame, here: Any) -> Any:
        """Return those of some positions in which a request does not lead farther from the goal of a mode."""
        found = self._false
        at_goal = here & mode.goal
        if at_goal != self._false:
            found = at_goal & self._arena.choice(event, mode.goal)
        for step in mode.steps:
            fresh = here & step.positions & ~step.nearer & ~mode.goal
            if fresh != self._false:
                found = found | (fresh & self._arena.choice(event, step.positions | mode.goal))
        return found
