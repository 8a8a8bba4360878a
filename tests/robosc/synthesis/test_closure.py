"""Chaining and saturation find what going round and round over all steps finds, whatever the steps read and change."""

import sys
from collections.abc import Callable, Sequence
from itertools import product
from random import Random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.errors import SynthesisCancelled
from robosc.synthesis import SynthesisProgress
from robosc.synthesis.chaining import Chaining
from robosc.synthesis.engines import Manager, make_manager
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.saturation import Saturation
from robosc.synthesis.step import Step
from support.effort import examples

ORDER = ("a", "b", "c", "d", "e")
LEVELS = {name: level for level, name in enumerate(ORDER)}
State = tuple[bool, ...]
Move = Callable[[State], set[State]]


def silent() -> ProgressMonitor:
    return ProgressMonitor(lambda: False, lambda progress: None)


def random_moves(dice: Random) -> tuple[frozenset[str], Move]:
    """Return one event's targets, nondeterministically, and the variables that it reads or changes."""
    names = dice.sample(ORDER, dice.randint(1, 3))
    places = [ORDER.index(name) for name in names]
    table = {
        values: [tuple(dice.random() < 0.5 for _ in names) for _ in range(dice.randint(1, 2))]
        for values in product((False, True), repeat=len(names))
        if dice.random() < 0.6
    }

    def move(state: State) -> set[State]:
        targets = table.get(tuple(state[place] for place in places), [])
        changes = [dict(zip(places, values, strict=True)) for values in targets]
        return {tuple(changed.get(place, value) for place, value in enumerate(state)) for changed in changes}

    return frozenset(names), move


class Sets:
    """Sets of states as predicates and back, a state at a time."""

    def __init__(self, manager: Manager) -> None:
        self.manager = manager
        manager.declare(*ORDER)

    def predicate(self, states: set[State]) -> Any:
        found = self.manager.false
        for state in states:
            one = self.manager.true
            for name, value in zip(ORDER, state, strict=True):
                one = one & (self.manager.var(name) if value else ~self.manager.var(name))
            found = found | one
        return found

    def states(self, predicate: Any) -> set[State]:
        return {
            state
            for state in product((False, True), repeat=len(ORDER))
            if self.manager.let(dict(zip(ORDER, state, strict=True)), predicate) == self.manager.true
        }

    def step(self, names: frozenset[str], move: Move) -> Step:
        """The step by substitution of what is above: it is asked about parts of diagrams, too."""

        def add(predicate: Any) -> Any:
            # Every variable above a part is free in it, and so it is in the result.
            return self.predicate({target for state in self.states(predicate) for target in move(state)})

        # All that it leads to, where every other variable is free.
        return Step(add, names, add(self.manager.true) if len(names) > 1 else None)


def swept(moves: Sequence[Move], begin: set[State], within: set[State]) -> set[State]:
    """The slow and obvious way."""
    while True:
        grown = begin | {target for move in moves for state in begin for target in move(state) if target in within}
        if grown == begin:
            return begin
        begin = grown


@pytest.mark.parametrize("engine", ["cudd", "oxidd", "autoref"])
@settings(max_examples=examples(50))
@given(seed=st.integers(0, 2**32))
def test_both_find_what_sweeps_find(engine: str, seed: int) -> None:
    if engine == "cudd":
        pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    dice = Random(seed)
    moves = [random_moves(dice) for _ in range(dice.randint(0, 6))]
    everything = list(product((False, True), repeat=len(ORDER)))
    share = dice.choice((0.5, 0.8, 1.0))
    within = {state for state in everything if dice.random() < share} or set(everything)
    begin = set(dice.sample(sorted(within), min(len(within), dice.randint(1, 3))))
    sets = Sets(make_manager(engine))
    steps = [sets.step(names, move) for names, move in moves]
    expected = swept([move for _, move in moves], begin, within)
    limits = sets.predicate(within)
    chained = Chaining(LEVELS, steps, limits, silent()).of(sets.predicate(begin), "test")
    saturated = Saturation(sets.manager, LEVELS, steps, limits, silent()).of(sets.predicate(begin), "test")
    assert sets.states(chained) == expected
    assert saturated == chained


def test_saturation_stays_below_what_a_step_is_about() -> None:
    sets = Sets(make_manager("autoref"))
    seen: list[Any] = []

    def add(predicate: Any) -> Any:
        seen.append(predicate)
        return sets.manager.let({"d": ~sets.manager.var("d")}, predicate)

    begin = sets.predicate({(True, False, True, False, True), (False, False, True, True, True)})
    steps = [Step(add, frozenset({"d"})), Step(lambda states: states, frozenset({"a"}))]
    found = Saturation(sets.manager, LEVELS, steps, sets.manager.true, silent()).of(begin, "test")
    assert sets.states(found) == {(a, False, True, d, True) for a in (False, True) for d in (False, True)}
    # Neither `a` nor `b` nor `c` is of any interest to the step.
    assert all(not sets.manager.support(predicate) & {"a", "b", "c"} for predicate in seen)
    # From each of the two parts once, and once more to see that it is closed.
    assert len(seen) == 4


