"""Tests of the reasons why events cannot happen in the states of random systems, against their explicit meaning."""

from collections import Counter
from dataclasses import replace
from random import Random

import pytest

from robosc.automata import Semantics, System
from robosc.automata.compile import NO_DATA, State, compile_expression
from robosc.automata.state import Subject, subject_domain, subjects
from robosc.explanation.analysis import Analysis, BlockingCause, BlockingCauseKind
from robosc.explanation.constraints import ConstraintKind, RelaxableConstraint, relaxable_constraints, without_ranges
from robosc.explanation.problems import Problems
from robosc.explanation.requirement_automata import as_conditions
from robosc.synthesis import runs, ways
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.engines import make_manager
from robosc.synthesis.monitor import BoundedMonitor, ProgressMonitor
from robosc.synthesis.ways import WayNotFoundError
from support.effort import seeds
from support.engines import needs_cudd
from support.random_systems import explicit_supervisor, random_system, wide_system

EXAMPLES = 40
WIDE = ("plant condition", "nobody's", "impossible")
"""Behaviours that no model has."""
STATES = 6
"""States of a system that are looked at."""

pytestmark = needs_cudd


class Twin:
    """One system, symbolic and state by state."""

    def __init__(self, system: System) -> None:
        self.system = system
        supervisor = explicit_supervisor(self.system)
        assert supervisor is not None
        self.supervisor = supervisor
        self.semantics = Semantics(self.system)
        self.constraints = relaxable_constraints(self.system)
        self.ranges = [item for item in self.constraints if item.kind is ConstraintKind.RANGE]
        # The events count as the environment's: no range holds them back.
        events = tuple(replace(event, is_controllable=False) for event in system.events)
        self.wanted = Semantics(replace(system, events=events))
        self.unrestricted = replace(system, plant_invariants=())
        self.places = {subject: place for place, subject in enumerate(subjects(self.system))}
        manager = make_manager("cudd")
        monitor = BoundedMonitor(ProgressMonitor(lambda: False, lambda progress: None))
        encoding = Encoding(self.system, manager)
        problems = Problems(encoding, monitor)
        fixed_point, problem = problems.without(())
        good = fixed_point.good_states(problem, manager.false)
        assert bool(good.reason) == supervisor.is_empty
        self.false = manager.false
        # The plants alone, as the analysis takes them: what leaves a range goes on at its end.
        self.free = Semantics(without_ranges(system, self.ranges))
        self.initial = fixed_point.initial & good.states
        self.analysis = Analysis(encoding, monitor, problems, self.constraints, good.states)

    def check(self, state: State, event: str, met: Counter[str]) -> None:
        here = self.analysis.predicate(state)
        found = self.analysis.blocking_causes(event, here)
        assert all(item.event == event and item.where == here for item in found)
        expected = [*self._behaviours(state, event)]
        if self.system.event(event).is_controllable:
            expected += [*self._ranges(state, event), *self._conditions(state, event)]
            if self.semantics.enabled(state, event) and self.semantics.condition(state, event):
                is_lost = not self.supervisor.good.issuperset(self.semantics.targets(state, event))
                expected += [(BlockingCauseKind.SUPERVISOR, None)] if is_lost else []
                assert self.supervisor.allows(state, event) == (not is_lost)
        assert [(item.kind, _cause(item)) for item in found] == expected
        met.update(str(kind) for kind, _ in expected)
        met.update(name for _, cause in expected for name in WIDE if isinstance(cause, str) and cause.startswith(name))
        met["several ranges"] += sum(kind is BlockingCauseKind.RANGE for kind, _ in expected) > 1
        # All causes that block the event are named, and none where it can happen.
        can_happen = here & self.analysis.possible(event) != self.false
        assert can_happen == (not expected)
        if can_happen and self.system.event(event).is_controllable:
            assert self.supervisor.allows(state, event)
        met["can happen"] += can_happen

    def allowed(self, states: set[State], event: str) -> set[State]:
        """The states that a supervisor lets an event lead to."""
        is_controllable = self.system.event(event).is_controllable
        happens = self.supervisor.allows if is_controllable else self.semantics.enabled
        return {item for state in states if happens(state, event) for item in self.semantics.targets(state, event)}

    def unrestrained(self, states: set[State], event: str) -> set[State]:
        """The states that the plants let an event lead to."""
        return {item for state in states if self.free.enabled(state, event) for item in self.free.targets(state, event)}

    def within_reach(self) -> set[State]:
        """The states that the plants get to by themselves."""
        found = {state for state in self.semantics.initial_states if state in self.supervisor.good}
        waiting = found
        while waiting:
            waiting = {item for event in self.system.events for item in self.unrestrained(waiting, event.name)} - found
            found = found | waiting
        return found

    def check_detour(self, goal: set[State], *, is_there: bool) -> bool:
        """Return whether the analysis finds a way to states that the supervisor never lets the system reach."""
        predicate = self.false
        for state in goal:
            predicate = predicate | self.analysis.predicate(state)
        detour = self.analysis.detour(self.initial, predicate, self.analysis.good)
        assert (detour is not None) == is_there
        if detour is None:
            return False
        states = set(self.semantics.initial_states) & self.supervisor.reachable
        for event in detour.events[: detour.stopped_at]:
            states = self.allowed(states, event)
        assert detour.state in states
        states = {detour.state}
        # It leaves for good what the supervisor allows.
        for event in detour.events[detour.stopped_at :]:
            states = self.unrestrained(states, event) - self.supervisor.reachable
        assert states & goal
        return True

    def _behaviours(self, state: State, event: str) -> list[tuple[BlockingCauseKind, object]]:
        found = [
            item.name
            for item in self.system.automata
            if event in item.alphabet - item.monitors
            and not any(
                edge.event == event
                and edge.source == state[self.places[Subject(item.name)]]
                and compile_expression(edge.guard, self.places)(state, NO_DATA) is True
                for edge in item.edges
            )
        ]
        found += [
            f"plant condition {place}"
            for place, item in enumerate(self.system.plant_conditions)
            if item.event == event and compile_expression(item.condition, self.places)(state, NO_DATA) is not True
        ]
        if not any(event in item.alphabet for item in self.system.automata):
            found.append("nobody's")
        if not found and not self.wanted.enabled(state, event):
            assert self.system.plant_invariants
            found.append("impossible")
        return [(BlockingCauseKind.BEHAVIOUR, item) for item in found]

    def _ranges(self, state: State, event: str) -> list[tuple[BlockingCauseKind, object]]:
        """The ranges each of which alone, the others left out, keeps the event from happening."""
        if not self.wanted.enabled(state, event):
            return []
        return [
            (BlockingCauseKind.RANGE, item)
            for item in self.ranges
            if not Semantics(without_ranges(self.unrestricted, [r for r in self.ranges if r != item])).enabled(
                state, event
            )
        ]

    def _conditions(self, state: State, event: str) -> list[tuple[BlockingCauseKind, object]]:
        if not self.wanted.enabled(state, event):
            return []
        return [
            (BlockingCauseKind.REQUIREMENT, place)
            for place, item in enumerate(self.system.conditions)
            if item.event == event and compile_expression(item.condition, self.places)(state, NO_DATA) is not True
        ]


