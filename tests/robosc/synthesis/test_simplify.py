"""Simplified conditions against the slow way: every valuation, every reachable state, both engines."""

import sys
from collections.abc import Callable
from dataclasses import replace
from itertools import count, product
from math import prod
from random import Random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.automata import DiscreteVariable, System
from robosc.automata.semantics import Semantics
from robosc.automata.state import subjects
from robosc.conditions.literals import operands
from robosc.conditions.rendering import Formulas, in_words
from robosc.expressions import (
    Binary,
    BinaryOperator,
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    StateTest,
    Unary,
)
from robosc.expressions.evaluate import evaluate as evaluate_expression
from robosc.supervisor import AddedCondition, DecisionDiagram
from robosc.supervisor.diagram import diagram_domains, validate
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import EngineOptions, SynthesisStatus, simplify, synthesize
from robosc.synthesis.diagrams import extract
from robosc.synthesis.nodes import restrict
from support.effort import examples
from support.families import FAMILIES
from support.random_systems import explicit_supervisor, random_system, system_seeds
from support.systems import automaton, edge, operation, read, system

MOST_STATES = 2_000
SIGNS: list[BinaryOperator] = ["+", "-"]
SAMENESS: list[BinaryOperator] = ["=", "!="]
COMPARISONS: list[BinaryOperator] = ["<=", "<", ">="]


def plain(system: System, formula: Expression, state: tuple[Any, ...]) -> Any:
    values = {(place.automaton, place.variable): value for place, value in zip(subjects(system), state, strict=True)}
    return evaluate_expression(formula, lambda a, v: values[a, v], lambda a: str(values[a, None]))


def check_conditions(system: System, added: tuple[AddedCondition, ...]) -> None:
    """Conditions are right wherever it matters, and their formulas are the conditions everywhere."""
    explicit = explicit_supervisor(system)
    assert explicit is not None
    semantics = Semantics(system)
    predicates = state_predicates(system, added)
    for event, holds in predicates.items():
        for state in explicit.reachable:
            if semantics.enabled(state, event) and semantics.condition(state, event):
                assert holds(state) == explicit.allows(state, event), (event, state)
    domains = diagram_domains(system)
    if prod(map(len, domains.values())) > MOST_STATES:
        return
    formulas = Formulas(domains)
    for item in added:
        validate(item.condition, domains)
        formula = formulas.formula(item.condition)
        if formula is not None:
            for state in product(*domains.values()):
                assert plain(system, formula, state) is predicates[item.event](state), (item.event, state)


@settings(max_examples=examples(10))
@given(system_seeds())
def test_random_systems(seed: int) -> None:
    system = random_system(seed)
    found = synthesize(system, engine="autoref")
    if found.status is SynthesisStatus.SUPERVISOR:
        check_conditions(system, found.added)


def counters(seed: int) -> System:
    """Two or three counters that some events raise and others lower, and what must hold between them."""
    dice = Random(seed)
    names = "abc"[: dice.choice([2, 2, 3])]
    automata = []
    for name in names:
        low = dice.randint(-2, 1)
        high = low + dice.randint(2, 5)
        level = read(f"{name}.n")
        edges = [
            edge(f"still -{name}_raise-> moving"),
            edge(f"moving -u_{name}_raised-> still", n=operation(level, "+", dice.randint(1, 2))),
            edge(f"still -{name}_lower-> still", n=operation(level, "-", 1)),
        ]
        variables = [DiscreteVariable("n", IntegerType(low, high), (low,))]
        automata.append(automaton(name, edges, marked=["still"], variables=variables))
    first, second, *others = (read(f"{name}.n") for name in dice.sample(names, len(names)))
    total = operation(first, dice.choice(SIGNS), second)
    for other in others:
        total = operation(total, dice.choice(SIGNS), other)
    required = [operation(total, dice.choice(COMPARISONS), dice.randint(-1, 3))]
    if dice.random() < 0.5:
        required.append(Binary("or", StateTest("a", "still"), operation(first, "!=", second)))
    return replace(system(*automata), invariants=tuple(required))


ROOM = EnumType("Room", ("hall", "attic", "cellar", "yard"))


