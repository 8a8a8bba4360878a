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

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import msgspec


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


class TwoSidedArena(Arena, Protocol):
    """A game in which moves of both sides can be looked at together."""

    def together(self, predicate: Any) -> Any:
        """Return the positions from which a move of either side can lead into a predicate."""


class Approach(msgspec.Struct, frozen=True):
    """A step towards a goal: positions that a round of the least fixed point has added.

    Attributes:
        positions: Positions from which the controller makes progress, whatever the surroundings do.
        nearer: Positions from which progress was known before.
        progress: Positions in which the controller, at its turn, makes progress.
        waiting: For each assumption, the positions in which the controller stays while that assumption fails.
        onwards: Positions that a request leads into, where the controller makes progress by one: those of the first
            part if it can, else those of the next one.
    """

    positions: Any
    nearer: Any
    progress: Any
    waiting: tuple[Any, ...]
    onwards: tuple[Any, ...]


class Solution(msgspec.Struct, frozen=True):
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
    is_enough: Callable[[Any], bool] = lambda winning: True,
    before: Solution | None = None,
) -> Solution:
    """Return the positions from which the controller wins, and its steps towards each goal.

    Assumptions and goals are judged when the controller has its turn. Where it does not win from enough positions, the
    work ends early: then there are no steps, and maybe it wins from fewer positions yet.

    Args:
        arena: The game.
        assumptions: Predicates that the surroundings make true again and again; none means that they owe nothing.
        goals: Predicates that the controller is to make true again and again, at least one.
        false: The predicate that is true nowhere.
        check_stop: Function called before each step; it may end the work with an error.
        is_enough: Function that returns False for positions that are too few to be of use.
        before: Solution for the same goals under these assumptions and others, of which `waiting` has only these; or
            None.
    """
    # The empty assumption is one that never fails.
    failing = [~item for item in assumptions] or [false]
    winning, rounds = arena.positions, 0
    approaches: list[tuple[Approach, ...]] = [()] * len(goals)
    if before is not None:
        winning = before.winning
        # Steps are bounds for those of fewer assumptions, one by one.
        approaches = list(before.approaches) if assumptions else approaches
    # The result is stable once each goal in a row has left it as it was. The last goal is first: of visits one after
    # the other the later ones decide where the earlier ones may lead.
    unchanged, number = 0, len(goals) - 1
    while unchanged < len(goals):
        check_stop()
        reached = goals[number] & arena.turn(winning)
        search = _Search(arena, failing, winning, false, check_stop)
        approaches[number] = tuple(search.approach(reached, approaches[number]))
        found = approaches[number][-1].positions if approaches[number] else false
        unchanged = unchanged + 1 if found == winning else 0
        winning = found
        rounds += number == 0
        number = (number - 1) % len(goals)
        if winning == false or not is_enough(winning):
            return Solution(winning, ((),) * len(goals), rounds)
    return Solution(winning, tuple(approaches), rounds)


def approach_in_earnest(
    arena: TwoSidedArena,
    assumptions: Sequence[Any],
    goal: Any,
    interrupted: Any,
    winning: Any,
    *,
    false: Any,
    near: Mapping[int, Any] | None = None,
    check_stop: Callable[[], object] = lambda: None,
) -> tuple[Approach, ...]:
    """Return steps towards a goal that rely on nothing that would not come, and on no interruption of the goal.

    Interruptions, such as a detour in which the goal counts as true, are left to the surroundings: the controller
    neither brings them about nor waits for them where it can make progress without them. It waits for an assumption
    that it may keep from coming true only where the surroundings can make it true, maybe after requests that do not
    give up what it waits for. Only where there is no other way, it does something else.

    Args:
        arena: The game.
        assumptions: Predicates that the surroundings make true again and again.
        goal: Positions in which the goal is true, interrupted ones among them.
        interrupted: Positions in which it is interrupted; None if it never is.
        winning: The positions from which the controller wins.
        false: The predicate that is true nowhere.
        near: Positions from which the surroundings alone can make an assumption true, by the numbers of those that the
            controller may keep from coming true.
        check_stop: Function called before each step; it may end the work with an error.
    """
    failing = [~item for item in assumptions] or [false]
    calm = winning if interrupted is None else winning & ~interrupted
    # An assumption that only an interruption makes true is not worth waiting for.
    hopeful = [~item & leading(arena, item & calm, calm, check_stop) for item in assumptions] or [false]
    search = _EarnestSearch(arena, failing, winning, false, check_stop)
    reached = goal & arena.turn(winning)
    found: list[Approach] = []
    while True:
        before = [item.positions for item in found]
        nearer = before[-1] if before else false
        ways = [(failing, (nearer,), winning)]
        if interrupted is not None:
            anyhow = (*(item & calm for item in before), *before)
            ways = [(hopeful, (nearer & calm,), calm), (failing, anyhow, winning)]
        steps = (
            search.step(reached, nearer, waited, onwards, within, helped)
            for helped in ((near, {}) if near else ({},))
            for waited, onwards, within in ways
        )
        step = next((item for item in steps if item is not None), None)
        if step is None:
            return tuple(found)
        found.append(step)


