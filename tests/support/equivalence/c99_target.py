"""Generated C99, compiled with sanitizers, as a process that reads what happens."""

import subprocess
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

from robosc.automata.executable import CALLED_KINDS
from robosc.automata.plants import PLANT_LOCATIONS, communication_plant_name
from robosc.execution.interpreter import describe
from robosc.execution.runtime.middleware_messages import is_finite
from robosc.execution.runtime.runner import Status
from robosc.execution.runtime.settings import Settings, settings_for
from robosc.expressions import BooleanType, DoubleType, EnumType, StringType, Type
from robosc.model.structure import CommunicationKind, Deployment
from robosc.supervisor import Supervisor
from robosc.targets.code.c.layout import event_data, make_layout
from support.c99 import OUTCOMES, SANITIZERS, compiled, data_words, microseconds, settings_words
from support.c99_layer import caller_place, compiled_layer, layer_settings_words, looked_at, refusals_of
from support.c99_layer_main import TOKENS
from support.c99_main import batch_types, events_back
from support.equivalence.observation import Entry, Issued, Observation, Sight
from support.equivalence.portable import Callers, Ids, flat
from support.equivalence.scenario import PERIOD_S, Action, Scenario

_ENDS = ("succeeded", "aborted", "cancelled")
_STATUSES = (Status.NEW, Status.WAITING, Status.RUNNING, Status.STOPPING, Status.STOPPED)


