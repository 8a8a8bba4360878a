"""The searches on packed states agree with the plain ones on state tuples."""

from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.automata import DiscreteVariable, InputVariable, Semantics, System
from robosc.automata.controlled import Added, controlled_graph
from robosc.automata.state import subject_domain, subjects
from robosc.errors import SynthesisCancelled
from robosc.expressions import IntegerType
from robosc.supervisor import AddedCondition
from robosc.supervisor.predicates import state_predicates
from robosc.verification import packing as packing_module
from robosc.verification import search as search_module
from robosc.verification import synthesize_explicit, verify_explicitly
from robosc.verification.packing import Packing
from robosc.verification.permissive import Allowed, allowed
from robosc.verification.search import Effort, Reached, blocking_state, search
from support.effort import examples
from support.families import FAMILIES
from support.random_supervisors import random_diagram
from support.random_systems import any_systems, systems
from support.systems import automaton, edge, operation, read, received, system


def effort(limit: int = 20_000) -> Effort:
    return Effort(limit, lambda: False, lambda message: None, "states")


def random_conditions(made: System, seed: int) -> Added:
    """Conditions on some events, uncontrollable ones as well."""
    dice = Random(seed)
    return state_predicates(
        made, [AddedCondition(event.name, random_diagram(dice, made)) for event in made.events if dice.random() < 0.5]
    )


def searched(made: System, added: Added, limit: int = 20_000) -> Reached:
    found = search(Packing(Semantics(made)), added, effort(limit))
    assert found is not None
    return found


def _allowed(made: System) -> tuple[Packing, Allowed]:
    packing = Packing(Semantics(made))
    tables = packing.tables(made.events, {})
    found = allowed(packing, tables, effort())
    assert found is not None
    return packing, found


@settings(max_examples=examples(15))
@given(systems(), st.integers(0, 10**6))
def test_the_search_finds_the_graph(made: System, seed: int) -> None:
    added = random_conditions(made, seed)
    graph = controlled_graph(Semantics(made), added, limit=20_000)
    assert graph is not None
    found = searched(made, added)
    assert {found.packing.decode(code) for code in found.codes} == set(graph.states)
    assert len(found.targets) == sum(len(targets) for steps in graph.steps for _, targets in steps)
    distances = {state: len(graph.trace(number)) for number, state in enumerate(graph.states)}
    for number, code in enumerate(found.codes):
        assert len(found.trace(number)) == distances[found.packing.decode(code)]


@settings(max_examples=examples(12))
@given(systems(), st.integers(0, 10**6))
def test_functions_are_conditions_as_well(made: System, seed: int) -> None:
    added = random_conditions(made, seed)
    functions = {event: (lambda at, holds=holds: holds(at)) for event, holds in added.items()}
    assert searched(made, functions).codes == searched(made, added).codes


@settings(max_examples=examples(12))
@given(systems(), st.integers(0, 10**6))
def test_blocking_states_are_those_from_which_no_marked_one_is_reachable(made: System, seed: int) -> None:
    found = searched(made, random_conditions(made, seed))
    semantics = Semantics(made)
    reaching = {n for n, code in enumerate(found.codes) if semantics.is_marked(found.packing.decode(code))}
    while True:
        more = {
            n
            for n in range(len(found.codes))
            if n not in reaching and reaching & {*found.targets[found.offsets[n] : found.offsets[n + 1]]}
        }
        if not more:
            break
        reaching |= more
    assert blocking_state(found) == min({*range(len(found.codes))} - reaching, default=None)


@settings(max_examples=examples(15))
@given(systems())
def test_the_recomputed_supervisor_is_the_explicit_one(made: System) -> None:
    explicit = synthesize_explicit(made, limit=20_000)
    assert explicit is not None
    packing, found = _allowed(made)
    states = {number: packing.decode(code) for code, number in found.numbers.items()}
    assert set(states.values()) == explicit.explored
    assert {state for number, state in states.items() if found.good[number]} == explicit.good
    for code, number in found.numbers.items():
        for place, event in enumerate(made.events):
            if event.is_controllable:
                assert found.allows(code, place) == explicit.allows(states[number], event.name)


