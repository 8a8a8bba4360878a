"""Automata of a program with expressions whose operators stand in each other thousands of times."""

from collections.abc import Callable
from dataclasses import replace

import pytest

import robosc
from robosc.automata import DiscreteVariable, EventCondition, System
from robosc.automata.check import MAXIMUM_LEVELS
from robosc.errors import InvalidSystemError
from robosc.expressions import TRUE, Binary, Call, Conditional, Constant, Expression, IntegerType, StateTest, Unary
from robosc.expressions.tree import levels
from support.systems import automaton, edge, read, system

DEEP = 2_001
IN_X, IN_Y = StateTest("A", "x"), StateTest("A", "y")


def nested(step: Callable[[Expression], Expression], depth: int, innermost: Expression = IN_X) -> Expression:
    for _ in range(depth):
        innermost = step(innermost)
    return innermost


CONDITIONS: dict[str, Callable[[Expression], Expression]] = {
    "negations": lambda inner: Unary("not", inner),
    "a list": lambda inner: Binary("or", inner, IN_Y),
    "a list the other way round": lambda inner: Binary("or", IN_Y, inner),
    "choices": lambda inner: Conditional(IN_Y, IN_Y, inner),
}
VALUES: dict[str, Callable[[Expression], Expression]] = {
    "signs": lambda inner: Unary("-", inner),
    "differences": lambda inner: Binary("-", Constant(3), inner),
    "calls": lambda inner: Call("min", (inner, Constant(3))),
}


def with_condition(condition: Expression) -> System:
    plain = system(automaton("A", ["x -go-> y", "y -u_back-> x"], marked=["x"]))
    return replace(plain, conditions=(EventCondition("go", condition),))


def with_value(value: Expression) -> System:
    number = DiscreteVariable("n", IntegerType(-3, 3), (0,))
    return system(automaton("A", [edge("x -go-> y", n=value), "y -u_back-> x"], marked=["x"], variables=[number]))


@pytest.mark.parametrize("shape", CONDITIONS)
def test_deep_conditions_are_synthesized_verified_and_explained(shape: str) -> None:
    deep = with_condition(nested(CONDITIONS[shape], DEEP - 1))
    made = robosc.synthesize(deep)
    assert made.supervisor is not None and made.supervisor.states == 2
    assert robosc.verify(made.supervisor).passed
    assert robosc.explain(deep).explanation is not None
    assert robosc.synthesize(deep, is_modular=True).supervisor is not None


@pytest.mark.parametrize("shape", VALUES)
def test_deep_values_are_synthesized_and_verified(shape: str) -> None:
    made = robosc.synthesize(with_value(nested(VALUES[shape], DEEP - 1, read("A.n"))))
    assert made.supervisor is not None and made.supervisor.states == 2
    assert robosc.verify(made.supervisor).passed


TOO_DEEP = nested(CONDITIONS["negations"], MAXIMUM_LEVELS)
PLAIN = with_condition(TRUE)
(AUTOMATON,) = PLAIN.automata


def with_guard(guard: Expression) -> System:
    first, *others = AUTOMATON.edges
    return replace(PLAIN, automata=(replace(AUTOMATON, edges=(replace(first, guard=guard), *others)),))


@pytest.mark.parametrize(
    ("faulty", "place"),
    [
        (with_condition(TOO_DEEP), "a condition on go"),
        (replace(PLAIN, plant_conditions=(EventCondition("u_back", TOO_DEEP),)), "a condition on u_back"),
        (replace(PLAIN, invariants=(TRUE, TOO_DEEP)), "invariant 2"),
        (replace(PLAIN, invariants=(TRUE,), plant_invariants=(TOO_DEEP,)), "plant invariant 1"),
        (replace(PLAIN, initial=TOO_DEEP), "the initial condition"),
        (replace(PLAIN, marker=TOO_DEEP), "the marker condition"),
        (with_guard(TOO_DEEP), "A: x -go-> y: the guard"),
        (with_value(nested(VALUES["signs"], MAXIMUM_LEVELS, read("A.n"))), "A: x -go-> y: n"),
    ],
)
def test_deeper_ones_are_refused_with_their_place(faulty: System, place: str) -> None:
    with pytest.raises(InvalidSystemError) as caught:
        robosc.synthesize(faulty)
    assert str(caught.value) == (
        f"{faulty.name}: {place}: it is nested {MAXIMUM_LEVELS + 1} operators deep, and at most {MAXIMUM_LEVELS} are "
        "possible: give parts of it to conditions or invariants of their own, or keep them in variables"
    )


def test_levels_of_what_stands_in_many_places_are_counted_soon() -> None:
    assert levels(IN_X) == 1
    assert levels(nested(lambda inner: Binary("and", inner, inner), 200)) == 201
