"""Event logs of random robots in random worlds, by the reference executors; mutations of them; and what is right.

`faults` is the obvious twin of the log check: it leads the interpreted system through a log, line by line.
"""

import copy
import json
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Any

from robosc.event_logs import LoggedRun, read_log
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.interpreter.received import path_text
from robosc.execution.runtime.event_log import json_line
from robosc.execution.runtime.protocol import MissingData, Reading
from robosc.expressions import BooleanType, EnumType
from robosc.model.received import converted_paths
from robosc.model.structure import Communication, CommunicationKind
from robosc.supervisor import Supervisor
from support.execution import Bench
from support.layers import LayerBench

Entry = dict[str, Any]

OUTCOMES = ("succeeded", "rejected", "aborted", "cancelled", "lost")


def random_settings(dice: Random, supervisor: Supervisor) -> dict[str, Any]:
    """Settings of either deployment, short times among them."""
    topics = {
        item.identifier for item in supervisor.model.communications if item.kind is CommunicationKind.OUTGOING_MESSAGE
    }
    incoming = {
        item.identifier for item in supervisor.model.communications if item.kind is CommunicationKind.INCOMING_MESSAGE
    }
    return {
        "on_unknown": dice.choice(("default", "default", "keep", "fault")),
        "service_timeout_s": dice.choice((1.0, 2.0)),
        "action_timeout_s": dice.choice((1.5, 1000.0)),
        "release_identifiers": tuple(name for name in sorted(incoming) if dice.random() < 0.7),
        "max_age_s": {name: 3.0 for name in sorted(topics) if dice.random() < 0.2},
    }


class World:
    """A robot around an executor, in which anything happens.

    Args:
        supervisor: Of a controller or a layer, as its deployment says.
        dice: Decides what happens.
        settings: The executor's; random ones if None.
    """

    def __init__(self, supervisor: Supervisor, dice: Random, settings: dict[str, Any] | None = None) -> None:
        self.supervisor = supervisor
        self.dice = dice
        model = supervisor.model
        self.topics = [item for item in model.communications if item.kind is CommunicationKind.OUTGOING_MESSAGE]
        self.requested = [item for item in model.communications if item.kind is not CommunicationKind.OUTGOING_MESSAGE]
        system = InterpretedSystem(supervisor)
        settings = random_settings(dice, supervisor) if settings is None else settings
        self.bench: Bench | LayerBench
        if supervisor.deployment == "layer":
            self.bench = LayerBench(system, **settings)
        else:
            self.bench = Bench(system, **settings)
        self._callers = 0

    @property
    def entries(self) -> list[Entry]:
        """The log so far, as a file would hold it."""
        return self.of(self.bench)

    @staticmethod
    def of(bench: Bench | LayerBench) -> list[Entry]:
        """The log of an executor, as a file would hold it."""
        return [json.loads(json_line(entry)) for entry in bench.log.entries]

    def run(self, steps: int) -> list[Entry]:
        """Let things happen; the log."""
        for _ in range(steps):
            self.act()
        return self.entries

    def act(self) -> None:
        """Let one thing happen, or nothing where data lacks what cannot be unknown."""
        dice, executor = self.dice, self.bench.executor
        choices: list[Callable[[], None]] = [self._wait] * 8
        if self.topics:
            choices += [self._receive] * 6
        if isinstance(self.bench, LayerBench) and self.requested:
            choices += [self._ask] * 8
        if self._calls() or self._goals():
            choices += [self._answer] * 6
        if dice.random() < 0.02:
            choices = [lambda: executor.stop("by hand", dice.random() < 0.5), executor.restart]
        elif executor.reasons and dice.random() < 0.2:
            choices = [executor.restart]
        with suppress(MissingData):
            dice.choice(choices)()

    def _calls(self) -> Any:
        return self.bench.executor._replies._calls._calls

    def _goals(self) -> Any:
        return self.bench.executor._replies._goals.open_goals()

    def _wait(self) -> None:
        self.bench.clock.advance(self.dice.choice((0.1, 0.1, 0.5, 1.0)))
        self.bench.executor.tick()

    def data(self, item: Communication) -> Any:
        """Return data that may come."""
        dice = self.dice
        if isinstance(item.response, BooleanType):
            return dice.choice((True, False, None))
        if isinstance(item.response, EnumType):
            return {"n": dice.choice((0, 1, 6)), "m": dice.choice((0, 1, 6))}
        return None

    def _receive(self) -> None:
        item = self.dice.choice(self.topics)
        self.bench.executor.receive(item.identifier, self.data(item))

    def _ask(self) -> None:
        assert isinstance(self.bench, LayerBench)
        dice, item = self.dice, self.dice.choice(self.requested)
        message = {"n": dice.choice((-1, 0, 1, 3, 6)), "m": dice.choice((-1, 0, 1, 3, 6))}
        if dice.random() < 0.1:
            message["m"] = float("nan")  # type: ignore[assignment]
        self._callers += 1
        match item.kind:
            case CommunicationKind.INCOMING_MESSAGE:
                self.bench.request(item.identifier, message)
            case CommunicationKind.SERVICE:
                self.bench.call(item.name, self._callers, message)
            case _:
                self.bench.goal(item.name, self._callers, message)

    def _answer(self) -> None:
        dice, executor = self.dice, self.bench.executor
        calls, goals = list(self._calls()), self._goals()
        if calls and (not goals or dice.random() < 0.5):
            number = dice.choice(calls)
            if dice.random() < 0.6:
                executor.on_reply(number, {"any": 1})
            else:
                executor.on_call_failed(number, "lost")
            return
        goal = dice.choice(goals)
        match dice.randrange(4):
            case 0:
                executor.on_goal_accepted(goal.number)
            case 1:
                executor.on_feedback(goal.number, {"any": 1})
            case 2 if isinstance(self.bench, LayerBench):
                self.bench.cancel(goal.action, self._callers)
            case _:
                executor.on_goal_ended(goal.number, dice.choice(OUTCOMES), {"any": 1})


