"""Steps of events forwards and backwards, against the explicit semantics."""

from collections.abc import Iterable
from dataclasses import replace
from itertools import islice, product
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.automata import DiscreteVariable, Semantics, System
from robosc.automata.compile import State
from robosc.automata.state import Subject, subject_domain, subjects
from robosc.expressions import IntegerType
from robosc.synthesis import synthesize, transitions
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.engines import make_manager
from robosc.synthesis.transitions import Steps, transition_of
from support.effort import examples
from support.random_systems import any_systems, any_wide_systems
from support.systems import automaton, edge, operation, read, system


def states_of(encoding: Encoding, states: Iterable[State]) -> Any:
    """The predicate of some states."""
    places = [encoding.subjects[subject] for subject in subjects(encoding.system)]
    return encoding.any_of(
        encoding.all_of(encoding.equals(bits, value) for bits, value in zip(places, state, strict=True))
        for state in states
    )


@settings(max_examples=examples(30))
@given(source=st.one_of(any_systems(), any_wide_systems()))
def test_steps_of_random_systems(engine: str, source: System) -> None:
    """From single states and into single states, reachable or not."""
    semantics = Semantics(source)
    encoding = Encoding(source, make_manager(engine))
    false = encoding.manager.false
    every = product(*(subject_domain(source, subject) for subject in subjects(source)))
    sample = [*islice(every, 0, 2000, 97), *semantics.initial_states[:1]]
    for event in source.events:
        steps = Steps(encoding, transition_of(encoding, event))
        for state in sample:
            here = states_of(encoding, [state])
            targets = semantics.targets(state, event.name)
            where = f"{event.name} in {state}"
            assert (steps.plant & here != false) == semantics.enabled(state, event.name), where
            assert (steps.condition & here != false) == semantics.condition(state, event.name), where
            if targets or not event.is_controllable:
                assert steps.image(here) == states_of(encoding, targets), where
                assert (steps.only(states_of(encoding, targets)) & here) == here, where
            for target in sorted(targets, key=str):
                into = states_of(encoding, [target])
                assert steps.some(into) & here == here, where
                assert (steps.only(into) & here == here) == (len(targets) == 1), where
            assert steps.some(encoding.valid_states() & ~states_of(encoding, targets)) & here == false or (
                event.is_controllable and not targets
            ), where


@settings(max_examples=examples(40))
@given(drawn=st.one_of(any_systems(), any_wide_systems()))
def test_bad_states_of_random_systems(engine: str, drawn: System) -> None:
    # Invariants are no event's business.
    source = replace(drawn, invariants=())
    semantics = Semantics(source)
    encoding = Encoding(source, make_manager(engine))
    bad = encoding.any_of(Steps(encoding, transition_of(encoding, event)).bad for event in source.events)
    every = product(*(subject_domain(source, subject) for subject in subjects(source)))
    for state in islice(every, 0, 3000, 53):
        assert (bad & states_of(encoding, [state]) != encoding.manager.false) == semantics.bad(state), state


def one(*arcs: Any) -> System:
    return system(automaton("A", arcs, variables=[DiscreteVariable("x", IntegerType(0, 3), (0,))]))


def functions_of(engine: str, source: System, event: str) -> tuple[Encoding, dict[str, Any]]:
    encoding = Encoding(source, make_manager(engine))
    return encoding, transition_of(encoding, source.event(event)).functions


def test_where_all_edges_lead_to_one_place_the_functions_are_constants(engine: str) -> None:
    """Check for constants, so that predecessors need a cofactor only, and no guard is substituted."""
    guard = operation(read("A.x"), "<", 2)
    arcs = [edge("a -go-> c", guard, x=read("A.x")), edge("b -go-> c"), "c -back-> b", "c -home-> a"]
    encoding, functions = functions_of(engine, one(*arcs), "go")
    assert functions
    assert all(function in (encoding.manager.true, encoding.manager.false) for function in functions.values())


def test_an_event_that_changes_nothing_has_no_functions(engine: str) -> None:
    arcs = [edge("a -stay-> a", x=read("A.x")), "a -go-> b", "b -stay-> b", "b -back-> a"]
    assert functions_of(engine, one(*arcs), "stay")[1] == {}


def test_edges_that_differ_are_told_apart(engine: str) -> None:
    source = one("a -turn-> b", "b -turn-> a", edge("a -low-> a", operation(read("A.x"), "<", 2)))
    encoding, functions = functions_of(engine, source, "turn")
    ((name, function),) = functions.items()
    assert function == ~encoding.manager.var(name)


def test_under_other_conditions_it_reads_what_they_read(engine: str) -> None:
    given = system(
        automaton("A", ["off -go-> on"], marked=["off"]),
        automaton("B", ["off -other-> on"], marked=["off"]),
    )
    encoding = Encoding(given, make_manager(engine))
    steps = Steps(encoding, transition_of(encoding, next(event for event in given.events if event.name == "go")))
    elsewhere = encoding.in_location("B", "on")
    added = steps.under(elsewhere).names - steps.names
    assert added == set(encoding.subjects[Subject("B")].names)
    assert steps.under(encoding.manager.true).names == steps.names


@settings(max_examples=examples(40))
@given(st.one_of(any_systems(), any_wide_systems()))
def test_states_before_an_event_are_found_by_a_relation_as_by_substitution(made: System) -> None:
    """Both lead back to the same states, whatever an event writes."""
    found = []
    for limit in (0, 10**9):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(transitions, "MAXIMUM_SUBSTITUTED", limit)
            found.append(synthesize(made, engine="autoref"))
    assert found[0].added == found[1].added
    assert found[0].status == found[1].status
    assert found[0].statistics.states == found[1].statistics.states
