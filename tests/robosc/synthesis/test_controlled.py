"""Questions about the controlled system, answered symbolically and by going through its states."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache, reduce
from itertools import combinations, product
from random import Random
from typing import Any

import pytest
from msgspec import structs

from robosc.automata import EventCondition, Semantics, System
from robosc.automata.compile import NO_DATA, State, compile_expression
from robosc.automata.controlled import controlled_graph
from robosc.automata.state import Subject, subjects
from robosc.automata.structure import Assignment, DiscreteVariable
from robosc.errors import SynthesisCancelled
from robosc.expressions import TRUE, Binary, Expression, IntegerType, StateTest, Unary
from robosc.supervisor import AddedCondition
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import (
    Answers,
    Cause,
    EnabledTogether,
    NeverEnabled,
    Questions,
    Restriction,
    SynthesisProgress,
    fixed_point,
    race,
    synthesize,
)
from robosc.synthesis.fixed_point import FixedPoint, GoodStates, Problem, Way
from robosc.verification import ExplicitSupervisor
from support.effort import seeds
from support.engines import needs_cudd
from support.random_systems import explicit_supervisor, random_system
from support.systems import automaton, edge, operation, read
from support.systems import system as system_of

ENGINES = ("cudd", "oxidd", "autoref")
LIMIT = 50_000

pytestmark = needs_cudd


# The twin: every state by itself


@lru_cache(maxsize=100)
def explicit(system: System) -> ExplicitSupervisor:
    supervisor = explicit_supervisor(system)
    assert supervisor is not None
    return supervisor


def without[Item](items: Sequence[Item], places: set[int]) -> tuple[Item, ...]:
    return tuple(item for place, item in enumerate(items) if place not in places)


class Twin:
    """Answers by enumeration; counts what it met."""

    def __init__(self, system: System, added: tuple[AddedCondition, ...]) -> None:
        self.system = system
        self._added = state_predicates(system, added)
        self.semantics = Semantics(system)
        self.supervisor = explicit(system)
        self.met: Counter[str] = Counter()
        self._places = {subject: place for place, subject in enumerate(subjects(system))}

    def can_happen(self, state: State, event: str) -> bool:
        if self.system.event(event).is_controllable:
            return self.supervisor.allows(state, event)
        return self.semantics.enabled(state, event)

    def answers(self, questions: Questions) -> Answers:
        found = Answers(
            never=tuple(self._cause(event) for event in questions.events if self._is_never(event)),
            unused=self._unused(questions.restrictions),
            together=tuple(pair for group in questions.rivals for pair in self._pairs(group)),
            unreached=tuple(item for item in questions.locations if not self._is_reached(*item)),
        )
        self.met["unreached"] += len(found.unreached)
        self.met.update(f"{item.cause} {item.is_reached}" for item in found.never)
        self.met["unused"] += len(found.unused)
        self.met["together"] += len(found.together)
        self.met["long"] += sum(len(pair.trace) > 3 for pair in found.together)
        return found

    def _is_never(self, event: str) -> bool:
        return not any(self.can_happen(state, event) for state in self.supervisor.reachable)

    def _is_reached(self, automaton: str, location: str) -> bool:
        place = self._places[Subject(automaton)]
        return any(state[place] == location for state in self.supervisor.reachable)

    def _cause(self, event: str) -> NeverEnabled:
        enabled, condition = self.semantics.enabled, self.semantics.condition
        if not any(enabled(state, event) for state in self._reached(enabled)):
            return NeverEnabled(event, Cause.PLANT, False)
        under = self._reached(lambda state, other: enabled(state, other) and condition(state, other))
        allowed = [condition(state, event) for state in under if enabled(state, event)]
        if not any(allowed):
            return NeverEnabled(event, Cause.REQUIREMENT, bool(allowed))
        here = [state for state in self.supervisor.reachable if enabled(state, event) and condition(state, event)]
        free = explicit(replace(self.system, invariants=()))
        if self.system.event(event).is_controllable:
            is_free = any((state, event) in free.allowed for state in free.reachable)
        else:
            is_free = any(enabled(state, event) for state in free.reachable)
        if not is_free:
            return NeverEnabled(event, Cause.SUPERVISOR, bool(here))
        after = {target for state in here for target in self.semantics.targets(state, event)}
        holds = [compile_expression(item, self._places) for item in self.system.invariants]
        broken = [place for place, item in enumerate(holds) if any(item(state, NO_DATA) is not True for state in after)]
        self.met["broken"] += bool(broken)
        return NeverEnabled(event, Cause.INVARIANT, bool(here), tuple(broken))

    def _reached(self, is_possible: Callable[[State, str], bool]) -> set[State]:
        """The states that are reached through some events, whatever synthesis makes of them."""
        found = set(self.semantics.initial_states)
        waiting = list(found)
        while waiting:
            state = waiting.pop()
            for event in self.system.events:
                if is_possible(state, event.name):
                    new = self.semantics.targets(state, event.name) - found
                    found |= new
                    waiting += new
        return found

    def _unused(self, restrictions: Sequence[Restriction]) -> tuple[int, ...]:
        """One after the other is left out for good if nothing changes: events' conditions first, later ones first."""
        candidates = [place for place, item in enumerate(restrictions) if not self._restricts(item)]
        unused: list[int] = []
        for place in sorted(candidates, key=lambda place: (bool(restrictions[place].invariants), -place)):
            is_unused = self._is_the_same_without([restrictions[other] for other in (*unused, place)])
            if is_unused:
                unused.append(place)
            kind = "invariant" if restrictions[place].invariants else "looked ahead"
            self.met[f"{kind} {'unused' if is_unused else 'used'}"] += 1
        return tuple(sorted(unused))

    def _restricts(self, restriction: Restriction) -> bool:
        conditions = [self.system.conditions[place] for place in restriction.conditions]
        for item in (*conditions, *restriction.watched):
            holds = compile_expression(item.condition, self._places)
            for state in self.supervisor.reachable:
                if self.semantics.enabled(state, item.event) and holds(state, NO_DATA) is not True:
                    self.met["used"] += 1
                    return True
        return False

    def _is_the_same_without(self, restrictions: Sequence[Restriction]) -> bool:
        other = replace(
            self.system,
            conditions=without(self.system.conditions, {place for item in restrictions for place in item.conditions}),
            invariants=without(self.system.invariants, {place for item in restrictions for place in item.invariants}),
        )
        return self._seen(explicit(other)) == self._seen(self.supervisor)

    @staticmethod
    def _seen(supervisor: ExplicitSupervisor) -> object:
        allowed = {(state, event) for state, event in supervisor.allowed if state in supervisor.reachable}
        return supervisor.reachable, allowed

    def _pairs(self, group: Sequence[str]) -> list[EnabledTogether]:
        """Traces are those of another breadth-first search: only their lengths need to agree."""
        graph = controlled_graph(self.semantics, self._added, limit=LIMIT)
        assert graph is not None
        found = []
        for second_place, second in enumerate(group):
            for first in group[:second_place]:
                numbers = [
                    number
                    for number, steps in enumerate(graph.steps)
                    if {first, second} <= {event for event, _ in steps}
                ]
                if numbers:
                    found.append(EnabledTogether(first, second, min(map(graph.trace, numbers), key=len)))
        return found

    def replay(self, pair: EnabledTogether) -> None:
        """The trace is a run, and at its end both can happen."""
        states = {self.semantics.initial}
        for event in pair.trace:
            sources = [state for state in states if self.can_happen(state, event)]
            states = {target for state in sources for target in self.semantics.targets(state, event)}
        assert any(self.can_happen(state, pair.first) and self.can_happen(state, pair.second) for state in states)