def read(folder: Path, entries: Sequence[Entry]) -> LoggedRun:
    """The entries as a log that was read from a file."""
    file = folder / "log.jsonl"
    file.write_text("".join(map(json_line, entries)), encoding="utf-8")
    return read_log(file)


def faults(supervisor: Supervisor, entries: Sequence[Entry]) -> Iterator[int]:
    """The line, from 1, of the first thing in a log that the interpreted system does not do; none if it does all."""
    system = InterpretedSystem(supervisor)
    reasons: set[str] = set()
    for line, entry in enumerate(entries, 1):
        kind = entry["kind"]
        if kind == "restart":
            system.restart()
            reasons.clear()
        elif kind in ("fault", "stop"):
            reasons.add(kind if kind == "fault" else entry["what"])
        elif kind == "resume":
            back = re.compile(re.escape(entry["what"].removesuffix(" is back")) + " on .* is stale", re.DOTALL)
            reasons = {item for item in reasons if not back.fullmatch(item)}
        elif kind == "event" and not _happens(system, supervisor, entry, bool(reasons)):
            yield line
            return


def _happens(system: InterpretedSystem, supervisor: Supervisor, entry: Entry, is_stopped: bool) -> bool:
    event = entry["event"]
    kind = event.rpartition(".")[2]
    if kind == "request" and (is_stopped or system.enabled_silent() is not None):
        return False
    if kind == "request" and supervisor.deployment == "controller" and not _is_provided(system, entry):
        return False
    is_cancel = kind == "cancel" and supervisor.deployment == "layer"
    is_own = kind in ("request", "cancel", "reset") or kind.startswith("tau_")
    if entry["controllable"] is not is_own and kind != "cancel":
        return False
    # A cancel in a layer may be the caller's: it is only to be possible.
    if is_own and not is_cancel and not system.enabled(event) and not _is_idle_tau(system, event):
        return False
    values = {}
    for path in converted_paths(supervisor.model, event):
        text = path_text(path)
        if text in (entry["data"] or {}):
            values[path] = entry["data"][text]
    if system.step(event, Reading(values, {}, (), False)) is None:
        return False
    return bool(system.state() == entry["state"])


