"""Ways to a goal in random systems, against a search that goes through the states one by one."""

from collections import Counter
from collections.abc import Iterable
from random import Random
from typing import Any

import pytest

from robosc.automata import Semantics, System
from robosc.automata.compile import State
from robosc.synthesis import runs, ways
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.engines import make_manager
from robosc.synthesis.fixed_point import initial_states
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.runs import SystemRun
from robosc.synthesis.transitions import Steps, transition_of
from robosc.synthesis.ways import WayNotFoundError, Ways
from support.effort import seeds
from support.engines import needs_cudd
from support.random_systems import random_system

EXAMPLES = 60
ENGINES = ("cudd", "oxidd", "autoref")

pytestmark = needs_cudd


class Twin:
    """One system, in which events happen wherever the plants let them, by an engine and state by state."""

    def __init__(self, system: System, engine: str) -> None:
        self.semantics = Semantics(system)
        self._events = [event.name for event in system.events]
        manager = make_manager(engine)
        self._encoding = Encoding(system, manager)
        self._steps = [Steps(self._encoding, transition_of(self._encoding, event)) for event in system.events]
        self._monitor = ProgressMonitor(lambda: False, lambda progress: None)
        assert initial_states(self._encoding) == self._predicate(self.semantics.initial_states)

    def _predicate(self, states: Iterable[State]) -> Any:
        return self._encoding.any_of(map(self._encoding.state, states))

    def targets(self, state: State) -> dict[str, frozenset[State]]:
        enabled = (name for name in self._events if self.semantics.enabled(state, name))
        return {name: self.semantics.targets(state, name) for name in enabled}

    def layers(self) -> list[list[State]]:
        """The states that the plants reach, by their distance from the initial ones."""
        found, layer = set(self.semantics.initial_states), sorted(self.semantics.initial_states)
        result = []
        while layer:
            result.append(layer)
            new = {target for state in layer for targets in self.targets(state).values() for target in targets}
            layer = sorted(new - found)
            found |= new
        return result

    def ways_to(self, goal: Iterable[State]) -> Ways:
        possible = {steps.event.name: steps.plant for steps in self._steps}
        return Ways(self._encoding, self._monitor, self._steps, possible, self._predicate(goal))

    def way(self, found: Ways, start: Iterable[State], **asked: bool) -> SystemRun | None:
        return found.way_from(self._predicate(start), **asked)

    def distance(self, start: Iterable[State], goal: set[State]) -> int | None:
        """Length of a shortest way; None if there is none."""
        known, layer, length = set(start), set(start), 0
        while layer:
            if layer & goal:
                return length
            layer = {item for state in layer for targets in self.targets(state).values() for item in targets} - known
            known |= layer
            length += 1
        return None

    def replay(self, run: SystemRun, start: Iterable[State], goal: set[State]) -> None:
        assert run.states[0] in set(start)
        assert run.states[-1] in goal
        assert len(run.states) == len(run.events) + 1
        for place, event in enumerate(run.events):
            assert run.states[place + 1] in self.targets(run.states[place])[event]


def questions(twin: Twin, seed: int) -> list[tuple[list[State], set[State]]]:
    """Return states where ways begin with those where they end: near, far, and back, where none may lead."""
    dice, layers = Random(seed), twin.layers()
    states = [state for layer in layers for state in layer]
    return [
        (layers[0], set(layers[-1])),
        (layers[0], {dice.choice(states)}),
        (layers[-1], {dice.choice(states)}),
        (dice.sample(states, min(3, len(states))), {dice.choice(states)}),
    ]


@pytest.mark.random
def test_shortest_ways() -> None:
    met: Counter[str] = Counter()
    for seed in seeds(EXAMPLES):
        twin = Twin(random_system(seed), "cudd")
        for start, goal in questions(twin, seed):
            run, length = twin.way(twin.ways_to(goal), start), twin.distance(start, goal)
            assert (run is None) == (length is None)
            if run is not None:
                twin.replay(run, start, goal)
                assert run.is_shortest
                assert len(run.events) == length
            met["none" if run is None else "long" if len(run.events) > 2 else "short"] += 1
    assert all(met[name] for name in ("none", "short", "long")), met


@pytest.mark.random
@pytest.mark.parametrize("steps", [0, ways.MAXIMUM_STEPS])
def test_ways_that_are_led_by_layers(steps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Check that they are ways, the same for both engines, wherever rings would be too hard to find."""
    monkeypatch.setattr(runs, "MAXIMUM_EFFORT", 0)
    monkeypatch.setattr(ways, "MAXIMUM_STEPS", steps)
    met: Counter[str] = Counter()
    for seed in seeds(EXAMPLES):
        twins = [Twin(random_system(seed), engine) for engine in ENGINES]
        for start, goal in questions(twins[0], seed):
            run, *others = (twin.way(twin.ways_to(goal), start) for twin in twins)
            assert others == [run] * len(others)
            length = twins[0].distance(start, goal)
            assert (run is None) == (length is None)
            if run is not None:
                twins[0].replay(run, start, goal)
                assert run.is_shortest == (not run.events)
                met["longer"] += len(run.events) != length
            met["none" if run is None else "some"] += 1
    assert all(met[name] for name in ("none", "some")), met


@pytest.mark.random
def test_layers_serve_many_ways(monkeypatch: pytest.MonkeyPatch) -> None:
    """Check that ways to one goal are the same whatever other ways to it were looked for before."""
    monkeypatch.setattr(runs, "MAXIMUM_EFFORT", 0)
    for seed in seeds(EXAMPLES // 2):
        twin = Twin(random_system(seed), "cudd")
        (start, goal), *others = questions(twin, seed)
        shared = twin.ways_to(goal)
        for other, _ in others:
            twin.way(shared, other)
        assert twin.way(shared, start) == twin.way(twin.ways_to(goal), start)


@pytest.mark.random
def test_ways_onwards_where_layers_are_too_large(monkeypatch: pytest.MonkeyPatch) -> None:
    """Check that a way is looked for onwards, and given up where that takes too long as well."""
    monkeypatch.setattr(runs, "MAXIMUM_EFFORT", 0)
    met: Counter[str] = Counter()
    for seed in seeds(EXAMPLES):
        twin = Twin(random_system(seed), "cudd")
        for start, goal in questions(twin, seed):
            length = twin.distance(start, goal)
            for nodes in (0, 60, 500):
                monkeypatch.setattr(ways, "MAXIMUM_NODES", nodes)
                try:
                    run = twin.way(twin.ways_to(goal), start)
                except WayNotFoundError:
                    met["given up"] += 1
                    assert length != 0
                    continue
                met["found"] += 1
                assert (run is None) == (length is None)
                if run is not None:
                    twin.replay(run, start, goal)
    assert all(met[name] for name in ("given up", "found")), met


def test_shortest_ways_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Check that no other way is looked for where none is wanted."""
    twin = Twin(random_system(0), "cudd")
    layers = twin.layers()
    goal = set(layers[-1])
    assert twin.way(twin.ways_to(goal), layers[0], is_led=False) is not None
    monkeypatch.setattr(runs, "MAXIMUM_EFFORT", 0)
    with pytest.raises(WayNotFoundError):
        twin.way(twin.ways_to(goal), layers[0], is_led=False)
