"""Tests of blame and of the way into trouble, against explicit synthesis and search on random systems."""

from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from itertools import chain, combinations, pairwise

import pytest

from robosc.automata import Semantics, System
from robosc.automata.compile import NO_DATA, State, compile_expression
from robosc.automata.state import subjects
from robosc.errors import SynthesisCancelled
from robosc.explanation.analysis import Analysis, BlockingCauseKind, Counterexample
from robosc.explanation.blame import find_blame
from robosc.explanation.constraints import ConstraintKind, RelaxableConstraint, relaxable_constraints, without
from robosc.explanation.problems import Problems
from robosc.explanation.requirement_automata import as_conditions
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.engines import make_manager
from robosc.synthesis.fixed_point import initial_states
from robosc.synthesis.monitor import BoundedMonitor, ProgressMonitor
from robosc.verification import synthesize_explicit
from support.effort import seeds
from support.empty_systems import empty_system
from support.engines import needs_cudd

ENGINES = ("cudd", "oxidd", "autoref")
EXAMPLES = 30
LIMIT = 50_000

pytestmark = needs_cudd


def empty(seed: int) -> System:
    """A system without a supervisor; every third has all that automata offer beyond RoboSC."""
    return empty_system(seed) if seed % 3 else as_conditions(empty_system(seed, is_wide=True))[0]


class Symbolic:
    """A system, encoded for questions."""

    def __init__(self, system: System, engine: str) -> None:
        self.manager = make_manager(engine)
        self.monitor = BoundedMonitor(ProgressMonitor(lambda: False, lambda progress: None))
        self.encoding = Encoding(system, self.manager)
        self.constraints = relaxable_constraints(system)
        self.problems = Problems(self.encoding, self.monitor)

    def counterexample(self, dropped: Iterable[RelaxableConstraint] = ()) -> Counterexample:
        analysis = Analysis(self.encoding, self.monitor, self.problems, self.constraints, self.manager.false, dropped)
        return analysis.counterexample_after(initial_states(self.encoding))


def is_empty(system: System) -> bool:
    supervisor = synthesize_explicit(system, limit=LIMIT)
    assert supervisor is not None
    return supervisor.is_empty


@pytest.mark.random
def test_the_blamed_set_is_minimal_and_the_removal_too() -> None:
    """Check by explicit synthesis: the set alone leaves no supervisor, and with any one less there is one."""
    met: Counter[object] = Counter()
    for seed in seeds(EXAMPLES):
        system = empty(seed)
        symbolic = [Symbolic(system, engine) for engine in ENGINES]
        blames = [find_blame(item.problems, item.constraints, item.manager.false, item.monitor) for item in symbolic]
        assert blames[1:] == [blames[0]] * (len(ENGINES) - 1)
        blame, constraints = blames[0], symbolic[0].constraints
        everything = frozenset(range(len(constraints)))

        @cache
        def empty_with(
            kept: frozenset[int], system: System = system, constraints: tuple[RelaxableConstraint, ...] = constraints
        ) -> bool:
            return is_empty(without(system, [item for place, item in enumerate(constraints) if place not in kept]))

        assert blame.is_minimal
        conflict = frozenset(blame.conflict)
        assert empty_with(conflict)
        assert not any(empty_with(conflict - {item}) for item in conflict)
        assert blame.sufficing == tuple(item for item in blame.conflict if not empty_with(everything - {item}))
        assert blame.removal is not None
        left = everything - set(blame.removal)
        assert not empty_with(left)
        assert all(empty_with(left | {item}) for item in blame.removal)
        if len(constraints) <= 5:
            # The whole lattice: less never empties, nothing at all is solvable.
            subsets = chain.from_iterable(combinations(sorted(everything), n) for n in range(len(everything) + 1))
            for kept in map(frozenset, subsets):
                assert not empty_with(kept) or all(empty_with(kept | {item}) for item in everything)
            met["lattice"] += 1
        met[len(conflict)] += 1
        met[f"removal of {len(blame.removal)}"] += 1
        met.update(constraints[item].kind for item in conflict)
        met["marker"] += any(constraints[item].is_marker for item in conflict)
    assert met[1] and met[2] + met[3] >= EXAMPLES // 20, met
    assert met["removal of 2"], met
    assert met["lattice"] >= EXAMPLES // 10
    assert all(met[kind] for kind in ConstraintKind if kind is not ConstraintKind.REQUIREMENT), met
    assert met["marker"], met


