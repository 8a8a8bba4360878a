"""The symbolic model checker agrees with the explicit one, and its runs show what they claim."""

from random import Random

import pytest
from hypothesis import given, settings

from robosc.automata import System
from robosc.errors import SynthesisCancelled
from robosc.expressions import TRUE, Expression, StateTest, Unary
from robosc.model_checking import RunKind, Verdict, verify_properties
from robosc.model_checking.formulas import (
    Condition,
    Enabled,
    Finally,
    Formula,
    Globally,
    Joined,
    Next,
    Not,
    Property,
    Until,
    formula_text,
)
from robosc.source import Location
from robosc.supervisor import AddedCondition
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import SynthesisStatus, synthesize
from support.effort import examples
from support.explicit_ctl import ExplicitChecker
from support.families import dining_philosophers
from support.random_formulas import random_formula
from support.random_systems import random_system, system_seeds
from support.systems import automaton, system

FORMULAS = 6


def claim(formula: Formula) -> Property:
    return Property("", formula_text(formula, ()), Location("here", 1, 1), formula)


def supervised(given_system: System, engine: str = "auto") -> tuple[AddedCondition, ...]:
    """Return the conditions that a supervisor adds; nothing if there is none.

    Without a supervisor, the controlled system is the plants under their conditions.
    """
    result = synthesize(given_system, engine=engine)
    return result.added if result.status is SynthesisStatus.SUPERVISOR else ()


def verdict(given_system: System, formula: Formula, engine: str = "auto") -> Verdict:
    (found,) = verify_properties(given_system, (), [claim(formula)], engine=engine)
    return found


@settings(max_examples=examples(40))
@given(system_seeds())
def test_it_agrees_with_the_explicit_checker(seed: int) -> None:
    drawn = random_system(seed)
    added = supervised(drawn)
    explicit = ExplicitChecker(drawn, state_predicates(drawn, added))
    if explicit.graph is None:
        return
    random = Random(seed)
    formulas = [random_formula(drawn, random) for _ in range(FORMULAS)]
    verdicts = verify_properties(drawn, added, [claim(formula) for formula in formulas])
    for formula, found in zip(formulas, verdicts, strict=True):
        assert found.holds == explicit.holds(formula), formula_text(formula, ())
        if found.run is not None:
            assert (found.run.kind is RunKind.WITNESS) == found.holds
            assert explicit.replay(found.run).shows(formula, found.holds), formula_text(formula, ())


@settings(max_examples=examples(10))
@given(system_seeds())
def test_all_engines_give_the_same(seed: int) -> None:
    drawn = random_system(seed)
    random = Random(seed)
    claims = [claim(random_formula(drawn, random)) for _ in range(FORMULAS)]
    added = supervised(drawn)
    first, *others = (verify_properties(drawn, added, claims, engine=engine) for engine in ("cudd", "oxidd", "autoref"))
    assert others == [first, first]


@settings(max_examples=examples(20))
@given(system_seeds())
def test_runs_to_a_state_are_shortest(seed: int) -> None:
    drawn = random_system(seed)
    explicit = ExplicitChecker(drawn, {})
    if explicit.graph is None:
        return
    goal = random_formula(drawn, Random(seed), depth=0)
    found = verdict(drawn, Finally("E", goal))
    distances = [len(explicit.graph.trace(number)) for number in explicit.where(goal)]
    assert found.holds == bool(distances)
    assert (found.run is not None and len(found.run.events)) == (min(distances) if distances else False)
    opposite = verdict(drawn, Globally("A", Not(goal)))
    assert opposite.holds != found.holds
    assert (opposite.run and opposite.run.states) == (found.run and found.run.states)


# By hand

IN = {name: Condition(StateTest("L", name)) for name in ("a", "b", "c", "d")}
LINE = system(automaton("L", ["a -one-> b", "b -two-> c", "c -three-> b", "b -four-> d"], marked=["d"]))
"""a leads to a cycle of b and c, which can be left to d: there nothing can happen any more."""


@pytest.mark.parametrize(
    ("formula", "events", "loop"),
    [
        (Finally("E", IN["d"]), ["one", "four"], None),
        (Globally("E", Not(IN["d"])), ["one", "two", "three"], 1),
        (Finally("E", Globally("E", IN["d"])), ["one", "four", None], 2),
        (Next("E", Next("E", IN["c"])), ["one", "two"], None),
        (Until("E", Not(IN["c"]), IN["d"]), ["one", "four"], None),
        (Finally("E", Joined("and", IN["b"], Next("E", IN["d"]))), ["one", "four"], None),
        (Finally("E", IN["a"]), [], None),
        (Finally("A", Enabled("one")), [], None),
    ],
)
def test_witnesses(formula: Formula, events: list[str | None], loop: int | None) -> None:
    found = verdict(LINE, formula)
    assert found.holds
    if isinstance(formula, Finally) and formula.quantifier == "A":
        assert found.run is None
        return
    assert found.run is not None
    assert (found.run.kind, list(found.run.events), found.run.loop) == (RunKind.WITNESS, events, loop)
    assert found.run.left == ()


