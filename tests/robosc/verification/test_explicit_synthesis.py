"""The explicit synthesizer, on systems worked out by hand and against the definition itself."""

from collections.abc import Callable
from itertools import chain, combinations

import pytest
from hypothesis import assume, given, settings

from robosc.automata import DiscreteVariable, InputVariable, Semantics, System
from robosc.automata.compile import State
from robosc.errors import SynthesisCancelled
from robosc.expressions import FALSE, BooleanType, IntegerType, StateTest
from robosc.verification import ExplicitSupervisor, synthesize_explicit
from support.effort import examples
from support.random_systems import any_systems, random_system, shares, wide_system
from support.systems import automaton, edge, operation, read, received, state, system


def _synthesize(made: System) -> ExplicitSupervisor:
    supervisor = synthesize_explicit(made, limit=100_000)
    assert supervisor is not None
    return supervisor


def _allowed(made: System) -> dict[State, set[str]]:
    """The controllable events allowed in each state of the controlled system."""
    supervisor = _synthesize(made)
    return {
        at: {event.name for event in made.events if event.is_controllable and supervisor.allows(at, event.name)}
        for at in supervisor.reachable
    }


def test_nothing_to_forbid() -> None:
    made = system(automaton("A", ["idle -go-> busy", "busy -u_end-> idle"]))
    assert _allowed(made) == {("idle",): {"go"}, ("busy",): set()}


def test_a_request_that_leads_to_a_blocked_state_is_forbidden() -> None:
    made = system(automaton("A", ["home -walk-> street", "street -back-> home", "street -jump-> pit"], marked=["home"]))
    assert _allowed(made) == {("home",): {"walk"}, ("street",): {"back"}}
    assert _synthesize(made).good == {("home",), ("street",)}
    assert _synthesize(made).explored == {("home",), ("street",), ("pit",)}


def test_a_loop_without_a_marked_state_is_blocked_too() -> None:
    made = system(automaton("A", ["home -leave-> a", "home -stay-> home", "a -u_x-> b", "b -u_y-> a"], marked=["home"]))
    assert _allowed(made) == {("home",): {"stay"}}


def test_a_request_after_which_the_environment_could_end_badly_is_forbidden() -> None:
    edges = ["home -walk-> ice", "ice -u_slip-> pit", "ice -back-> home", "home -ride-> road", "road -u_stop-> home"]
    made = system(automaton("A", edges, marked=["home"]))
    assert _allowed(made) == {("home",): {"ride"}, ("road",): set()}
    # From the ice one could go back, but not in time.
    assert ("ice",) not in _synthesize(made).good


def test_one_bad_choice_of_the_environment_is_enough() -> None:
    edges = ["home -walk-> ice", "ice -u_slip-> pit", "ice -u_slip-> home", "home -stay-> home"]
    assert _allowed(system(automaton("A", edges, marked=["home"]))) == {("home",): {"stay"}}


def test_a_condition_on_an_uncontrollable_event_keeps_away_from_where_it_could_be_broken() -> None:
    door = automaton("Door", ["closed -open-> open", "open -close-> closed"])
    child = automaton("Child", ["inside -u_run-> outside", "outside -call-> inside"])
    made = system(door, child, conditions={"u_run": StateTest("Door", "closed")})
    assert _allowed(made) == {
        ("closed", "inside"): set(),
        ("closed", "outside"): {"open", "call"},
        ("open", "outside"): {"close"},
    }


def test_a_condition_on_a_controllable_event_is_kept_but_is_no_reason_to_keep_away() -> None:
    made = system(automaton("A", ["l -go-> m", "m -go-> l", "m -back-> l"]), conditions={"go": StateTest("A", "l")})
    assert _allowed(made) == {("l",): {"go"}, ("m",): {"back"}}


def test_a_bounded_counter_counts_up_to_its_range() -> None:
    up = edge("l -up-> l", n=operation(read("A.n"), "+", 1))
    down = edge("l -down-> l", n=operation(read("A.n"), "-", 1))
    made = system(automaton("A", [up, down], variables=[DiscreteVariable("n", IntegerType(-1, 1), (0,))]))
    assert _allowed(made) == {("l", -1): {"up"}, ("l", 0): {"up", "down"}, ("l", 1): {"down"}}