class C99Target:
    """A compiled test program around generated C.

    Args:
        supervisor: Supervisor from which the C is generated.
        folder: Folder in which to compile, unless the same was compiled there before.
        options: Options for the compiler.
    """

    name = "c99"
    # Its callback for a log gives kind and event, or the topic of a release.
    sight = Sight(log_keys=frozenset({"kind", "event", "identifier", "action", "why", "aim", "assumption"}))
    _commands: Mapping[str, str] = {"tick": "t", "wait": "w", "restart": "R"}

    def __init__(self, supervisor: Supervisor, folder: Path, *options: str) -> None:
        self._supervisor = supervisor
        self._layout = make_layout(supervisor)
        self._events = tuple(self._layout.events)
        self._communications = tuple(self._layout.communications)
        self._topics = tuple(self._layout.topics)
        self._ids = Ids()
        self._now_s = 0.0
        program = self._compiled(folder, *(options or SANITIZERS))
        self._errors = (folder / "errors").open("w+", encoding="utf-8")
        self._process = subprocess.Popen(
            [program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors, text=True
        )

    def _compiled(self, folder: Path, *options: str) -> Path:
        return compiled(self._supervisor, folder, *options)

    def start(self, scenario: Scenario, awaited: Observation | None = None) -> Observation:
        """Begin."""
        settings = settings_for(scenario.all_settings(), describe(self._supervisor))
        self._order(self._settings(settings))
        return self._order(["s", microseconds(self._now_s)])

    def _settings(self, settings: Settings) -> list[object]:
        return settings_words(self._layout, settings)

    def do(self, action: Action, awaited: Observation | None = None) -> Observation:
        """Let one thing happen."""
        self._now_s += PERIOD_S if action.do == "tick" else action.seconds
        now, name, ids = microseconds(self._now_s), action.subject, self._ids
        match action.do:
            case "tick" | "wait" | "restart":
                return self._order([self._commands[action.do], now])
            case "stop":
                return self._order(["S", now, 0])
            case "message":
                place = list(self._layout.received_topics).index(name)
                words: list[object] = ["m", now, place, *self._handed(action.data)]
                for type_ in batch_types(self._layout, name):
                    words += data_words(self._layout, type_, action.data, is_root=True)
                return self._order(words)
            case "reply":
                return self._back(f"{name}.response", ids.end(name), action.data)
            case "feedback":
                return self._back(f"{name}.feedback", ids.last(name), action.data)
            case "fail":
                return self._order(["f", now, ids.end(name)])
            case "accept":
                return self._order(["a", now, ids.last(name)])
            case "refuse":
                return self._order(["c", now, ids.last(name), int(action.how == "ended")])
            case "end" if action.how == "succeeded":
                return self._back(f"{name}.response", ids.end(name), action.data)
            case "end":
                return self._order(["e", now, ids.end(name), OUTCOMES.index(action.how), *self._ended()])
        raise ValueError(action.do)

    def _back(self, event: str, number: int, data: Any) -> Observation:
        place = events_back(self._layout).index(event)
        words: list[object] = ["b", microseconds(self._now_s), place, number, *self._handed(data)]
        type_ = event_data(self._layout.model, event)
        return self._order(words + ([] if type_ is None else data_words(self._layout, type_, data, is_root=True)))

    def _handed(self, data: Any) -> list[object]:
        """Return the words that hand the program the message itself, which a controller does not need."""
        return []

    def _ended(self) -> list[object]:
        """Return the words for the result of a goal without success, which a controller does not need."""
        return []

    def _order(self, words: list[object]) -> Observation:
        _pipe(self._process.stdin).write(" ".join(map(str, words)) + "\n")
        _pipe(self._process.stdin).flush()
        issued: list[Issued] = []
        log: list[Entry] = []
        for line in _pipe(self._process.stdout):
            kind, *rest = line.split()
            if kind == "state":
                return self._observation(rest, issued, log)
            if kind == "log":
                log.append(self._entry(*rest))
            else:
                issued += self._issued(kind, rest)
        self._process.wait()
        self._errors.seek(0)
        raise AssertionError(f"c99: the program ended: {self._errors.read()[-3000:]}")

    def _entry(self, kind: str, number: str = "-1", *more: str) -> Entry:
        if kind == "release":
            return {"kind": kind, "identifier": self._topics[int(number)]}
        description = self._layout.description
        if kind in ("reached", "approach"):
            return {"kind": kind, "aim": None if int(number) < 0 else description.aims[int(number)].name}
        if kind in ("owed", "met"):
            return {"kind": kind, "assumption": description.assumptions[int(number)].name}
        if kind in ("cancelling", "cancel_overdue"):
            named = {"kind": kind, "action": self._communications[int(number)]}
            return {**named, "why": _why(*more)} if more else named
        if int(number) < 0:
            return {"kind": kind}
        return {"kind": kind, "event": self._events[int(number)]}

    def _issued(self, kind: str, words: list[str]) -> list[Issued]:
        if kind == "default":
            return [(kind, self._topics[int(words[0])], {})]
        number = words.pop(0) if kind != "publish" else ""
        name = self._communications[int(words.pop(0))]
        if kind in ("call", "goal"):
            self._ids.add(name, int(number))
        return [(kind, name, {path: _given(text) for path, _, text in (word.partition("=") for word in words)})]

    def _observation(self, words: list[str], issued: list[Issued], log: list[Entry]) -> Observation:
        left = iter(words)
        state: dict[str, Any] = {}
        for component, behaviour in self._layout.executable.behaviours:
            place = behaviour.states[int(next(left))].name
            variables = {item.name: _value(item.type, next(left)) for item in behaviour.variables}
            state[component] = {"state": place, "variables": variables}
        plants = {
            communication_plant_name(item): PLANT_LOCATIONS[item.kind][int(next(left))]
            for item in self._layout.model.communications
            if item.kind in CALLED_KINDS
        }
        locations = {
            item.name: plants[communication_plant_name(item)]
            for item in self._layout.model.communications
            if item.kind in CALLED_KINDS
        }
        assert next(left) == "enabled"
        flags = next(left) if self._layout.executable.issued else ""
        actions = [item.name for item in self._layout.of_kind(CommunicationKind.ACTION)]
        cancelled = {name: int(next(left)) for name in actions}
        progress = None
        if self._layout.supervisor.strategy is not None:
            assert next(left) == "progress"
            progress = self._progress([int(next(left)) for _ in range(self._progress_length)])
        named = dict(zip(left, left, strict=False))
        return Observation(
            issued=tuple(issued),
            log=tuple(log),
            state=state,
            enabled=frozenset(
                event for event, flag in zip(self._layout.executable.issued, flags, strict=True) if flag == "1"
            ),
            locations=locations,
            status=(_STATUSES[int(named["status"])].value, named["fault"] == "1"),
            cancelling=(
                tuple(name for name in actions if cancelled[name] >= 1),
                tuple(name for name in actions if cancelled[name] == 2),
            ),
            progress=progress,
        )

    @property
    def _progress_length(self) -> int:
        description = self._layout.description
        missions = sum(3 + len(mission.detours) for mission in description.missions)
        return 2 + 5 * (len(description.aims) + len(description.assumptions)) + missions

    def _progress(self, numbers: list[int]) -> dict[str, Any]:
        """Return the progress of the strategy as the executor in Python tells it."""
        description = self._layout.description
        approached, chosen, *rest = numbers
        end = 5 * (len(description.aims) + len(description.assumptions))
        rest, left = rest[:end], iter(rest[end:])
        missions = [
            (mission.name, next(left), next(left) == 1, next(left), tuple(next(left) for _ in mission.detours))
            for mission in description.missions
        ]
        items = [
            (item.name, item.words, is_met == 1, count, unmet_us / 1e6 if is_unmet else None, item.mission)
            for item, is_met, is_unmet, _, count, unmet_us in zip(
                (*description.aims, *description.assumptions), *(rest[place::5] for place in range(5)), strict=True
            )
        ]
        assert not any(rest[2 : 5 * len(description.aims) : 5])
        owed = rest[5 * len(description.aims) :]
        overdue = [item.name for item, late in zip(description.assumptions, owed[2::5], strict=True) if late]
        return {
            "aims": items[: len(description.aims)],
            "assumptions": items[len(description.aims) :],
            "missions": missions,
            "overdue": overdue,
            "approached": None if approached < 0 else description.aims[approached].name,
            "chosen": None if chosen < 0 else self._communications[chosen],
        }

    def close(self) -> Observation:
        """End the program: a sanitizer may still complain."""
        _pipe(self._process.stdin).close()
        left = _pipe(self._process.stdout).read()
        self._process.wait()
        self._errors.seek(0)
        complaint = self._errors.read()
        self._errors.close()
        _pipe(self._process.stdout).close()
        assert not complaint and not left, complaint or left
        return Observation()


class C99Layer(C99Target):
    """A compiled test program around a generated C layer, which knows each message by the number that it came with."""

    name = "c99 layer"
    _commands: Mapping[str, str] = {"tick": "w", "wait": "w", "restart": "R"}  # It decides nothing.

    def __init__(self, supervisor: Supervisor, folder: Path, *options: str) -> None:
        super().__init__(supervisor, folder, *options)
        topics = {
            item.name: item.identifier
            for item in supervisor.model.communications
            if item.kind is CommunicationKind.INCOMING_MESSAGE
        }
        # It publishes on a topic, whichever of the messages there it recognized.
        self.sight = replace(
            self.sight, log_keys=frozenset({"kind", "event", "action", "why"}), topics=topics, is_exact=True
        )
        self._callers = Callers()
        self._messages: list[Any] = []
        self._moved: dict[int, dict[str, float]] = {}

    def _compiled(self, folder: Path, *options: str) -> Path:
        return compiled_layer(self._supervisor, folder, *options)

    def _settings(self, settings: Settings) -> list[object]:
        return layer_settings_words(self._layout, settings)

    def do(self, action: Action, awaited: Observation | None = None) -> Observation:
        """Let one thing happen."""
        name = action.subject
        kind = action.do.removeprefix("ask_")
        if action.do == "ask":
            incoming = self._layout.of_kind(CommunicationKind.INCOMING_MESSAGE)
            types = looked_at(self._layout, next(item.name for item in incoming if item.identifier == name))
            data = [word for type_ in types for word in data_words(self._layout, type_, action.data, is_root=True)]
            return self._ask(action, self._topics.index(name), self._sent(action.data) + data)
        if kind in ("call", "goal"):
            place = caller_place(self._layout, f"{kind}_{name}")
            types = looked_at(self._layout, name)
            data = [word for type_ in types for word in data_words(self._layout, type_, action.data, is_root=True)]
            return self._ask(action, place, [self._callers.next(name), *self._sent(action.data), *data])
        if kind == "cancel":
            return self._ask(action, caller_place(self._layout, f"cancel_{name}"), [self._callers.last(name)])
        return super().do(action, awaited)

    def _ask(self, action: Action, place: int, words: list[object]) -> Observation:
        return self._order(["q", microseconds(self._now_s), place, *words])

    def _sent(self, data: Any) -> list[object]:
        return [*self._handed(data), int(is_finite(data)), int(not any(flat(data).values()))]

    def _handed(self, data: Any) -> list[object]:
        self._messages.append(data)
        return [(len(self._messages) - 1) % TOKENS]

    def _ended(self) -> list[object]:
        return [-1]

    def _entry(self, kind: str, number: str = "-1", *more: str) -> Entry:
        if kind == "blocked":
            return {"kind": kind, "why": refusals_of(self._layout)[int(number)]}
        return super()._entry(kind, number, *more)

    def _issued(self, kind: str, words: list[str]) -> list[Issued]:
        if kind == "blocked":
            return [(kind, _text(words[0]), {})]
        if kind == "set":
            token, place = int(words[0]), int(words[1])
            _, path = list(self._layout.numbers)[place]
            self._moved.setdefault(token, {})[".".join(path)] = float(words[2])
            return []
        numbers = [int(word) for word in words]
        match kind:
            case "default" | "publish":
                # The topic's name stands for the message's: `Sight.topics`.
                return [(kind, self._topics[numbers[0]], self._data(*numbers[1:]))]
            case "pass":
                return [(kind, list(self._layout.received_topics)[numbers[0]], self._data(numbers[1]))]
            case "call" | "goal":
                self._ids.add(self._communications[numbers[1]], numbers[0])
                return [(kind, self._communications[numbers[1]], self._data(numbers[2]))]
            case "cancel":
                return [(kind, self._communications[numbers[0]], {})]
        name, caller = self._communications[numbers[0]], {"caller": numbers[1]}
        match kind:
            case "answer" | "feedback":
                return [(kind, name, {**caller, **self._data(numbers[2])})]
            case "end":
                return [("ended", name, {**caller, "how": _ENDS[numbers[2]], **self._data(numbers[3])})]
        return [(kind.replace("_", " "), name, caller)]

    def _data(self, number: int = -1) -> dict[str, Any]:
        return {} if number < 0 else {**flat(self._messages[number]), **self._moved.get(number, {})}


def c99_target(supervisor: Supervisor, folder: Path) -> C99Target:
    """The target `c99` of a controller or a layer."""
    kind = C99Layer if supervisor.deployment is Deployment.LAYER else C99Target
    return kind(supervisor, folder)


def _pipe(pipe: IO[str] | None) -> IO[str]:
    assert pipe is not None
    return pipe


def _given(text: str) -> Any:
    return _text(text) if text.startswith("x") else float(text)


def _text(word: str) -> str:
    return bytes.fromhex(word[1:]).decode("utf-8", "surrogatepass")


def _value(type_: Type, word: str) -> Any:
    match type_:
        case BooleanType():
            return word == "1"
        case DoubleType():
            return float(word)
        case StringType():
            return _text(word)
        case EnumType(values=values):
            return values[int(word)]
        case _:
            return int(word)


def _why(reason: str, *numbers: str) -> str:
    """Return why a goal is to be cancelled, as the log of the executor in Python tells it."""
    if reason != "requirement":
        return {"caller": "the caller"}.get(reason, reason)
    one = f"requirement {numbers[0]} no longer holds"
    return one if len(numbers) == 1 else f"requirements {', '.join(numbers)} no longer hold"