def with_invariants(system: System, seed: int) -> System:
    """Up to two conditions of a system as invariants too, or their opposites, as long as it starts in them."""
    dice = Random(seed)
    places = {subject: place for place, subject in enumerate(subjects(system))}
    guards = [edge_.guard for automaton_ in system.automata for edge_ in automaton_.edges if edge_.guard != TRUE]
    candidates = [*guards, *(item.condition for item in system.conditions)]
    drawn = [dice.choice((item, Unary("not", item))) for item in dice.sample(candidates, min(2, len(candidates)))]
    initial = Semantics(system).initial
    kept = [item for item in drawn if compile_expression(item, places)(initial, NO_DATA) is True]
    return replace(system, invariants=(*system.invariants, *kept))


def random_questions(system: System, seed: int) -> Questions:
    """Every event, location and condition by itself, some conditions together, and two groups of rivals."""
    dice = Random(seed)
    events = [event.name for event in system.events]
    places = range(len(system.conditions))
    single = [Restriction((place,)) for place in places]
    watching = [
        Restriction((place,), watched=(EventCondition(dice.choice(events), system.conditions[place].condition),))
        for place in places
    ]
    several = [Restriction(pair) for pair in combinations(places, 2)]
    lasting = [Restriction(invariants=(place,)) for place in range(len(system.invariants))]
    mixed = [Restriction(tuple(places[:1]), tuple(range(len(system.invariants)))[:1])]
    groups = tuple(tuple(dice.sample(events, min(len(events), size))) for size in (2, 4))
    locations = tuple((item.name, location) for item in system.automata for location in item.locations)
    return Questions(tuple(events), (*single, *watching, *several, *lasting, *mixed), groups, locations)


