"""Strategies of synthesis: each finds the same supervisor, and a race of them costs thrice the best one at most."""

from collections.abc import Callable

import pytest

from robosc.automata import System
from robosc.automata.semantics import Semantics
from robosc.errors import NodeLimitError
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import EngineOptions, SynthesisResult, SynthesisStatus, race, synthesize
from robosc.synthesis.race import Race
from robosc.synthesis.result import Search
from robosc.synthesis.synthesize import _Portfolio
from support.effort import seeds
from support.engines import needs_cudd
from support.families import cat_and_mouse, dining_philosophers
from support.random_systems import explicit_supervisor, random_system, wide_system
from support.seeded_families import SEEDED_FAMILIES, shuffled

WAYS = [(False, Search.BACKWARDS), (False, Search.REACHABLE_FIRST), (True, Search.BACKWARDS)]


def alone(system: System, way: tuple[bool, Search], patch: pytest.MonkeyPatch) -> SynthesisResult:
    """The result of one strategy without a race."""
    with patch.context() as only:
        only.setattr(_Portfolio, "_ways", lambda portfolio: [way])
        return synthesize(system)


@pytest.mark.random
@pytest.mark.parametrize("make", [random_system, wide_system])
def test_each_strategy_finds_the_same_supervisor(
    make: Callable[[int], System], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(race, "HEAD_START", 1)
    monkeypatch.setattr(race, "SHARE", 500)
    for seed in seeds(25):
        system, explicit = make(seed), explicit_supervisor(make(seed))
        assert explicit is not None
        results = [synthesize(system), *(alone(system, way, monkeypatch) for way in WAYS)]
        assert len({result.status for result in results}) == 1, seed
        assert len({result.statistics.states for result in results}) == 1, seed
        if results[0].status is SynthesisStatus.EMPTY:
            continue
        semantics = Semantics(system)
        added = [state_predicates(system, result.added) for result in results]
        for state in explicit.reachable:
            for event in system.events:
                if semantics.enabled(state, event.name) and semantics.condition(state, event.name):
                    allowed = [event.name not in item or item[event.name](state) for item in added]
                    assert len(set(allowed)) == 1, (seed, state, event.name)


HEAD_START, SHARE = 2_000, 200

FAMILIES = [
    (family, order)
    for family in ("product line", "movable bridges", "locks", "cluster tools", "fleet in zones", "hub", "pairs")
    for order in (0, 1)
]


@needs_cudd
@pytest.mark.parametrize(("family", "order"), FAMILIES)
def test_a_race_costs_thrice_the_best_strategy_at_most(
    family: str, order: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The bound is in nodes worked on: beyond it are the head start, and what strategies do at once."""
    monkeypatch.setattr(race, "HEAD_START", HEAD_START)
    monkeypatch.setattr(race, "SHARE", SHARE)
    system = shuffled(SEEDED_FAMILIES[family](40, 1), order)
    at_once = [0]
    spend = Race.spend

    def watched(self: Race, nodes: int) -> None:
        at_once.append(nodes)
        spend(self, nodes)

    monkeypatch.setattr(Race, "spend", watched)
    found = synthesize(system)
    strategies = found.statistics.race
    costs = [sum(item.nodes for item in alone(system, way, monkeypatch).statistics.race) for way in WAYS]
    assert sum(item.nodes for item in strategies) <= 3 * (min(costs) + max(at_once) + SHARE) + HEAD_START
    # The winner has worked no more than the others would, but for the head start.
    (won,) = (item for item in strategies if item.won)
    assert won.nodes <= min(costs) + max(at_once) + SHARE + HEAD_START


@needs_cudd
def test_the_same_comes_out_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(race, "HEAD_START", 100)
    monkeypatch.setattr(race, "SHARE", 100)
    system = shuffled(SEEDED_FAMILIES["product line"](30, 1), 3)
    found = synthesize(system, engine="cudd")
    assert len(found.statistics.race) == 3
    for engine in ("cudd", "cudd", "oxidd", "autoref"):
        again = synthesize(system, engine=engine)
        assert (again.added, again.initial) == (found.added, found.initial)
        assert again.statistics.race == found.statistics.race


def test_small_systems_have_no_race() -> None:
    (strategy,) = synthesize(dining_philosophers(5)).statistics.race
    assert strategy.won == 1


@needs_cudd
def test_others_are_given_up_where_diagrams_become_too_large(monkeypatch: pytest.MonkeyPatch) -> None:
    """A result that one strategy finds with so many nodes alone comes out although others began beside it."""
    monkeypatch.setattr(race, "HEAD_START", 1)
    monkeypatch.setattr(race, "SHARE", 5_000)
    system = cat_and_mouse(3, 2)
    least = next(limit for limit in range(1_000, 100_000, 500) if _fits(system, limit, monkeypatch))
    found = synthesize(system, engine=EngineOptions("cudd", maximum_nodes=least))
    assert found.status is SynthesisStatus.SUPERVISOR
    assert any(item.given_up for item in found.statistics.race)
    assert synthesize(system).statistics.race[0].given_up == 0
    with pytest.raises(NodeLimitError, match="BDD node limit 1000 exceeded"):
        synthesize(system, engine=EngineOptions("cudd", maximum_nodes=1_000))


def _fits(system: System, limit: int, patch: pytest.MonkeyPatch) -> bool:
    with patch.context() as only:
        only.setattr(_Portfolio, "_ways", lambda portfolio: WAYS[:1])
        try:
            synthesize(system, engine=EngineOptions("cudd", maximum_nodes=limit))
        except NodeLimitError:
            return False
        return True
