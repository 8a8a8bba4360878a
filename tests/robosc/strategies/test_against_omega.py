"""Reactive problems that omega solves as well: it finds the same winning positions."""

from collections import Counter
from random import Random

import pytest

from robosc.synthesis.engines import make_manager
from support import omega_peer
from support.effort import seeds
from support.reactive import ReactiveProblem, game_of, is_realizable, solution_of
from support.reactive_families import FAMILIES, HOPELESS, random_problem


def compare(problem: ReactiveProblem, engine: str) -> tuple[bool, bool]:
    """Return whether the system wins from its start, and whether it wins in some positions and not in others."""
    manager = make_manager(engine)
    problem.declare(manager)
    game = game_of(problem, manager)
    winning = solution_of(game).winning
    # Both work in one manager, so that equal predicates are the same node.
    opponent = omega_peer.automaton_of(problem, manager)
    theirs = omega_peer.winning_positions(opponent)
    assert winning == theirs
    is_won = is_realizable(game, winning)
    assert is_won == omega_peer.is_realizable(opponent, theirs)
    return is_won, winning not in (manager.true, manager.false)


@pytest.mark.random
@pytest.mark.parametrize(("engine", "number"), [("cudd", 200), ("autoref", 60)])
def test_random_problems_are_won_from_the_same_positions(engine: str, number: int) -> None:
    met: Counter[tuple[bool, bool]] = Counter()
    tried = seeds(number)
    for seed in tried:
        met[compare(random_problem(Random(seed)), engine)] += 1
    for is_won in (False, True):
        # Problems that are won everywhere or nowhere would say little.
        assert met[is_won, True] >= len(tried) // 40, met


@pytest.mark.parametrize(
    ("family", "size"), [("arbiter", 2), ("arbiter", 6), ("lift", 2), ("lift", 6), ("bus", 2), ("bus", 3)]
)
def test_families_are_won_from_the_same_positions(family: str, size: int) -> None:
    assert compare(FAMILIES[family](size), "cudd")[0]
    assert not compare(HOPELESS[family](size), "cudd")[0]