class States(frozenset[State]):
    """A set of states with what progress reports of a predicate."""

    @property
    def dag_size(self) -> int:
        return len(self)

    def __or__(self, other: Any) -> "States":
        return States(super().__or__(other))


class Everything:
    """Restriction that all states meet."""

    def __and__(self, other: Any) -> Any:
        return other


def chaining(step: Step, monitor: ProgressMonitor) -> Chaining:
    return Chaining(LEVELS, [step], Everything(), monitor)


def counting(limit: int) -> tuple[Step, list[int]]:
    """A step that adds one number after the other, and what it was asked for."""
    asked: list[int] = []

    def add(states: States) -> States:
        asked.append(len(states))
        return States({(True,) * min(len(states) + 1, limit)})

    return Step(add, frozenset({"a"})), asked


def test_enough_is_enough_for_chaining() -> None:
    step, asked = counting(1000)
    found = chaining(step, silent()).of(States({(True,)}), "test", States({(True,) * 5}))
    assert len(found) == 5
    assert asked == [1, 2, 3, 4]


def counter(sets: Sets) -> Step:
    """Counts with all five bits upwards."""
    return sets.step(frozenset(ORDER), lambda state: {_following(state)})


def _following(state: State) -> State:
    number = sum(value << place for place, value in enumerate(reversed(state))) + 1
    return tuple(bool(number >> place & 1) for place in reversed(range(len(state))))


@pytest.mark.parametrize("wanted", [1, 5, 32])
def test_enough_is_enough_for_saturation(wanted: int) -> None:
    sets = Sets(make_manager("autoref"))
    saturation = Saturation(sets.manager, LEVELS, [counter(sets)], sets.manager.true, silent())
    begin = sets.predicate({(False,) * 5})
    last = tuple(bool((wanted - 1) >> place & 1) for place in reversed(range(5)))
    found = saturation.of(begin, "test", sets.predicate({last}))
    assert len(sets.states(found)) == wanted


def becoming_true(manager: Manager, name: str) -> Callable[[Any], Any]:
    return lambda states: manager.exist([name], states) & manager.var(name)


def test_diagrams_may_be_deeper_than_python_goes_by_itself() -> None:
    """Each of 3,000 bits that are zero may become one, by an event of its own."""
    pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    manager = make_manager("cudd")
    names = [f"bit{number}" for number in range(3_000)]
    manager.declare(*names)
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(1_500)
    try:
        steps = [Step(becoming_true(manager, name), frozenset({name})) for name in names]
        levels = {name: level for level, name in enumerate(names)}
        states = manager.true
        for name in reversed(names):
            states = states & ~manager.var(name)
        assert Saturation(manager, levels, steps, manager.true, silent()).of(states, "test") == manager.true
    finally:
        sys.setrecursionlimit(max(before, sys.getrecursionlimit()))


def test_chaining_stops_on_request() -> None:
    step, asked = counting(1000)
    with pytest.raises(SynthesisCancelled):
        chaining(step, ProgressMonitor(lambda: len(asked) >= 20, lambda progress: None)).of(States({(True,)}), "test")
    assert len(asked) == 20


def test_saturation_stops_on_request() -> None:
    sets = Sets(make_manager("autoref"))
    asked: list[None] = []

    def should_stop() -> bool:
        asked.append(None)
        return len(asked) == 7

    monitor = ProgressMonitor(should_stop, lambda progress: None)
    with pytest.raises(SynthesisCancelled):
        Saturation(sets.manager, LEVELS, [counter(sets)], sets.manager.true, monitor).of(
            sets.predicate({(False,) * 5}), "test"
        )
    assert len(asked) == 7


def test_progress_is_reported_at_the_end_at_least() -> None:
    step, _ = counting(3)
    reported: list[SynthesisProgress] = []
    chaining(step, ProgressMonitor(lambda: False, reported.append)).of(States({(True,)}), "test")
    sets = Sets(make_manager("autoref"))
    monitor = ProgressMonitor(lambda: False, reported.append)
    found = Saturation(sets.manager, LEVELS, [counter(sets)], sets.manager.true, monitor).of(
        sets.predicate({(True, True, True, True, False)}), "test"
    )
    assert {progress.phase for progress in reported} == {"test"}
    assert [reported[0].nodes, reported[-1].nodes] == [3, found.dag_size]