class Search:
    """Search, state by state, for all that can be reached under the requirements; bad states are its ends."""

    def __init__(self, system: System) -> None:
        self.semantics = Semantics(system)
        self.system = system
        self.states = self._reached(list(self.semantics.initial_states))
        coreachable = {state for state in self.states if self.semantics.is_marked(state) and not self.bad(state)}
        grown = True
        while grown:
            more = {state for state in self.states if not self.bad(state) and self._reaches(state, coreachable)}
            grown = not more <= coreachable
            coreachable |= more
        self.troubled = self.states - coreachable

    def bad(self, state: State) -> bool:
        return self.semantics.bad(state)

    def steps(self, state: State) -> Iterable[tuple[str, State]]:
        for event in self.system.events:
            if not event.is_controllable or self.semantics.condition(state, event.name):
                for target in self.semantics.targets(state, event.name):
                    yield event.name, target

    def _reaches(self, state: State, goal: set[State]) -> bool:
        for event in self.system.events:
            if event.is_controllable and not self.semantics.condition(state, event.name):
                continue
            targets = self.semantics.targets(state, event.name)
            # A supervisor allows a controllable event as a whole or not at all, and none into a bad state.
            if targets & goal and not (event.is_controllable and any(map(self.bad, targets))):
                return True
        return False

    def inside(self, start: State) -> set[State]:
        """Return the states reached without bad states and without controllable events that may lead into them."""
        found, frontier = {start}, [start]
        while frontier:
            state = frontier.pop()
            for event in self.system.events:
                targets = self.semantics.targets(state, event.name)
                if event.is_controllable and (
                    not self.semantics.condition(state, event.name) or any(map(self.bad, targets))
                ):
                    continue
                for target in targets:
                    if target not in found and not self.bad(target):
                        found.add(target)
                        frontier.append(target)
        return found

    def _reached(self, states: list[State]) -> set[State]:
        found = set(states)
        while states:
            state = states.pop()
            if not self.bad(state):
                for _, target in self.steps(state):
                    if target not in found:
                        found.add(target)
                        states.append(target)
        return found

    def distance(self, *, uncontrollable_only: bool) -> int | None:
        """Length of a shortest run into trouble."""
        distances = dict.fromkeys(self.semantics.initial_states, 0)
        queue = deque(distances)
        while queue:
            state = queue.popleft()
            if state in self.troubled:
                return distances[state]
            for event, target in self.steps(state):
                if uncontrollable_only and self.system.event(event).is_controllable:
                    continue
                if target not in distances:
                    distances[target] = distances[state] + 1
                    queue.append(target)
        return None


@pytest.mark.random
def test_trouble_is_real_and_the_run_is_shortest() -> None:
    met: Counter[str] = Counter()
    for seed in seeds(2 * EXAMPLES):
        system = empty(seed)
        counterexample, *others = (Symbolic(system, engine).counterexample() for engine in ENGINES)
        assert all(other.run == counterexample.run for other in others)
        search = Search(system)
        run = counterexample.run
        assert run.is_shortest
        assert run.states[0] in search.semantics.initial_states
        for event, (before, after) in zip(run.events, pairwise(run.states), strict=True):
            assert (event, after) in list(search.steps(before))
        last = run.states[-1]
        assert last in search.troubled
        forced = search.distance(uncontrollable_only=True)
        assert counterexample.is_forced == (forced is not None)
        assert len(run.events) == (search.distance(uncontrollable_only=False) if forced is None else forced)
        assert counterexample.is_blocking == (not search.bad(last))
        met["forced" if counterexample.is_forced else "not forced"] += 1
        met["blocking" if counterexample.is_blocking else "bad"] += 1
        met["long"] += len(run.events) > 1
        _check_what_is_broken(system, search, counterexample, last, met)
        if counterexample.is_blocking:
            _check_detour(system, search, counterexample, last, met)
    assert all(met[name] for name in ("forced", "not forced", "blocking", "bad", "long", "invariant", "range")), met
    assert all(met[name] for name in ("condition", "no way", *map(str, BlockingCauseKind))), met


