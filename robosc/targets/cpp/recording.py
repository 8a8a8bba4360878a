"""A run of the reference executor, recorded when a C++ package is generated, as the steps of the package's test.

The test repeats the run on the generated supervisor in C99. It has its own structures in place of messages, so it needs
no middleware.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from random import Random
from typing import Any

from robosc.automata.executable import ExecutableSystem
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.event_log import MemoryLog
from robosc.execution.runtime.executor import Executor
from robosc.execution.runtime.settings import Settings
from robosc.expressions import (
    ArrayType,
    BooleanType,
    Constant,
    DoubleType,
    IntegerType,
    NoneType,
    ObjectType,
    StringType,
    Type,
    leaves,
)
from robosc.model.structure import CommunicationKind, Deployment, EventKind, Model
from robosc.supervisor import Supervisor
from robosc.targets.code.c.header import batch
from robosc.targets.code.c.layout import Layout, event_data
from robosc.targets.code.c.text import string_literal
from robosc.targets.cpp.model import received_topics, take_name
from robosc.targets.text import indent

STEPS = 40
PERIOD_S = 0.125
"""A fraction that floats and microseconds hold exactly."""

_SEED = 1
_SCAN = 360
_DOUBLES = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 3.0, -0.25, -2.0)
_INTEGERS = (0, 1, 2, 3, 5, 100, -1)
_TEXTS = ("", "a")
_FIELDS = {BooleanType: "bool", IntegerType: "std::int64_t", DoubleType: "double", StringType: "std::string"}
_OUTCOMES = ("succeeded", "aborted", "cancelled")

_Shape = Type | dict[str, Any] | list[Any]
"""Type of data as one structure: a basic type, the shapes of an object's fields by name, or a list of one shape."""


@dataclass(frozen=True)
class Recording:
    """A run as parts of a C++ source.

    Attributes:
        structures: Lines that define the structures in place of messages.
        steps: For each step the statements that let something happen, then the events that follow and the controllable
            events that are allowed after them, as C++ strings.
    """

    structures: tuple[str, ...]
    steps: tuple[tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]], ...]


def record(supervisor: Supervisor, layout: Layout) -> Recording:
    """Return the run of a supervisor with chance data, the same for the same model."""
    return _Recorder(supervisor, layout).run()


class _World:
    """A middleware that takes everything, and remembers calls and goals under way by their communication."""

    def __init__(self) -> None:
        self.open: dict[str, list[int]] = {}

    def prepare(self, communication: str, data: Any) -> Any:
        return data

    def is_default(self, communication: str, message: Any) -> bool:
        return False

    def publish(self, communication: str, message: Any) -> None:
        """Do nothing: the events are recorded."""

    def publish_default(self, identifier: str) -> None:
        """Do nothing."""

    def call(self, communication: str, request_id: int, message: Any) -> None:
        self.open.setdefault(communication, []).append(request_id)

    def send_goal(self, communication: str, goal_id: int, message: Any) -> None:
        self.open.setdefault(communication, []).append(goal_id)

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        """The goal may end at any time."""


@dataclass
class _Structures:
    """Definitions of structures in C++, each after those that it uses."""

    lines: list[str] = field(default_factory=list)
    _names: dict[str, str] = field(default_factory=dict)

    def define(self, shape: _Shape) -> str:
        """Return the C++ type of a shape, and define it if it needs a definition."""
        if isinstance(shape, list):
            return f"std::vector<{self.define(shape[0])}>"
        if not isinstance(shape, dict):
            return _FIELDS[type(shape)]
        members = [f"{self.define(part)} {name}{{}};" for name, part in shape.items()]
        key = " ".join(members)
        if key in self._names:
            return self._names[key]
        name = self._names[key] = f"Data{len(self._names)}"
        self.lines += [f"struct {name}", "{", *indent(members), "};", ""]
        return name


