"""Tests of automata beyond RoboSC, state by state: ways to begin, requirement automata, input variables."""

from dataclasses import replace

import pytest

from robosc.automata import Role, Semantics, System, check_system, disables, environment_variable
from robosc.automata.semantics import MAXIMUM_CHOICES, TooManyChoicesError
from robosc.automata.structure import DiscreteVariable, Edge, Event, EventCondition
from robosc.errors import NondeterministicEventError
from robosc.expressions import TRUE, Binary, Constant, Expression, IntegerType, StateTest, Unary, VariableRead
from robosc.synthesis import SynthesisStatus, synthesize
from robosc.verification import synthesize_explicit
from support.systems import automaton, edge, system

DIGIT = IntegerType(0, 3)


def requirement(name: str, *edges: str, blocks: tuple[str, ...] = ()) -> System:
    """A plant that does what it likes, under a requirement automaton."""
    plant = automaton("P", ["here -go-> here", "here -u_seen-> here"])
    watcher = replace(automaton(name, edges, blocks=blocks), role=Role.REQUIREMENT)
    return system(plant, watcher)


def test_a_system_begins_wherever_all_its_parts_may() -> None:
    parts = automaton("A", ["a -go-> b"], initial=["a", "b"], variables=[DiscreteVariable("n", DIGIT, (0, 2))])
    made = system(parts)
    assert Semantics(made).initial_states == (("a", 0), ("a", 2), ("b", 0), ("b", 2))
    both = Binary("or", StateTest("A", "b"), Binary("=", VariableRead("A", "n"), Constant(2)))
    assert Semantics(replace(made, initial=both)).initial_states == (("a", 2), ("b", 0), ("b", 2))


def test_too_many_ways_to_begin_are_told() -> None:
    wide = IntegerType(0, MAXIMUM_CHOICES)
    made = system(automaton("A", ["a -go-> a"], variables=[DiscreteVariable("n", wide, tuple(range(wide.high or 0)))]))
    assert len(Semantics(made).initial_states) == MAXIMUM_CHOICES
    more = DiscreteVariable("b", DIGIT, (0, 1))
    twice = replace(made, automata=(replace(made.automata[0], variables=(*made.automata[0].variables, more)),))
    with pytest.raises(TooManyChoicesError):
        _ = Semantics(twice).initial_states
    assert synthesize_explicit(twice, limit=10) is None


def test_a_supervisor_begins_only_where_it_can_go_on() -> None:
    made = system(automaton("A", ["a -u_fall-> broken", "b -go-> b"], initial=["a", "b"], marked=["b"]))
    result = synthesize(made)
    assert result.status is SynthesisStatus.SUPERVISOR
    assert result.statistics.states == 1
    assert result.initial is not None
    assert synthesize(system(automaton("A", ["a -go-> b"], initial=["a", "b"]))).initial is None
    nowhere = synthesize(replace(made, initial=StateTest("A", "a")))
    assert nowhere.status is SynthesisStatus.EMPTY


def test_a_marker_condition_marks_fewer_states() -> None:
    made = system(automaton("A", ["a -go-> b"]))
    marked = Semantics(replace(made, marker=StateTest("A", "b")))
    assert [marked.is_marked((location,)) for location in "ab"] == [False, True]
    assert [Semantics(made).is_marked((location,)) for location in "ab"] == [True, True]


def test_a_requirement_automaton_watches_and_forbids() -> None:
    semantics = Semantics(requirement("R", "calm -u_seen-> alert", "calm -go-> calm", "alert -u_seen-> alert"))
    assert semantics.targets(("here", "calm"), "u_seen") == {("here", "alert")}
    assert semantics.condition(("here", "calm"), "go")
    # The plant can do it, the requirement is against it and stays where it is.
    assert semantics.enabled(("here", "alert"), "go")
    assert not semantics.condition(("here", "alert"), "go")
    assert semantics.targets(("here", "alert"), "go") == {("here", "alert")}
    assert semantics.bad_reason(("here", "alert")) is None