@pytest.mark.random
def test_trouble_without_some_obstacles_speaks_of_the_others_alone() -> None:
    """Check the blamed constraints alone: the run is one of the system that is left, and complete in what it names."""
    met: Counter[str] = Counter()
    for seed in seeds(3 * EXAMPLES):
        system = empty(seed)
        symbolic = [Symbolic(system, engine) for engine in ENGINES]
        blame = find_blame(
            symbolic[0].problems, symbolic[0].constraints, symbolic[0].manager.false, symbolic[0].monitor
        )
        constraints = symbolic[0].constraints
        kept = [constraints[place] for place in blame.conflict]
        dropped = [item for item in constraints if item not in kept]
        counterexample, *others = (item.counterexample(dropped) for item in symbolic)
        for other in others:
            assert (counterexample.run, counterexample.is_forced, counterexample.unmarked) == (
                other.run,
                other.is_forced,
                other.unmarked,
            )
        search = Search(without(system, dropped))
        assert counterexample.run.states[-1] in search.troubled
        steps = list(zip(counterexample.run.events, pairwise(counterexample.run.states), strict=True))
        assert all((name, after) in list(search.steps(before)) for name, (before, after) in steps)
        _check_run_of_the_robot(system, search, counterexample, met)
        named = {place for item in kept for place in item.conditions}
        blocking_causes = () if counterexample.detour is None else counterexample.detour.blocking_causes
        assert {place for _, place in counterexample.forbidden} <= named
        assert {item.condition for item in blocking_causes if item.condition is not None} <= named
        assert set(counterexample.invariants) <= {place for item in kept for place in item.invariants}
        assert {item for _, item in counterexample.leaving} <= set(kept)
        assert {item.range for item in blocking_causes if item.range is not None} <= set(kept)
        assert set(counterexample.unmarked) <= {item.marking for item in kept}
        assert not counterexample.is_marker_missed or any(item.is_marker for item in kept)
        met["another story"] += counterexample.run != symbolic[0].counterexample().run
    assert all(met[name] for name in ("another story", "real", "range dropped", "shortest")), met


def _check_run_of_the_robot(system: System, search: Search, counterexample: Counterexample, met: Counter[str]) -> None:
    """No update of the run stops at the end of a range, if there is such a run; and no shorter run is there."""
    free = Semantics(
        without(system, [item for item in relaxable_constraints(system) if item.kind is not ConstraintKind.RANGE])
    )

    def really(state: State, *, is_forced: bool) -> Iterator[tuple[str, State]]:
        for name, target in search.steps(state):
            if not (is_forced and system.event(name).is_controllable) and target in free.targets(state, name):
                yield name, target

    def distance(is_forced: bool) -> int | None:
        return _distance(
            set(search.semantics.initial_states),
            lambda state: (target for _, target in really(state, is_forced=is_forced)),
            lambda state: state in search.troubled,
        )

    forced = distance(True)
    shortest = distance(False) if forced is None else forced
    if shortest is not None:
        assert len(counterexample.run.events) == shortest
        for name, (before, after) in zip(counterexample.run.events, pairwise(counterexample.run.states), strict=True):
            assert (name, after) in list(really(before, is_forced=counterexample.is_forced))
        met["shortest"] += shortest > 0
        met["real"] += 1
    met["range dropped"] += search.system.automata != system.automata


def _check_what_is_broken(
    system: System, search: Search, counterexample: Counterexample, last: State, met: Counter[str]
) -> None:
    places = {subject: place for place, subject in enumerate(subjects(system))}
    broken = [compile_expression(item, places)(last, NO_DATA) is not True for item in system.invariants]
    assert counterexample.invariants == tuple(place for place, is_broken in enumerate(broken) if is_broken)
    met["invariant"] += any(broken)
    for place, condition in enumerate(system.conditions):
        if not system.event(condition.event).is_controllable:
            is_broken = compile_expression(condition.condition, places)(last, NO_DATA) is not True
            expected = is_broken and search.semantics.enabled(last, condition.event)
            assert ((condition.event, place) in counterexample.forbidden) == expected
            met["condition"] += expected
    for event, constraint in counterexample.leaving:
        # This range alone makes the state bad: the others, conditions and invariants are left out.
        others = [item for item in relaxable_constraints(system) if item != constraint]
        assert Semantics(without(system, others)).bad_reason(last) is not None
        assert not system.event(event).is_controllable
        met["range"] += 1
    free = [item for item in relaxable_constraints(system) if item.kind is not ConstraintKind.RANGE]
    assert Semantics(without(system, free)).bad(last) == bool(counterexample.leaving)