def test_an_event_that_may_end_badly_is_no_way_out() -> None:
    """A supervisor allows a controllable event as a whole or not at all."""
    n = IntegerType(0, 1)
    made = system(
        automaton(
            "A",
            [edge("home -go-> away", n=received()), edge("away -rest-> done", operation(read("A.n"), "=", 0))],
            marked=["done"],
            variables=[DiscreteVariable("n", n, (0,))],
        ),
        inputs=[InputVariable("go", (), n)],
    )
    packing, found = _allowed(made)
    good = {packing.decode(code) for code, number in found.numbers.items() if found.good[number]}
    explicit = synthesize_explicit(made, limit=100)
    assert explicit is not None
    assert good == explicit.good == {("away", 0), ("done", 0)}


def test_what_is_forgotten_is_worked_out_again(monkeypatch: pytest.MonkeyPatch) -> None:
    made = FAMILIES["random robot"](3)
    before = searched(made, {})
    whole = verify_explicitly(made, {})
    monkeypatch.setattr(packing_module, "REMEMBERED", 2)
    assert searched(made, {}).codes == before.codes
    assert verify_explicitly(made, {}) == whole


@settings(max_examples=examples(10))
@given(any_systems())
def test_packing_and_back(made: System) -> None:
    packing = Packing(Semantics(made))
    for dice in map(Random, range(5)):
        state = tuple(dice.choice(list(subject_domain(made, subject))) for subject in subjects(made))
        assert packing.decode(packing.encode(state)) == state


def test_the_limit_is_exact() -> None:
    made = FAMILIES["random robot"](3)
    states = len(searched(made, {}).codes)
    assert search(Packing(Semantics(made)), {}, effort(states)) is not None
    assert search(Packing(Semantics(made)), {}, effort(states - 1)) is None


@pytest.mark.timeout(60)
def test_steps_without_number_end_the_search() -> None:
    wide = IntegerType(0, 10_000)
    made = system(
        automaton(
            "A",
            [edge("l -u_got-> l", n=received("x"), m=received("y"))],
            variables=[DiscreteVariable("n", wide, (0,)), DiscreteVariable("m", wide, (0,))],
        ),
        inputs=[InputVariable("u_got", ("x",), wide), InputVariable("u_got", ("y",), wide)],
    )
    assert search(Packing(Semantics(made)), {}, effort(10**6)) is None
    one = system(
        automaton("A", [edge("l -u_got-> l", n=received("x"))], variables=[DiscreteVariable("n", wide, (0,))]),
        inputs=[InputVariable("u_got", ("x",), wide)],
    )
    assert search(Packing(Semantics(one)), {}, effort(20_000)) is None


def test_a_range_too_wide_to_list_is_packed() -> None:
    made = system(
        automaton(
            "A",
            [edge("l -go-> l", n=received())],
            variables=[DiscreteVariable("n", IntegerType(-(2**31), 2**31 - 1), (7,))],
        ),
        inputs=[InputVariable("go", (), IntegerType(3, 4))],
    )
    assert len(searched(made, {}).codes) == 3


def test_progress_is_reported_and_the_search_stops(monkeypatch: pytest.MonkeyPatch) -> None:
    made, reported = FAMILIES["dining philosophers"](8), list[str]()
    search(Packing(Semantics(made)), {}, Effort(50_000, lambda: False, reported.append, "states"))
    assert reported == []
    monkeypatch.setattr(search_module, "PROGRESS_INTERVAL", 1024)
    search(Packing(Semantics(made)), {}, Effort(50_000, lambda: False, reported.append, "states"))
    assert reported[:1] == ["1024 states"]
    with pytest.raises(SynthesisCancelled):
        search(Packing(Semantics(made)), {}, Effort(50_000, lambda: bool(reported), reported.append, "states"))