def _is_provided(system: InterpretedSystem, entry: Entry) -> bool:
    is_known, data = system.provide(entry["event"].rpartition(".")[0])
    return is_known and bool(json.loads(json_line({"data": data}))["data"] == entry["data"])


def _is_idle_tau(system: InterpretedSystem, event: str) -> bool:
    """A tau that changes nothing is never taken, but it is not forbidden."""
    rule = system._events[event]
    successor = system._successor(rule, lambda path: None)
    return event.rpartition(".")[2].startswith("tau_") and successor is not None and successor.state == system._state


def mutated(dice: Random, supervisor: Supervisor, entries: Sequence[Entry]) -> list[Entry] | None:
    """The log with one thing that is not as it was; None if it has none to change."""
    places = [number for number, entry in enumerate(entries) if entry["kind"] == "event"]
    if not places:
        return None
    found = copy.deepcopy(list(entries))
    place = dice.choice(places)
    match dice.randrange(6):
        case 0:
            del found[place]
        case 5:
            asked = [number for number in places if found[number]["event"].endswith(".request")]
            if not asked:
                return None
            found[dice.choice(asked)]["data"] = dice.choice((None, 1, {}, {"n": 1}, {"n": 1, "m": 1.5}, True, "small"))
        case 1:
            requests = [
                f"{item.name}.request"
                for item in supervisor.model.communications
                if item.kind is not CommunicationKind.OUTGOING_MESSAGE
            ]
            if not requests:
                return None
            found[place] |= {"event": dice.choice(requests), "controllable": True, "data": None}
        case 2:
            _change_state(dice, supervisor, found[place]["state"])
        case 3:
            other = dice.choice(places)
            found[place], found[other] = found[other], found[place]
        case 4:
            found.insert(place, copy.deepcopy(found[dice.choice(places)]))
    return found


def _change_state(dice: Random, supervisor: Supervisor, state: dict[str, Any]) -> None:
    component = dice.choice([item for item in supervisor.model.components if item.behaviour])
    behaviour = component.behaviour
    assert behaviour is not None
    if behaviour.variables and dice.random() < 0.5:
        variable = dice.choice(behaviour.variables)
        now = state[component.name]["variables"][variable.name]
        others = [value for value in (True, False, "small", "large", 1, None) if value is not now and value != now]
        state[component.name]["variables"][variable.name] = dice.choice(others)
    else:
        state[component.name]["state"] = dice.choice([*(item.name for item in behaviour.states), "nowhere"])


def walked(supervisor: Supervisor, dice: Random, steps: int, data: Callable[[Random], Any]) -> list[Entry]:
    """A log of the interpreted system alone, led anywhere it can go: every kind of variable and data, no executor."""
    system = InterpretedSystem(supervisor)
    events = sorted(system._events)
    entries: list[Entry] = []
    for number in range(steps if events else 0):
        event = system.enabled_silent() or dice.choice(events)
        kind = event.rpartition(".")[2]
        is_own = kind in ("request", "cancel", "reset") or kind.startswith("tau_")
        if is_own and not system.enabled(event):
            continue
        try:
            reading = system.read(event, None if is_own else data(dice))
        except MissingData:
            continue
        rule = system._events[event]
        successor = system._successor(rule, reading.values.get)
        if successor is None or successor.leaves_range:
            continue
        is_known, provided = system.provide(event.rpartition(".")[0]) if kind == "request" else (True, None)
        if not is_known:
            continue
        system.step(event, reading)
        shown = {"data": provided if is_own else reading.data, "state": system.state()}
        entry = {"time": float(number), "kind": "event", "event": event, "controllable": is_own, **shown}
        entries.append(json.loads(json_line(entry)))
    return entries
