"""The layer against its obvious twin, on random robots with random callers; and what must hold whatever happens."""

import math
from collections import Counter
from collections.abc import Callable
from random import Random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.protocol import Reading
from robosc.execution.runtime.runner import Status
from robosc.expressions import BooleanType, EnumType
from robosc.expressions.evaluate import evaluate
from robosc.model.structure import Communication, CommunicationKind, Deployment
from robosc.supervisor import Supervisor
from support.effort import examples
from support.generated import load_system
from support.layer_twin import LayerTwin, TwinCall, TwinGoal
from support.layers import LayerBench
from support.random_layers import random_layer
from support.random_limits import limited_robot, with_defaults
from support.random_travels import random_travels

STEPS = 60
OUTCOMES = ("succeeded", "rejected", "aborted", "cancelled", "lost")
_INCOMING = CommunicationKind.INCOMING_MESSAGE


class Watched(InterpretedSystem):
    """Asserts by itself that no request against a requirement is ever taken."""

    def __init__(self, supervisor: Supervisor) -> None:
        super().__init__(supervisor)
        self.requests = 0

    def step(self, event: str, reading: Reading | None = None) -> tuple[str, ...] | None:
        name, _, kind = event.rpartition(".")
        if kind == "request":
            self.requests += 1
            state = self.state()
            for requirement in self._model.requirements_on(name):
                value = evaluate(
                    requirement.condition,
                    lambda component, variable: state[component]["variables"][variable],
                    lambda component: state[component]["state"],
                    lambda path: None,
                )
                assert value is True, (event, requirement)
        return super().step(event, reading)


class Pair:
    """A layer and its twin in one world.

    Args:
        seed: Decides the robot and all that happens.
        load: Makes the layer's system of a supervisor.
    """

    def __init__(self, seed: int, load: Callable[[Supervisor], Any] = Watched) -> None:
        dice = self.dice = Random(seed)
        is_travel = dice.random() < 0.3
        supervisor = random_travels(dice.randrange(2**32), Deployment.LAYER) if is_travel else random_layer(dice)
        if not is_travel and seed % 3 == 0:
            supervisor = limited_robot(with_defaults(supervisor, dice), dice)
        model = supervisor.model
        self.topics = [item for item in model.communications if item.kind is CommunicationKind.OUTGOING_MESSAGE]
        self.requested = [item for item in model.communications if item.kind is not CommunicationKind.OUTGOING_MESSAGE]
        incoming = sorted({item.identifier for item in self.requested if item.kind is _INCOMING})
        topics = sorted({item.identifier for item in self.topics})
        self.settings: dict[str, Any] = {
            "release_identifiers": tuple(name for name in incoming if dice.random() < 0.7),
            "on_unknown": dice.choice(("default", "default", "keep", "fault")),
            "service_timeout_s": dice.choice((1.0, 2.0)),
            "action_timeout_s": dice.choice((1.5, 1000.0)),
            "cancel_timeout_s": dice.choice((0.5, 1.0)),
            "command_timeout_s": dice.choice((0.0, 0.5, 1.0)),
            "max_age_s": {name: 3.0 for name in topics if dice.random() < 0.2},
        }
        self.system = load(supervisor)
        self.bench = LayerBench(self.system, **self.settings)
        self.twin = LayerTwin(supervisor, self.settings)
        self.callers = 0
        self.done: Counter[str] = Counter()

    def run(self, steps: int) -> None:
        self.compare([])
        for _ in range(steps):
            if self.twin.is_endless:
                self.done["endless"] += 1
                assert self.bench.executor.is_faulty
                return
            self.twin.reported.clear()
            kind, sent = self.act()
            self.done[kind] += 1
            self.done.update(f"reported {item[0]}" for item in sent)
            self.compare(sent)

    def compare(self, sent: list[Any]) -> None:
        bench, twin = self.bench, self.twin
        self.check_rest()
        if twin.is_endless:
            return
        left, right = sent, twin.reported
        # Ends for the caller at one moment have no order of their own.
        assert sorted(map(repr, left)) == sorted(map(repr, right))
        ends = ("end", "no answer", "answer", "feedback")
        assert [x for x in map(repr, left) if x[2:].split("'")[0] not in ends] == [
            x for x in map(repr, right) if x[2:].split("'")[0] not in ends
        ]
        assert bench.events == twin.events
        assert bench.executor.counters.unexpected == twin.unexpected
        assert bench.executor.cancelling == twin.cancelling()
        assert [entry["action"] for entry in bench.entries("cancel_overdue")] == twin.late
        assert bench.system.state() == twin.system.state()
        assert (bench.status() in (Status.STOPPED, Status.STOPPING)) is bool(twin.reasons)
        assert bench.executor.is_faulty is ("fault" in twin.reasons)
        assert (bench.status() is Status.RUNNING) is twin.may_request

    def check_rest(self) -> None:
        """While the robot rests, the last message on every release identifier is the default one."""
        if not self.bench.executor.reasons:
            return
        named = {item.name: item.identifier for item in self.requested}
        last: dict[str, str] = {}
        for kind, *rest in self.bench.middleware.sent:
            if kind in ("publish", "default"):
                last[named[rest[0]] if kind == "publish" else rest[0]] = kind
        for identifier in self.settings["release_identifiers"]:
            assert last[identifier] == "default"

    def message(self) -> Any:
        dice = self.dice
        if dice.random() < 0.2:
            return {"n": 0, "m": 0}
        message: dict[str, Any] = {"n": dice.choice((-1, 0, 1, 3, 6)), "m": dice.choice((-1, 0, 1, 3, 6))}
        if dice.random() < 0.15:
            message["inner"] = {"x": dice.choice((0.5, math.nan, math.inf))}
        return message

    def act(self) -> tuple[str, Any]:
        """Do one thing to both: its name, and what the layer reported because of it."""
        dice, bench, twin = self.dice, self.bench, self.twin
        waiting: list[TwinCall | TwinGoal] = [*twin.calls, *twin.goals]
        choices = ["request"] * 8 * bool(self.requested) + ["receive"] * 4 * bool(self.topics) + ["wait"] * 4
        choices += ["answer"] * 6 * bool(waiting)
        if dice.random() < 0.015:
            choices = ["rest", "restart"]
        elif twin.reasons and dice.random() < 0.3:
            choices = ["restart"]
        match dice.choice(choices):
            case "request":
                return self.request(dice.choice(self.requested))
            case "receive":
                return self.receive(dice.choice(self.topics))
            case "answer":
                return self.answer(dice.choice(waiting))
            case "rest":
                is_fault = dice.random() < 0.5
                twin.stop(is_fault)
                return "stop", bench.during(lambda: bench.executor.stop("by hand", is_fault))
            case "restart":
                twin.restart()
                return "restart", bench.during(bench.executor.restart)
        seconds = dice.choice((0.25, 0.25, 0.5, 1.0))
        twin.wait(seconds)
        return "wait", bench.wait(seconds)

    def receive(self, item: Communication) -> tuple[str, Any]:
        data: Any = None
        if isinstance(item.response, EnumType):
            data = {"n": self.dice.choice((0, 1, 6)), "m": self.dice.choice((0, 1, 6))}
        elif isinstance(item.response, BooleanType):
            data = self.dice.random() < 0.5
        self.twin.receive(item.identifier, data)
        return "receive", self.bench.receive(item.identifier, data)

    def request(self, item: Communication) -> tuple[str, Any]:
        message = self.message()
        self.callers += 1
        if item.kind is _INCOMING:
            self.twin.request(item.identifier, message)
            sent = self.bench.request(item.identifier, message)
        elif item.kind is CommunicationKind.SERVICE:
            self.twin.call(item.name, self.callers, message)
            sent = self.bench.call(item.name, self.callers, message)
        else:
            self.twin.goal(item.name, self.callers, message)
            sent = self.bench.goal(item.name, self.callers, message)
        self.twin.finish()
        return f"request {item.kind}", sent

    def answer(self, waiting: TwinCall | TwinGoal) -> tuple[str, Any]:
        bench, twin, data = self.bench, self.twin, {"any": self.dice.random()}
        if isinstance(waiting, TwinCall):
            if self.dice.random() < 0.5:
                twin.reply(waiting, data)
                return "reply", bench.reply(waiting.number, data)
            twin.reply(waiting, None)
            return "fail", bench.fail(waiting.number)
        if not waiting.is_accepted and self.dice.random() < 0.6:
            twin.accept(waiting)
            return "accept", bench.during(bench.executor.on_goal_accepted, waiting.number)
        match self.dice.randrange(4):
            case 0:
                twin.feedback(waiting, data)
                return "feedback", bench.feedback(waiting.number, data)
            case 1:
                outcome = self.dice.choice(OUTCOMES if waiting.asked is None else (*OUTCOMES, "cancelled", "cancelled"))
                twin.end(waiting, outcome, data)
                return "end", bench.end(waiting.number, outcome, data)
            case 2:
                twin.cancelled_by_caller(waiting)
                return "cancel", bench.cancel(waiting.action, waiting.caller)
        twin.wait(0.25)
        return "wait", bench.wait(0.25)