def without_traces(answers: Answers) -> object:
    return (
        answers.never,
        answers.unused,
        [(pair.first, pair.second, len(pair.trace)) for pair in answers.together],
        answers.unreached,
    )


@pytest.mark.random
@pytest.mark.parametrize("smallest", [0, 100])
def test_random_systems(
    smallest: int, record_property: Callable[[str, object], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Surroundings of each event give the answers that predicates of the whole give."""
    monkeypatch.setattr("robosc.synthesis.conjuncts.SMALLEST", smallest)
    met: Counter[str] = Counter()

    def compare(seed: int) -> None:
        system = with_invariants(random_system(seed), seed)
        questions = random_questions(system, seed)
        # The plain engine is slow: every other time will do.
        engines = ENGINES if seed % 2 else ENGINES[:1]
        results = [synthesize(system, engine=engine, questions=questions) for engine in engines]
        assert results[0].answers == results[-1].answers
        plain = synthesize(system)
        assert (plain.added, plain.statistics) == (results[0].added, results[0].statistics)
        twin = Twin(system, plain.added)
        if twin.supervisor.is_empty:
            assert results[0].answers == Answers()
            return
        assert without_traces(results[0].answers) == without_traces(twin.answers(questions))
        for pair in results[0].answers.together:
            twin.replay(pair)
        met.update(twin.met)

    for seed in seeds(60):
        compare(seed)
    record_property("answers compared with the explicit twin", ", ".join(f"{k} {met[k]}" for k in sorted(met)))
    causes = [f"{cause} {is_reached}" for cause in Cause for is_reached in (False, True)]
    wanted = (
        *causes[:1],
        *causes[2:],
        "broken",
        "used",
        "looked ahead used",
        "invariant used",
        "invariant unused",
        "together",
        "long",
        "unreached",
    )
    assert all(met[kind] for kind in wanted), met


# By hand


def chain(length: int) -> System:
    """A counter that goes up to `length`, where two events can happen that cannot before."""
    n = read("C.n")
    up = edge("l -up-> l", operation(n, "<", length), n=operation(n, "+", 1))
    ends = [edge(f"l -{name}-> l", operation(n, "=", length)) for name in ("first", "second")]
    back = edge("l -zero-> l", n=operation(0, "*", n))
    counter = DiscreteVariable("n", IntegerType(0, length), (0,))
    return system_of(automaton("C", [up, *ends, back], variables=[counter]))


@pytest.mark.parametrize("length", [0, 1, 2, 50])
def test_a_trace_is_as_long_as_the_shortest_run(engine: str, length: int) -> None:
    questions = Questions(rivals=(("first", "second"), ("second", "first", "up")))
    answers = synthesize(chain(length), engine=engine, questions=questions).answers
    assert answers.together == (
        EnabledTogether("first", "second", ("up",) * length),
        EnabledTogether("second", "first", ("up",) * length),
    )


def test_beyond_the_effort_a_trace_is_still_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """Traces may be longer then, and are the same for both engines."""
    for seed in range(25):
        system = random_system(seed)
        questions = structs.replace(random_questions(system, seed), restrictions=())
        shortest = synthesize(system, questions=questions).answers.together
        for effort in (0, 300):
            monkeypatch.setattr("robosc.synthesis.runs.MAXIMUM_EFFORT", effort)
            found = [synthesize(system, engine=engine, questions=questions).answers.together for engine in ENGINES]
            assert found == found[:1] * len(found)
            twin = Twin(system, ())
            for pair, best in zip(found[0], shortest, strict=True):
                twin.replay(pair)
                assert len(pair.trace) >= len(best.trace)
        monkeypatch.undo()


def test_chained_events_find_the_longer_way_first(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    plant = automaton("A", ["s -a-> p", "p -b-> q", "q -c-> t", "s -z-> t", "t -x-> t", "t -y-> t"])
    questions = Questions(rivals=(("x", "y"),))
    traces = []
    for effort in (1_000, 0):
        monkeypatch.setattr("robosc.synthesis.runs.MAXIMUM_EFFORT", effort)
        (pair,) = synthesize(system_of(plant), engine=engine, questions=questions).answers.together
        traces.append(pair.trace)
    assert traces == [("z",), ("a", "b", "c")]


def test_many_components_by_themselves_take_no_rings_to_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """With rings alone this takes as many as there are steps; and all of it counts against the effort."""
    monkeypatch.setattr("robosc.synthesis.runs.MAXIMUM_EFFORT", 10_000)
    count = 30
    plants = [automaton(f"P{n}", [f"a -e{n}-> b", f"b -e{n}-> c", f"c -e{n}-> a"]) for n in range(count)]
    last = automaton("Last", ["l -x-> l", "l -y-> l"])
    done: list[Expression] = [StateTest(f"P{n}", "c") for n in range(count)]
    everywhere = reduce(lambda left, right: Binary("and", left, right), done[1:], done[0])
    system = replace(
        system_of(*plants, last), conditions=(EventCondition("x", everywhere), EventCondition("y", everywhere))
    )
    rounds: list[str] = []
    result = synthesize(
        system, questions=Questions(rivals=(("x", "y"),)), on_progress=lambda progress: rounds.append(progress.phase)
    )
    (pair,) = result.answers.together
    assert Counter(pair.trace) >= Counter({f"e{n}": 2 for n in range(count)})
    assert rounds.count("shortest runs") < 20


def trap() -> System:
    """From `pit` the only way out is `climb`, which is never allowed: so `jump` is forbidden."""
    plant = automaton("A", ["ground -jump-> pit", "pit -climb-> ground", "ground -walk-> ground"], marked=["ground"])
    return system_of(plant, conditions={"climb": StateTest("A", "ground"), "walk": StateTest("A", "ground")})


def test_causes(engine: str) -> None:
    answers = synthesize(trap(), engine=engine, questions=Questions(events=("climb", "jump", "walk"))).answers
    assert answers.never == (
        NeverEnabled("climb", Cause.REQUIREMENT, True),
        NeverEnabled("jump", Cause.SUPERVISOR, True),
    )
    stuck = replace(trap(), conditions=(EventCondition("jump", StateTest("A", "pit")),))
    answers = synthesize(stuck, engine=engine, questions=Questions(events=("climb", "jump", "walk"))).answers
    assert answers.never == (
        NeverEnabled("climb", Cause.REQUIREMENT, False),
        NeverEnabled("jump", Cause.REQUIREMENT, True),
    )


def test_causes_of_what_is_cut_by_invariants_and_by_synthesis(engine: str) -> None:
    questions = Questions(events=("climb", "jump", "walk"))
    dry = replace(trap(), conditions=(), invariants=(StateTest("A", "ground"),))
    answers = synthesize(dry, engine=engine, questions=questions).answers
    assert answers.never == (
        NeverEnabled("climb", Cause.INVARIANT, False),
        NeverEnabled("jump", Cause.INVARIANT, True, (0,)),
    )
    lost = automaton("A", ["ground -jump-> pit", "pit -climb-> pit", "ground -walk-> ground"], marked=["ground"])
    answers = synthesize(replace(dry, automata=(lost,), invariants=()), engine=engine, questions=questions).answers
    assert answers.never == (
        NeverEnabled("climb", Cause.SUPERVISOR, False),
        NeverEnabled("jump", Cause.SUPERVISOR, True),
    )
    # The system would be lost without the invariant, too.
    answers = synthesize(replace(dry, automata=(lost,)), engine=engine, questions=questions).answers
    assert answers.never == (
        NeverEnabled("climb", Cause.SUPERVISOR, False),
        NeverEnabled("jump", Cause.SUPERVISOR, True),
    )
    apart = automaton("A", ["pit -jump-> ground", "pit -climb-> ground", "ground -walk-> ground"], initial="ground")
    answers = synthesize(replace(dry, automata=(apart,)), engine=engine, questions=questions).answers
    assert answers.never == (NeverEnabled("climb", Cause.PLANT, False), NeverEnabled("jump", Cause.PLANT, False))


def test_a_condition_that_synthesis_looks_ahead_to_is_used(engine: str) -> None:
    """No state is ever reached where it forbids `climb`; and yet without it `jump` would be allowed."""
    questions = Questions(restrictions=(Restriction((0,)), Restriction((1,))))
    assert [item.event for item in trap().conditions] == ["climb", "walk"]
    assert synthesize(trap(), engine=engine, questions=questions).answers.unused == (1,)


def test_of_two_alike_the_later_one_can_go(engine: str) -> None:
    """With two on `climb` neither is needed by itself, but one of them is."""
    climb = trap().conditions[0]
    system = replace(trap(), conditions=(climb, climb))
    each, both = (Restriction((0,)), Restriction((1,))), Restriction((0, 1))
    assert synthesize(system, engine=engine, questions=Questions(restrictions=each)).answers.unused == (1,)
    assert synthesize(system, engine=engine, questions=Questions(restrictions=(both,))).answers.unused == ()


def test_whichever_way_less_is_solved_the_answers_are_the_same(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a head start all ways begin, with what is known and without."""
    begun = set[tuple[str, bool]]()

    def noted(way: Way, problem: Problem, known: Any, place: int, solver: FixedPoint) -> tuple[GoodStates, int]:
        begun.add((way.__name__, known != solver._encoding.manager.false))
        return way(solver, problem, known), place

    monkeypatch.setattr(race, "HEAD_START", 0)
    monkeypatch.setattr(race, "SHARE", 1)
    monkeypatch.setattr(fixed_point, "_way_of_less", noted)
    test_of_two_alike_the_later_one_can_go(engine)
    test_a_condition_that_synthesis_looks_ahead_to_is_used(engine)
    test_causes_of_what_is_cut_by_invariants_and_by_synthesis(engine)
    assert begun == set(product(("good_states", "reached_good_states"), (False, True)))


def test_what_is_watched_counts(engine: str) -> None:
    away = StateTest("A", "home")
    plant = automaton("A", ["home -go-> away", "away -back-> home"])
    system = system_of(plant, conditions={"go": away})
    restrictions = (
        Restriction((0,)),
        Restriction((0,), watched=(EventCondition("back", away),)),
    )
    answers = synthesize(system, engine=engine, questions=Questions(restrictions=restrictions)).answers
    assert answers.unused == (0,)


def test_an_update_that_always_leaves_its_range_is_the_plants_own_fault(engine: str) -> None:
    plant = automaton(
        "A",
        [replace(edge("l -go-> l"), updates=(Assignment("n", operation(5, "+", 5)),)), edge("l -stay-> l")],
        variables=[DiscreteVariable("n", IntegerType(0, 3), (0,))],
    )
    answers = synthesize(system_of(plant), engine=engine, questions=Questions(events=("go", "stay"))).answers
    assert answers.never == (NeverEnabled("go", Cause.PLANT, False),)


def test_of_many_rivals_the_first_hundred_pairs_are_reported(engine: str) -> None:
    names = tuple(f"e{number:02}" for number in range(40))
    plant = automaton("A", [f"l -{name}-> l" for name in names])
    answers = synthesize(system_of(plant), engine=engine, questions=Questions(rivals=(names,))).answers
    pairs = [(pair.first, pair.second) for pair in answers.together]
    assert pairs == [(first, second) for place, second in enumerate(names) for first in names[:place]][:100]


def test_cancelling_while_runs_are_searched(engine: str) -> None:
    """The search for runs asks too: it can be the longest part."""
    phases: list[str] = []

    def hear(progress: SynthesisProgress) -> None:
        phases.append(progress.phase)

    questions = Questions(rivals=(("first", "second"),))
    with pytest.raises(SynthesisCancelled):
        synthesize(
            chain(50),
            engine=engine,
            questions=questions,
            on_progress=hear,
            should_stop=lambda: phases.count("shortest runs") == 10,
        )
    assert phases.count("shortest runs") == 10


def test_an_event_that_there_is_not(engine: str) -> None:
    with pytest.raises(KeyError, match="nothing"):
        synthesize(trap(), engine=engine, questions=Questions(events=("nothing",)))
