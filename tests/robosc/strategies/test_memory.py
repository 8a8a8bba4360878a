"""The memory of a game on decision diagrams: observed part by part, and followed apart where tours are long."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from random import Random
from typing import Any

import pytest

from robosc.automata import ExecutableSystem
from robosc.automata.goal_memory import MEMORY, Obligations, Place, remembering
from robosc.automata.state import Subject
from robosc.controller_properties import StrategyRun
from robosc.expressions import Expression, Unary, VariableRead
from robosc.model.structure import Deployment
from robosc.strategies import memory
from robosc.strategies.memory import ObservedMemory
from robosc.strategies.synthesize import StrategySynthesis
from robosc.supervisor import Strategy
from robosc.synthesis.changes import changed_subjects
from robosc.synthesis.workspace import Workspace, workspace
from support.long_detours import robot_with_detours
from support.models import model_of
from support.random_couriers import random_courier


@contextmanager
def place_of(executable: ExecutableSystem, engine: str = "auto") -> Iterator[Workspace]:
    system = executable.remembering_automata
    followed = changed_subjects(system)
    conditions = [place.judged for place in executable.obligations.places]
    with workspace(system, engine, lambda: False, lambda progress: None, conditions, followed) as place:
        yield place


def read(name: str) -> Expression:
    return VariableRead(MEMORY, name)


def owed(*places: tuple[str, Expression]) -> Obligations:
    return Obligations((), (), (), tuple(Place(name, update) for name, update in places), (), ())


def memory_of(place: Workspace, names: Sequence[str], *true: str) -> Any:
    """Return the predicate that of some places of the memory these are true."""
    encoding = place.encoding
    found = encoding.manager.true
    for name in names:
        variable = encoding.manager.var(encoding.subjects[Subject(MEMORY, name)].names[0])
        found = found & (variable if name in true else ~variable)
    return found


@pytest.mark.parametrize(
    "updates",
    [
        # Places that decide about each other, about the next one, and about the one before.
        {"a": "b", "b": "a", "c": "c"},
        {"a": "a", "b": "a", "c": "b"},
        {"a": "b", "b": "c", "c": "!c"},
    ],
)
def test_places_are_observed_at_once_whatever_they_read(updates: dict[str, str]) -> None:
    wanted = owed(
        *(
            (name, Unary("not", read(update[1:])) if update.startswith("!") else read(update))
            for name, update in updates.items()
        )
    )
    plain = ExecutableSystem(model_of(robot_with_detours(0, 0, 1)), Deployment.CONTROLLER)
    system = remembering(plain.automata, wanted.places)
    with workspace(system, "auto", lambda: False, lambda progress: None) as place:
        observed = ObservedMemory(place.encoding, wanted)
        for number in range(2 ** len(updates)):
            true = [name for bit, name in enumerate(updates) if number >> bit & 1]
            after = [
                name for name, item in updates.items() if (item[1:] not in true if item[0] == "!" else item in true)
            ]
            assert observed.after(memory_of(place, list(updates), *true)) == memory_of(place, list(updates), *after)


@pytest.mark.parametrize("engine", ["cudd", "oxidd", "autoref"])
def test_memory_is_observed_as_in_explicit_states(engine: str) -> None:
    compared = moved = 0
    for seed in range(12):
        found = random_courier(seed)
        if found is None:
            continue
        model, added = found
        executable = ExecutableSystem(model, Deployment.CONTROLLER)
        run, dice = StrategyRun(executable, Strategy(((),) * len(executable.obligations.aims))), Random(seed)
        with place_of(executable, engine) as place:
            synthesis = StrategySynthesis(executable, added, place)
            observed = ObservedMemory(place.encoding, executable.obligations)
            domains = [bits.domain for bits in place.encoding.places]
            count = len(domains) - len(executable.obligations.places)
            held = run.memory
            for _ in range(30):
                state = tuple(dice.choice(list(domain)) for domain in domains[: count - 1])
                after = run.observed(state, held)
                one = place.encoding.state((*state, "only", *held))
                other = place.encoding.state((*state, "only", *after))
                assert observed.after(one) == other, seed
                assert one & ~observed.before(other) == synthesis.false, seed
                assert one & observed.before(~other) == synthesis.false, seed
                compared += 1
                moved += held != after
                held = after
    assert compared > 200 and moved > 50


def test_tours_that_are_followed_apart_have_the_same_visits(monkeypatch: pytest.MonkeyPatch) -> None:
    more = never = 0
    for seed in range(60):
        found = random_courier(seed)
        if found is None:
            continue
        model, added = found
        executable = ExecutableSystem(model, Deployment.CONTROLLER)
        with place_of(executable) as place:
            synthesis = StrategySynthesis(executable, added, place)
            exact = synthesis.arena.reachable_positions()
            expected = synthesis.result(range(len(model.assumptions))).never_made
            with monkeypatch.context() as patch:
                patch.setattr(memory, "MAXIMUM_TOGETHER", 1)
                apart = synthesis.arena.reachable_positions()
                result = synthesis.result(range(len(model.assumptions)))
            assert exact & ~apart == synthesis.false, seed
            assert result.never_made == expected, seed
            more += exact != apart
            never += bool(expected)
    assert more > 5 and never > 3


def test_long_detours_are_followed_one_by_one() -> None:
    executable = ExecutableSystem(model_of(robot_with_detours(3, 12)), Deployment.CONTROLLER)
    with place_of(executable) as place:
        synthesis = StrategySynthesis(executable, (), place)
        assert len(list(ObservedMemory(place.encoding, executable.obligations).apart())) == 2
        # The exact positions take more nodes, and many more on the way.
        assert synthesis.arena.reachable_positions().dag_size < 1_000
        result = synthesis.result()
    assert result.strategy is not None and result.winning == result.positions == 7 * 2**3 * 3 * 13**3
