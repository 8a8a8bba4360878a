"""Symbolic synthesis against the explicit twin, the same suite over every engine."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from robosc.automata import Automaton, Edge, Event, InputVariable, System, to_automata
from robosc.automata.controlled import controlled_graph
from robosc.automata.semantics import Semantics
from robosc.automata.structure import Assignment, DiscreteVariable, EventCondition
from robosc.cif import check_cif, load_cif
from robosc.errors import SynthesisCancelled
from robosc.expressions import BooleanType, IntegerType, Received
from robosc.expressions.tree import Binary, Constant, VariableRead
from robosc.model.structure import Deployment
from robosc.supervisor.predicates import state_predicate, state_predicates
from robosc.synthesis import (
    SynthesisProgress,
    SynthesisResult,
    SynthesisStatus,
    UnknownEngineError,
    race,
    synthesize,
)
from robosc.synthesis.result import Closure, Search
from robosc.verification import CheckOutcome, verify_explicitly
from robosc.verification.symbolic import verify_symbolically
from support.effort import seeds
from support.engines import needs_cudd
from support.models import EXAMPLE_NAMES, example_model
from support.random_systems import explicit_supervisor, kind, random_system, wide_system

ENGINES = ("cudd", "oxidd", "autoref")
PARTS = 4
"""Parts that can run beside each other."""

LIMIT = 50_000

pytestmark = needs_cudd


def agree(system: System, engines: tuple[str, ...] = ENGINES) -> str:
    """Compare engines with the explicit twin in every reachable state; returns the system's kind."""
    explicit = explicit_supervisor(system)
    assert explicit is not None
    results = [synthesize(system, engine=engine) for engine in engines]
    first = results[0]
    assert all(result.added == first.added and result.status == first.status for result in results)
    # The same strategies race for every engine, as far, and the same one wins.
    assert len({replace(result.statistics, engine="", closure=Closure.SATURATION) for result in results}) == 1
    assert (first.status is SynthesisStatus.EMPTY) == explicit.is_empty
    if explicit.is_empty:
        assert first.reason
        return "empty"
    assert first.statistics.states == len(explicit.reachable)
    semantics = Semantics(system)
    added = state_predicates(system, first.added)
    disables = False
    for state in explicit.reachable:
        for event in system.events:
            if not event.is_controllable:
                assert event.name not in added
                continue
            plant = semantics.enabled(state, event.name) and semantics.condition(state, event.name)
            allowed = plant and (event.name not in added or added[event.name](state))
            assert allowed == explicit.allows(state, event.name), (state, event)
            disables = disables or (plant and not allowed)
    assert all(result.initial == first.initial for result in results)
    begins = state_predicate(system, first.initial) if first.initial else (lambda state: True)
    assert all(begins(state) == (state in explicit.good) for state in semantics.initial_states)
    graph = controlled_graph(semantics, added, initial=begins, limit=LIMIT)
    assert graph is not None
    assert set(graph.states) == set(explicit.reachable)
    assert_verified(system, first)
    return "disables" if disables else "free"


def assert_verified(system: System, result: SynthesisResult) -> None:
    """All four properties hold for the independent verifiers, state by state and on sets of states."""
    added = state_predicates(system, result.added)
    initial = None if result.initial is None else state_predicate(system, result.initial)
    one_by_one = verify_explicitly(system, added, initial=initial, limit=LIMIT, permissive_limit=LIMIT)
    checked = (one_by_one.safe, one_by_one.controllable, one_by_one.nonblocking, one_by_one.maximally_permissive)
    assert set(checked) == {CheckOutcome.PASSED}, one_by_one.message
    on_sets = verify_symbolically(system, added, initial=initial, limit=10**9)
    assert {on_sets.safe, on_sets.controllable, on_sets.nonblocking} == {CheckOutcome.PASSED}, on_sets.message
    assert one_by_one.states == on_sets.states == result.statistics.states


