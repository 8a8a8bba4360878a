"""Strategies of random robots against an explicit game, which is solved and checked another way."""

from collections import Counter
from collections.abc import Callable, Iterable
from random import Random

import pytest

from robosc.automata import ExecutableSystem
from robosc.controller_properties.goals import check_strategy
from robosc.model.structure import Deployment
from robosc.strategies.gr1 import solve
from robosc.strategies.synthesize import StrategyResult, StrategySynthesis
from robosc.supervisor import Strategy
from robosc.synthesis.workspace import workspace
from support.goal_twin import LOST, NEVER, Game, Item, deciding, game_of, unfair_goal, values_of, winning_positions
from support.random_goals import wanting_robot

LIMIT = 3_000


def compare(seed: int, engine: str, met: Counter[str]) -> None:
    supervisor, model = wanting_robot(seed)
    if supervisor is None:
        return
    executable = ExecutableSystem(model, Deployment.CONTROLLER)
    game = game_of(executable, supervisor.added, LIMIT)
    if game is None:
        return
    won = winning_positions(game)
    owed, system = executable.obligations, executable.remembering_automata
    with workspace(system, engine, lambda: False, lambda progress: None) as place:
        synthesis = StrategySynthesis(executable, supervisor.added, place)
        false = place.encoding.manager.false
        winning = solve(synthesis.arena, synthesis.assumptions, synthesis.goals, false=false).winning
        for position in game.choices:
            state = place.encoding.state(values_of(position, model, owed))
            assert state & ~synthesis.arena.positions == false, seed
            assert (state & winning != false) == (position in won), seed
        if game.first != LOST:
            reached = (place.encoding.state(values_of(position, model, owed)) for position in game.choices)
            assert synthesis.arena.met() == place.encoding.any_of(reached), seed
        every = range(len(model.assumptions))
        result = synthesis.result(allowed=every)
        strategy = result.strategy
        preventable = synthesis.result().preventable
    is_won = game.first != LOST and game.first in won
    assert (strategy is not None) == is_won, seed
    if game.first != LOST:
        compare_reasons(game, result, seed, met)
        prevented = [number for number, item in enumerate(game.assumptions) if is_prevented(game, item)]
        assert list(preventable) == prevented, seed
        met["preventable"] += bool(prevented)
    met["models"] += 1
    met["positions"] += len(game.choices)
    met["won" if is_won else "lost"] += 1
    if strategy is None:
        return
    met["with requests"] += any(strategy.modes)
    check = check_strategy(executable, supervisor.added, strategy)
    assert check.result == "passed", (seed, check)

    assert unfair_goal(game, deciding(game, executable, strategy)) is None, seed
    # A strategy that was damaged is judged alike: without any request, or with some forgotten, for other goals.
    dice = Random(seed)
    kept = [[item for item in mode if dice.random() < 0.6] for mode in strategy.modes]
    dice.shuffle(kept)
    for damaged in (Strategy(((),) * len(kept)), Strategy(tuple(map(tuple, kept)))):
        is_missed = unfair_goal(game, deciding(game, executable, damaged)) is not None
        found = check_strategy(executable, supervisor.added, damaged)
        assert found.result == ("failed" if is_missed else "passed"), seed
        met["damaged, missed" if is_missed else "damaged, still reached"] += 1


def is_prevented(game: Game, assumption: Item) -> bool:
    """Return True if the robot can keep an assumption from coming true, in a position in which that is possible."""
    won, possible = winning_positions(game.asking([assumption], [NEVER])), game.possible(assumption)
    hopeless = set(game.choices) - possible
    return any(position in won or hopeless & {*game.choices[position].values()} for position in possible)


def compare_reasons(game: Game, result: StrategyResult, seed: int, met: Counter[str]) -> None:
    """Check the goals that are said not to be reached, and the assumptions that are said not to be needed."""

    def is_won(assumptions: Iterable[int], goals: Iterable[int]) -> bool:
        asked = game.asking([game.assumptions[item] for item in assumptions], [game.goals[item] for item in goals])
        return game.first in winning_positions(asked)

    every = set(range(len(game.assumptions)))
    if result.unreached:
        assert not is_won(every, result.unreached), seed
        for item in result.unreached if len(result.unreached) > 1 else ():
            assert is_won(every, set(result.unreached) - {item}), seed
        assert result.is_hopeless is not game.can_meet_again_and_again(result.unreached), seed
        met["hopeless" if result.is_hopeless else "prevented by the surroundings"] += 1
    else:
        goals = range(len(game.goals))
        needed = every - set(result.unneeded)
        assert is_won(needed, goals), seed
        assert not any(is_won(needed - {item}, goals) for item in needed), seed
        met["unneeded"] += bool(result.unneeded)
        met["needed"] += bool(needed)


@pytest.mark.parametrize("first", range(0, 480, 80))
def test_random_robots_agree(first: int, record_property: Callable[[str, object], None]) -> None:
    met: Counter[str] = Counter()
    for seed in range(first, first + 80):
        compare(seed, "auto", met)
    for name, count in sorted(met.items()):
        record_property(name, count)
    assert met["models"] > 40 and min(met["won"], met["lost"]) > 5 and met["with requests"] > 30, met


def test_engines_agree() -> None:
    met: Counter[str] = Counter()
    for seed in range(40):
        compare(seed, "autoref", met)
    assert met["won"] > 5 and met["lost"] > 5, met
