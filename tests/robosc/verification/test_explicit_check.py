"""The verifier accepts right supervisors and catches each kind of wrong one, with a trace that replays."""

from collections.abc import Callable
from itertools import islice

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from robosc.automata import DiscreteVariable, Semantics, System, to_automata
from robosc.automata.compile import State
from robosc.errors import SynthesisCancelled
from robosc.expressions import IntegerType, StateTest
from robosc.model.structure import Deployment
from robosc.verification import CheckOutcome, ExplicitSupervisor, Failure, Verification, verify_explicitly
from support.effort import examples
from support.models import EXAMPLE_NAMES, example_model
from support.random_systems import disables_something, explicit_supervisor, systems
from support.systems import automaton, edge, operation, read, replay, system

PASSED, FAILED, NOT_CHECKED = CheckOutcome.PASSED, CheckOutcome.FAILED, CheckOutcome.NOT_CHECKED

# From the street one may fall; on the ice the environment decides.
WALK = system(
    automaton(
        "A",
        [
            "home -walk-> street",
            "street -back-> home",
            "street -jump-> pit",
            "home -skate-> ice",
            "ice -u_slip-> pit",
        ],
        marked=["home"],
    )
)
RIGHT: dict[str, Callable[[State], bool]] = {"jump": lambda at: False, "skate": lambda at: False}


def _outcomes(found: Verification) -> tuple[CheckOutcome, CheckOutcome, CheckOutcome, CheckOutcome]:
    return found.safe, found.controllable, found.nonblocking, found.maximally_permissive


def _failure(found: Verification, property_: str) -> Failure:
    return next(item for item in found.failures if item.property == property_)


def test_a_right_supervisor_passes() -> None:
    found = verify_explicitly(WALK, RIGHT)
    assert _outcomes(found) == (PASSED, PASSED, PASSED, PASSED)
    assert (found.states, found.transitions) == (2, 2)
    assert (found.failures, found.trace, found.message) == ((), (), "")


@pytest.mark.parametrize(("event", "trace"), [("jump", ("walk", "jump")), ("skate", ("skate", "u_slip"))])
def test_a_forbidden_request_that_is_allowed_blocks(event: str, trace: tuple[str, ...]) -> None:
    added = {name: condition for name, condition in RIGHT.items() if name != event}
    found = verify_explicitly(WALK, added)
    assert found.nonblocking is FAILED
    assert found.safe is PASSED
    failure = _failure(found, "nonblocking")
    assert replay(WALK, added, failure.trace) == {failure.state}
    assert failure.trace == trace[: len(failure.trace)]


def test_an_allowed_request_that_is_forbidden_is_found() -> None:
    added = {**RIGHT, "walk": lambda at: False}
    found = verify_explicitly(WALK, added)
    assert _outcomes(found) == (PASSED, PASSED, PASSED, FAILED)
    assert found.message == "not maximally permissive: walk is disabled although it could be allowed in A = home"
    assert found.trace == ()


def test_a_request_forbidden_deep_inside_is_found_there() -> None:
    added = {**RIGHT, "back": lambda at: False}
    found = verify_explicitly(WALK, added)
    failure = _failure(found, "maximally permissive")
    assert failure.trace == ("walk",)
    assert failure.state == ("street",)
    assert found.nonblocking is FAILED


def test_a_bad_state_that_can_be_reached_is_unsafe() -> None:
    made = system(
        automaton("A", ["l -go-> m", "m -u_x-> l", "l -on-> n", "n -off-> l"]), conditions={"u_x": StateTest("A", "l")}
    )
    found = verify_explicitly(made, {})
    assert found.safe is FAILED
    assert found.message == "not safe: u_x can happen against its requirement in A = m"
    assert found.trace == ("go",)
    assert _outcomes(verify_explicitly(made, {"go": lambda at: False})) == (PASSED, PASSED, PASSED, PASSED)


def test_the_environment_does_not_care_about_requirements() -> None:
    made = system(automaton("A", ["l -u_x-> pit"], marked=["l"]), conditions={"u_x": StateTest("A", "pit")})
    found = verify_explicitly(made, {})
    assert found.states == 2
    assert found.safe is FAILED
    assert _failure(found, "nonblocking").trace == ("u_x",)


def test_a_range_that_the_environment_can_leave_is_unsafe() -> None:
    made = system(
        automaton(
            "A",
            [edge("l -ask-> m"), edge("m -u_got-> l", n=operation(read("A.n"), "+", 1))],
            variables=[DiscreteVariable("n", IntegerType(0, 2), (0,))],
        )
    )
    found = verify_explicitly(made, {})
    assert found.safe is FAILED
    assert found.trace == ("ask", "u_got", "ask", "u_got", "ask")
    assert _outcomes(verify_explicitly(made, {"ask": lambda at: at[1] != 2})) == (PASSED, PASSED, PASSED, PASSED)
    assert verify_explicitly(made, {"ask": lambda at: at[1] == 0}).maximally_permissive is FAILED