def _distance(
    start: set[State], steps: Callable[[State], Iterable[State]], is_goal: Callable[[State], bool]
) -> int | None:
    queue, distances = deque(start), dict.fromkeys(start, 0)
    while queue:
        state = queue.popleft()
        if is_goal(state):
            return distances[state]
        for target in steps(state):
            if target not in distances:
                distances[target] = distances[state] + 1
                queue.append(target)
    return None


def _check_detour(
    system: System, search: Search, counterexample: Counterexample, last: State, met: Counter[str]
) -> None:
    """The plants alone would have this way, and up to the event named all of it is allowed."""
    free = Semantics(
        without(system, [item for item in relaxable_constraints(system) if item.kind is not ConstraintKind.MARKING])
    )
    inside = search.inside(last)

    def freely(state: State) -> Iterator[State]:
        return (target for each in system.events for target in free.targets(state, each.name))

    # Under the requirements if that is a way at all, else by the plants alone.
    found = _distance(inside, lambda state: (target for _, target in search.steps(state)), free.is_marked)
    if found is None:
        found = _distance(inside, freely, free.is_marked)
    assert (counterexample.detour is None) == (found is None)
    if counterexample.detour is None:
        met["no way"] += 1
        return
    # From wherever what is allowed leads to, no way of the plants alone is shorter.
    assert len(counterexample.detour.events) - counterexample.detour.stopped_at == found
    states = {last}
    for event in counterexample.detour.events[: counterexample.detour.stopped_at]:
        states = {target for state in states for name, target in search.steps(state) if name == event}
        states = {state for state in states if not search.bad(state)}
    here, event = counterexample.detour.state, counterexample.detour.events[counterexample.detour.stopped_at]
    assert here in states
    assert here in inside
    semantics = search.semantics
    kinds = {item.kind for item in counterexample.detour.blocking_causes}
    met.update(map(str, kinds))
    if system.event(event).is_controllable:
        assert (BlockingCauseKind.REQUIREMENT in kinds) == (not semantics.condition(here, event))
        assert (BlockingCauseKind.RANGE in kinds) == (not semantics.enabled(here, event))
        assert kinds
    met[str(BlockingCauseKind.BEHAVIOUR)] += BlockingCauseKind.BEHAVIOUR not in kinds


def test_a_search_that_takes_too_long_reports_what_it_has() -> None:
    """Check for any limit: blamed constraints are to blame, and only a search to its end calls the blame minimal."""
    symbolic = Symbolic(empty_system(3), "cudd")
    full = find_blame(symbolic.problems, symbolic.constraints, symbolic.manager.false, symbolic.monitor)
    needed = symbolic.monitor.steps
    seen = set()
    for limit in range(0, needed + 20, max(1, needed // 40)):
        item = Symbolic(empty_system(3), "cudd")
        item.monitor.limit = limit
        blame = find_blame(item.problems, item.constraints, item.manager.false, item.monitor)
        kept = {item.constraints[place] for place in blame.conflict}
        assert is_empty(without(empty_system(3), [each for each in item.constraints if each not in kept]))
        assert not blame.is_minimal or blame.conflict == full.conflict
        assert blame.sufficing is None or blame.sufficing == full.sufficing
        seen.add((blame.is_minimal, blame.removal is None))
    assert seen == {(False, True), (True, True), (True, False)}


def test_the_search_can_be_stopped() -> None:
    symbolic = Symbolic(empty_system(3), "cudd")
    stopped = BoundedMonitor(ProgressMonitor(lambda: True, lambda progress: None))
    problems = Problems(symbolic.encoding, stopped)
    with pytest.raises(SynthesisCancelled):
        find_blame(problems, symbolic.constraints, symbolic.manager.false, stopped)
