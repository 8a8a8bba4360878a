"""Tests of automata beyond RoboSC: ways to begin, requirement automata, monitors, plant conditions, input variables."""

from dataclasses import replace
from functools import partial

import pytest

from robosc.automata import Role, Semantics, System, check_system, disables, environment_variable
from robosc.automata.semantics import MAXIMUM_CHOICES, TooManyChoicesError
from robosc.automata.structure import DiscreteVariable, Edge, Event, EventCondition
from robosc.expressions import FALSE, TRUE, Binary, Constant, Expression, IntegerType, StateTest, Unary, VariableRead
from robosc.synthesis import SynthesisStatus, edge_choices, synthesize
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


def test_too_many_ways_to_begin_are_reported() -> None:
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


def test_an_event_of_requirements_alone_happens_where_they_allow_it() -> None:
    watcher = replace(automaton("R", ["l -other-> m"], marked=["m"]), role=Role.REQUIREMENT)
    made = system(automaton("P", ["here -go-> here"]), watcher)
    semantics = Semantics(made)
    assert semantics.enabled(("here", "l"), "other")
    assert semantics.targets(("here", "l"), "other") == {("here", "m")}
    assert semantics.condition(("here", "l"), "other")
    # They are against it, but the plants could do it: uncontrollable, it would make the state bad.
    assert semantics.enabled(("here", "m"), "other")
    assert not semantics.condition(("here", "m"), "other")
    result = synthesize(made)
    assert (result.status, result.statistics.states) == (SynthesisStatus.SUPERVISOR, 2)


def test_an_event_of_nobody_cannot_happen() -> None:
    made = system(automaton("P", ["here -go-> here"]))
    made = replace(made, events=(*made.events, Event("u_other", False)))
    made = replace(made, conditions=(EventCondition("u_other", FALSE),))
    assert not Semantics(made).enabled(("here",), "u_other")
    assert synthesize(made).statistics.states == 1


def test_a_monitor_blocks_nothing_and_follows_where_it_can() -> None:
    plant = automaton("P", ["here -go-> here"])
    watcher = replace(automaton("M", ["a -go-> b"]), monitors=frozenset({"go"}))
    for role in Role:
        semantics = Semantics(system(plant, replace(watcher, role=role)))
        assert semantics.targets(("here", "a"), "go") == {("here", "b")}
        assert semantics.targets(("here", "b"), "go") == {("here", "b")}
        assert semantics.condition(("here", "b"), "go")
    # An event that is only monitored always can happen.
    assert Semantics(system(watcher)).targets(("b",), "go") == {("b",)}


def test_a_requirement_without_an_edge_for_a_monitored_uncontrollable_event_has_nothing_against_it() -> None:
    plant = automaton("P", ["here -u_seen-> here"])
    watcher = replace(automaton("R", ["a -u_seen-> b"]), role=Role.REQUIREMENT)
    assert synthesize(system(plant, watcher)).status is SynthesisStatus.EMPTY
    monitor = replace(watcher, monitors=frozenset({"u_seen"}))
    assert synthesize(system(plant, monitor)).statistics.states == 2


def counting(event: str) -> System:
    """A counter that cannot say itself where it ends."""
    up = edge(f"l -{event}-> l", n=Binary("+", VariableRead("A", "n"), Constant(1)))
    return system(automaton("A", [up], variables=[DiscreteVariable("n", DIGIT, (0,))]))


def below(bound: int) -> Binary:
    """The count is below a bound."""
    return Binary("<", VariableRead("A", "n"), Constant(bound))


@pytest.mark.parametrize(("event", "states"), [("count", 3), ("u_count", 3)])
def test_a_plant_condition_bars_an_event_whoever_controls_it(event: str, states: int) -> None:
    made = replace(counting(event), plant_conditions=(EventCondition(event, below(2)),))
    semantics = Semantics(made)
    assert [semantics.enabled(("l", n), event) for n in range(4)] == [True, True, False, False]
    # An event that does not happen is against no requirement and leaves no range.
    strict = replace(made, conditions=(EventCondition(event, below(2)),))
    assert not any(Semantics(strict).bad(("l", n)) for n in (2, 3))
    result = synthesize(strict)
    assert (result.statistics.states, result.added) == (states, ())
    # The requirement is a duty that cannot be fulfilled here.
    only_required = replace(counting("u_count"), conditions=(EventCondition("u_count", below(2)),))
    assert synthesize(only_required).status is SynthesisStatus.EMPTY


