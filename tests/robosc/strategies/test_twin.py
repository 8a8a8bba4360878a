"""Strategies of random robots against an explicit game, which is solved and checked another way."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Sequence
from random import Random
from typing import Any

import pytest

from robosc.automata import ExecutableSystem
from robosc.automata.goal_memory import Aim
from robosc.controller_properties.goals import check_strategy
from robosc.model.structure import Deployment, Model
from robosc.strategies.counter_strategy import CounterPlayer, CounterStage, CounterStrategy
from robosc.strategies.gr1 import solve
from robosc.strategies.synthesize import StrategyResult, StrategySynthesis
from robosc.supervisor import AddedCondition, DecisionDiagram, Strategy
from robosc.synthesis.changes import changed_subjects
from robosc.synthesis.workspace import workspace
from support.counter_twin import fault_of_counter
from support.goal_twin import (
    LOST,
    NEVER,
    Decide,
    Game,
    Item,
    Position,
    deciding,
    distances,
    endless_requests,
    game_of,
    leading,
    put_off,
    taken_along,
    unfair_goal,
    values_of,
    winning_positions,
)
from support.random_couriers import random_courier
from support.random_goals import wanting_robot
from support.random_waiting import random_waiting

LIMIT = 3_000

Robot = tuple[Model, tuple[AddedCondition, ...]]
"""A model, and what its supervisor adds."""


def random_goals(seed: int) -> Robot | None:
    """Return a random robot with goals, and what its supervisor adds, or None if there is none."""
    supervisor, model = wanting_robot(seed)
    return None if supervisor is None else (model, supervisor.added)


def compare(robot: Robot | None, seed: int, engine: str, met: Counter[str]) -> None:
    if robot is None:
        return
    model, added = robot
    executable = ExecutableSystem(model, Deployment.CONTROLLER)
    game = game_of(executable, added, LIMIT)
    if game is None:
        return
    won = winning_positions(game)
    owed, system = executable.obligations, executable.remembering_automata
    # Without next-state variables, moves are looked at event by event.
    followed = () if seed % 4 == 0 else changed_subjects(system)
    with workspace(system, engine, lambda: False, lambda progress: None, followed=followed) as place:
        synthesis = StrategySynthesis(executable, added, place)
        false = place.encoding.manager.false
        winning = solve(synthesis.arena, synthesis.assumptions, synthesis.goals, false=false).winning
        for position in game.choices:
            state = place.encoding.state(values_of(game, position, owed))
            assert state & ~synthesis.arena.positions == false, seed
            assert (state & winning != false) == (position in won), seed
        if game.first != LOST:
            reached = (place.encoding.state(values_of(game, position, owed)) for position in game.choices)
            assert synthesis.arena.reachable_positions() == place.encoding.any_of(reached), seed
        every = range(len(model.assumptions))
        result = synthesis.result(allowed=every)
        strategy = result.strategy
        cautious = synthesis.result()
        preventable = cautious.preventable
        is_denied = bool(result.unreached) and not synthesis.is_won(every, result.unreached)
        counter = synthesis.counter(result.unreached) if is_denied else None
    is_won = game.first != LOST and game.first in won
    in_name = is_won and is_in_name_alone(game, result, seed, met)
    assert (strategy is not None) == (is_won and not in_name), seed
    if game.first != LOST and not in_name:
        compare_reasons(game, owed.aims, result, result.unreached, seed, met)
        prevented = [number for number, item in enumerate(game.assumptions) if is_prevented(game, item)]
        assert list(preventable) == prevented, seed
        met["preventable"] += bool(prevented)
    met["models"] += 1
    met["positions"] += len(game.choices)
    met["won" if is_won else "lost"] += 1
    if counter is not None and game.first != LOST and not in_name:
        compare_counter(game, executable, counter, result.unreached, seed, met)
    if strategy is None:
        return
    never = {executable.obligations.aims[number].name for number in result.never_made}
    assert never == {aim.name for aim in executable.obligations.aims if aim.mission is not None} - game.made, seed
    met["never made"] += bool(never)
    idle = [
        number
        for number, aim in enumerate(owed.aims)
        if aim.mission is None and all(game.holds(position, game.goals[number]) for position in game.choices)
    ]
    assert list(result.idle) == idle, seed
    met["idle goals"] += bool(idle)
    met["with requests"] += any(strategy.modes)
    check = check_strategy(executable, added, strategy)
    assert check.result == "passed", (seed, check)
    decide = deciding(game, executable, strategy)
    assert unfair_goal(game, decide) is None, seed
    late = put_off(game, [aim.name for aim in executable.obligations.aims], decide)
    assert set(check.put_off) == late, seed
    met["put off"] += bool(late)
    own = deciding(game, executable, for_own_goals(strategy))
    compare_preferences(game, won, model, own, seed, met)
    compare_waiting(game, won, every, decide, own, seed, met)
    if cautious.strategy is not None and model.assumptions:
        own = deciding(game, executable, for_own_goals(cautious.strategy))
        decide = deciding(game, executable, cautious.strategy)
        assert unfair_goal(game, decide) is None, seed
        compare_waiting(game, won, (), decide, own, seed, met)
    # A strategy that was damaged is judged alike: without any request, or with some forgotten, for other goals.
    dice = Random(seed)
    kept = [[item for item in mode if dice.random() < 0.6] for mode in strategy.modes]
    dice.shuffle(kept)
    for damaged in (Strategy(((),) * len(kept)), Strategy(tuple(map(tuple, kept)))):
        is_missed = unfair_goal(game, deciding(game, executable, damaged)) is not None
        found = check_strategy(executable, added, damaged)
        # A cancel that silent steps pass over is exact there, and possible everywhere in the game.
        is_exact = not any(any(item.passing) for item in owed.cancels)
        expected = "failed" if is_missed else "passed"
        assert found.result == expected or not (is_exact or found.result == "failed"), seed
        met["unseen cancels"] += not is_exact
        met["damaged, missed" if is_missed else "damaged, still reached"] += 1


def is_in_name_alone(game: Game, result: StrategyResult, seed: int, met: Counter[str]) -> bool:
    """Return True if not all goals and assumptions can come true; check what is said of them then."""
    goals, assumptions = range(len(game.goals)), range(len(game.assumptions))
    if not assumptions or game.can_meet_again_and_again(goals, assumptions):
        assert not result.impossible and not result.unreached, seed
        return False
    is_alone = not game.can_meet_again_and_again((), assumptions)
    assert bool(result.impossible) != bool(result.unreached), seed
    assert result.is_impossible_alone == is_alone, seed
    others = () if is_alone else goals
    for item in (None, *result.unreached, *result.impossible):
        items = {*result.unreached, *result.impossible} - {item}
        asked = (items, ()) if result.unreached else (others, items)
        assert not items or game.can_meet_again_and_again(*asked) is (item is not None), seed
    kept = "goals" if result.unreached else "assumptions"
    assert not result.unreached or result.is_hopeless, seed
    met[f"impossible {kept}"] += 1
    return True


def for_own_goals(strategy: Strategy) -> Strategy:
    """Return a strategy without what its modes request for others."""
    return Strategy(tuple(tuple(item for item in mode if not item.is_meanwhile) for mode in strategy.modes))


def is_prevented(game: Game, assumption: Item) -> bool:
    """Return True if the robot can keep an assumption from coming true, in a position in which that is possible."""
    won, possible = winning_positions(game.asking([assumption], [NEVER])), game.possible(assumption)
    hopeless = set(game.choices) - possible
    return any(position in won or hopeless & {*game.choices[position].values()} for position in possible)


def compare_preferences(
    game: Game, won: set[Position], model: Model, decide: Decide, seed: int, met: Counter[str]
) -> None:
    """Check that nothing is chosen where a request that is preferred to it leads nearer, too.

    Nearer to the goal of the mode is what has a smaller distance, by the twin's distances.
    """
    requests = [item.name for item in model.communications]
    owed = game.assumptions
    pairs = [(first, second) for item in model.preferences for first in item.preferred for second in item.others]
    for mode in range(len(game.goals)) if pairs else ():
        known = distances(game, won, mode)
        for position in won:
            request, number = decide(position, mode)
            if request is None or number != mode:
                continue
            choices = game.choices[position]
            nearer = {name.removesuffix(".request") for name in leading(game, known, position, mode)}
            met["last resort"] += position in known.last_resort
            chosen = request.removesuffix(".request")
            if chosen not in nearer:
                # It helps the surroundings with an assumption that they cannot make true alone.
                assert not nearer, seed
                assert any(not game.holds(position, item) and position not in game.alone(item) for item in owed), seed
                met["helping"] += 1
                continue
            for first, second in pairs:
                assert not (second == chosen and first in nearer), (seed, mode, first, second)
                is_refined = first == chosen and second in nearer and requests.index(second) < requests.index(first)
                met["preferred to an earlier one"] += is_refined
                met["not preferred, as it leads nowhere"] += second == chosen and f"{first}.request" in choices


def compare_waiting(
    game: Game, won: set[Position], allowed: Collection[int], decide: Decide, own: Decide, seed: int, met: Counter[str]
) -> None:
    """Check what is requested for other goals where the mode requests nothing by itself."""
    assert endless_requests(game, decide) is None, seed
    known = [distances(game, won, mode) for mode in range(len(game.goals))]
    for mode in range(len(game.goals)):
        for position in won:
            if game.holds(position, game.goals[mode]):
                continue
            request, alone = decide(position, mode)[0], own(position, mode)[0]
            if alone is None and game.assumptions:
                alone = taken_along(game, known, allowed, own, position, mode)
                met["meanwhile"] += alone is not None
                met["waiting for all"] += alone is None
            assert request == alone, (seed, position, mode)


def compare_reasons(
    game: Game, aims: Sequence[Aim], result: StrategyResult, unreached: Sequence[int], seed: int, met: Counter[str]
) -> None:
    """Check the goals that are said not to be reached, and the assumptions that are said not to be needed."""

    def is_won(assumptions: Iterable[int], goals: Iterable[int]) -> bool:
        asked = game.asking([game.assumptions[item] for item in assumptions], [game.goals[item] for item in goals])
        return game.first in winning_positions(asked)

    every = set(range(len(game.assumptions)))
    if unreached:
        assert not is_won(every, unreached), seed
        for item in unreached if len(unreached) > 1 else ():
            assert is_won(every, set(unreached) - {item}), seed
        assert result.is_hopeless is not game.can_meet_again_and_again(unreached), seed
        met["hopeless" if result.is_hopeless else "prevented by the surroundings"] += 1
    else:
        goals = range(len(game.goals))
        needed = every - set(result.unneeded)
        assert is_won(needed, goals), seed
        # Interruptions of a visit may be enough, but are not waited for.
        if all(item.interruption is None for item in aims):
            assert not any(is_won(needed - {item}, goals) for item in needed), seed
        else:
            met["interruptible"] += 1
        met["unneeded"] += bool(result.unneeded)
        met["needed"] += bool(needed)


def compare_counter(
    game: Game,
    executable: ExecutableSystem,
    counter: CounterStrategy,
    unreached: tuple[int, ...],
    seed: int,
    met: Counter[str],
) -> None:
    """Check that a counter-strategy keeps the goals from coming true, and that a damaged one is seen not to."""
    owed = executable.obligations

    def values(position: Position) -> tuple[Any, ...]:
        return values_of(game, position, owed)

    def fault(counter: CounterStrategy) -> str:
        player = CounterPlayer.of(executable.remembering_automata, owed, counter)
        return fault_of_counter(game, unreached, player, values)

    assert fault(counter) == "", seed
    met["counter-strategies"] += 1
    # A counter-strategy that only gives the controller its turn.
    everywhere = DecisionDiagram((), 1)
    idle = CounterStage(0, everywhere, ((everywhere,),) * max(1, len(game.assumptions)))
    met["idle, seen"] += bool(fault(CounterStrategy((idle,))))


@pytest.mark.parametrize("first", range(0, 800, 80))
def test_random_robots_agree(first: int, record_property: Callable[[str, object], None]) -> None:
    met: Counter[str] = Counter()
    for seed in range(first, first + 80):
        compare(random_goals(seed), seed, "auto", met)
    for name, count in sorted(met.items()):
        record_property(name, count)
    assert met["models"] > 40 and min(met["won"], met["lost"]) > 5 and met["with requests"] > 30, met
    assert met["counter-strategies"] > 5 and met["idle, seen"] > 0, met


@pytest.mark.parametrize("first", range(0, 300, 100))
def test_random_couriers_agree(first: int, record_property: Callable[[str, object], None]) -> None:
    met: Counter[str] = Counter()
    for seed in range(first, first + 100):
        compare(random_courier(seed), seed, "auto", met)
    for name, count in sorted(met.items()):
        record_property(name, count)
    assert met["never made"] > 3 and met["put off"] > 2, met
    assert met["with requests"] > 30 and met["lost"] > 20 and met["damaged, missed"] > 30, met
    assert min(met["preferred to an earlier one"], met["not preferred, as it leads nowhere"]) > 30, met
    assert min(met["last resort"], met["helping"]) > 10, met


def test_random_robots_with_much_to_do_at_a_time_agree(record_property: Callable[[str, object], None]) -> None:
    met: Counter[str] = Counter()
    for seed in range(160):
        compare(random_waiting(seed), seed, "auto", met)
    for name, count in sorted(met.items()):
        record_property(name, count)
    assert min(met["meanwhile"], met["waiting for all"]) > 1_000 and min(met["won"], met["lost"]) > 30, met


def test_engines_agree() -> None:
    met: Counter[str] = Counter()
    for seed in range(40):
        compare(random_goals(seed), seed, "autoref", met)
    for seed in range(20):
        compare(random_courier(seed), seed, "autoref", met)
    assert met["won"] > 5 and met["lost"] > 5, met
