"""The explicit semantics, by hand and against a naive reading of the definition."""

import math
from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.automata import DiscreteVariable, InputVariable, Semantics, System
from robosc.automata.compile import State, compile_expression
from robosc.automata.inputs import valuations
from robosc.automata.state import initial_values, subjects
from robosc.expressions import (
    FALSE,
    TRUE,
    BooleanType,
    Constant,
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    PathStep,
    StateTest,
    Unary,
)
from support.effort import examples
from support.naive_system import NaiveSystem
from support.random_systems import any_systems, any_wide_systems
from support.systems import automaton, edge, operation, read, received, state, system

DIGIT = IntegerType(0, 2)
COLOUR = EnumType("Colour", ("red", "green"))
UNKNOWN = operation(operation(1, "/", 0), ">", 0)


def test_all_automata_with_the_event_move_and_the_others_stay() -> None:
    subject = Semantics(
        system(
            automaton("A", ["idle -go-> busy"]),
            automaton("B", ["off -go-> on"]),
            automaton("C", ["here -leave-> there"]),
        )
    )
    assert subject.initial == ("idle", "off", "here")
    assert subject.targets(subject.initial, "go") == {("busy", "on", "here")}
    assert not subject.enabled(("busy", "off", "here"), "go")
    assert subject.targets(("busy", "off", "here"), "go") == frozenset()


def test_an_event_in_the_alphabet_without_an_edge_is_blocked() -> None:
    subject = Semantics(system(automaton("A", ["idle -go-> busy"]), automaton("B", ["x -y-> x"], blocks=["go"])))
    assert not subject.enabled(subject.initial, "go")


@pytest.mark.parametrize(
    ("guard", "holds"),
    [(TRUE, True), (FALSE, False), (UNKNOWN, False), (Unary("not", UNKNOWN), False), (StateTest("B", "off"), True)],
)
def test_a_guard_holds_only_when_it_is_true(guard: Expression, holds: bool) -> None:
    subject = Semantics(system(automaton("A", [edge("idle -go-> busy", guard)]), automaton("B", ["off -x-> on"])))
    assert subject.enabled(subject.initial, "go") is holds


@pytest.mark.parametrize("condition", [FALSE, UNKNOWN, Unary("not", UNKNOWN)])
def test_a_condition_that_is_not_true_forbids_a_controllable_event_and_makes_an_uncontrollable_one_bad(
    condition: Expression,
) -> None:
    subject = Semantics(
        system(
            automaton("A", ["idle -go-> busy", "busy -u_end-> idle"]), conditions={"go": condition, "u_end": condition}
        )
    )
    assert subject.enabled(("idle",), "go")
    assert not subject.condition(("idle",), "go")
    assert not subject.bad(("idle",))
    assert subject.bad(("busy",))
    assert subject.bad_reason(("busy",)) == "u_end can happen against its requirement"


def test_updates_read_the_old_state_and_happen_together() -> None:
    swap = edge("l -swap-> l", x=read("B.y"))
    other = edge("l -swap-> l", y=read("A.x"))
    subject = Semantics(
        system(
            automaton("A", [swap], variables=[DiscreteVariable("x", DIGIT, (0,))]),
            automaton("B", [other], variables=[DiscreteVariable("y", DIGIT, (2,))]),
        )
    )
    assert subject.targets(("l", 0, "l", 2), "swap") == {("l", 2, "l", 0)}


def test_an_unknown_update_leaves_its_variable() -> None:
    quotient = operation(read("A.x"), "/", 0)
    move = edge("l -go-> m", x=operation(quotient, "+", 1))
    subject = Semantics(system(automaton("A", [move], variables=[DiscreteVariable("x", DIGIT, (2,))])))
    assert subject.targets(subject.initial, "go") == {("m", 2)}


def test_leaving_the_range_disables_a_controllable_event() -> None:
    count = edge("l -count-> l", x=operation(read("A.x"), "+", 1))
    subject = Semantics(system(automaton("A", [count], variables=[DiscreteVariable("x", DIGIT, (1,))])))
    assert subject.targets(("l", 1), "count") == {("l", 2)}
    assert not subject.enabled(("l", 2), "count")
    assert subject.targets(("l", 2), "count") == frozenset()
    assert not subject.bad(("l", 2))


