"""Generalized reactivity of rank 1: if every assumption comes true again and again, so does every goal.

The winning positions are three nested fixed points: the greatest set from which each goal in turn can be reached and
left again, by a least set that grows towards the goal, by greatest sets in which some assumption fails for ever.

Sources: N. Piterman, A. Pnueli and Y. Sa'ar, "Synthesis of reactive(1) designs", VMCAI 2006, LNCS 3855, pp. 364-380;
R. Bloem, B. Jobstmann, N. Piterman, A. Pnueli and Y. Sa'ar, "Synthesis of reactive(1) designs", Journal of Computer
and System Sciences 78(3), 2012, pp. 911-938.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol


class Arena(Protocol):
    """A game between a controller and its surroundings, on predicates over positions.

    In a position the surroundings move as often as they like; then the controller has its turn. They let it have its
    turn again and again.
    """

    positions: Any
    """Positions that there are."""

    def surroundings(self, predicate: Any) -> Any:
        """Return the positions from which every single move of the surroundings leads into a predicate."""

    def turn(self, predicate: Any) -> Any:
        """Return the positions in which the controller, at its turn, has a choice that leads into a predicate."""


@dataclass(frozen=True, slots=True)
class Approach:
    """A step towards a goal: positions that a round of the least fixed point has added.

    Attributes:
        positions: Positions from which the controller makes progress, whatever the surroundings do.
        nearer: Positions from which progress was known before.
        waiting: For each assumption, the positions in which the controller stays while that assumption fails.
    """

    positions: Any
    nearer: Any
    waiting: tuple[Any, ...]


@dataclass(frozen=True, slots=True)
class Solution:
    """Winning positions of the controller, and how it wins.

    Attributes:
        winning: The positions from which it wins.
        approaches: For each goal, the steps towards it, the nearest first.
        rounds: Number of rounds of the greatest fixed point.
    """

    winning: Any
    approaches: tuple[tuple[Approach, ...], ...]
    rounds: int


def solve(
    arena: Arena,
    assumptions: Sequence[Any],
    goals: Sequence[Any],
    *,
    false: Any,
    check_stop: Callable[[], object] = lambda: None,
) -> Solution:
    """Return the positions from which the controller wins, and its steps towards each goal.

    Assumptions and goals are judged when the controller has its turn.

    Args:
        arena: The game.
        assumptions: Predicates that the surroundings make true again and again; none means that they owe nothing.
        goals: Predicates that the controller is to make true again and again, at least one.
        false: The predicate that is true nowhere.
        check_stop: Function called before each step; it may end the work with an error.
    """
    # Without an assumption there is one that never fails.
    failing = [~item for item in assumptions] or [false]
    winning, rounds = arena.positions, 0
    approaches: list[tuple[Approach, ...]] = [()] * len(goals)
    # The result is stable once each goal in a row has left it as it was.
    unchanged, number = 0, 0
    while unchanged < len(goals):
        check_stop()
        reached = goals[number] & arena.turn(winning)
        approaches[number] = tuple(_approach(arena, reached, failing, false, check_stop))
        found = approaches[number][-1].positions if approaches[number] else false
        unchanged = unchanged + 1 if found == winning else 0
        winning = found
        number = (number + 1) % len(goals)
        rounds += number == 0
        if winning == false:
            return Solution(winning, ((),) * len(goals), rounds)
    return Solution(winning, tuple(approaches), rounds)


def _approach(
    arena: Arena, reached: Any, failing: Sequence[Any], false: Any, check_stop: Callable[[], object]
) -> list[Approach]:
    """Return the steps towards a goal; the positions of the last one are all from which it is approached.

    Args:
        arena: The game.
        reached: Positions in which the goal is true, and the controller's turn leads to where it goes on winning.
        failing: For each assumption, the positions in which it is not true.
        false: The predicate that is true nowhere.
        check_stop: Function called before each step.
    """
    found: list[Approach] = []
    nearer = false
    while True:
        progress = reached | arena.turn(nearer)
        waiting = tuple(_waiting(arena, progress, item, check_stop) for item in failing)
        positions = nearer
        for item in waiting:
            positions = positions | item
        if positions == nearer:
            return found
        found.append(Approach(positions, nearer, waiting))
        nearer = positions


def _waiting(arena: Arena, progress: Any, failing: Any, check_stop: Callable[[], object]) -> Any:
    """Return the largest set in which each turn makes progress, or stays in the set while an assumption fails."""
    staying = arena.positions
    while True:
        check_stop()
        narrowed = staying & arena.surroundings(staying) & (progress | (failing & arena.turn(staying)))
        if narrowed == staying:
            return staying
        staying = narrowed
