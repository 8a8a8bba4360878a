"""The work list finds what going round and round over all steps finds, whatever the steps read and change."""

from collections.abc import Callable
from itertools import product
from random import Random
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.errors import SynthesisCancelled
from robosc.synthesis import Progress
from robosc.synthesis.closure import Closure, Step
from robosc.synthesis.watch import Watch

ORDER = ("a", "b", "c", "d")
State = tuple[bool, ...]


class States(frozenset[State]):
    """A set of states with what progress is told of a predicate."""

    @property
    def dag_size(self) -> int:
        return len(self)

    def __or__(self, other: Any) -> "States":
        return States(super().__or__(other))


def silent() -> Watch:
    return Watch(lambda: False, lambda progress: None)


def random_step(dice: Random) -> Step:
    """A step that reads and changes some variables, and is restricted by a predicate over all of them."""
    names = dice.sample(ORDER, dice.randint(1, 3))
    places = [ORDER.index(name) for name in names]
    table = {
        values: tuple(dice.random() < 0.5 for _ in names)
        for values in product((False, True), repeat=len(names))
        if dice.random() < 0.7
    }
    allowed = {state for state in product((False, True), repeat=len(ORDER)) if dice.random() < 0.7}

    def add(states: States) -> States:
        found = set()
        for state in states & allowed:
            values = table.get(tuple(state[place] for place in places))
            if values is not None:
                changed = dict(zip(places, values, strict=True))
                found.add(tuple(changed.get(place, value) for place, value in enumerate(state)))
        return States(found)

    return Step(add, frozenset(names))


def swept(steps: list[Step], states: States) -> States:
    """The slow and obvious way."""
    while True:
        grown = states
        for step in steps:
            grown = grown | step.add(grown)
        if grown == states:
            return states
        states = grown


@settings(max_examples=300, deadline=None)
@given(st.integers(0, 2**32))
def test_it_is_what_sweeps_find(seed: int) -> None:
    dice = Random(seed)
    steps = [random_step(dice) for _ in range(dice.randint(0, 8))]
    begin = States({tuple(dice.random() < 0.5 for _ in ORDER)})
    assert Closure(steps, ORDER, silent()).of(begin, "test") == swept(steps, begin)


def counting(limit: int) -> tuple[Step, list[int]]:
    """A step that adds one number after the other, and what it was asked for."""
    asked: list[int] = []

    def add(states: States) -> States:
        asked.append(len(states))
        return States({(True,) * min(len(states) + 1, limit)})

    return Step(add, frozenset({"a"})), asked


def test_enough_is_enough() -> None:
    step, asked = counting(1000)
    enough: Callable[[Any], bool] = lambda states: len(states) == 5  # noqa: E731
    found = Closure([step], ORDER, silent()).of(States({(True,)}), "test", enough)
    assert len(found) == 5
    assert asked == [1, 2, 3, 4]


def test_it_stops_when_told_and_tells_where_it_is() -> None:
    step, asked = counting(1000)
    told: list[Progress] = []
    closure = Closure([step], ORDER, Watch(lambda: len(asked) >= 20, told.append))
    try:
        closure.of(States({(True,)}), "test")
    except SynthesisCancelled:
        assert len(asked) == 20
    else:
        raise AssertionError("it did not stop")


def test_progress_is_told_at_the_end_at_least() -> None:
    step, _ = counting(3)
    told: list[Progress] = []
    Closure([step], ORDER, Watch(lambda: False, told.append)).of(States({(True,)}), "test")
    assert told
    assert {progress.phase for progress in told} == {"test"}
    assert told[-1].nodes == 3
