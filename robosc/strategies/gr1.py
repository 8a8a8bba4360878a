"""Generalized reactivity of rank 1: if every assumption comes true again and again, so does every goal.

The winning positions are three nested fixed points: the greatest set from which each goal in turn can be reached and
left again, by a least set that grows towards the goal, by greatest sets in which some assumption fails for ever.

All three only shrink from one round of the outermost to the next: each greatest set begins from what it was in the
round before, and within what may still win.

Sources: N. Piterman, A. Pnueli and Y. Sa'ar, "Synthesis of reactive(1) designs", VMCAI 2006, LNCS 3855, pp. 364-380;
R. Bloem, B. Jobstmann, N. Piterman, A. Pnueli and Y. Sa'ar, "Synthesis of reactive(1) designs", Journal of Computer
and System Sciences 78(3), 2012, pp. 911-938; A. Browne, E. M. Clarke, S. Jha, D. E. Long and W. Marrero, "An improved
algorithm for the evaluation of fixpoint expressions", Theoretical Computer Science 178(1-2), 1997, pp. 237-255
(beginning from earlier results).
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
    # The empty assumption is one that never fails.
    failing = [~item for item in assumptions] or [false]
    winning, rounds = arena.positions, 0
    approaches: list[tuple[Approach, ...]] = [()] * len(goals)
    # The result is stable once each goal in a row has left it as it was.
    unchanged, number = 0, 0
    while unchanged < len(goals):
        check_stop()
        reached = goals[number] & arena.turn(winning)
        search = _Search(arena, failing, winning, false, check_stop)
        approaches[number] = tuple(search.approach(reached, approaches[number]))
        found = approaches[number][-1].positions if approaches[number] else false
        unchanged = unchanged + 1 if found == winning else 0
        winning = found
        number = (number + 1) % len(goals)
        rounds += number == 0
        if winning == false:
            return Solution(winning, ((),) * len(goals), rounds)
    return Solution(winning, tuple(approaches), rounds)


@dataclass(frozen=True, slots=True)
class _Search:
    """Search for the positions from which a goal is approached.

    Attributes:
        arena: The game.
        failing: For each assumption, the positions in which it is not true.
        winning: Positions outside of which no position is looked for.
        false: The predicate that is true nowhere.
        check_stop: Function called before each step.
    """

    arena: Arena
    failing: Sequence[Any]
    winning: Any
    false: Any
    check_stop: Callable[[], object]

    def approach(self, reached: Any, before: Sequence[Approach]) -> list[Approach]:
        """Return the steps towards a goal; the positions of the last one are all from which it is approached.

        Args:
            reached: Positions in which the goal is true, and the controller's turn leads to where it goes on winning.
            before: Steps found while more positions counted as winning; or none.
        """
        found: list[Approach] = []
        nearer, last = self.false, None
        while True:
            progress = reached | self.arena.turn(nearer)
            # All of a step follows from where it makes progress.
            if progress == last:
                return found
            bounds = (
                [item & self.winning for item in before[len(found)].waiting]
                if len(found) < len(before)
                else [self.winning] * len(self.failing)
            )
            waiting = tuple(
                self._waiting(progress, item, bound) for item, bound in zip(self.failing, bounds, strict=True)
            )
            positions = nearer
            for item in waiting:
                positions = positions | item
            if positions == nearer:
                return found
            found.append(Approach(positions, nearer, waiting))
            nearer, last = positions, progress

    def _waiting(self, progress: Any, failing: Any, bound: Any) -> Any:
        """Return the largest set in which each turn makes progress, or stays in the set while an assumption fails.

        Args:
            progress: Positions in which the turn can make progress.
            failing: Positions in which the assumption is not true.
            bound: Positions that the set is part of.
        """
        staying = bound
        while True:
            self.check_stop()
            narrowed = staying & self.arena.surroundings(staying)
            # An assumption that never fails is nothing to stay for.
            narrowed = narrowed & (
                progress if failing == self.false else progress | (failing & self.arena.turn(staying))
            )
            if narrowed == staying:
                return staying
            staying = narrowed