def leading(arena: TwoSidedArena, found: Any, within: Any, check_stop: Callable[[], object]) -> Any:
    """Return the positions from which moves of both sides can lead to some positions, without leaving a bound.

    Args:
        arena: The game.
        found: The positions to get to.
        within: Positions that moves begin in: those that are not to be left.
        check_stop: Function called before each step; it may end the work with an error.
    """
    before = None
    while found != before:
        check_stop()
        before = found
        found = found | (within & arena.together(found))
    return found


class _Search(msgspec.Struct, frozen=True):
    """Search for the positions from which a goal is approached.

    Attributes:
        arena: The game.
        failing: For each assumption, the positions in which it is not true.
        winning: Positions outside of which no position is looked for.
        false: The predicate that is true nowhere.
        check_stop: Function called before each step.
        known: For some sets that are looked at again for other assumptions, the positions in them whose surroundings
            lead into them, and those whose turn does.
    """

    arena: Arena
    failing: Sequence[Any]
    winning: Any
    false: Any
    check_stop: Callable[[], object]
    known: dict[Any, tuple[Any, Any]] = msgspec.field(default_factory=dict)

    def approach(self, reached: Any, before: Sequence[Approach]) -> list[Approach]:
        """Return the steps towards a goal; the positions of the last one are all from which it is approached.

        Args:
            reached: Positions in which the goal is true, and the controller's turn leads to where it goes on winning.
            before: Steps found while more positions counted as winning; or none.
        """
        found: list[Approach] = []
        nearer, last = self.false, None
        while True:
            known = before[len(found)] if len(found) < len(before) else None
            progress = reached | self.arena.turn(nearer)
            # All of a step follows from where it makes progress.
            if progress == last:
                return found
            bounds = [self.winning] * len(self.failing)
            if known is not None:
                bounds = [item & self.winning for item in known.waiting]
            if known is not None and known.progress == progress and list(known.waiting) == bounds:
                # The goal has the same positions as before, so that its search ends where it ended before.
                waiting = known.waiting
            else:
                # Sets of one step are alike, those of several are not; all may begin with all winning positions.
                for item in [item for item in self.known if item != self.winning]:
                    del self.known[item]
                waiting = tuple(
                    self._waiting(progress, item, bound) for item, bound in zip(self.failing, bounds, strict=True)
                )
            positions = nearer
            for item in waiting:
                positions = positions | item
            if positions == nearer:
                return found
            found.append(Approach(positions, nearer, progress, waiting, (nearer,)))
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
            if staying not in self.known:
                self.known[staying] = staying & self.arena.surroundings(staying), self.arena.turn(staying)
            closed, turn = self.known[staying]
            # An assumption that never fails is nothing to stay for.
            narrowed = closed & (progress if failing == self.false else progress | (failing & turn))
            if narrowed == staying:
                return staying
            staying = narrowed


class _EarnestSearch(_Search, frozen=True):
    """Search that can also look at what both sides can do together."""

    arena: TwoSidedArena

    def step(
        self,
        reached: Any,
        nearer: Any,
        failing: Sequence[Any],
        onwards: tuple[Any, ...],
        within: Any,
        near: Mapping[int, Any],
    ) -> Approach | None:
        """Return one step towards a goal, or None if it adds no position.

        Args:
            reached: Positions in which the goal is true, and the controller's turn leads to where it goes on winning.
            nearer: Positions from which progress was known before.
            failing: For each assumption, the positions in which it fails and is waited for.
            onwards: Positions that requests may lead into, those of the first part before those of the next one.
            within: Positions in which moves begin that are to lead near an assumption, and which they do not leave.
            near: For some assumptions, by number, positions from which the surroundings alone can make them true. The
                controller waits for these only where moves can lead there while it goes on waiting.
        """
        progress = reached
        for item in onwards[-1:]:
            progress = progress | self.arena.turn(item)
        waiting = tuple(
            self._waiting_helped(progress, item, near[number], within)
            if number in near
            else self._waiting(progress, item, self.winning)
            for number, item in enumerate(failing)
        )
        positions = nearer
        for item in waiting:
            positions = positions | item
        return None if positions == nearer else Approach(positions, nearer, progress, waiting, onwards)

    def _waiting_helped(self, progress: Any, failing: Any, near: Any, within: Any) -> Any:
        """Return the largest set to wait in, as `_waiting` does, in which moves can lead nearer before any progress.

        Args:
            progress: Positions in which the turn can make progress.
            failing: Positions in which the assumption is not true.
            near: Positions from which the surroundings alone can make it true.
            within: Positions that such moves begin in and do not leave; none is needed from others.
        """
        bound, staying = None, self.winning
        while staying != bound:
            bound = self._waiting(progress, failing, staying)
            inside = bound & within & ~progress
            led = leading(self.arena, inside & near, inside, self.check_stop)
            staying = led | (bound & ~inside)
        return staying