def test_disabling_an_uncontrollable_event_is_found() -> None:
    made = system(automaton("A", ["home -skate-> ice", "ice -u_slip-> pit", "ice -back-> home"], marked=["home"]))
    found = verify_explicitly(made, {"u_slip": lambda at: False})
    assert _outcomes(found) == (PASSED, FAILED, PASSED, PASSED)
    assert found.trace == ("skate",)
    assert found.message == "not controllable: the uncontrollable u_slip is disabled in A = ice"


def test_a_condition_on_an_uncontrollable_event_that_disables_nothing_is_allowed() -> None:
    made = system(automaton("A", ["l -go-> m", "m -u_x-> l"]))
    assert _outcomes(verify_explicitly(made, {"u_x": lambda at: at == ("m",)})) == (PASSED, PASSED, PASSED, PASSED)


def test_every_requirement_counts_even_if_the_supervisor_adds_nothing() -> None:
    made = system(automaton("A", ["l -go-> m", "m -back-> l"]), conditions={"go": StateTest("A", "m")})
    found = verify_explicitly(made, {})
    assert found.states == 1
    assert found.safe is PASSED


def test_beyond_the_limits_nothing_is_claimed() -> None:
    assert verify_explicitly(WALK, RIGHT, limit=1) == Verification(None, None, *[NOT_CHECKED] * 4)  # type: ignore[arg-type]
    assert _outcomes(verify_explicitly(WALK, RIGHT, permissive_limit=3)) == (PASSED, PASSED, PASSED, NOT_CHECKED)


def test_an_unknown_event_is_refused() -> None:
    with pytest.raises(ValueError, match="does not have: fly"):
        verify_explicitly(WALK, {"fly": lambda at: True})


def test_it_stops_on_request() -> None:
    with pytest.raises(SynthesisCancelled):
        verify_explicitly(WALK, RIGHT, should_stop=lambda: True)


def _added(made: System, supervisor: ExplicitSupervisor) -> dict[str, Callable[[State], bool]]:
    def condition(event: str) -> Callable[[State], bool]:
        return lambda at: supervisor.allows(at, event)

    return {event.name: condition(event.name) for event in made.events if event.is_controllable}


@settings(max_examples=examples(50))
@given(systems())
def test_what_is_synthesized_passes(drawn: System) -> None:
    supervisor = explicit_supervisor(drawn)
    assert supervisor is not None
    found = verify_explicitly(drawn, _added(drawn, supervisor))
    if supervisor.is_empty:
        assert FAILED in (found.safe, found.nonblocking)
    else:
        assert _outcomes(found) == (PASSED, PASSED, PASSED, PASSED)
        assert found.states == len(supervisor.reachable)


def _mutant(
    made: System, supervisor: ExplicitSupervisor, flipped: tuple[State, str]
) -> dict[str, Callable[[State], bool]]:
    """The supervisor with its mind changed about one event in one state."""
    where, event = flipped
    added = _added(made, supervisor)
    right = added[event]
    added[event] = lambda at: right(at) != (at == where)
    return added


@settings(max_examples=examples(50))
@given(systems(), st.data())
def test_every_mutant_is_caught_with_a_trace_that_replays(drawn: System, data: st.DataObject) -> None:
    supervisor = explicit_supervisor(drawn)
    assume(supervisor is not None and not supervisor.is_empty and disables_something(drawn, supervisor))
    assert supervisor is not None
    semantics = Semantics(drawn)
    places = [
        (at, event.name)
        for at in islice(sorted(supervisor.reachable), 50)
        for event in drawn.events
        if event.is_controllable and semantics.enabled(at, event.name) and semantics.condition(at, event.name)
    ]
    where, event = data.draw(st.sampled_from(places))
    added = _mutant(drawn, supervisor, (where, event))
    found = verify_explicitly(drawn, added)
    if supervisor.allows(where, event):
        assert found.maximally_permissive is FAILED
        assert found.safe is PASSED
        assert _failure(found, "maximally permissive").state == where
    else:
        assert FAILED in (found.safe, found.nonblocking)
    for failure in found.failures:
        assert failure.state in replay(drawn, added, failure.trace)


@pytest.mark.parametrize("name", EXAMPLE_NAMES)
@pytest.mark.parametrize("deployment", list(Deployment))
def test_the_examples_have_supervisors_that_pass(name: str, deployment: Deployment) -> None:
    drawn = to_automata(example_model(name), deployment)
    supervisor = explicit_supervisor(drawn)
    assert supervisor is not None
    assert not supervisor.is_empty
    found = verify_explicitly(drawn, _added(drawn, supervisor))
    assert _outcomes(found) == (PASSED, PASSED, PASSED, PASSED)
    assert found.states == len(supervisor.reachable)