def test_a_counter_of_the_environment_must_not_run_over() -> None:
    got = edge("l -u_got-> l", operation(read("A.on"), "=", True), n=operation(read("A.n"), "+", 1), on=FALSE)
    ask = edge("l -ask-> l", on=operation(read("A.on"), "or", True))
    use = edge("l -use-> l", n=operation(read("A.n"), "-", 1))
    variables = [DiscreteVariable("n", IntegerType(0, 1), (0,)), DiscreteVariable("on", BooleanType(), (False,))]
    made = system(automaton("A", [got, ask, use], variables=variables))
    assert _allowed(made) == {
        ("l", 0, False): {"ask"},
        ("l", 0, True): {"ask"},
        ("l", 1, False): {"use"},
    }


def test_received_data_that_could_be_bad_is_reason_enough() -> None:
    take = edge("asked -u_got-> idle", n=operation(read("A.n"), "+", received()))
    variables = [DiscreteVariable("n", IntegerType(0, 3), (0,))]
    made = system(
        automaton(
            "A", ["idle -ask-> asked", take, edge("idle -drop-> idle", n=operation(1, "+", 0))], variables=variables
        ),
        inputs=[InputVariable("u_got", (), IntegerType(0, 2))],
    )
    allowed = _allowed(made)
    assert {at[1]: events for at, events in allowed.items() if at[0] == "idle"} == {
        0: {"ask", "drop"},
        1: {"ask", "drop"},
        2: {"drop"},
        3: {"drop"},
    }
    assert {at[1] for at in allowed if at[0] == "asked"} == {0, 1}


def test_an_empty_supervisor_is_a_result() -> None:
    made = system(automaton("A", ["l -u_fall-> pit", "pit -u_x-> pit"], marked=["l"]))
    supervisor = _synthesize(made)
    assert supervisor.is_empty
    assert supervisor.good == supervisor.reachable == frozenset()
    assert not supervisor.allows(("l",), "u_fall")


def test_the_search_ends_at_bad_states() -> None:
    made = system(automaton("A", ["l -go-> m", "m -u_x-> n", "n -on-> o"]), conditions={"u_x": StateTest("A", "l")})
    assert _synthesize(made).explored == {state(made), state(made, A="m")}


def test_beyond_the_limit_there_is_no_answer() -> None:
    made = system(automaton("A", ["a -go-> b", "b -go-> c"]))
    assert synthesize_explicit(made, limit=2) is None
    assert synthesize_explicit(made, limit=3) is not None


def test_it_stops_on_request() -> None:
    made = system(automaton("A", ["a -go-> b", "b -go-> c"]))
    with pytest.raises(SynthesisCancelled):
        synthesize_explicit(made, limit=10, should_stop=lambda: True)


# The definition itself: the largest set of states that is safe, controllable and nonblocking.


def _supports(semantics: Semantics, kept: frozenset[State]) -> bool:
    """Return True if a supervisor could keep the system in `kept` from every state of it."""
    steps: dict[State, set[State]] = {}
    for at in kept:
        if semantics.bad(at):
            return False
        steps[at] = set()
        for event in semantics.system.events:
            targets = semantics.targets(at, event.name)
            if not event.is_controllable and not targets <= kept:
                return False
            if targets <= kept and (not event.is_controllable or semantics.condition(at, event.name)):
                steps[at] |= targets
    reach = {at for at in kept if semantics.is_marked(at)}
    while True:
        more = {at for at in kept - reach if steps[at] & reach}
        if not more:
            return reach == kept
        reach |= more


@settings(max_examples=examples(60))
@given(any_systems())
def test_agrees_with_the_largest_subset_that_meets_the_definition(drawn: System) -> None:
    supervisor = _synthesize(drawn)
    assume(len(supervisor.explored) <= 9)
    semantics = Semantics(drawn)
    states = sorted(supervisor.explored)
    subsets = chain.from_iterable(combinations(states, size) for size in range(len(states) + 1))
    largest: frozenset[State] = frozenset()
    for subset in map(frozenset, subsets):
        if not subset <= largest and _supports(semantics, subset):
            largest |= subset
    assert supervisor.good == largest
    assert supervisor.is_empty == (semantics.initial not in largest)


@pytest.mark.parametrize("make", [random_system, wide_system])
def test_random_systems_are_worth_comparing(make: Callable[[int], System]) -> None:
    found = shares([make(seed) for seed in range(150)])
    assert found["disables"] >= 0.5
    assert 0.1 <= found["empty"] <= 0.34