@pytest.mark.parametrize("event", ["count", "u_count"])
def test_what_would_break_a_plant_invariant_does_not_happen(event: str) -> None:
    made = replace(counting(event), plant_invariants=(below(2),))
    semantics = Semantics(made)
    assert semantics.targets(("l", 0), event) == {("l", 1)}
    assert not semantics.enabled(("l", 1), event)
    assert not semantics.bad(("l", 1))
    result = synthesize(made)
    assert (result.statistics.states, result.added) == (2, ())


def test_of_several_steps_those_are_left_that_keep_the_plant_invariants() -> None:
    made = system(automaton("A", ["a -u_go-> b", "a -u_go-> c"]))
    made = replace(made, plant_invariants=(Unary("not", StateTest("A", "c")),))
    assert Semantics(made).targets(("a",), "u_go") == {("b",)}
    assert synthesize(made).statistics.states == 2


def test_the_system_does_not_begin_against_a_plant_invariant() -> None:
    made = system(automaton("A", ["a -go-> a", "b -go-> b"], initial=["a", "b"]))
    assert Semantics(replace(made, plant_invariants=(StateTest("A", "b"),))).initial_states == (("b",),)
    nowhere = synthesize(replace(made, plant_invariants=(StateTest("A", "b"), StateTest("A", "a"))))
    assert nowhere.status is SynthesisStatus.EMPTY
    assert nowhere.reason == "there is no initial state in which the plant invariants are true"


def test_without_a_location_to_begin_in_there_is_no_initial_state() -> None:
    made = system(automaton("A", ["a -go-> a"], initial=[]))
    check_system(made)
    assert Semantics(made).initial_states == ()
    assert synthesize(made).reason == "there is no initial state"


@pytest.mark.parametrize("engine", ["cudd", "oxidd", "autoref"])
def test_a_controllable_event_is_allowed_only_where_each_of_its_edges_is_good(engine: str) -> None:
    if engine == "cudd":
        pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    made = system(automaton("A", ["a -go-> b", "a -go-> a", "b -u_back-> a"]))
    assert Semantics(made).targets(("a",), "go") == {("a",), ("b",)}
    result = synthesize(made, engine=engine)
    assert (result.statistics.states, result.added) == (2, ())
    assert synthesize(replace(made, invariants=(StateTest("A", "a"),)), engine=engine).statistics.states == 1


def test_choices_between_edges_are_reported() -> None:
    n = VariableRead("B", "n")
    up = Binary("+", n, Constant(2))
    made = system(
        automaton("A", ["a -go-> b", "a -go-> a", "b -go-> a", "b -u_back-> a", "b -u_back-> b"]),
        automaton(
            "B",
            [edge("l -go-> l", below_two := Binary("<", n, Constant(2))), edge("l -go-> m", below_two, n=up)],
            variables=[DiscreteVariable("n", DIGIT, (0,))],
        ),
    )
    found = [("go", "A", "a"), ("go", "B", "l")]
    choices = partial(edge_choices, is_controllable=True)
    assert [(item.event, item.automaton, item.location) for item in choices(made)] == found
    assert str(choices(made)[0]) == "A: go has several edges that can be taken in one state of a"
    assert {item.event for item in edge_choices(made)} == {"go", "u_back"}
    assert [str(item)[:1] for item in edge_choices(made, is_controllable=False)] == ["A"]
    # No choice remains if the other automaton blocks the event, or if an edge leaves a range.
    blocking = replace(made, automata=(made.automata[0], automaton("B", ["m -x-> m"], blocks=["go"])))
    assert choices(replace(blocking, events=(*made.events, Event("x", True)))) == ()
    narrow = DiscreteVariable("n", IntegerType(0, 1), (0,))
    leaving = replace(made, automata=(made.automata[0], replace(made.automata[1], variables=(narrow,))))
    assert [item.automaton for item in choices(leaving)] == ["A"]


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
    # Every value of the sensor may change to 3, so the supervisor never lets the plant go.
    assert synthesize(made).statistics.states == 4
    assert synthesize(replace(made, invariants=(TRUE,))).statistics.states == 8
