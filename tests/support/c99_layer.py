"""Compares a generated C layer with the reference layer: the same commands to both, all that happens line by line."""

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

from robosc.execution.runtime.layer import (
    _A_FAULT,
    _AT_REST,
    _CAME_TO_REST,
    _NOT_ALLOWED,
    _NOT_FINITE,
    _NOT_KNOWN,
    _NOT_WITHIN,
    _OLD_CALLS,
    _OLD_GOALS,
    _STILL_RUNNING,
    _TOO_LONG,
    _TURNED,
    Layer,
)
from robosc.execution.runtime.middleware_messages import is_finite
from robosc.execution.runtime.protocol import MissingData
from robosc.execution.runtime.runner import Status
from robosc.execution.runtime.settings import Settings
from robosc.expressions import DoubleType, Type
from robosc.model.structure import CommunicationKind
from robosc.supervisor import Supervisor
from robosc.targets.code.c.layer import request_parameters
from robosc.targets.code.c.layout import Layout, groups, sharing
from support.c99 import OUTCOMES, Reference, _hex, built, compare, data_words, microseconds
from support.c99_layer_main import CALLBACKS, TOKENS, layer_program
from support.c99_main import batch_types, events_back

REFUSALS = (
    _NOT_ALLOWED,
    _NOT_FINITE,
    _NOT_KNOWN,
    _NOT_WITHIN,
    _STILL_RUNNING,
    _AT_REST[Status.NEW],
    _AT_REST[Status.WAITING],
    _OLD_GOALS,
    _OLD_CALLS,
    _AT_REST[Status.STOPPED],
    _A_FAULT,
)


def refusals_of(layout: Layout) -> list[str]:
    """The reasons of a layer, in the order of its enumeration."""
    return [why for why in REFUSALS if layout.numbers or why != _NOT_WITHIN]


ABORTS = (*(f"its server: {outcome}" for outcome in OUTCOMES), _TURNED, _CAME_TO_REST, _TOO_LONG)
"""The reasons why a goal ends as aborted, in the order of the enumeration of a layer."""

_ENDS = ("succeeded", "aborted", "cancelled")


def compiled_layer(supervisor: Supervisor, folder: Path, *options: str) -> Path:
    """The test program of a layer; the one that is there, if the same was compiled into the folder before."""
    return built(supervisor, layer_program(supervisor), folder, *options)


def layer_settings_words(layout: Layout, settings: Settings) -> list[object]:
    """The command that makes a new layer with some settings."""
    words: list[object] = ["n", ("default", "keep", "fault").index(settings.on_unknown)]
    words += [microseconds(settings.service_timeout_s), microseconds(settings.action_timeout_s)]
    words += [microseconds(settings.cancel_timeout_s), microseconds(settings.command_timeout_s)]
    for item in layout.model.communications:
        is_sensor = item.kind is CommunicationKind.OUTGOING_MESSAGE
        age = settings.max_age_s.get(item.identifier, item.max_age) if is_sensor else None
        words.append(0 if age is None else microseconds(age))
    return words + [int(topic in (settings.release_identifiers or ())) for topic in layout.topics]


def caller_place(layout: Layout, name: str) -> int:
    """Number of the function for a caller's call, goal or cancel, such as `goal_NAME`."""
    purpose, _, asked = name.partition("_")
    item = layout.model.communication(asked)
    names = [f"call_{group[0].name}" for group in groups(layout.model, CommunicationKind.SERVICE)]
    for group in groups(layout.model, CommunicationKind.ACTION):
        names += [f"goal_{group[0].name}", f"cancel_{group[0].name}"]
    first = sharing(layout.model, item.kind, item.identifier)[0].name
    return len(layout.topics) + names.index(f"{purpose}_{first}")


def looked_at(layout: Layout, name: str) -> list[Type]:
    """The types as which a layer takes the data of the requests on the identifier of a communication."""
    item = layout.model.communication(name)
    group = sharing(layout.model, item.kind, item.identifier)
    return [layout.source(type_) for _, type_ in request_parameters(layout, group).values()]