@settings(max_examples=examples(60))
@given(st.integers(0, 2**32))
def test_the_layer_does_what_its_twin_does(seed: int) -> None:
    Pair(seed).run(STEPS)


@pytest.mark.parametrize("seed", range(20))
def test_a_layer_on_generated_code_does_what_its_twin_does(seed: int) -> None:
    Pair(seed, load_system).run(STEPS)


@pytest.fixture(scope="module")
def total() -> Counter[str]:
    """Counts of what happens with some fixed seeds."""
    found: Counter[str] = Counter()
    for seed in range(300):
        pair = Pair(seed)
        pair.run(STEPS)
        found.update(pair.done)
        found["requests taken"] += pair.system.requests
        found["releases"] += len(pair.bench.entries("release"))
        found["ends too late"] += len(pair.twin.late)
        found["own cancels asked for"] += sum(
            "requirement" in entry["why"] for entry in pair.bench.entries("cancelling")
        )
        for entry in pair.bench.entries("event"):
            if entry["event"].endswith(".cancel"):
                found[f"{'own' if entry['controllable'] else 'caller'} cancels"] += 1
    return found


def test_the_random_worlds_show_everything(total: Counter[str]) -> None:
    print(dict(total))
    sent = "publish default blocked call goal cancel answer accept reject end feedback pass".split()
    for what in (*sent, "no answer"):
        assert total[f"reported {what}"] > 50, what
    for what in ("releases", "requests taken", "cancel", "restart", "stop"):
        assert total[what] > 50, what
    assert total["own cancels"] > 5
    assert total["ends too late"] > 50
    assert total["endless"] < 150