def house(seed: int) -> System:
    """A cat and a mouse that go from room to room, and a bell that may ring where it does no harm."""
    dice = Random(seed)
    automata = []
    for name in ("cat", "mouse"):
        edges = []
        for room in ROOM.values:
            goes_to = dice.choice([other for other in ROOM.values if other != room])
            here = operation(read(f"{name}.room"), "=", EnumValue("Room", room))
            event = f"{dice.choice(['', 'u_'])}{name}_{room}"
            edges.append(edge(f"still -{event}-> still", here, room=EnumValue("Room", goes_to)))
        variables = [DiscreteVariable("room", ROOM, (dice.choice(ROOM.values),))]
        automata.append(automaton(name, edges, variables=variables))
    together = operation(read("cat.room"), dice.choice(SAMENESS), read("mouse.room"))
    bell = automaton("bell", ["still -ring-> rung", "rung -rest-> still", edge("rung -u_fight-> lost", together)])
    return replace(system(*automata, bell), invariants=(Unary("not", StateTest("bell", "lost")),))


@pytest.mark.parametrize(
    ("family", "parts"),
    [(counters, ("a.n + b.n <= ", "a.n != b.n")), (house, ("cat.room = mouse.room", "cat.room != mouse.room"))],
)
def test_variables_that_depend_on_each_other(family: Callable[[int], System], parts: tuple[str, ...]) -> None:
    together = ""
    for seed in range(12):
        system_ = family(seed)
        found = synthesize(system_, engine="autoref")
        if found.status is SynthesisStatus.SUPERVISOR:
            check_conditions(system_, found.added)
            formulas = [Formulas(diagram_domains(system_)).formula(item.condition) for item in found.added]
            together += "; ".join(in_words(formula, ()) for formula in formulas if formula is not None)
    for part in parts:
        assert part in together, together