def test_leaving_the_range_with_an_uncontrollable_event_is_bad() -> None:
    count = edge("l -u_count-> l", x=operation(read("A.x"), "-", 1))
    subject = Semantics(system(automaton("A", [count], variables=[DiscreteVariable("x", DIGIT, (1,))])))
    assert not subject.bad(("l", 1))
    assert subject.enabled(("l", 0), "u_count")
    assert subject.bad_reason(("l", 0)) == "u_count can take a variable out of its range"


def test_one_datum_out_of_range_among_many_is_enough_for_a_bad_state() -> None:
    take = edge("l -u_got-> l", x=received("n"))
    subject = Semantics(
        system(
            automaton("A", [take], variables=[DiscreteVariable("x", DIGIT, (1,))]),
            inputs=[InputVariable("u_got", ("n",), IntegerType(1, 3))],
        )
    )
    assert subject.bad(subject.initial)
    assert subject.targets(subject.initial, "u_got") == {("l", 1), ("l", 2)}


def test_received_data_is_shared_by_all_updates_of_a_step() -> None:
    same = EnumValue("Colour", "red")
    subject = Semantics(
        system(
            automaton(
                "A",
                [edge("l -u_seen-> l", c=received("colour"), b=operation(received("colour"), "=", same))],
                variables=[DiscreteVariable("c", COLOUR, ("green",)), DiscreteVariable("b", BooleanType(), (True,))],
            ),
            automaton(
                "B", [edge("l -u_seen-> l", d=received("colour"))], variables=[DiscreteVariable("d", COLOUR, ("red",))]
            ),
            inputs=[InputVariable("u_seen", ("colour",), COLOUR)],
        )
    )
    assert subject.targets(subject.initial, "u_seen") == {
        ("l", "red", True, "l", "red"),
        ("l", "green", False, "l", "green"),
    }


def test_different_data_of_one_event_vary_freely() -> None:
    subject = Semantics(
        system(
            automaton(
                "A",
                [edge("l -u_seen-> l", b=received("p"), c=received("q"))],
                variables=[DiscreteVariable(name, BooleanType(), (False,)) for name in ("b", "c")],
            ),
            inputs=[InputVariable("u_seen", (name,), BooleanType()) for name in ("p", "q")],
        )
    )
    assert len(subject.targets(subject.initial, "u_seen")) == 4


def test_data_of_another_event_is_other_data() -> None:
    subject = Semantics(
        system(
            automaton(
                "A",
                [edge("l -u_a-> l", x=received("n")), edge("l -u_b-> l", x=received("n"))],
                variables=[DiscreteVariable("x", DIGIT, (0,))],
            ),
            inputs=[InputVariable("u_a", ("n",), IntegerType(1, 1)), InputVariable("u_b", ("n",), IntegerType(0, 1))],
        )
    )
    assert subject.targets(subject.initial, "u_a") == {("l", 1)}
    assert subject.targets(subject.initial, "u_b") == {("l", 0), ("l", 1)}


def test_several_edges_of_an_uncontrollable_event_all_count() -> None:
    subject = Semantics(
        system(
            automaton("A", ["l -u_end-> m", "l -u_end-> n"]),
            automaton("B", ["p -u_end-> q", "p -u_end-> p"]),
        )
    )
    assert subject.targets(("l", "p"), "u_end") == {("m", "q"), ("m", "p"), ("n", "q"), ("n", "p")}


def test_a_later_element_is_known_only_if_the_earlier_ones_are() -> None:
    flags = [DiscreteVariable(name, COLOUR, ("red",)) for name in ("a", "b")]
    take = edge("l -u_scan-> l", a=received("scan", 1), b=received("scan", 4))
    subject = Semantics(
        system(
            automaton("A", [take], variables=flags),
            inputs=[InputVariable("u_scan", ("scan", index), COLOUR, may_be_unknown=True) for index in (1, 4)],
        )
    )
    # Unknown leaves green; only the later one alone cannot be known.
    assert subject.targets(("l", "green", "green"), "u_scan") == set(product(["l"], COLOUR.values, COLOUR.values))
    boolean = [DiscreteVariable(name, IntegerType(0, 2), (0,)) for name in ("a", "b")]
    subject = Semantics(
        system(
            automaton("A", [take], variables=boolean),
            inputs=[InputVariable("u_scan", ("scan", i), IntegerType(2, 2), may_be_unknown=True) for i in (4, 1)],
        )
    )
    assert subject.targets(("l", 0, 0), "u_scan") == {("l", 0, 0), ("l", 2, 0), ("l", 2, 2)}


