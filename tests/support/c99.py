"""Compares generated C with the reference executor: the same commands to both, everything that happens line by line."""

import math
import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from random import Random
from typing import Any

from robosc.automata.executable import CALLED_KINDS
from robosc.automata.plants import PLANT_LOCATIONS, communication_plant_name
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.decision import RandomPolicy
from robosc.execution.runtime.executor import Executor
from robosc.execution.runtime.protocol import DataDoesNotFit, MissingData
from robosc.execution.runtime.runner import Status
from robosc.execution.runtime.settings import POLICIES, Settings
from robosc.expressions import (
    ArrayType,
    BooleanType,
    DoubleType,
    EnumType,
    IntegerType,
    NoneType,
    ObjectType,
    StringType,
    Type,
)
from robosc.model.structure import CommunicationKind, ObjectValue
from robosc.supervisor import Supervisor
from robosc.targets import generate
from robosc.targets.code.c.layout import Layout, event_data, make_layout
from support.c99_main import batch_types, events_back, test_program

GCC = shutil.which("gcc")
WARNINGS = "-std=c99 -Wall -Wextra -Wpedantic -Werror -Wconversion".split()
SANITIZERS = "-g -fsanitize=address,undefined -fno-sanitize-recover=all".split()
_STATUSES = (Status.NEW, Status.WAITING, Status.RUNNING, Status.STOPPING, Status.STOPPED)
_FAILURES = {"publish": 1, "default": 2, "call": 4, "goal": 8, "cancel": 16, "fits": 32}
OUTCOMES = ("rejected", "aborted", "cancelled", "lost")
"""Outcomes of a goal that did not succeed, in the order of generated C."""
_MASK = 2**64 - 1


def compiled(supervisor: Supervisor, folder: Path, *options: str) -> Path:
    """The test program of a supervisor; the one that is there, if the same was compiled into the folder before."""
    return built(supervisor, test_program(supervisor), folder, *options)


