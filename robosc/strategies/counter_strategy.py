"""Counter-strategy: how the surroundings keep a goal from coming true for ever, although every assumption does.

It is the dual of the three nested fixed points of `gr1`: a least set of stages, in each of which one goal is denied for
ever or the stage before is reached; of each stage a greatest set that the controller cannot leave otherwise; and in it,
for each assumption, a least set of layers that leads to a turn at which the assumption is true. The surroundings bring
about one assumption after the other, so they remember which one is next.

Sources: N. Piterman, A. Pnueli and Y. Sa'ar, "Synthesis of reactive(1) designs", VMCAI 2006, LNCS 3855, pp. 364-380
(the game is determined); R. Koenighofer, G. Hofferek and R. Bloem, "Debugging formal specifications using simple
counterstrategies", FMCAD 2009, pp. 152-159.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self

import msgspec

from robosc.automata import System
from robosc.automata.compile import NO_DATA, State, compile_expression
from robosc.automata.goal_memory import Obligations
from robosc.automata.state import Subject, subjects
from robosc.expressions import Expression
from robosc.strategies.gr1 import Arena
from robosc.supervisor import DecisionDiagram
from robosc.supervisor.predicates import state_predicate

Rank = tuple[int, int]
"""Number of a stage, and of a layer in it: the surroundings move to lower ones."""


class CounterStage(msgspec.Struct, frozen=True):
    """Positions in which the surroundings deny one goal.

    Attributes:
        goal: Number of the goal.
        positions: The positions, with those of the stages before.
        layers: For each assumption, or once where there is none, positions from which the surroundings bring about a
            turn at which it is true: the nearest first, each with those before it. A turn at which it is not true may
            be between, and leads to a nearer layer, whatever the controller chooses.
    """

    goal: int
    positions: Any
    layers: tuple[tuple[Any, ...], ...]


class CounterStrategy(msgspec.Struct, frozen=True):
    """Counter-strategy of the surroundings, from the position in which the executor begins.

    Attributes:
        stages: Its stages, with diagrams over the state and the memory of goals.
    """

    stages: tuple[CounterStage, ...]


def oppose(
    arena: Arena,
    assumptions: Sequence[Any],
    goals: Sequence[Any],
    lost: Any,
    is_enough: Callable[[Any], bool],
    *,
    false: Any,
    check_stop: Callable[[], object] = lambda: None,
) -> tuple[CounterStage, ...]:
    """Return the stages of the surroundings, with predicates, until they are enough.

    Args:
        arena: The game.
        assumptions: Predicates that the surroundings are to make true again and again.
        goals: Predicates of which the surroundings are to deny one.
        lost: Positions from which the controller does not win.
        is_enough: Function that returns True if positions need no further stages.
        false: The predicate that is true nowhere.
        check_stop: Function called before each step; it may end the work with an error.
    """
    owed = [*assumptions] or [arena.positions]
    game = _Surroundings(arena, false, check_stop)
    stages: list[CounterStage] = []
    before, number, unchanged = false, 0, 0
    while unchanged < len(goals) and not is_enough(before):
        denied = ~goals[number] | game.forced(before)
        kept = lost
        while True:
            turns = denied & game.forced(kept)
            layers = tuple(game.layers(before, turns, item, kept) for item in owed)
            narrowed = kept
            for item in layers:
                narrowed = narrowed & (item[-1] if item else before)
            if narrowed == kept:
                break
            kept = narrowed
        unchanged = unchanged + 1 if kept == before else 0
        if not unchanged:
            stages.append(CounterStage(number, kept, layers))
        before = kept
        number = (number + 1) % len(goals)
    return tuple(stages)


class _Surroundings(msgspec.Struct, frozen=True):
    """Moves as the surroundings see them.

    Attributes:
        arena: The game.
        false: The predicate that is true nowhere.
        check_stop: Function called before each step.
    """

    arena: Arena
    false: Any
    check_stop: Callable[[], object]

    def forced(self, predicate: Any) -> Any:
        """Return the positions in which whatever the controller chooses may lead into a predicate."""
        positions = self.arena.positions
        return positions & ~self.arena.turn(positions & ~predicate)

    def reaching(self, predicate: Any) -> Any:
        """Return the positions from which a move of the surroundings can lead into a predicate."""
        positions = self.arena.positions
        return positions & ~self.arena.surroundings(positions & ~predicate)

    def layers(self, before: Any, turns: Any, owed: Any, bound: Any) -> tuple[Any, ...]:
        """Return the layers that lead to a turn at which an assumption is true, or to the stage before.

        Args:
            before: Positions of the stages before.
            turns: Positions in which the controller may have its turn.
            owed: Positions in which the assumption is true.
            bound: Positions that the layers are part of.
        """
        found: list[Any] = []
        nearer = before
        while True:
            self.check_stop()
            turn = turns & (owed | self.forced(nearer))
            wider = bound & (nearer | self.reaching(nearer) | turn)
            if wider == nearer:
                return tuple(found)
            found.append(wider)
            nearer = wider


class CounterPlayer:
    """Player of a counter-strategy over explicit states: what the surroundings do, and which assumption is next.

    Args:
        stages: Stages of the counter-strategy, with functions that say whether a state is in a predicate.
        assumptions: Functions that say whether each assumption is true in a state.
    """

    def __init__(self, stages: Sequence[CounterStage], assumptions: Sequence[Callable[[State], bool]]) -> None:
        self._stages = tuple(stages)
        self._assumptions = tuple(assumptions)

    @classmethod
    def of(cls, system: System, owed: Obligations, counter: CounterStrategy) -> Self:
        """Return the player of a counter-strategy whose states are those of a system, in the order of its subjects.

        Args:
            system: The automata with the memory of goals beside them.
            owed: Goals and assumptions over them.
            counter: The counter-strategy.
        """

        def decided(diagram: DecisionDiagram) -> Callable[[State], bool]:
            return state_predicate(system, diagram)

        stages = (
            CounterStage(
                stage.goal, decided(stage.positions), tuple(tuple(map(decided, item)) for item in stage.layers)
            )
            for stage in counter.stages
        )
        places = {subject: place for place, subject in enumerate(subjects(system))}
        return cls(tuple(stages), [condition_of(item, places) for item in owed.assumptions])

    def stage(self, state: State) -> int | None:
        """Return the number of the first stage of a position, or None if the counter-strategy knows none."""
        return next((number for number, item in enumerate(self._stages) if item.positions(state)), None)

    def denied(self, state: State) -> int | None:
        """Return the number of the goal that is denied in a position, or None where the counter-strategy knows none."""
        stage = self.stage(state)
        return None if stage is None else self._stages[stage].goal

    def denied_next(self, state: State) -> tuple[int, ...]:
        """Return the numbers of the goals one of which is denied from then on if the one that is denied comes true.

        Only in a position of the first stage the goal is denied for ever, whatever the controller does; from any other
        the controller can get to a stage before. None where all of these deny the same goal.
        """
        before = reversed(self._stages[: self.stage(state) or 0])
        goals = tuple(dict.fromkeys(item.goal for item in before))
        return () if set(goals) == {self.denied(state)} else goals

    def rank(self, state: State, aim: int) -> Rank | None:
        """Return the rank of a position, or None if the counter-strategy does not know the position.

        Args:
            state: The position.
            aim: Number of the assumption that is to come true next.
        """
        stage = self.stage(state)
        if stage is None:
            return None
        layers = self._stages[stage].layers[aim]
        layer = next((number for number, holds in enumerate(layers) if holds(state)), None)
        return None if layer is None else (stage, layer)

    def move(self, state: State, targets: Sequence[State | None], aim: int) -> int | None:
        """Return which of their moves the surroundings take; None if they let the controller have its turn.

        Args:
            state: The position.
            targets: For each move, the position that it leads to; None where silent steps do not end.
            aim: Number of the assumption that is to come true next.
        """
        own = self.rank(state, aim)
        if own is None:
            return None
        best, chosen = own, None
        for number, target in enumerate(targets):
            if target is None:
                return number
            rank = self.rank(target, aim)
            if rank is not None and rank < best:
                best, chosen = rank, number
        return chosen

    def holding(self, state: State) -> tuple[bool, ...]:
        """Return for each assumption True if it is true."""
        return tuple(holds(state) for holds in self._assumptions)

    def aim_after(self, state: State, aim: int) -> int:
        """Return the number of the assumption that is next after a turn of the controller in a position."""
        holding = self.holding(state)
        return (aim + 1) % len(holding) if holding and holding[aim] else aim


def condition_of(expression: Expression, places: Mapping[Subject, int]) -> Callable[[State], bool]:
    """Return a condition as a function of states whose values stand in certain places; unknown is not true."""
    function = compile_expression(expression, places)
    return lambda state: function(state, NO_DATA) is True