@pytest.mark.parametrize(
    ("formula", "events", "loop"),
    [
        (Globally("A", Not(IN["d"])), ["one", "four"], None),
        (Finally("A", IN["c"]), ["one", "four", None], 2),
        (Next("A", IN["a"]), ["one"], None),
        (Until("A", IN["a"], IN["c"]), ["one"], None),
        (Until("A", Joined("or", IN["a"], IN["b"]), IN["c"]), ["one", "four"], None),
        (Until("A", Not(Condition(StateTest("L", "d"))), IN["d"]), ["one", "two", "three"], 1),
        (Globally("A", Joined("or", Not(IN["c"]), Finally("A", IN["d"]))), ["one", "two", "three", "two"], 2),
        (IN["b"], [], None),
    ],
)
def test_counterexamples(formula: Formula, events: list[str | None], loop: int | None) -> None:
    found = verdict(LINE, formula)
    assert not found.holds
    assert found.run is not None
    assert (found.run.kind, list(found.run.events), found.run.loop) == (RunKind.COUNTEREXAMPLE, events, loop)
    assert found.run.left == ()


def test_a_state_without_events_stays_as_it_is() -> None:
    stuck = IN["d"]
    everywhere = [
        Joined("or", Not(stuck), part)
        for part in (Next("A", stuck), Next("E", stuck), Globally("A", stuck), Globally("E", stuck))
    ]
    assert all(verdict(LINE, Globally("A", part)).holds for part in everywhere)
    assert verdict(LINE, Globally("A", Joined("or", Not(stuck), Not(Enabled("four"))))).holds


def test_what_no_run_shows_is_named_with_its_place() -> None:
    ever = Globally("A", Not(IN["a"]))
    found = verdict(LINE, Finally("E", Joined("and", IN["c"], ever)))
    assert found.run is not None
    assert list(found.run.events) == ["one", "two"]
    assert [(item.place, item.formula, item.holds) for item in found.run.left] == [(2, ever, True)]
    ways = Joined("and", Finally("E", IN["d"]), Finally("E", IN["c"]))
    found = verdict(LINE, ways)
    assert found.run is not None
    assert [(item.place, item.formula) for item in found.run.left] == [(0, ways.right)]
    assert verdict(LINE, Globally("A", Finally("E", IN["d"]))).run is None
    assert verdict(LINE, Finally("E", IN["d"])).run is not None


def test_the_way_to_a_cycle_is_short() -> None:
    """A long tail behind a cycle draws no run away from it."""
    tail = [f"t{number} -go-> t{number + 1}" for number in range(30)]
    drawn = system(automaton("L", ["s -enter-> r", "r -round-> q", "q -back-> r", "q -leave-> t0", *tail]))
    found = verdict(drawn, Globally("E", Condition(Unary("not", StateTest("L", "t30")))))
    assert found.run is not None
    assert list(found.run.events) == ["enter", "round", "back"]


def test_of_several_ways_to_a_cycle_the_short_one_is_taken() -> None:
    for first, second in (("a", "z"), ("z", "a")):
        long = [f"s -{first}-> l0", "l0 -on-> l1", "l1 -on-> l2", "l2 -on-> l3", "l3 -loop-> l3"]
        found = verdict(
            system(automaton("L", [*long, f"s -{second}-> k", "k -on-> r", "r -loop-> r"])),
            Globally("E", Condition(TRUE)),
        )
        assert found.run is not None
        assert list(found.run.events) == [second, "on", "loop"]


def test_a_state_behind_a_cycle_is_no_way_to_it() -> None:
    """x is nearer than the cycle of c and comes behind it, but can only be left for what must not be."""
    drawn = system(automaton("L", ["s -to-> x", "s -by-> y", "y -on-> c", "c -on-> c", "c -to-> x", "x -on-> bad"]))
    found = verdict(drawn, Globally("E", Condition(Unary("not", StateTest("L", "bad")))))
    assert found.run is not None
    assert list(found.run.events) == ["by", "on", "on"]


@pytest.mark.parametrize("outside", ["m", "n"])
def test_a_run_until_something_keeps_to_its_states(outside: str) -> None:
    drawn = system(automaton("L", ["s -a-> m", "s -b-> n", "m -on-> goal", "n -on-> goal"]))
    found = verdict(
        drawn, Until("E", Condition(Unary("not", StateTest("L", outside))), Condition(StateTest("L", "goal")))
    )
    assert found.run is not None
    assert list(found.run.events) == [{"m": "b", "n": "a"}[outside], "on"]


def test_many_states() -> None:
    """Far more states than could be gone through one by one."""
    drawn = dining_philosophers(12)

    def eats(number: int) -> Expression:
        return StateTest(f"p{number}", "eating")

    added = supervised(drawn)
    first, second, third = verify_properties(
        drawn,
        added,
        [
            claim(Globally("A", Not(Joined("and", Condition(eats(0)), Condition(eats(1)))))),
            claim(Globally("A", Finally("E", Condition(eats(5))))),
            claim(Finally("A", Condition(eats(5)))),
        ],
    )
    assert (first.holds, second.holds, third.holds) == (True, True, False)
    assert third.run is not None
    assert third.run.loop is not None


def test_it_can_be_stopped_at_every_question() -> None:
    drawn = dining_philosophers(3)
    formula = claim(Globally("A", Finally("A", Condition(StateTest("p0", "eating")))))
    asked = 0

    def count() -> bool:
        nonlocal asked
        asked += 1
        return False

    verify_properties(drawn, (), [formula], should_stop=count)
    for limit in (0, 1, asked // 2, asked - 1):
        left = limit

        def stop() -> bool:
            nonlocal left
            left -= 1
            return left < 0

        with pytest.raises(SynthesisCancelled):
            verify_properties(drawn, (), [formula], should_stop=stop)
