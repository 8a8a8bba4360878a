"""Tests of faults in a system, one at a time; and that everything made by the rules fits."""

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings

from robosc.automata import (
    Assignment,
    DiscreteVariable,
    Edge,
    Event,
    EventCondition,
    InputVariable,
    System,
    check_system,
    to_automata,
)
from robosc.errors import InvalidSystemError
from robosc.expressions import (
    Binary,
    BooleanType,
    Constant,
    DoubleType,
    EnumType,
    EnumValue,
    IntegerType,
    Received,
    StateTest,
    StringType,
    Type,
    VariableRead,
)
from robosc.model.structure import Deployment
from support.effort import examples
from support.models import EXAMPLE_NAMES, example_model
from support.random_systems import system_seeds, wide_system
from support.systems import automaton, edge, system

COLOUR = EnumType("Colour", ("red", "green"))
SOUND = system(
    automaton(
        "A",
        [
            edge("idle -go-> busy", n=Binary("mod", VariableRead("A", "n"), Constant(3))),
            edge("busy -u_seen-> idle", n=Received(("level",))),
        ],
        variables=[DiscreteVariable("n", IntegerType(0, 5), (0, 1)), DiscreteVariable("c", COLOUR, ("red",))],
    ),
    inputs=[InputVariable("u_seen", ("level",), IntegerType(0, 5))],
)


def with_automaton(**changes: Any) -> System:
    """The sound system with changes in its automaton."""
    return replace(SOUND, automata=(replace(SOUND.automata[0], **changes),))


def with_edge(item: Edge) -> System:
    """The sound system with one more edge."""
    return with_automaton(edges=(*SOUND.automata[0].edges, item))


def with_variable(item: DiscreteVariable) -> System:
    """The sound system with one more variable."""
    return with_automaton(variables=(*SOUND.automata[0].variables, item))


def with_input(type_: Type) -> System:
    """The sound system with one more received datum."""
    return replace(SOUND, inputs=(*SOUND.inputs, InputVariable("u_seen", ("x",), type_)))


FAULTY = [
    (replace(SOUND, events=(*SOUND.events, Event("go", True))), "there are two of event go"),
    (replace(SOUND, automata=SOUND.automata * 2), "there are two of automaton A"),
    (with_automaton(locations=("idle", "busy", "idle")), "A: there are two of location idle"),
    (with_automaton(monitors=frozenset({"fly"})), "A: fly is monitored but is not in the alphabet"),
    (replace(SOUND, plant_conditions=(EventCondition("fly", Constant(True)),)), "the event fly, which there is not"),
    (replace(SOUND, plant_invariants=(Constant(1),)), "an invariant: integer is not a condition"),
    (with_automaton(initial=("gone",)), "A: there is no location gone, which is to be initial"),
    (with_automaton(marked=frozenset({"gone"})), "A: there is no location gone, which is to be marked"),
    (with_automaton(alphabet=frozenset({"go", "u_seen", "fly"})), "A: there is no event fly, which is in the alphabet"),
    (with_edge(Edge("idle", "go", "gone")), "A: idle -go-> gone: there is no location gone"),
    (with_edge(Edge("gone", "go", "idle")), "A: gone -go-> idle: there is no location gone"),
    (with_edge(Edge("idle", "fly", "idle")), "A: idle -fly-> idle: fly is not in the alphabet"),
    (with_edge(edge("idle -go-> idle", StateTest("B", "on"))), "A: idle -go-> idle: the guard: there is no state B.on"),
    (
        with_edge(edge("idle -go-> idle", VariableRead("A", "n"))),
        "A: idle -go-> idle: the guard: integer(0..5) is not a condition",
    ),
    (with_edge(edge("idle -go-> idle", x=Constant(1))), "A: idle -go-> idle: there is no variable x to assign to"),
    (with_edge(edge("idle -go-> idle", n=Constant(True))), "A: idle -go-> idle: n: boolean is not integer(0..5)"),
    (with_edge(edge("idle -go-> idle", n=Constant(1.5))), "A: idle -go-> idle: n: double is not integer(0..5)"),
    (with_edge(edge("idle -go-> idle", n=Received(("level",)))), "n: received data is read where none is"),
    (with_edge(edge("idle -go-> idle", n=Binary("div", VariableRead("A", "n"), Constant(0.5)))), "'div' does not take"),
    (with_edge(edge("idle -go-> idle", c=EnumValue("Colour", "blue"))), "c: the enum Colour has no value blue"),
    (
        with_edge(Edge("idle", "go", "idle", updates=(Assignment("n", Constant(0)), Assignment("n", Constant(1))))),
        "A: idle -go-> idle: there are two of assignment to n",
    ),
    (with_variable(DiscreteVariable("n", IntegerType(0, 5), (0,))), "A: there are two of variable n"),
    (with_variable(DiscreteVariable("x", StringType(), ("a",))), "A: x: string has infinitely many values"),
    (with_variable(DiscreteVariable("x", IntegerType(0, 3), ())), "A: x: it has no value to begin with"),
    (with_variable(DiscreteVariable("x", IntegerType(0, 3), (4,))), "A: x: 4 is not integer(0..3)"),
    (with_variable(DiscreteVariable("x", COLOUR, ("blue",))), "A: x: 'blue' is not Colour"),
    (with_input(IntegerType(3, 0)), "integer(3..0) has no value"),
    (with_input(EnumType("None", ())), "enum None has no value"),
    (with_input(EnumType("E", ("a", "a"))), "there are two of enum E value a"),
    (with_input(EnumType("Colour", ("red",))), "there are two of enum Colour, with other values"),
    (replace(SOUND, conditions=(EventCondition("fly", Constant(True)),)), "the event fly, which there is not"),
    (replace(SOUND, conditions=(EventCondition("go", Constant(1)),)), "a condition on go: integer is not a condition"),
    (replace(SOUND, invariants=(StateTest("A", "gone"),)), "an invariant: there is no state A.gone"),
    (replace(SOUND, initial=Constant(1)), "the initial condition: integer is not a condition"),
    (replace(SOUND, marker=VariableRead("A", "x")), "the marker condition: there is no variable A.x"),
    (replace(SOUND, inputs=SOUND.inputs * 2), "there are two of received datum u_seen value.level"),
    (
        replace(SOUND, inputs=(InputVariable("fly", (), BooleanType()), *SOUND.inputs)),
        "data is received with the event fly",
    ),
    (with_input(DoubleType()), "double has infinitely many values"),
]


def test_the_sound_system_is() -> None:
    check_system(SOUND)


@pytest.mark.parametrize(("faulty", "message"), FAULTY, ids=[message for _, message in FAULTY])
def test_one_fault_is_reported_once(faulty: System, message: str) -> None:
    with pytest.raises(InvalidSystemError) as caught:
        check_system(faulty)
    (line,) = str(caught.value).split("\n")
    assert line.startswith(f"{faulty.name}: ")
    assert message in line


def test_all_faults_are_reported() -> None:
    faulty = replace(with_automaton(initial=("gone",)), marker=Constant(1), initial=Constant(2))
    with pytest.raises(InvalidSystemError) as caught:
        check_system(faulty)
    assert len(str(caught.value).split("\n")) == 3


@pytest.mark.parametrize("deployment", list(Deployment))
@pytest.mark.parametrize("name", EXAMPLE_NAMES)
def test_lowered_models_fit(name: str, deployment: Deployment) -> None:
    check_system(to_automata(example_model(name), deployment))


@given(system_seeds())
@settings(max_examples=examples(20))
def test_random_systems_fit(seed: int) -> None:
    check_system(wide_system(seed))
