"""The interpreter against the explicit meaning of the automata: the same states, the same enabled events."""

from random import Random
from typing import Any

import pytest

from robosc.automata import Semantics, to_automata
from robosc.automata.state import subjects
from robosc.execution.interpreter import InterpretedSystem
from robosc.expressions import (
    ArrayType,
    BooleanType,
    DoubleType,
    EnumType,
    IntegerType,
    ObjectType,
    StringType,
    Type,
    Value,
)
from robosc.model.structure import EventKind, Model, is_tau
from robosc.supervisor import Supervisor
from robosc.supervisor.predicates import state_predicates
from support.execution import supervisor_of
from support.models import EXAMPLE_NAMES, example_model
from support.random_supervisors import random_supervisor

STEPS = 60


def well_typed(dice: Random, model: Model, type_: Type | None) -> Any:
    """Data as the declared type promises it; arrays of any length."""
    match type_:
        case BooleanType():
            return dice.random() < 0.5
        case IntegerType():
            return dice.randint(-3 if type_.low is None else type_.low, 6 if type_.high is None else type_.high)
        case DoubleType():
            return dice.choice((-1.5, 0.0, 0.5, 2.0, 7.0))
        case StringType():
            return dice.choice(("", "a", "text"))
        case EnumType(name=name):
            return well_typed(dice, model, model.enum(name).source)
        case ObjectType(name=name):
            return {item.name: well_typed(dice, model, item.type) for item in model.object(name).properties}
        case ArrayType(element=element):
            return [well_typed(dice, model, element) for _ in range(dice.randint(0, 4))]
        case _:
            return None


class Pair:
    """One supervisor, twice."""

    def __init__(self, supervisor: Supervisor) -> None:
        self.model = supervisor.model
        self.system = to_automata(supervisor.model, supervisor.deployment)
        self.semantics = Semantics(self.system)
        self.added = state_predicates(self.system, supervisor.added)
        self.interpreted = InterpretedSystem(supervisor)
        self.subjects = subjects(self.system)

    def state(self) -> tuple[Value, ...]:
        """The interpreter's state as the automata write it."""
        states = self.interpreted.state()
        services = {f"{item.kind} {item.name}": item.name for item in self.model.communications}
        values: list[Value] = []
        for subject in self.subjects:
            if subject.variable is not None:
                values.append(states[subject.automaton]["variables"][subject.variable])
            elif subject.automaton in states:
                values.append(states[subject.automaton]["state"])
            elif subject.automaton.startswith("message "):
                values.append("idle")
            else:
                values.append(self.interpreted.location(services[subject.automaton]))
        return tuple(values)

    def expected(self, event: str, state: tuple[Value, ...]) -> bool:
        """Return True if the automata and the supervisor allow a controllable event."""
        allowed = self.semantics.enabled(state, event) and self.semantics.condition(state, event)
        if event in self.added:
            allowed = allowed and self.added[event](state)
        return allowed and not (is_tau(event) and self.semantics.targets(state, event) == {state})

    def walk(self, dice: Random) -> int:
        """Take random events for a while, comparing everything; how many were taken."""
        self.interpreted.restart()
        assert self.state() == self.semantics.initial
        for step in range(STEPS):
            state = self.state()
            if self.semantics.bad(state):
                return step
            candidates = [event.name for event in self.system.events if not event.is_controllable]
            for event in self.system.events:
                if event.is_controllable:
                    assert self.interpreted.enabled(event.name) == self.expected(event.name, state), event.name
                    if self.interpreted.enabled(event.name):
                        candidates.append(event.name)
            if not candidates:
                return step
            self.take(dice, dice.choice(candidates), state)
        return STEPS

    def take(self, dice: Random, event: str, state: tuple[Value, ...]) -> None:
        name, _, kind = event.rpartition(".")
        reading = None
        if not is_tau(event):
            type_ = self.model.communication(name).received_type(EventKind(kind))
            reading = self.interpreted.read(event, well_typed(dice, self.model, type_))
        skipped = self.interpreted.step(event, reading)
        targets = self.semantics.targets(state, event)
        if skipped is None:
            assert not targets, event
            assert self.state() == state
        else:
            assert self.state() in targets, event


@pytest.mark.parametrize("name", EXAMPLE_NAMES)
def test_the_examples_agree(name: str) -> None:
    pair = Pair(supervisor_of(example_model(name)))
    dice = Random(name)
    assert sum(pair.walk(dice) for _ in range(20)) > 500


def test_random_supervisors_agree() -> None:
    taken = 0
    for seed in range(150):
        pair = Pair(random_supervisor(seed))
        taken += sum(pair.walk(Random(seed)) for _ in range(3))
    # Enough of them must really have gone somewhere.
    assert taken > 3000