@pytest.mark.random
@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize("make", [random_system, wide_system])
def test_random_systems(make: Callable[[int], System], part: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for seed in seeds(15):
        # Without a head start, and with short turns, small systems are solved by every strategy.
        monkeypatch.setattr(race, "HEAD_START", (10**7, 1, 2_000, 10_000)[seed % 4])
        monkeypatch.setattr(race, "SHARE", (500, 1, 100, 3_000)[seed % 4])
        # The seeds are the same in every part, the systems are not.
        system = make(seed * PARTS + part)
        # The plain engine is slow: every other time will do.
        assert agree(system, ENGINES if seed % 2 else ENGINES[:1]) == kind(system), seed


@pytest.mark.random
def test_either_search_comes_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(race, "HEAD_START", 1)
    monkeypatch.setattr(race, "SHARE", 1)
    found = [synthesize(random_system(seed)).statistics for seed in seeds(60)]
    assert {item.search for item in found} == set(Search)
    assert len({item.order for item in found}) > 1


def test_states_that_no_run_reaches_do_not_hold_up_synthesis() -> None:
    # From the marked states backwards this takes a minute and a half.
    found = check_cif(load_cif(Path(__file__).parents[2] / "models" / "wafer_handling.cif"))
    assert found.system is not None
    result = synthesize(found.system, engine="cudd")
    assert result.statistics.search is Search.REACHABLE_FIRST
    assert result.statistics.states == 468_979_718


@pytest.mark.parametrize("deployment", list(Deployment))
@pytest.mark.parametrize("name", EXAMPLE_NAMES)
def test_the_example_robots(name: str, deployment: Deployment) -> None:
    found = agree(to_automata(example_model(name), deployment))
    assert found == ("disables" if name.startswith("navigation") else "free")


def counter(high: int, *, controllable: bool = True) -> System:
    """A counter that one event raises, and another sets back."""
    up = Binary("+", VariableRead("C", "n"), Constant(1))
    automaton = Automaton(
        name="C",
        locations=("only",),
        initial=("only",),
        marked=frozenset({"only"}),
        alphabet=frozenset({"up", "zero"}),
        edges=(
            Edge("only", "up", "only", updates=(Assignment("n", up),)),
            Edge("only", "zero", "only", updates=(Assignment("n", Constant(0)),)),
        ),
        variables=(DiscreteVariable("n", IntegerType(0, high), (0,)),),
    )
    return System("Counter", (Event("up", controllable), Event("zero", True)), (automaton,))


@pytest.mark.parametrize("high", [1, 2, 3, 7, 100])
def test_a_counter_stops_at_its_bound(engine: str, high: int) -> None:
    result = synthesize(counter(high), engine=engine)
    assert result.statistics.states == high + 1
    # The range itself disables the event: there is nothing for the supervisor to add.
    assert result.added == ()


def test_a_counter_that_nobody_can_stop_has_no_supervisor(engine: str) -> None:
    result = synthesize(counter(3, controllable=False), engine=engine)
    assert result.status is SynthesisStatus.EMPTY
    assert "uncontrollable" in result.reason


def test_counts_are_exact_beyond_a_double(engine: str) -> None:
    """60 toggles have 2^60 states, and one automaton more makes the number odd."""
    toggles = [
        Automaton(
            f"T{number}",
            ("off", "on"),
            ("off",),
            frozenset({"off", "on"}),
            frozenset({f"t{number}"}),
            (Edge("off", f"t{number}", "on"), Edge("on", f"t{number}", "off")),
        )
        for number in range(60)
    ]
    line = Automaton(
        "Three",
        ("a", "b", "c"),
        ("a",),
        frozenset({"a", "b", "c"}),
        frozenset({"next"}),
        (Edge("a", "next", "b"), Edge("b", "next", "c")),
    )
    events = (*(Event(f"t{number}", True) for number in range(60)), Event("next", True))
    result = synthesize(System("Many", events, (*toggles, line)), engine=engine)
    assert result.statistics.states == 3 * 2**60


def nested(paths: tuple[tuple[str | int, ...], ...]) -> System:
    """One automaton that remembers the last received elements of arrays within arrays."""
    variables = tuple(DiscreteVariable(f"v{n}", BooleanType(), (False,)) for n in range(len(paths)))
    updates = tuple(Assignment(f"v{n}", Received(path)) for n, path in enumerate(paths))
    automaton = Automaton(
        "A", ("l",), ("l",), frozenset({"l"}), frozenset({"e"}), (Edge("l", "e", "l", updates=updates),), variables
    )
    inputs = tuple(InputVariable("e", path, BooleanType(), may_be_unknown=True) for path in paths)
    return System("Nested", (Event("e", False),), (automaton,), inputs)


@pytest.mark.parametrize(
    "paths",
    [
        (("a", 0), ("a", 2)),
        (("a", 0), ("b", 0)),
        (("a", 1, "b", 0), ("a", 0, "b", 3)),
        (("a", 1, "b", 0), ("a", 1, "b", 3), ("a", 0, "b", 3)),
        (("a", 2), ("a", 1), ("a", 1, "b", 0)),
    ],
)
def test_arrays_within_arrays(paths: tuple[tuple[str | int, ...], ...]) -> None:
    """Check that the states that one event reaches show the elements that can be missing together."""
    assert agree(nested(paths)) == "free"


def test_cancelling(engine: str) -> None:
    asked = 0

    def stop() -> bool:
        nonlocal asked
        asked += 1
        return asked > 3

    with pytest.raises(SynthesisCancelled):
        synthesize(counter(100), engine=engine, should_stop=stop)
    assert asked == 4


def test_progress_is_reported(engine: str) -> None:
    reported: list[SynthesisProgress] = []
    synthesize(counter(3), engine=engine, on_progress=reported.append)
    assert list(dict.fromkeys(progress.phase for progress in reported)) == [
        "encoding",
        "coreachability",
        "fixed point",
        "reachability",
    ]
    assert all(progress.nodes > 0 for progress in reported)


def test_an_unknown_engine_is_refused() -> None:
    with pytest.raises(UnknownEngineError, match="there are auto, autoref, cudd"):
        synthesize(counter(3), engine="sylvan")


def test_an_event_condition_on_an_uncontrollable_event_makes_states_bad(engine: str) -> None:
    """State 2 is never reached: nobody may set the counter back from it, and nobody can forbid it."""
    system = replace(
        counter(3),
        events=(Event("up", True), Event("zero", False)),
        conditions=(EventCondition("zero", Binary("!=", VariableRead("C", "n"), Constant(2))),),
    )
    result = synthesize(system, engine=engine)
    assert result.statistics.states == 2
    allowed = state_predicates(system, result.added)["up"]
    assert [allowed(("only", n)) for n in (0, 1)] == [True, False]