def _cause(item: BlockingCause) -> str | RelaxableConstraint | int | None:
    condition = "nobody's" if item.plant_condition is None else f"plant condition {item.plant_condition}"
    return {
        BlockingCauseKind.BEHAVIOUR: item.automaton or ("impossible" if item.is_impossible else condition),
        BlockingCauseKind.RANGE: item.range,
        BlockingCauseKind.REQUIREMENT: item.condition,
        BlockingCauseKind.SUPERVISOR: None,
    }[item.kind]


def system_of(seed: int) -> System:
    """One of a model's kind, or of what automata offer beyond it."""
    return as_conditions(wide_system(seed))[0] if seed % 2 else random_system(seed)


@pytest.mark.random
def test_blocking_causes_in_reachable_states() -> None:
    met: Counter[str] = Counter()
    for seed in seeds(2 * EXAMPLES):
        twin = Twin(system_of(seed))
        for state in sorted(twin.supervisor.reachable)[:STATES]:
            for event in twin.system.events:
                twin.check(state, event.name, met)
    assert all(met[name] for name in (*map(str, BlockingCauseKind), "can happen", *WIDE)), met


@pytest.mark.random
def test_what_would_follow_runs_into_trouble() -> None:
    """Check for every event that the supervisor forbids the states that it would lead to, and that they are lost."""
    met: Counter[str] = Counter()
    for seed in seeds(EXAMPLES):
        twin = Twin(system_of(seed))
        for state in sorted(twin.supervisor.reachable)[:STATES]:
            here = twin.analysis.predicate(state)
            for event in twin.system.events:
                kinds = {item.kind for item in twin.analysis.blocking_causes(event.name, here)}
                if BlockingCauseKind.SUPERVISOR in kinds:
                    counterexample = twin.analysis.counterexample_after(
                        twin.analysis.bad_after(event.name, here, twin.analysis.good)
                    )
                    start = counterexample.run.states[0]
                    assert start in twin.semantics.targets(state, event.name)
                    assert start not in twin.supervisor.good
                    assert counterexample.run.states[-1] not in twin.supervisor.good
                    assert counterexample.is_blocking == (not twin.semantics.bad(counterexample.run.states[-1]))
                    forced = all(not twin.system.event(name).is_controllable for name in counterexample.run.events)
                    assert counterexample.is_forced == forced
                    met["forced" if forced else "not forced"] += 1
                    met["blocking" if counterexample.is_blocking else "bad"] += 1
    assert all(met[name] for name in ("forced", "blocking", "bad")), met


