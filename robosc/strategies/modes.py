"""Modes of a strategy: what the controller requests to get to one goal, step by step."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any

import msgspec

from robosc.automata.goal_memory import Aim
from robosc.strategies.arena import ControllerArena
from robosc.strategies.gr1 import Approach

Requests = dict[str, Any]
"""For each request the positions in which it is chosen."""


class ModeGame(msgspec.Struct, frozen=True):
    """A mode of the strategy, on positions.

    Attributes:
        goal: Positions in which its goal is true.
        interrupted: Positions in which its visit is not asked for.
        steps: Steps towards the goal, the nearest first.
        chosen: Choices of the mode by itself.
        approaching: The part of them by which the controller gets nearer to the goal, and does not interrupt a visit.
    """

    goal: Any
    interrupted: Any
    steps: Sequence[Approach]
    chosen: Requests
    approaching: Requests


class Modes:
    """Modes of the strategy for one game.

    Args:
        arena: The game.
        aims: Goals and visits, one for each mode.
        requests: Events of requests, the preferred ones first.
        near: For each assumption that the robot may keep from coming true, the positions from which the surroundings
            alone can make it true.
        false: The predicate that is true nowhere.
    """

    def __init__(
        self,
        arena: ControllerArena,
        aims: Sequence[Aim],
        requests: Sequence[str],
        near: Mapping[int, Any],
        false: Any,
    ) -> None:
        self._arena = arena
        self._aims = aims
        self._requests = requests
        self._near = near
        self._false = false

    def mode(self, number: int, goal: Any, steps: Sequence[Approach]) -> ModeGame:
        """Return the mode that approaches a goal.

        Args:
            number: Number of the goal.
            goal: Positions in which it is true.
            steps: Steps towards it, the nearest first.
        """
        chosen: Requests = {}
        approaching: Requests = {}
        decided = goal
        for step in steps:
            here = step.positions & ~step.nearer
            # The first half of several parts that requests may lead into are those without interruptions.
            uninterrupted = max(1, len(step.onwards) // 2)
            for (part, target), event in product(enumerate(step.onwards), self._requests):
                found = here & ~decided & self._arena.choice(event, target)
                if found != self._false:
                    chosen[event] = chosen.get(event, self._false) | found
                    decided = decided | found
                    if part < uninterrupted:
                        approaching[event] = approaching.get(event, self._false) | found
            for assumption, near in self._near.items():
                for event, helped in self._helping(step, number, assumption, near):
                    found = here & ~decided & helped
                    chosen[event] = chosen.get(event, self._false) | found
                    decided = decided | found
                # The first assumption that can be waited for is waited for until it comes, or progress is made.
                here = here & ~step.waiting[assumption]
        return ModeGame(goal, self._interrupted(number), steps, chosen, approaching)

    def _interrupted(self, number: int) -> Any:
        """Return the positions in which a visit is not asked for."""
        interruption = self._aims[number].interruption
        return self._false if interruption is None else self._arena.condition(interruption)

    def _helping(self, step: Approach, number: int, assumption: int, near: Any) -> Iterator[tuple[str, Any]]:
        """Yield requests, each with positions in which it helps the surroundings to make an assumption true.

        While the assumption fails the controller may do whatever stays where it can wait for it. It does what leads to
        where the surroundings have their part to do, such as calling a service once more.

        Args:
            step: Step towards a goal.
            number: Number of the goal.
            assumption: Number of the assumption.
            near: Positions from which the surroundings alone can make it true.
        """
        everywhere = step.waiting[assumption]
        calm = everywhere & ~self._interrupted(number)
        # Luck, and then interruptions, are waited for only where nothing else helps.
        ways = [(calm & ~step.progress, near), (calm, near | step.progress)]
        if self._aims[number].interruption is not None:
            ways.append((everywhere, near))
        found = self._false
        for staying, wanted in ways:
            found, before = found | (staying & wanted), None
            while found != before:
                before = found
                closer = staying & self._arena.responses(found) & ~found
                if closer != self._false:
                    found = found | closer
                    continue
                for event in self._requests:
                    helped = staying & ~found & self._arena.choice(event, before)
                    if helped != self._false:
                        yield event, helped
                        found = found | helped