def _known(inputs: list[InputVariable]) -> set[tuple[bool, ...]]:
    return {tuple(data[item.path] is not None for item in inputs) for data in valuations(inputs)}


def _element(*path: PathStep) -> InputVariable:
    return InputVariable("u_e", path, BooleanType(), may_be_unknown=True)


def test_parts_of_one_element_are_known_together() -> None:
    assert _known([_element("scan", 2, "near"), _element("scan", 2, "far")]) == {(True, True), (False, False)}


def test_elements_of_two_arrays_are_known_independently() -> None:
    assert len(_known([_element("left", 0), _element("right", 0)])) == 4


def test_an_inner_array_needs_its_outer_element() -> None:
    found = _known([_element("rows", 0, 0), _element("rows", 0, 1), _element("rows", 1, 0)])
    assert (False, True, False) not in found
    assert (False, False, True) in found  # The first row may be shorter than the second.
    assert len(found) == 6


def test_what_is_left_out_without_an_array_stands_alone() -> None:
    assert _known([_element("p"), _element("q")]) == set(product([True, False], repeat=2))


def test_marked_when_every_automaton_is() -> None:
    subject = Semantics(
        system(automaton("A", ["l -go-> m"], marked=["l"]), automaton("B", ["l -go-> m", "m -x-> l"], marked=["m"]))
    )
    assert not subject.is_marked(("l", "l"))
    assert subject.is_marked(("l", "m"))


def test_a_very_long_condition_is_no_trouble() -> None:
    condition: Expression = StateTest("A", "idle")
    for _ in range(20_000):
        condition = operation(condition, "and", StateTest("A", "idle"))
    subject = Semantics(system(automaton("A", [edge("idle -go-> idle", condition)])))
    assert subject.enabled(subject.initial, "go")


def test_a_comparison_with_an_infinity_is_an_ordinary_one() -> None:
    guard = operation(Constant(math.inf), ">", 1)
    subject = Semantics(system(automaton("A", [edge("idle -go-> idle", guard)])))
    assert subject.enabled(subject.initial, "go")


def _some_states(subject: Semantics, count: int) -> list[State]:
    frontier = list(subject.initial_states)
    found = dict.fromkeys(frontier)
    while frontier and len(found) < count:
        at = frontier.pop(0)
        for event in subject.system.events:
            new = [item for item in subject.targets(at, event.name) if item not in found]
            found.update(dict.fromkeys(new))
            frontier.extend(new)
    return list(found)[:count]


@settings(max_examples=examples(90))
@given(st.one_of(any_systems(), any_wide_systems()))
def test_agrees_with_the_naive_reading_of_the_definition(drawn: System) -> None:
    subject, naive = Semantics(drawn), NaiveSystem(drawn)
    beginnings = naive.beginnings(None)
    assert subject.initial_states == tuple(at for at in product(*initial_values(drawn)) if at in beginnings)
    for at in _some_states(subject, 12):
        is_bad = not naive.true(drawn.invariants, at)
        for event in drawn.events:
            targets, leaves_range = naive.step(at, event.name)
            meets = naive.meets(at, event.name)
            possible = bool(targets) or leaves_range
            if event.is_controllable:
                possible = possible and not leaves_range
                targets = frozenset() if leaves_range else targets
            elif (possible and not meets) or leaves_range:
                is_bad = True
            assert subject.enabled(at, event.name) is possible
            assert subject.targets(at, event.name) == targets
            assert subject.condition(at, event.name) is meets
        assert subject.bad(at) is is_bad


@settings(max_examples=examples(40))
@given(any_systems())
def test_compiled_expressions_mean_the_same_as_evaluated_ones(drawn: System) -> None:
    places = {subject: place for place, subject in enumerate(subjects(drawn))}
    naive = NaiveSystem(drawn)
    expressions = [item.condition for item in drawn.conditions] + [
        arc.guard for item in drawn.automata for arc in item.edges
    ]
    for at in _some_states(Semantics(drawn), 5):
        for expression in expressions:
            assert compile_expression(expression, places)(at, {}) == naive.evaluate(expression, at, {})


def test_the_state_helper_starts_from_the_initial_state() -> None:
    made = system(automaton("A", ["l -go-> m"], variables=[DiscreteVariable("x", DIGIT, (1,))]))
    assert state(made, A="m") == ("m", 1)
    assert state(made, A_x=2) == ("l", 2)
