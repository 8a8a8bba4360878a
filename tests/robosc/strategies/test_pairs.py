"""Moves that are looked at as pairs, beside the same moves that are looked at event by event."""

from random import Random

import pytest

from robosc.automata import ExecutableSystem
from robosc.model.structure import Deployment, Model
from robosc.strategies import arena, pairs
from robosc.strategies.arena import ControllerArena
from robosc.supervisor import AddedCondition
from robosc.synthesis.changes import changed_subjects
from robosc.synthesis.workspace import workspace
from support.models import model_of
from support.random_couriers import random_courier
from support.random_goals import wanting_robot

Robot = tuple[Model, tuple[AddedCondition, ...]]
"""A model, and what its supervisor adds."""


def paired(item: ControllerArena) -> int:
    """Return the number of moves that are looked at as pairs."""
    return len(item._turns) + len(item._cases) - len(item._other_cases)


def compare(robot: Robot, seed: int, engine: str, patch: pytest.MonkeyPatch) -> tuple[int, ...]:
    """Compare what moves lead to; return how many of them are looked at as pairs each time."""
    model, added = robot
    executable = ExecutableSystem(model, Deployment.CONTROLLER)
    owed, system = executable.obligations, executable.remembering_automata
    dice = Random(seed)
    with workspace(system, engine, lambda: False, lambda progress: None, (), changed_subjects(system)) as place:
        arenas = []
        # None at all, some in several diagrams, and all in one.
        for limit, each in ((0, 0), (5_000, dice.choice((8, 12, 18, 27, 40, 60, 90, 135))), (5_000, 5_000)):
            patch.setattr(arena, "MAXIMUM_NODES", limit)
            patch.setattr(pairs, "MAXIMUM_NODES", each)
            arenas.append(ControllerArena(executable, added, owed, place.encoding, place.monitor))
        sizes = tuple(map(paired, arenas))
        first, *others = arenas
        assert not paired(first)
        reachable = first.reachable_positions()
        manager = place.encoding.manager
        for other in others:
            assert other.reachable_positions() == reachable, seed
            assert other.unobserved(reachable) == first.unobserved(reachable), seed
        predicates = [first.positions, manager.false, *(first.condition(item.condition) for item in owed.aims)]
        for _ in range(6):
            cube = manager.true
            for name in dice.sample(place.encoding.state_names, 2):
                cube = cube & (manager.var(name) if dice.random() < 0.5 else ~manager.var(name))
            predicates.append(dice.choice(predicates) & ~cube)
        for predicate in predicates:
            event = dice.choice(first.requests) if first.requests else None
            for other in others:
                assert other.surroundings(predicate) == first.surroundings(predicate), seed
                assert other.responses(predicate) == first.responses(predicate), seed
                assert other.turn(predicate) == first.turn(predicate), seed
                if event is not None:
                    assert other.choice(event, predicate) == first.choice(event, predicate), seed
        # A manager must not end before its predicates.
        del arenas, first, others, reachable, predicates, cube, predicate, other
    return sizes


@pytest.mark.parametrize("engine", ["cudd", "oxidd", "autoref"])
@pytest.mark.parametrize("kind", ["controllers", "couriers"])
def test_pairs_lead_where_events_lead(engine: str, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = set[tuple[int, ...]]()
    for seed in range(24):
        if kind == "couriers":
            found = random_courier(seed)
            if found is None:
                continue
            model, added = found
        else:
            supervisor, model = wanting_robot(seed)
            if supervisor is None:
                continue
            added = supervisor.added
        sizes.add(compare((model, added), seed, engine, monkeypatch))
    assert len(sizes) > 2
    assert any(none < some < every for none, some, every in sizes), sizes


ENDLESS = """robot Wheel {
    component Lamp {
        incoming message light with identifier: "/light", type: none
        outgoing message broken with identifier: "/broken", type: none
        outgoing message repaired with identifier: "/repaired", type: none
        behaviour {
            initial marked state dark { on request to light goto bright on response from broken goto flashing }
            marked state bright { on response from broken goto dark }
            marked state flashing { transition goto dimmed }
            marked state dimmed { transition goto flashing on response from repaired goto dark }
        }
    }
    goal always eventually Lamp.bright
}"""


@pytest.mark.parametrize("engine", ["cudd", "oxidd", "autoref"])
def test_silent_steps_without_end_lead_nowhere(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the dark lamp a message can lead to silent steps that never end: that is outside of every predicate."""
    compare((model_of(ENDLESS), ()), 0, engine, monkeypatch)