class _Recorder:
    def __init__(self, supervisor: Supervisor, layout: Layout) -> None:
        self._model: Model = supervisor.model
        self._layout = layout
        self._dice = Random(_SEED)  # noqa: S311  # It draws the data of a test.
        self._structures = _Structures()
        self._system = InterpretedSystem(supervisor)
        self._issued = ExecutableSystem(supervisor.model, Deployment.CONTROLLER).issued
        self._log = MemoryLog()
        self._clock = ManualClock()
        self._world = _World()
        settings = Settings(period_s=PERIOD_S, every="event")
        self._executor: Any = Executor(self._system, self._world, settings, self._clock, self._log)
        self._texts = (*_TEXTS, *texts_of(self._model))
        self._topics = dict(self._topic_shapes())

    def run(self) -> Recording:
        self._executor.start()
        begun = self._seen()
        steps = []
        for _ in range(STEPS):
            statements = self._next()
            steps.append((tuple(statements), *self._seen()))
        first = (("run.start();",), *begun)
        return Recording(tuple(self._structures.lines), (first, *steps))

    def _seen(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        happened = [entry["event"] for entry in self._log.entries if entry["kind"] == "event"]
        self._log.entries.clear()
        allowed = sorted(event for event in self._issued if self._system.enabled(event))
        return tuple(map(string_literal, happened)), tuple(map(string_literal, allowed))

    # Events.

    def _next(self) -> list[str]:
        chance = self._dice.random()
        answers = list(self._answers())
        if answers and chance < 0.4:
            return self._answer(*self._dice.choice(answers))
        if self._topics and chance < 0.8:
            return self._message()
        self._clock.advance(PERIOD_S)
        self._executor.tick()
        return ["run.tick();"]

    def _message(self) -> list[str]:
        identifier = self._dice.choice(sorted(self._topics))
        shape, is_basic, type_name = self._topics[identifier]
        data = self._data(shape)
        self._executor.receive(identifier, data["data"] if is_basic else data)
        number = received_topics(self._layout).index(identifier)
        call = f"model::receive_{number}(run.robot(), run.now(), message, run.notes());"
        return [f"{type_name} message;", *_assigned("message", shape, data), call]

    def _answers(self) -> Iterator[tuple[str, str]]:
        """Answers that a server may give now: the service or action, and a word for each."""
        for item in self._model.communications:
            if self._world.open.get(item.name):
                words = ("reply", "fail") if item.kind is CommunicationKind.SERVICE else ("accept", "feedback", "end")
                yield from ((item.name, word) for word in words)

    def _answer(self, name: str, word: str) -> list[str]:
        number, prefix = self._layout.communications[name], self._layout.prefix
        last = f"run.last({number})"
        if word == "fail":
            self._executor.on_call_failed(self._world.open[name].pop(), "lost")
            return [f"{prefix}_call_failed(run.robot(), run.now(), run.end({number}));"]
        if word == "accept":
            self._executor.on_goal_accepted(self._world.open[name][-1])
            return [f"{prefix}_goal_accepted(run.robot(), run.now(), {last});"]
        if word == "feedback":
            event = self._event(name, EventKind.FEEDBACK)
            lines, data = self._answered(event, last)
            self._executor.on_feedback(self._world.open[name][-1], data)
            return lines
        event = self._event(name, EventKind.RESPONSE)
        ended = f"run.end({number})"
        if word == "reply":
            lines, data = self._answered(event, ended)
            self._executor.on_reply(self._world.open[name].pop(), data)
            return lines
        how = self._dice.choice(_OUTCOMES)
        if how != "succeeded":
            self._executor.on_goal_ended(self._world.open[name].pop(), how, None)
            outcome = f"{self._layout.upper}_OUTCOME_{how.upper()}"
            return [f"{prefix}_goal_ended(run.robot(), run.now(), {ended}, {outcome});"]
        lines, data = self._answered(event, ended)
        self._executor.on_goal_ended(self._world.open[name].pop(), how, data)
        return lines

    def _event(self, name: str, kind: EventKind) -> str:
        return self._model.communication(name).event(kind)

    def _answered(self, event: str, number: str) -> tuple[list[str], Any]:
        type_ = event_data(self._model, event)
        shape, is_basic = self._shape([type_] if type_ is not None else [])
        data = self._data(shape)
        lines = [f"{self._structures.define(shape)} message;", *_assigned("message", shape, data)]
        call = f"model::{take_name(self._layout, event)}(run.robot(), run.now(), {number}, message, run.notes());"
        return [*lines, call], data["data"] if is_basic else data

    # Data.

    def _topic_shapes(self) -> Iterator[tuple[str, tuple[dict[str, Any], bool, str]]]:
        for identifier in received_topics(self._layout):
            events = (item.event(EventKind.RESPONSE) for item in batch(self._layout, identifier))
            types = [event_data(self._model, event) for event in events]
            try:
                shape, is_basic = self._shape([type_ for type_ in types if type_ is not None])
            except _MixedError:
                continue
            yield identifier, (shape, is_basic, self._structures.define(shape))

    def _shape(self, types: list[Type]) -> tuple[dict[str, Any], bool]:
        """Return the fields of a message that is read as all these types, and True if its datum is that of a field."""
        sources = [source for type_ in types if not isinstance(source := self._layout.source(type_), NoneType)]
        if not sources:
            return {}, False
        if all(isinstance(source, ObjectType) for source in sources):
            return self._merged(sources), False
        return {"data": self._merged(sources)}, True

    def _merged(self, sources: Sequence[Type]) -> Any:
        first = sources[0]
        if any(type(source) is not type(first) for source in sources):
            raise _MixedError
        if isinstance(first, ObjectType):
            found: dict[str, list[Type]] = {}
            for name in (source.name for source in sources if isinstance(source, ObjectType)):
                for part in self._model.object(name).properties:
                    if not isinstance(part.type, NoneType):
                        found.setdefault(part.name, []).append(self._layout.source(part.type))
            return {name: self._merged(parts) for name, parts in found.items()}
        if isinstance(first, ArrayType):
            elements = [self._layout.source(item.element) for item in sources if isinstance(item, ArrayType)]
            return [self._merged(elements)]
        return first

    def _data(self, shape: Any) -> Any:
        dice = self._dice
        if isinstance(shape, dict):
            return {name: self._data(part) for name, part in shape.items()}
        if isinstance(shape, list):
            items = [self._data(shape[0])] * dice.choice((0, 1, 4, _SCAN, _SCAN, _SCAN))
            for _ in range(dice.choice((0, 1, 2))):
                begin = dice.choice((0, 15, 225, 270, 345))
                items[begin : begin + 10] = [self._data(shape[0])] * len(items[begin : begin + 10])
            return items
        match shape:
            case BooleanType():
                return dice.choice((True, False))
            case IntegerType():
                return dice.choice(_INTEGERS)
            case DoubleType():
                return dice.choice(_DOUBLES)
            case _:
                return dice.choice(self._texts)


class _MixedError(Exception):
    """A topic whose messages are read in ways that no structure of the test has."""


def texts_of(model: Model) -> list[str]:
    """The texts that rules of enums ask for."""
    rules = [rule.condition for enum in model.enums for rule in enum.rules]
    return [
        leaf.value
        for rule in rules
        for leaf in leaves(rule)
        if isinstance(leaf, Constant) and isinstance(leaf.value, str)
    ]


def _assigned(place: str, shape: Any, data: Any) -> list[str]:
    """Statements that give a place the data."""
    if isinstance(shape, dict):
        return [line for name, part in shape.items() for line in _assigned(f"{place}.{name}", part, data[name])]
    if not isinstance(shape, list):
        return [f"{place} = {_literal(data)};"]
    if not data:
        return []
    lines = [f"{place}.resize({len(data)});"]
    begin = 0
    for value, same in groupby(data):
        length = len(list(same))
        if isinstance(shape[0], dict | list):
            for k in range(begin, begin + length):
                lines += _assigned(f"{place}[{k}]", shape[0], value)
        else:
            lines.append(f"std::fill_n({place}.begin() + {begin}, {length}, {_literal(value)});")
        begin += length
    return lines


def _literal(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return f"INT64_C({value})"
    if isinstance(value, float):
        return repr(value)
    return string_literal(value)


__all__ = ["PERIOD_S", "Recording", "record"]