def built(supervisor: Supervisor, program: str, folder: Path, *options: str) -> Path:
    """Build a program around generated C.

    Args:
        supervisor: Supervisor from which the C is generated.
        program: The text of the file with `main`.
        folder: Folder in which to compile.
        options: Options for the compiler.
    """
    unit = [*WARNINGS, "-ffp-contract=off", *options, "-c", f"{make_layout(supervisor).prefix}.c", "-o", "unit.o"]
    whole = ["-std=c99", *options, "test.c", "unit.o", "-lm", "-o", "test"]
    texts = {**generate(supervisor, "c99"), "test.c": program, "options.txt": " ".join(options)}
    if (folder / "test").exists() and all((folder / path).read_text("utf-8") == text for path, text in texts.items()):
        return folder / "test"
    folder.mkdir(parents=True, exist_ok=True)
    for path, text in texts.items():
        (folder / path).write_text(text, encoding="utf-8")
    for command in (unit, whole):
        done = subprocess.run([GCC or "gcc", *command], cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr[:4000]
    return folder / "test"


class Splitmix(RandomPolicy):
    """The policy `random` of generated C."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._state = seed & _MASK

    def choose(self, among: Sequence[int] | None = None) -> int | None:
        """One of the candidates."""
        candidates = self.enabled if among is None else among
        if not candidates:
            return None
        z = self._state = (self._state + 0x9E3779B97F4A7C15) & _MASK
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & _MASK
        z ^= z >> 31
        return candidates[((z >> 32) * len(candidates)) >> 32]


class Reference:
    """The reference executor, and the lines that generated C must print for the same commands."""

    is_active = True
    dropped = 0

    def __init__(self, supervisor: Supervisor, dice: Random, settings: Settings | None = None) -> None:
        self.model = supervisor.model
        self.layout: Layout = make_layout(supervisor)
        self.system = InterpretedSystem(supervisor)
        self.dice = dice
        # Half of the runs have no stop, so that the executor comes far.
        self.is_calm = dice.random() < 0.5
        self.clock = ManualClock()
        self.failing: set[str] = set()
        self.commands: list[str] = []
        self.lines: list[str] = []
        self.numbers = {name: number for number, name in enumerate(self.layout.communications)}
        self.events = {name: number for number, name in enumerate(self.layout.events)}
        self.topics = list(self.layout.topics)
        self.calls: dict[int, str] = {}
        self.goals: dict[int, str] = {}
        self.unknown = 0
        self.executor = self._new(settings or self._settings())

    # Settings.

    def _settings(self) -> Settings:
        dice = self.dice
        requests = [item.name for item in self.layout.requests]
        policy = dice.choice(["fair", "fair", "priority", "random"])
        priority = tuple(dice.sample(requests, dice.randint(0, len(requests)))) if policy == "priority" else ()
        every = dice.choice(["period", "period", "event"])
        on_unknown = dice.choice(["default", "keep"] if self.is_calm else ["default", "keep", "fault"])
        identifiers = list(self.layout.received_topics)
        ages = {name: dice.choice([1.5, 4.0]) for name in identifiers if dice.random() < 0.15 and not self.is_calm}
        released = tuple(topic for topic in self.topics if self.is_calm or dice.random() < 0.6)
        return Settings(
            period_s=0.125,
            policy=policy,
            priority=priority,
            seed=dice.randrange(2**64),
            every=every,
            release_identifiers=released,
            max_age_s=ages,
            service_timeout_s=dice.choice([1.0, 10.0]),
            action_timeout_s=dice.choice([None, None, 2.0]),
            cancel_timeout_s=dice.choice([0.0, 0.5, 1.0]),
            on_unknown=on_unknown,
        )

    def _new(self, settings: Settings) -> Executor:
        executor = Executor(self.system, self, settings, self.clock, self)
        settings = executor.settings
        if settings.policy == "random":
            seed = settings.seed
            executor._new_policy = lambda: Splitmix(seed)  # type: ignore[method-assign]
        words = settings_words(self.layout, settings)
        self.executor = executor
        self._note_command(words)
        return executor

    # The middleware.

    def prepare(self, communication: str, data: Any) -> Any:
        """The data itself."""
        if "fits" in self.failing and self.numbers[communication] % 2:
            raise DataDoesNotFit("no")
        return data

    def is_default(self, communication: str, message: Any) -> bool:
        """Return True if everything is zero or empty."""
        if isinstance(message, dict):
            return all(self.is_default(communication, part) for part in message.values())
        return message is None or message in (0, "")

    def _send(self, kind: str, *words: object) -> None:
        if kind in self.failing:
            raise RuntimeError(kind)
        self.lines.append(" ".join([kind, *map(str, words)]))

    def publish(self, communication: str, message: Any) -> None:
        """Remember."""
        self._send("publish", self._request(communication, message))

    def publish_default(self, identifier: str) -> None:
        """Remember."""
        self._send("default", self.topics.index(identifier))

    def call(self, communication: str, request_id: int, message: Any) -> None:
        """Remember."""
        self._send("call", request_id, self._request(communication, message))
        self.calls[request_id] = communication

    def send_goal(self, communication: str, goal_id: int, message: Any) -> None:
        """Remember."""
        self._send("goal", goal_id, self._request(communication, message))
        self.goals[goal_id] = communication

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        """Remember."""
        self._send("cancel", goal_id, self.numbers[communication])

    def _request(self, communication: str, message: Any) -> str:
        type_ = self.model.communication(communication).request
        assert type_ is not None
        provided = [item.value for item in self.model.provides_for(communication)]
        order = [path for value in provided for path in _paths(value, ())]
        order += [bound.path for limit in self.model.limits_for(communication) for bound in limit.bounds]
        given = dict(self._given(type_, message, ()))
        parts = [f"{'.'.join(path)}={given[path]}" for path in _grouped(order) if path in given]
        return " ".join([str(self.numbers[communication]), *parts])

    def _given(self, type_: Type, message: Any, path: tuple[str, ...]) -> list[tuple[tuple[str, ...], str]]:
        if message is None:
            return []
        if isinstance(type_, ObjectType):
            types = {part.name: part.type for part in self.model.object(type_.name).properties}
            return [item for name, part in message.items() for item in self._given(types[name], part, (*path, name))]
        match type_:
            case DoubleType():
                return [(path, f"{float(message):.17g}")]
            case StringType() | EnumType():
                return [(path, _hex(message))]
            case _:
                return [(path, str(int(message)))]

    # The log.

    def write(self, entry: dict[str, Any]) -> None:
        """Remember what happened."""
        kind = entry["kind"]
        self.unknown += kind == "unknown"
        if kind in ("event", "unknown", "unexpected", "limited"):
            number = self.events[entry["event"]] if "event" in entry else -1
            self.lines.append(f"log {kind} {number}")
        elif kind == "release":
            self.lines.append(f"log release {self.topics.index(entry['identifier'])}")
        elif kind in ("cancelling", "cancel_overdue"):
            self.lines.append(" ".join(["log", kind, str(self.numbers[entry["action"]]), *_reason(entry)]))
        else:
            self.lines.append(f"log {kind}")

    def close(self) -> None:
        """Do nothing."""

    # Commands.

    def command(self, kind: str, *words: object) -> None:
        """Give the generated code, too, a command that the executor was given."""
        self._note_command([kind, microseconds(self.clock.now_s), *words])

    def let_fail(self, *names: str) -> None:
        """Let these callbacks fail from now on, and no others."""
        self.failing = set(names)
        self._note_command(["x", sum(_FAILURES[name] for name in names)])

    def _note_command(self, words: Sequence[object]) -> None:
        self.commands.append(" ".join(map(str, words)))
        self.lines.append(self._state(0.0 if words[0] in ("n", "x") else None))

    def _state(self, now_s: float | None) -> str:
        words = ["state"]
        state = self.system.state()
        for component, behaviour in self.layout.executable.behaviours:
            names = [item.name for item in behaviour.states]
            words.append(str(names.index(state[component]["state"])))
            for variable in behaviour.variables:
                words.append(self._value(variable.type, state[component]["variables"][variable.name]))
        for item in self.model.communications:
            if item.kind in CALLED_KINDS:
                place = self.system._state[communication_plant_name(item), None]
                words.append(str(PLANT_LOCATIONS[item.kind].index(str(place))))
        enabled = "".join(str(int(self.system.enabled(event))) for event in self.layout.executable.issued)
        counters, executor = self.executor.counters, self.executor
        before = self.clock.now_s
        if now_s is not None:
            self.clock.now_s = now_s
        status = _STATUSES.index(executor.status)
        self.clock.now_s = before
        words += ["enabled", enabled, *self._cancelling()]
        words += ["status", str(status), "fault", str(int(executor.is_faulty))]
        return " ".join([*words, "counters", f"{self.unknown} {counters.unexpected} {counters.faults}"])

    def _cancelling(self) -> list[str]:
        """Return for each action whether its goal is to be cancelled: 1; 2 if that takes too long."""
        names = [item.name for item in self.layout.of_kind(CommunicationKind.ACTION)]
        cancelling, overdue = self.executor.cancelling, self.executor.overdue_cancels
        return [str((name in cancelling) + (name in overdue)) for name in names]

    def _value(self, type_: Type, value: Any) -> str:
        match type_:
            case DoubleType():
                return f"{value:.17g}"
            case StringType():
                return _hex(value)
            case EnumType(values=values):
                return str(values.index(value))
            case _:
                return str(int(value))

    def act(self) -> None:
        """One random command."""
        dice, executor = self.dice, self.executor
        self.clock.advance(dice.choice([0, 1, 1] if self.is_calm else [0, 0, 1, 1, 1, 2, 4, 9, 33]) * 0.125)
        now = microseconds(self.clock.now_s)
        back = events_back(self.layout)
        kinds = ["start", "tick", "watch", "stop", "restart", "failing", "receive", "back", "failed", "goal"]
        weights = [4, 8, 0, 0, 0, 0] if self.is_calm else [0.3, 4, 0.5, 0.15, 0.6, 0.3]
        weights += [6, 4, 0.7, 1.5] if back else [6, 0, 0, 0]
        kind = dice.choices(kinds, weights)[0]
        match kind:
            case "start":
                executor.start()
                self._note_command(["s", now])
            case "tick":
                executor.tick()
                self._note_command(["t", now])
            case "watch":
                executor.watch()
                self._note_command(["w", now])
            case "stop":
                is_fault = dice.random() < 0.5
                executor.stop("test", is_fault)
                self._note_command(["S", now, int(is_fault)])
            case "restart":
                executor.restart()
                self._note_command(["R", now])
            case "failing":
                self.let_fail(*[name for name in _FAILURES if dice.random() < 0.15] if dice.random() < 0.4 else [])
            case "receive" if self.layout.received_topics:
                self._receive(now)
            case "back":
                self._back(now, dice.choice(back))
            case "failed" if any(item.kind is CommunicationKind.SERVICE for item in self.model.communications):
                number = self._some(self.calls)
                executor.on_call_failed(number, "test")
                self._note_command(["f", now, number])
            case "goal" if any(item.kind is CommunicationKind.ACTION for item in self.model.communications):
                self._goal(now)

    def _some(self, ids: dict[int, str], of: str | None = None) -> int:
        open_ = [number for number, name in ids.items() if of in (None, name)][-2:]
        return self.dice.choice(open_) if open_ and self.dice.random() < 0.9 else self.dice.randint(500, 502)

    def _receive(self, now: int) -> None:
        identifier = self.dice.choice(list(self.layout.received_topics))
        types = batch_types(self.layout, identifier)
        words: list[object] = ["m", now, list(self.layout.received_topics).index(identifier)]
        datum: Any = None
        chosen = self.dice.randrange(len(types)) if types else 0
        if types:
            datum = self._datum(types[chosen])
        for number, type_ in enumerate(types):
            shared: Any = datum if number == chosen else None
            if number != chosen and isinstance(type_, DoubleType) and type(datum) is int:
                shared = float(datum)
            words += data_words(self.layout, type_, shared, is_root=True)
        try:
            self.executor.receive(identifier, datum)
        except MissingData:
            self._let_time_pass(now)
            return
        self._note_command(words)

    def _let_time_pass(self, now: int) -> None:
        """Let no more than that happen instead of what lacks data: much of that cannot be said in C."""
        self.executor.watch()
        self._note_command(["w", now])

    def _back(self, now: int, event: str) -> None:
        name, _, kind = event.rpartition(".")
        is_service = self.model.communication(name).kind is CommunicationKind.SERVICE
        number = self._waiting(self.calls if is_service else self.goals, name)
        type_ = event_data(self.model, event)
        datum = None if type_ is None else self._datum(self.layout.source(type_))
        words: list[object] = ["b", now, events_back(self.layout).index(event), number, *self._token_words(datum)]
        if type_ is not None:
            words += data_words(self.layout, type_, datum, is_root=True)
        try:
            if is_service:
                self.executor.on_reply(number, datum)
            elif kind == "feedback":
                self.executor.on_feedback(number, datum)
            else:
                self.executor.on_goal_ended(number, "succeeded", datum)
        except MissingData:
            self._let_time_pass(now)
            return
        self._note_command(words)

    def _waiting(self, ids: dict[int, str], name: str) -> int:
        """A number that something comes back with."""
        return self._some(ids, name)

    def _token_words(self, datum: Any) -> list[object]:
        """Words by which the program finds a message again."""
        return []

    def _goal(self, now: int) -> None:
        number = self._some(self.goals)
        match self.dice.randrange(4):
            case 0 | 1:
                self.executor.on_goal_accepted(number)
                self._note_command(["a", now, number])
            case 2:
                outcome = self.dice.choice([*OUTCOMES, "cancelled"])
                self.executor.on_goal_ended(number, outcome)
                self._note_command(["e", now, number, OUTCOMES.index(outcome)])
            case _:
                ended = self.dice.random() < 0.7
                self.executor.on_cancel_refused(number, ended)
                self._note_command(["c", now, number, int(ended)])

    # Data.

    def _datum(self, type_: Type, *, is_complete: bool = False) -> Any:
        """Return a possible datum of a type, as far as C can represent it.

        Args:
            type_: The type.
            is_complete: True if nothing is left out that cannot be said in C, where no event would be refused for it.
        """
        dice = self.dice
        match type_:
            case EnumType():
                return self._datum(self.layout.source(type_), is_complete=is_complete)
            case BooleanType():
                return dice.choice([True, False, *([] if is_complete else [None])])
            case IntegerType():
                numbers = [0, 1, -1, 2, 3, 4, 5, 6, 7, 100, 2**31 - 1, 2**31, -(2**31), -(2**40)]
                return dice.choice([*numbers, *([] if is_complete and type_.is_bounded else [None])])
            case DoubleType():
                values = [0.0, 0.1, 0.4, 0.5, 0.7, 1.0, 2.0, 3.0, -1.5, 1e308, math.nan, math.inf, -math.inf]
                return dice.choice(values)
            case StringType():
                return dice.choice(["", "a", "it's", '"""\n\\', "\udc80é", None])
            case ObjectType(name=name):
                if dice.random() < 0.05 and not is_complete:
                    return None
                parts = [item for item in self.model.object(name).properties if not isinstance(item.type, NoneType)]
                return {item.name: self._datum(item.type, is_complete=is_complete) for item in parts}
            case ArrayType(element=element):
                if dice.random() < 0.1:
                    return None
                if isinstance(element, DoubleType) and dice.random() < 0.3:
                    return [dice.choice([0.1, 3.0])] * 360
                is_inner = not isinstance(element, BooleanType | IntegerType)
                return [self._datum(element, is_complete=is_inner) for _ in range(dice.randint(0, 4))]
        raise AssertionError(type_)


def _reason(entry: dict[str, Any]) -> list[str]:
    """Return why a goal is to be cancelled, as the program prints it."""
    words = entry.get("why", "").replace(",", "").split()
    numbers = [word for word in words if word.isdigit()]
    return ["requirement", *numbers] if numbers else words[-1:]


def settings_words(layout: Layout, settings: Settings) -> list[object]:
    """The command that makes generated code begin with settings, which are spelled out."""
    numbers = {name: number for number, name in enumerate(layout.communications)}
    own = "fair" if layout.supervisor.strategy is None else "strategy"
    words: list[object] = ["n", POLICIES.index(settings.policy or own), len(settings.priority)]
    words += [numbers[name] for name in settings.priority]
    words += [settings.seed, int(settings.every == "event")]
    words += [("default", "keep", "fault").index(settings.on_unknown)]
    words += [microseconds(settings.service_timeout_s), microseconds(settings.action_timeout_s)]
    words.append(microseconds(settings.cancel_timeout_s))
    if layout.supervisor.strategy is not None:
        words.append(microseconds(settings.assumption_timeout_s))
    for item in layout.model.communications:
        is_sensor = item.kind is CommunicationKind.OUTGOING_MESSAGE
        age = settings.max_age_s.get(item.identifier, item.max_age) if is_sensor else None
        words.append(0 if age is None else microseconds(age))
    return words + [int(topic in (settings.release_identifiers or ())) for topic in layout.topics]


def lonely_end(supervisor: Supervisor) -> str:
    """Return the line that an example program, to which nothing is ever sent, prints at its end after a second."""
    ages = [item.max_age for item in supervisor.model.communications if item.max_age is not None]
    status = 4 if any(age <= 1.0 for age in ages) else 1 if ages else 2  # Stopped by a stale sensor, waiting, running.
    return f"status {status} after 1000000 us"


def data_words(layout: Layout, type_: Type, datum: Any, is_root: bool = False) -> list[object]:
    """Received data of a type as the test program reads it; what is not there, or of another type, is unknown."""
    type_ = layout.source(type_)
    match type_:
        case BooleanType():
            return [int(datum) if isinstance(datum, bool) else -1]
        case IntegerType():
            return [datum if isinstance(datum, int) and not isinstance(datum, bool) else -(2**63)]
        case DoubleType():
            is_number = isinstance(datum, int | float) and not isinstance(datum, bool)
            return [repr(float(datum)) if is_number else "nan"]
        case StringType():
            return [_hex(datum) if isinstance(datum, str) else "?"]
        case ArrayType(element=element):
            if not isinstance(datum, list):
                return [-1]
            return [len(datum), *(word for item in datum for word in data_words(layout, element, item))]
        case ObjectType(name=name):
            if is_root and not isinstance(datum, dict):
                return [0]
            given = datum if isinstance(datum, dict) else {}
            parts = [
                word
                for item in layout.model.object(name).properties
                if not isinstance(item.type, NoneType)
                for word in data_words(layout, item.type, given.get(item.name))
            ]
            return [1, *parts] if is_root else parts
    raise AssertionError(type_)


def _paths(value: Any, path: tuple[str, ...]) -> list[tuple[str, ...]]:
    if isinstance(value, ObjectValue):
        return [item for name, part in value.properties for item in _paths(part, (*path, name))]
    return [path]


def _grouped(paths: list[tuple[str, ...]]) -> list[tuple[str, ...]]:
    """The paths in the order of the structs: all of a property together, where it came first."""
    found: dict[str, list[tuple[str, ...]]] = {}
    if paths and not paths[0]:
        return [()]
    for path in paths:
        found.setdefault(path[0], []).append(path[1:])
    return [(name, *rest) for name, rests in found.items() for rest in (_grouped(rests) if rests[0] else [()])]


def _hex(text: str) -> str:
    return "x" + text.encode("utf-8", "surrogatepass").hex()


def microseconds(seconds: float | None) -> int:
    """Time as generated code has it; None is never."""
    return _MASK if seconds is None else round(seconds * 1e6)


def compare(
    supervisor: Supervisor,
    program: Path,
    dice: Random,
    runs: int,
    length: int,
    reference_of: Callable[[Supervisor, Random], Reference] = Reference,
) -> list[str]:
    """Let both execute random commands; all lines, which were the same."""
    commands: list[str] = []
    lines: list[str] = []
    for _ in range(runs):
        reference = reference_of(supervisor, dice)
        for _ in range(length):
            reference.act()
        commands += reference.commands
        lines += reference.lines
    replay(program, commands, lines)
    return lines


def replay(program: Path, commands: list[str], lines: list[str]) -> None:
    """Give generated code commands: it must print these lines."""
    done = subprocess.run([program], input="\n".join(commands) + "\n", capture_output=True, text=True, check=False)
    assert not done.stderr, done.stderr[-4000:]
    found = done.stdout.splitlines()
    if found != lines:
        place = next(n for n in range(len(lines)) if n >= len(found) or found[n] != lines[n])
        step = sum(line.startswith("state") for line in lines[:place])
        around = "\n".join(lines[max(0, place - 12) : place])
        raise AssertionError(
            f"command {step}: {commands[step]}\nbefore: {commands[max(0, step - 3) : step]}\n{around}\n"
            f"expected {lines[place]}\nfound    {found[place] if place < len(found) else None}"
        )