@pytest.mark.parametrize(("family", "size"), [("dining philosophers", 3), ("cat and mouse, 1 pair", 2)])
@pytest.mark.parametrize("bound", ["MAXIMUM_NODES", "MAXIMUM_KEPT_NODES", "MAXIMUM_SUBJECTS", "STEPS"])
def test_what_is_given_up_is_right_all_the_same(
    family: str, size: int, bound: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    system = FAMILIES[family](size)
    best = synthesize(system, engine="autoref").added
    monkeypatch.setattr(simplify, bound, 0)
    monkeypatch.setattr(simplify, "MAXIMUM_EFFORT", 0)
    found = synthesize(system, engine="autoref").added
    assert [item.event for item in found] == [item.event for item in best]
    check_conditions(system, found)
    assert length(system, found) > length(system, best)


def rooms(number: int, seed: int) -> System:
    """Cats and mice that go through rooms, counted room by room, and never meet."""
    dice = Random(seed)
    doors = {name: {(room, (room + 1) % number) for room in range(number)} for name in ("cat", "mouse")}
    for found in doors.values():
        found |= {(here, other) for here, other in (dice.sample(range(number), 2) for _ in range(dice.randint(0, 3)))}
    automata = []
    for name, begin in (("cat", 0), ("mouse", number - 1)):
        for room in range(number):
            edges = [f"some -{name}_{room}_{other}-> none" for here, other in sorted(doors[name]) if here == room]
            edges += [f"none -{name}_{here}_{room}-> some" for here, other in sorted(doors[name]) if other == room]
            initial = "some" if room == begin else "none"
            automata.append(automaton(f"{name}{room}", edges, initial=initial, marked=["some", "none"]))
    apart = [Binary("or", StateTest(f"cat{room}", "none"), StateTest(f"mouse{room}", "none")) for room in range(number)]
    return replace(system(*automata), invariants=tuple(apart))


@pytest.mark.parametrize("seed", range(4))
def test_tokens_counted_place_by_place(seed: int) -> None:
    system_ = rooms(7, seed)
    check_conditions(system_, synthesize(system_).added)


def test_of_places_with_the_same_information_few_are_tested() -> None:
    """Tests of all other rooms would show, too, where the mouse is, but in many words."""
    system_ = rooms(50, 2)
    formulas = Formulas(diagram_domains(system_))
    for item in synthesize(system_).added:
        formula = formulas.formula(item.condition)
        assert formula is not None and operands(formula) <= 3, item.event


def test_when_the_time_is_over_conditions_are_right_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """With more time none is longer; the clock goes on by a second whenever it is asked."""
    clock = count()
    monkeypatch.setattr(simplify, "monotonic", lambda: float(next(clock)))
    system_ = FAMILIES["cat and mouse, 1 pair"](2)
    best = synthesize(system_, engine="autoref").added
    assert next(clock) == 0, "without a limit no clock is asked"
    lengths = []
    for seconds in (0, 3, 8, 20, 60, 1_000):
        added = synthesize(system_, engine=EngineOptions("autoref", condition_seconds=seconds)).added
        assert [item.event for item in added] == [item.event for item in best]
        check_conditions(system_, added)
        lengths.append(length(system_, added))
    assert lengths == sorted(lengths, reverse=True)
    assert lengths[0] > lengths[3] > lengths[-1] == length(system_, best)


class Larger:
    """A predicate that says that it is very large."""

    dag_size = 10**9

    def __init__(self, predicate: Any) -> None:
        self._predicate = predicate


@pytest.mark.parametrize("vain", [0, 3])
def test_restricting_what_is_large_is_given_up_after_it_made_some_larger(
    vain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All of it counts as large, and restricting always makes it larger: after three in a row it is not tried."""
    calls: list[Any] = []

    def enlarging(manager: Any, node: Any, care: Any) -> Any:
        calls.append(node)
        return Larger(restrict(manager, node, care))

    monkeypatch.setattr(simplify, "MAXIMUM_NODES", 0)
    monkeypatch.setattr(simplify, "MAXIMUM_VAIN", vain)
    monkeypatch.setattr(simplify, "restrict", enlarging)
    system_ = rooms(7, 0)
    added = synthesize(system_).added
    check_conditions(system_, added)
    assert len(calls) == vain < len(added)


def length(system: System, added: tuple[AddedCondition, ...]) -> int:
    formulas = Formulas(diagram_domains(system))
    found = [formulas.formula(item.condition) for item in added]
    return sum(len(str(formula)) for formula in found)


@settings(max_examples=examples(10))
@given(st.integers(0, 2**32 - 1))
def test_formulas_are_never_longer_than_after_restricting_alone(seed: int) -> None:
    """The candidate that restricting gives is always among those that are compared."""

    class Watched(simplify.Simplifier):
        def condition(self, wanted: Any, care: Any) -> DecisionDiagram | None:
            chosen = super().condition(wanted, care)
            if chosen is not None and chosen.nodes:
                first = extract(self._encoding, restrict(self._manager, wanted, care))
                plain = extract(self._encoding, wanted & self._encoding.valid_states())
                assert self._length(chosen) <= max(self._length(first), self._length(plain))
            return chosen

    with pytest.MonkeyPatch.context() as patch:
        # The package has a function of its module's name.
        patch.setattr(sys.modules["robosc.synthesis.synthesize"], "Simplifier", Watched)
        synthesize(random_system(seed), engine="autoref")


@pytest.mark.parametrize(
    ("family", "size", "event", "words"),
    [
        ("transfer line", 2, "m0b_start", "b0b.n = 0"),
        ("transfer line", 2, "m0a_start", "b0a.n <= 1 or t0.idle and b0a.n = 2"),
        ("counter", 40, "fill", "tank.n <= 35"),
        ("cat and mouse, 1 pair", 1, "cat0_0_3_4", "false"),
        ("cat and mouse, 2 pairs", 1, "cat0_0_2_0", "mouse0.r0_4 and mouse1.r0_4"),
        ("dining philosophers", 5, "p1_takes_f2", "not (p0.right and p2.right and p4.right and f4.used)"),
    ],
)
def test_families_in_words(family: str, size: int, event: str, words: str) -> None:
    system = FAMILIES[family](size)
    added = {item.event: item.condition for item in synthesize(system).added}
    formula = Formulas(diagram_domains(system)).formula(added[event])
    assert formula is not None
    assert in_words(formula, ()) == words