def test_an_uncontrollable_event_against_a_requirement_automaton_is_bad() -> None:
    semantics = Semantics(requirement("R", "calm -u_seen-> alert"))
    assert semantics.bad_reason(("here", "alert")) == "u_seen can happen against its requirement"
    assert synthesize(requirement("R", "calm -u_seen-> alert")).status is SynthesisStatus.EMPTY


def test_an_event_of_requirements_alone_cannot_happen() -> None:
    made = system(automaton("P", ["here -go-> here"]), replace(automaton("R", ["l -other-> l"]), role=Role.REQUIREMENT))
    assert not Semantics(made).enabled(("here", "l"), "other")
    result = synthesize(made)
    assert (result.status, result.statistics.states) == (SynthesisStatus.SUPERVISOR, 1)


@pytest.mark.parametrize("engine", ["cudd", "autoref"])
def test_a_controllable_event_with_two_edges_is_an_error(engine: str) -> None:
    if engine == "cudd":
        pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    made = system(automaton("A", ["a -go-> b", "a -go-> a", "b -u_back-> a"]))
    with pytest.raises(NondeterministicEventError, match="go has 2 edges that can be taken in a"):
        Semantics(made).targets(("a",), "go")
    with pytest.raises(NondeterministicEventError, match="A: the controllable event go has several edges"):
        synthesize(made, engine=engine)


def test_guards_that_meet_only_where_there_is_no_value_do_not_meet() -> None:
    n = VariableRead("A", "n")
    low, high = Binary("<", n, Constant(2)), Binary(">=", n, Constant(2))
    # Three values need two bits, whose fourth code is above them all.
    beyond = Binary("or", low, Binary(">", n, Constant(2)))
    arcs: list[Edge | str] = [
        edge("a -go-> a", high, n=Constant(0)),
        edge("a -go-> b", beyond, n=Constant(2)),
        "b -u_back-> a",
    ]
    made = system(automaton("A", arcs, variables=[DiscreteVariable("n", IntegerType(0, 2), (0,))]))
    assert synthesize(made).status is SynthesisStatus.SUPERVISOR


def test_both_forms_of_an_exclusion() -> None:
    made = system(automaton("A", ["a -go-> b", "b -go-> a"]))
    inside: Expression = StateTest("A", "a")
    needs = Semantics(replace(made, conditions=(EventCondition("go", inside),)))
    against = Semantics(replace(made, conditions=(disables(inside, "go"),)))
    for location in "ab":
        assert needs.condition((location,), "go") is (location == "a")
        assert against.condition((location,), "go") is (location == "b")


def test_an_unknown_condition_disables_nothing() -> None:
    unknown = Binary("=", Binary("div", Constant(1), Constant(0)), Constant(1))
    made = system(automaton("A", ["a -go-> b"]))
    assert Semantics(replace(made, conditions=(disables(unknown, "go"),))).condition(("a",), "go")
    assert not Semantics(replace(made, conditions=(EventCondition("go", unknown),))).condition(("a",), "go")


def test_an_input_variable_has_any_value_at_any_time() -> None:
    sensor = environment_variable("sensor", DIGIT)
    near = Binary("<", sensor.read, Constant(2))
    plant = automaton("A", ["a -go-> b", "b -back-> a"])
    made = System(
        "Sensing",
        (sensor.event, Event("go", True), Event("back", True)),
        (sensor.automaton, plant),
        inputs=(sensor.received,),
        conditions=(disables(near, "go"),),
        invariants=(Unary("not", Binary("and", StateTest("A", "b"), Binary("=", sensor.read, Constant(3)))),),
    )
    check_system(made)
    semantics = Semantics(made)
    assert len(semantics.initial_states) == 4
    assert semantics.targets(("here", 0, "a"), "sensor.changes") == {("here", value, "a") for value in range(4)}
    assert [semantics.condition(("here", value, "a"), "go") for value in range(4)] == [False, False, True, True]
    # Whatever the sensor says may change to 3, so the supervisor never lets the plant go.
    assert synthesize(made).statistics.states == 4
    assert synthesize(replace(made, invariants=(TRUE,))).statistics.states == 8