class LayerReference(Reference):
    """The reference layer, both its sides, and the lines that generated C must print for the same commands."""

    executor: Layer  # type: ignore[assignment]

    def __init__(self, supervisor: Supervisor, dice: Random, settings: Settings | None = None) -> None:
        self.messages: list[Any] = []
        self.last_caller = 0
        self.callers: list[int] = []
        super().__init__(supervisor, dice, settings)

    # Settings.

    def _settings(self) -> Settings:
        dice = self.dice
        on_unknown = dice.choice(["default", "keep"] if self.is_calm else ["default", "keep", "fault"])
        ages = {
            name: dice.choice([1.5, 4.0])
            for name in self.layout.received_topics
            if dice.random() < 0.15 and not self.is_calm
        }
        return Settings(
            release_identifiers=tuple(topic for topic in self.topics if self.is_calm or dice.random() < 0.6),
            max_age_s=ages,
            service_timeout_s=dice.choice([1.0, 10.0]),
            action_timeout_s=dice.choice([None, None, 2.0]),
            cancel_timeout_s=dice.choice([0.0, 0.5, 1.0]),
            on_unknown=on_unknown,
            command_timeout_s=dice.choice([0.0, 0.5, 1.0]),
        )

    def _new(self, settings: Settings) -> Layer:  # type: ignore[override]
        executor = Layer(self.system, self, self, settings, self.clock, self)
        self.executor = executor
        self._note_command(layer_settings_words(self.layout, executor.settings))
        return executor

    # Both sides.

    def let_fail(self, *names: str) -> None:
        """Let these callbacks fail from now on, and no others."""
        self.failing = set(names)
        self._note_command(["x", sum(2 ** CALLBACKS.index(name) for name in names)])

    def number(self, message: Any) -> int:
        """Return the number of a message: its last one."""
        for place in reversed(range(len(self.messages))):
            if self.messages[place] is message:
                return place % TOKENS
        return self.asked  # Limits have made another of it.

    def publish(self, communication: str, message: Any) -> None:
        """Remember."""
        identifier = self.model.communication(communication).identifier
        self._send("publish", self.topics.index(identifier), self.number(message))

    def call(self, communication: str, request_id: int, message: Any) -> None:
        """Remember."""
        self._send("call", request_id, self.numbers[communication], self.number(message))
        self.calls[request_id] = communication

    def send_goal(self, communication: str, goal_id: int, message: Any) -> None:
        """Remember."""
        self._send("goal", goal_id, self.numbers[communication], self.number(message))
        self.goals[goal_id] = communication

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        """Remember."""
        self._send("cancel", self.numbers[communication], goal_id)

    def pass_on(self, identifier: str, message: Any) -> None:
        """Remember."""
        self._send("pass", list(self.layout.received_topics).index(identifier), self.number(message))

    def blocked(self, identifier: str, why: str) -> None:
        """Remember."""
        self._send("blocked", _hex(identifier), self.refusal)

    def answer(self, communication: str, call_id: Any, data: Any) -> None:
        """Remember."""
        self._send("answer", self.numbers[communication], call_id, self.number(data))

    def answer_default(self, communication: str, call_id: Any, why: str) -> None:
        """Remember."""
        self._send("no_answer", self.numbers[communication], call_id)

    def accept_goal(self, communication: str, goal_id: Any) -> None:
        """Remember."""
        self._send("accept", self.numbers[communication], goal_id)

    def reject_goal(self, communication: str, goal_id: Any, why: str) -> None:
        """Remember."""
        self._send("reject", self.numbers[communication], goal_id)

    def pass_feedback(self, communication: str, goal_id: Any, data: Any) -> None:
        """Remember."""
        self._send("feedback", self.numbers[communication], goal_id, self.number(data))

    def end_goal(self, communication: str, goal_id: Any, outcome: str, data: Any, why: str) -> None:
        """Remember."""
        number = -1 if data is None and outcome != "succeeded" else self.number(data)
        reason = ABORTS.index(why) if outcome == "aborted" else -1
        self._send("end", self.numbers[communication], goal_id, _ENDS.index(outcome), number, reason)

    def write(self, entry: dict[str, Any]) -> None:
        """Remember what happened."""
        if entry["kind"] == "limited":
            name = entry["event"].rpartition(".")[0]
            for word in entry["limited"]:
                path, _, value = word.partition(": ")
                place = list(self.layout.numbers).index((name, () if path == "value" else tuple(path.split("."))))
                self.lines.append(f"set {self.asked} {place} {float(value.split(' -> ')[1]):.17g}")
            self.lines.append(f"log limited {self.events[entry['event']]}")
        elif entry["kind"] == "blocked":
            self.refusal = refusals_of(self.layout).index(entry["why"])
            self.lines.append(f"log blocked {self.refusal}")
        else:
            super().write(entry)

    # Commands.

    def act(self) -> None:
        """One random command."""
        dice = self.dice
        self.clock.advance(dice.choice([0, 1, 1] if self.is_calm else [0, 0, 1, 1, 1, 2, 4, 9, 33]) * 0.125)
        now = microseconds(self.clock.now_s)
        kinds: list[tuple[float, Callable[[int], None]]] = [
            (4 if self.is_calm else 0.6, self._start),
            (3, self._watch),
            (0 if self.is_calm else 0.15, self._stop),
            (0 if self.is_calm else 0.6, self._restart),
            (0 if self.is_calm else 0.3, self._fail),
        ]
        if self.layout.received_topics:
            kinds.append((5, self._receive))
        if self.layout.requests:
            kinds.append((10, self._ask))
        share = 1.0 if self._open() else 0.1
        if self.layout.of_kind(CommunicationKind.SERVICE):
            kinds.append((0.7 * share, self._call_failed))
        if self.layout.of_kind(CommunicationKind.ACTION):
            kinds += [(5 * share, self._goal), (4 * share, self._cancel)]
        if events_back(self.layout):
            kinds.append((4 * share, self._back_random))
        dice.choices([kind for _, kind in kinds], [weight for weight, _ in kinds])[0](now)

    def _start(self, now: int) -> None:
        self.executor.start()
        self._note_command(["s", now])

    def _watch(self, now: int) -> None:
        self.dice.choice([self.executor.watch, self.executor.tick])()
        self._note_command(["w", now])

    def _stop(self, now: int) -> None:
        is_fault = self.dice.random() < 0.5
        self.executor.stop("test", is_fault)
        self._note_command(["S", now, int(is_fault)])

    def _restart(self, now: int) -> None:
        self.executor.restart()
        self._note_command(["R", now])

    def _fail(self, now: int) -> None:
        dice = self.dice
        self.let_fail(*[name for name in CALLBACKS if dice.random() < 0.15] if dice.random() < 0.4 else [])

    def _call_failed(self, now: int) -> None:
        number = self._some(self.calls)
        self.executor.on_call_failed(number, "test")
        self._note_command(["f", now, number])

    def remember(self, message: Any) -> int:
        """The number of a new message."""
        self.messages.append(message)
        return (len(self.messages) - 1) % TOKENS

    def _receive(self, now: int) -> None:
        identifier = self.dice.choice(list(self.layout.received_topics))
        types = batch_types(self.layout, identifier)
        datum, words = self._shared(types, lambda datum: datum)
        place = list(self.layout.received_topics).index(identifier)
        number = self.remember(datum)
        try:
            self.executor.receive(identifier, datum)
        except MissingData:
            self._let_time_pass(now)
            return
        self._note_command(["m", now, place, number, *words])

    def _shared(self, types: list[Type], change: Callable[[Any], Any]) -> tuple[Any, list[object]]:
        """A datum of one of some types, changed, and how it is handed over as all of them."""
        words: list[object] = []
        if not types:
            return None, words
        chosen = self.dice.randrange(len(types))
        datum = change(self._datum(types[chosen], is_complete=True))
        for number, type_ in enumerate(types):
            shared: Any = datum if number == chosen else None
            if number != chosen and isinstance(type_, DoubleType) and type(datum) is int:
                shared = float(datum)
            words += data_words(self.layout, type_, shared, is_root=True)
        return datum, words

    def _ask(self, now: int) -> None:
        item = self.dice.choice(self.layout.requests)
        if item.kind is CommunicationKind.INCOMING_MESSAGE:
            self.send(item.identifier, now)
            return
        self.last_caller += 1
        self.callers.append(self.last_caller)
        types = looked_at(self.layout, item.name)
        message, data = self._shared(types, self._sendable)
        if not types:
            message = self._whole({"x": self.dice.choice([0, 1.5])})
        name = ("call_" if item.kind is CommunicationKind.SERVICE else "goal_") + item.name
        words = [self.last_caller, *self._sent(item.name, message), *data]
        ask = self.executor.on_call if item.kind is CommunicationKind.SERVICE else self.executor.on_goal
        ask(item.name, self.last_caller, message)
        self._note_command(["q", now, self._place(name), *words])

    def send(self, identifier: str, now: int) -> None:
        """The caller sends a random message."""
        messages = self.layout.of_kind(CommunicationKind.INCOMING_MESSAGE)
        name = next(item.name for item in messages if item.identifier == identifier)
        types = looked_at(self.layout, name)
        datum, words = self._shared(types, self._sendable)
        if not types and self.dice.random() < 0.8:
            datum = self._whole({"x": self.dice.choice([0, 1.5])})
        sent = self._sent(name, datum)
        self.executor.on_request(identifier, datum)
        self._note_command(["q", now, self.topics.index(identifier), *sent, *words])

    def _sendable(self, datum: Any) -> Any:
        tame = self._tame(datum)
        return self._whole(tame) if isinstance(tame, dict) else tame

    def _tame(self, datum: Any, is_element: bool = False) -> Any:
        """The same with less that is not finite, and some numbers that are missing.

        No element of an array is missing: C has NaN for one, which `min` and `max` do not heed.
        """
        if isinstance(datum, dict):
            return {name: self._tame(part) for name, part in datum.items()}
        if isinstance(datum, list):
            return [self._tame(part, is_element=True) for part in datum]
        if isinstance(datum, float) and not math.isfinite(datum) and self.dice.random() < 0.95:
            return self.dice.choice([0.5, 0.0, 0.5 if is_element else None])
        return datum

    def _whole(self, message: dict[str, Any]) -> dict[str, Any]:
        """The message with a part that the model does not know, now and then a bad one."""
        dice = self.dice
        if dice.random() < 0.2:
            message = {name: 0 if isinstance(part, float) else part for name, part in message.items()}
        return {**message, "other": [math.nan if dice.random() < 0.07 else 0.0]} if dice.random() < 0.8 else message

    def is_default(self, communication: str, message: Any) -> bool:
        """Return True if everything is zero or empty."""
        if isinstance(message, list):
            return all(self.is_default(communication, part) for part in message)
        return super().is_default(communication, message)

    def _sent(self, name: str, message: Any) -> list[object]:
        self.asked = len(self.messages) % TOKENS
        flags = [int(is_finite(message)), int(self.is_default(name, message))]
        return [self.remember(message), *flags]

    def _place(self, name: str) -> int:
        """Number of the function for a call, a goal or a cancel."""
        return caller_place(self.layout, name)

    def _cancel(self, now: int) -> None:
        action = self.dice.choice(self.layout.of_kind(CommunicationKind.ACTION)).name
        recent = [*self.callers[-3:], 700]
        caller = self.dice.choice(recent)
        own = self.executor._callers._waiting_goals.values()
        if self.dice.random() < 0.8:
            caller = next((goal.goal_id for goal in own if goal.action == action), caller)
        self.executor.on_cancel(action, caller)
        self._note_command(["q", now, self._place(f"cancel_{action}"), caller])

    def _open(self) -> list[str]:
        """Calls and goals that something may come back to."""
        calls = [call.service for call in self.executor._calls._calls.values()]
        return calls + [goal.action for goal in self.executor._goals.open_goals()]

    def _back_random(self, now: int) -> None:
        events = events_back(self.layout)
        fitting = [event for event in events if event.rpartition(".")[0] in self._open()]
        self._back(now, self.dice.choice(fitting if self.dice.random() < 0.9 and fitting else events))

    def _waiting(self, ids: dict[int, str], name: str) -> int:
        # C has a function for each of them: it cannot take what another one waits for.
        return self._some({number: item for number, item in ids.items() if item == name})

    def _token_words(self, datum: Any) -> list[object]:
        return [self.remember(datum)]

    def _goal(self, now: int) -> None:
        open_ = [goal.number for goal in self.executor._goals.open_goals()]
        number = self.dice.choice(open_) if open_ and self.dice.random() < 0.8 else self._some(self.goals)
        match self.dice.randrange(5):
            case 0 | 1:
                self.executor.on_goal_accepted(number)
                self._note_command(["a", now, number])
            case 2 | 3:
                own = self.executor._goals.find(number)
                is_cancelled = own is not None and own.is_cancelling and self.dice.random() < 0.6
                self.end(number, "cancelled" if is_cancelled else self.dice.choice(OUTCOMES))
            case _:
                ended = self.dice.random() < 0.7
                self.executor.on_cancel_refused(number, ended)
                self._note_command(["c", now, number, int(ended)])

    def end(self, number: int, outcome: str) -> None:
        """A goal's server ends it, without success."""
        data = {"code": 1} if self.dice.random() < 0.5 else None
        token = -1 if data is None else self.remember(data)
        self.executor.on_goal_ended(number, outcome, data)
        self._note_command(["e", microseconds(self.clock.now_s), number, OUTCOMES.index(outcome), token])


compare_layer = partial(compare, reference_of=LayerReference)
"""Let both execute random commands, as `compare`."""
