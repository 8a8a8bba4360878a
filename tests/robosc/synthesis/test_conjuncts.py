"""Answers by what is near, against the same answers by predicates of the whole and problems that are solved anew."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.automata import Semantics, System
from robosc.automata.compile import NO_DATA, compile_expression, subjects_read
from robosc.automata.state import Subject, subjects
from robosc.expressions import TRUE, Expression, StateTest, Unary, conjunction
from robosc.synthesis import Answers, Questions, Restriction, conjuncts, synthesize
from robosc.synthesis.conjuncts import Conjuncts
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.engines import make_manager
from robosc.synthesis.fixed_point import FixedPoint, Problem, SolvedProblem, safe_states
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.nodes import assigned
from robosc.synthesis.restrictions import _Neighbourhood
from robosc.synthesis.transitions import Steps, transition_of
from support.effort import examples, seeds
from support.engines import needs_cudd
from support.random_systems import any_systems, random_system
from support.seeded_families import SEEDED_FAMILIES
from support.systems import automaton, edge, system

pytestmark = needs_cudd


def with_many_invariants(seed: int) -> System:
    """A system that never blocks, with up to seven invariants of it that hold at first, some of them twice."""
    dice = Random(seed)
    drawn = random_system(seed)
    parts = tuple(replace(item, marked=frozenset(item.locations)) for item in drawn.automata)
    made = replace(drawn, automata=parts, marker=TRUE)
    atoms: list[Expression] = [StateTest(item.name, location) for item in parts for location in item.locations]
    atoms += [edge.guard for item in parts for edge in item.edges if edge.guard != TRUE]
    invariants: list[Expression] = []
    for _ in range(dice.randrange(1, 7)):
        some = dice.sample(atoms, min(dice.randrange(1, 4), len(atoms)))
        invariants.append(Unary("not", conjunction(*some)))
        if dice.random() < 0.2:
            invariants.append(invariants[-1])
    dice.shuffle(invariants)
    places = {subject: place for place, subject in enumerate(subjects(made))}
    begins = Semantics(made).initial_states

    def holds(invariant: Expression) -> bool:
        compiled = compile_expression(invariant, places)
        return all(compiled(state, NO_DATA) is True for state in begins)

    return replace(made, invariants=tuple(filter(holds, invariants)))


def each_by_itself(asked: System) -> Questions:
    """Does each condition, and each invariant, restrict? Can each event happen, and each location be reached?"""
    conditions = [Restriction((place,)) for place in range(len(asked.conditions))]
    invariants = [Restriction(invariants=(place,)) for place in range(len(asked.invariants))]
    return Questions(
        events=tuple(event.name for event in asked.events),
        restrictions=(*conditions, *invariants),
        rivals=(tuple(event.name for event in asked.events),),
        locations=tuple((item.name, location) for item in asked.automata for location in item.locations),
    )


@pytest.mark.random
def test_nearby_answers_are_those_of_the_whole(
    record_property: Callable[[str, object], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Verdicts on invariants are those of the problem solved anew without each of them."""
    met: Counter[str] = Counter()
    told = _Neighbourhood.is_unused

    def counted(self: _Neighbourhood, restriction: Restriction) -> bool | None:
        verdict = told(self, restriction)
        met[f"unused: {verdict}"] += self._is_able
        return verdict

    monkeypatch.setattr(_Neighbourhood, "is_unused", counted)
    for seed in seeds(80):
        asked = with_many_invariants(seed)
        answers = []
        for smallest in (0, 10_000):
            monkeypatch.setattr("robosc.synthesis.conjuncts.SMALLEST", smallest)
            answers.append(synthesize(asked, questions=each_by_itself(asked)).answers)
        assert answers[0] == answers[1], seed
        met["without supervisor"] += answers[0] == Answers()
    record_property("verdicts by what is near", ", ".join(f"{kind} {met[kind]}" for kind in sorted(met)))
    assert all(met[f"unused: {verdict}"] for verdict in (True, False, None)), met


def solved(source: System, engine: str) -> SolvedProblem | None:
    """A system with its solution, or None where there is none."""
    encoding = Encoding(source, make_manager(engine))
    monitor = ProgressMonitor(lambda: False, lambda progress: None)
    steps = tuple(Steps(encoding, transition_of(encoding, event)) for event in source.events)
    problem, fixed_point = Problem(steps, safe_states(encoding, source.invariants)), FixedPoint(encoding, monitor)
    found = fixed_point.solution(problem, encoding.manager.false)
    if found.reason:
        return None
    return SolvedProblem(encoding, monitor, problem, found.states, fixed_point.reachable_states(problem, found.states))


@settings(max_examples=examples(40))
@given(source=st.one_of(any_systems(), st.integers(0, 10_000).map(with_many_invariants)))
def test_conjuncts_are_right_for_good_states(engine: str, source: System) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("robosc.synthesis.conjuncts.SMALLEST", 0)
        problem = solved(source, engine)
        if problem is None:
            return
        conjuncts = Conjuncts(problem)
        everything = {id(item): item for items in conjuncts.near.values() for item in items}.values()
        manager, good = problem.encoding.manager, problem.good
        assert problem.encoding.all_of(item.holds for item in everything) == good or good == manager.true
        for steps in problem.problem.steps:
            assert conjuncts.only(steps) & good == steps.only(good) & good
            for item in everything:
                if not steps.event.is_controllable and item.invariant is not None:
                    assert item.holds & ~steps.only(item.holds) == manager.false