@pytest.mark.random
@pytest.mark.parametrize("effort", [0, runs.MAXIMUM_EFFORT])
def test_ways_of_the_plants_leave_what_is_allowed(effort: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Check ways to states that the supervisor keeps the system from: shortest ones, and those led by layers."""
    monkeypatch.setattr(runs, "MAXIMUM_EFFORT", effort)
    met: Counter[bool] = Counter()
    for seed in seeds(EXAMPLES):
        twin = Twin(system_of(seed))
        if twin.supervisor.is_empty:
            continue
        within_reach = twin.within_reach()
        kept_from = sorted(within_reach - twin.supervisor.reachable)
        for goal in ({state} for state in kept_from[:STATES]):
            met[twin.check_detour(goal, is_there=True)] += 1
        dice = Random(seed)
        domains = [subject_domain(twin.system, subject) for subject in subjects(twin.system)]
        anywhere = {tuple(dice.choice(values) for values in domains) for _ in range(STATES)}
        for goal in ({state} for state in sorted(anywhere - within_reach)):
            met[twin.check_detour(goal, is_there=False)] += 1
    assert met[True], met
    assert met[False], met


@pytest.mark.random
def test_ways_are_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Check that what takes too long is reported as that, and never as no way at all."""
    met: Counter[str] = Counter()
    monkeypatch.setattr(runs, "MAXIMUM_EFFORT", 0)
    monkeypatch.setattr(ways, "MAXIMUM_NODES", 0)
    for seed in seeds(EXAMPLES):
        twin = Twin(system_of(seed))
        kept_from = [] if twin.supervisor.is_empty else sorted(twin.within_reach() - twin.supervisor.reachable)
        for state in kept_from[:STATES]:
            try:
                twin.check_detour({state}, is_there=True)
            except WayNotFoundError:
                met["given up"] += 1
    assert met["given up"], met
