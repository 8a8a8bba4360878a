"""Counter-strategies of random abstract games, against Zielonka's algorithm and all that the controller can do."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Any

from robosc.automata.compile import State
from robosc.model.structure import GoalForm
from robosc.strategies.counter_strategy import CounterPlayer, CounterStage, oppose
from robosc.strategies.gr1 import solve
from support.counter_twin import fault_of_counter
from support.goal_twin import LOST, Game, Item, Position, winning_positions


@dataclass(frozen=True)
class Numbers:
    """A predicate over positions of an abstract game, as a set of bits."""

    bits: int
    every: int

    def __and__(self, other: "Numbers") -> "Numbers":
        return Numbers(self.bits & other.bits, self.every)

    def __or__(self, other: "Numbers") -> "Numbers":
        return Numbers(self.bits | other.bits, self.every)

    def __invert__(self) -> "Numbers":
        return Numbers(self.every & ~self.bits, self.every)

    def __call__(self, state: State) -> bool:
        return bool(self.bits >> int(state[0]) & 1)


class Graph:
    """A game on numbers: for each, where the surroundings can move, and where requests lead. LOST is no number."""

    def __init__(self, moves: list[set[Any]], choices: list[set[Any]]) -> None:
        self._moves, self._choices = moves, choices
        self._every = (1 << len(moves)) - 1
        self.positions = self.holding(lambda number: True)

    def holding(self, holds: Callable[[int], bool]) -> Numbers:
        return Numbers(sum(1 << number for number in range(len(self._moves)) if holds(number)), self._every)

    def surroundings(self, predicate: Numbers) -> Numbers:
        return self.holding(lambda number: all(_is_in(item, predicate) for item in self._moves[number]))

    def turn(self, predicate: Numbers) -> Numbers:
        return self.holding(lambda number: any(_is_in(item, predicate) for item in {number, *self._choices[number]}))


def _is_in(number: Any, predicate: Numbers) -> bool:
    return number != LOST and predicate((number,))


def _position(number: Any) -> Any:
    return LOST if number == LOST else (((number,), ()), (False,) * 4)


def _random(dice: Random) -> tuple[Graph, Game, list[Numbers], list[Numbers]]:
    """A random game, also as an explicit one, with its assumptions and goals."""
    size = dice.randint(3, 8)

    def targets(most: int) -> set[Any]:
        found: set[Any] = {dice.randrange(size) for _ in range(dice.randint(0, most))}
        return found | ({LOST} if dice.random() < 0.02 else set())

    moves, choices = [targets(2) for _ in range(size)], [targets(2) for _ in range(size)]
    graph = Graph(moves, choices)
    owed, wanted = (
        [graph.holding(lambda number: dice.random() < 0.35) for _ in range(dice.randint(low, 2))] for low in (0, 1)
    )
    items = [
        [Item("", GoalForm.ALWAYS_EVENTUALLY, one, lambda state: False) for one in some] for some in (owed, wanted)
    ]
    game = Game(items[0], list(items[1]))
    game.successors = {_position(number): {_position(item) for item in found} for number, found in enumerate(moves)}
    game.choices = {
        _position(number): {str(place): _position(item) for place, item in enumerate(sorted(found, key=str))}
        for number, found in enumerate(choices)
    }
    return graph, game, owed, wanted


def _state(position: Position) -> tuple[Any, ...]:
    return position[0][0]


def test_counter_strategies_of_random_games_deny_a_goal(record_property: Callable[[str, object], None]) -> None:
    met: Counter[str] = Counter()
    dice = Random(1)
    for _ in range(1_500):
        graph, game, owed, wanted = _random(dice)
        false = ~graph.positions
        lost = graph.positions & ~solve(graph, owed, wanted, false=false).winning
        won = winning_positions(game)
        assert all((position in won) is not lost(_state(position)) for position in game.choices)
        stages = oppose(graph, owed, wanted, lost, lambda found: False, false=false)
        assert (stages[-1].positions if stages else false) == lost
        met["stages"] += max(0, len(stages) - 1)
        for position in game.choices:
            if lost(_state(position)):
                game.first = position

                def fault(stages: tuple[CounterStage, ...], game: Game = game, owed: list[Numbers] = owed) -> str:
                    return fault_of_counter(game, range(len(game.goals)), CounterPlayer(stages, owed), _state)

                assert fault(stages) == ""
                met["lost"] += 1
                for name, damaged in _damaged(stages):
                    met[f"{name}, {'seen' if fault(damaged) else 'still denied'}"] += 1
    for name, count in sorted(met.items()):
        record_property(name, count)
    assert all(met[f"{name}, seen"] > 20 for name in ("idle", "turned", "cut")), met


def _damaged(stages: tuple[CounterStage, ...]) -> list[tuple[str, tuple[CounterStage, ...]]]:
    """Counter-strategies that were damaged: without moves, for another assumption, without a stage."""

    def changed(change: Callable[[CounterStage], tuple[tuple[Any, ...], ...]]) -> tuple[CounterStage, ...]:
        return tuple(CounterStage(item.goal, item.positions, change(item)) for item in stages)

    return [
        ("idle", changed(lambda item: ((item.positions,),) * len(item.layers))),
        ("turned", changed(lambda item: (*item.layers[1:], item.layers[0]))),
        ("cut", stages[1:]),
    ]