@pytest.fixture(params=[0, 10_000], ids=["nearby", "whole"])
def smallest(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bits from which answers come from what is near."""
    monkeypatch.setattr("robosc.synthesis.conjuncts.SMALLEST", request.param)


def unused_in(asked: System) -> tuple[int, ...]:
    """The invariants, after the conditions, that a system does not need."""
    return synthesize(asked, questions=each_by_itself(asked)).answers.unused


@pytest.mark.parametrize("fall", ["fall", "u_fall"])
@pytest.mark.usefixtures("smallest")
def test_an_invariant_that_keeps_from_a_pit(fall: str) -> None:
    """Synthesis keeps from a pit that nothing leads out of anyway, also by keeping from where it may fall."""
    edges = ["home -go-> out", "out -back-> home", f"out -{fall}-> pit", "pit -stay-> pit"]
    for marked, unused in ((["home"], (0,)), (["home", "pit"], ())):
        fallible = automaton("A", edges, marked=marked)
        asked = replace(system(fallible), invariants=(Unary("not", StateTest("A", "pit")),))
        assert unused_in(asked) == unused


@pytest.mark.parametrize("allowed_in", ["home", "out"])
@pytest.mark.usefixtures("smallest")
def test_a_way_back_that_is_forbidden_is_none(allowed_in: str) -> None:
    there_and_back = automaton("A", ["home -go-> out", "out -back-> home"], marked=["home"])
    asked = system(there_and_back, conditions={"back": StateTest("A", allowed_in)})
    asked = replace(asked, invariants=(Unary("not", StateTest("A", "out")),))
    # With the condition there is no way back, so that synthesis keeps from there anyway.
    invariant = Questions(restrictions=(Restriction(invariants=(0,)),))
    assert synthesize(asked, questions=invariant).answers.unused == ((0,) if allowed_in == "home" else ())
    # The condition is not needed as long as the invariant is there, and goes first.
    assert unused_in(asked) == (0,)


@pytest.mark.usefixtures("smallest")
def test_of_two_that_only_matter_together_the_later_one_can_go() -> None:
    """The only way back from `x` is through `y`, and the only way to `y` is from `x`."""
    first = automaton("A", ["home -go-> x", edge("x -next-> home", StateTest("B", "y"))], marked=["home"])
    second = automaton("B", [edge("idle -up-> y", StateTest("A", "x")), "y -down-> idle"], marked=["idle"])
    apart = tuple(Unary("not", StateTest(*place)) for place in (("B", "y"), ("A", "x")))
    assert unused_in(replace(system(first, second), invariants=apart)) == (1,)
    assert unused_in(replace(system(first, second), invariants=apart[::-1])) == (1,)


def row(size: int) -> System:
    """Parts in a row that go out and come back: no two neighbours are both out, which is said twice of some."""
    parts = [
        automaton(f"P{n}", [f"home -go{n}-> ready", f"ready -u_out{n}-> out", f"out -back{n}-> home"], marked=["home"])
        for n in range(size)
    ]
    apart = [
        Unary("not", conjunction(StateTest(f"P{n}", "out"), StateTest(f"P{n + 1}", "out"))) for n in range(size - 1)
    ]
    return replace(system(*parts), invariants=(*apart, *apart[::3]))


def test_what_is_near_decides_about_a_large_system(monkeypatch: pytest.MonkeyPatch) -> None:
    """A new solution without each invariant would take time that grows with the square of the size."""
    size = 60
    solutions = 0
    solution = FixedPoint.solution_of_less

    def counted(*arguments: object, **named: object) -> object:
        nonlocal solutions
        solutions += 1
        return solution(*arguments, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(FixedPoint, "solution_of_less", counted)
    asked = row(size)
    assert unused_in(asked) == tuple(range(size - 1, len(asked.invariants)))
    assert solutions == 0


def test_conditions_of_a_large_system_test_what_is_near() -> None:
    """Restricted to what matters, the condition on one event of the whole tests all places above it."""
    added = synthesize(row(150)).added
    assert len(added) == 150
    assert all(len(item.condition.nodes) <= 2 for item in added)


def test_a_condition_of_the_model_is_near_its_places_however_large_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(conjuncts, "MAXIMUM_NODES", 1)
    bins = SEEDED_FAMILIES["loads"](30, 1)
    near = {
        place: {other for item in bins.invariants if place in subjects_read(item) for other in subjects_read(item)}
        for place in subjects(bins)
    }
    added = synthesize(bins).added
    assert len(added) == 30
    for item in added:
        tested = {Subject(node.automaton, node.variable) for node in item.condition.nodes}
        assert tested <= near[Subject(item.event.removesuffix("_up"), "at")]


@settings(max_examples=examples(50))
@given(seed=st.integers(0, 10_000), nodes=st.sampled_from([0, 100]))
def test_values_of_variables(engine: str, seed: int, nodes: int) -> None:
    """The kernel, for small predicates, finds what the engine does."""
    dice = Random(seed)
    manager = make_manager(engine)
    names = [f"x{number}" for number in range(8)]
    manager.declare(*names)
    predicate = manager.false
    for _ in range(6):
        predicate = predicate | manager.cube({name: dice.random() < 0.5 for name in dice.sample(names, 4)})
    values = {name: dice.random() < 0.5 for name in dice.sample(names, dice.randrange(1, 5))}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("robosc.synthesis.nodes._SMALL", nodes)
        assert assigned(manager, values, manager.cube(values), predicate) == manager.let(values, predicate)
