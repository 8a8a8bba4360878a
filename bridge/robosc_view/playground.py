"""The source for a model that is not executed: a person steps it by hand, and each page has its own run.

The run is that of `robosc simulate`: events with data, undo and redo, walks by chance and until there is a finding,
kept as an event log or a test. For automata, a person also chooses the initial state and the outcome of an event.
When the model's file is saved, what was done so far is done again on the new model.
"""

import asyncio
import base64
import binascii
import time
import zlib
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from robosc.certification.supervisor_file import StateInWords
from robosc.conditions.goals import goal_text
from robosc.errors import RoboscError
from robosc.pipeline.counter_run import CounterRun
from robosc.pipeline.event_scripts import parse_event
from robosc.pipeline.received_data import NO_DATA
from robosc.pipeline.saved_runs import ModelOfTest, entries_of, event_log, pytest_module, state_by_component
from robosc.pipeline.simulation import Run
from robosc.pipeline.steps import Step, changes_text, event_text
from robosc.pipeline.system_runs import ChoiceError, SystemRun
from robosc.pipeline.systems import SystemSupervisor
from robosc_bridge.daemon.states import OperatorCommand
from robosc_view.automata import EdgesTaken, distinguishing_parts, robot_of_automata
from robosc_view.definition import Robot, robot_of
from robosc_view.messages import TransitionTracker, run_text, saved_text
from robosc_view.model_changes import model_changes
from robosc_view.replay import LastTaken
from robosc_view.reports import Choice, EventBatch, Notice, RunReport, SourceKind, Status
from robosc_view.requests import Form, HistoryMove, LoadModel, Restart, Resume, RunCommand, Save, TakeEvent, Wait, Walk
from robosc_view.sources import RefusedError, ReplayCommand, Sink, not_replayed
from robosc_view.watched_model import NoSupervisorError, SynthesizedModel, WatchedModel

MAXIMUM_WAITING = 50
"""Commands of one page that wait for their turn."""

MAXIMUM_STEPS = 20_000
"""Events of one run: a page is no place for longer ones."""

MAXIMUM_KEPT = 100
"""Runs that are kept for pages that come back."""

MAXIMUM_TEXT = 1 << 20
"""Characters of a model that a link holds."""

MAXIMUM_LINK = 8000
"""Characters of a link beyond which none is offered: browsers and messages cut longer ones."""

MAXIMUM_ANSWERS = 5
"""Events of the surroundings that one report names."""

MAXIMUM_WAYS = 100
"""States to begin in, or that an event can lead to, which a page offers."""

_CODE = "model"


def packed(text: str) -> str | None:
    """A model's text as it stands in a link; None where that would be too long."""
    found = base64.urlsafe_b64encode(zlib.compress(text.encode("utf-8", "surrogatepass"), 9)).decode().rstrip("=")
    return found if len(found) <= MAXIMUM_LINK else None


def unpacked(text: str) -> str:
    """Return the model's text in a link.

    Raises:
        RefusedError: The link has no model.
    """
    try:
        content = base64.urlsafe_b64decode(text + "=" * (-len(text) % 4))
        stream = zlib.decompressobj()
        found = stream.decompress(content, MAXIMUM_TEXT)
        if not stream.eof:
            raise RefusedError("the link is cut off, or its model is too large")
        return found.decode("utf-8")
    except (binascii.Error, ValueError, zlib.error) as error:
        raise RefusedError("the link holds no model") from error


@dataclass(frozen=True, slots=True)
class StoredRun:
    """A run of a page.

    Attributes:
        own: Model of a link that the run uses; None: the watched one.
        history: Steps that the run has taken.
        beginning: Parts of the state that it has begun in.
    """

    own: SynthesizedModel | None = None
    history: tuple[Step, ...] = ()
    beginning: Mapping[str, object] = field(default_factory=dict)


class StoredRuns:
    """Runs of pages that may come back after a lost connection or a reload. The oldest are forgotten."""

    def __init__(self) -> None:
        self._runs: OrderedDict[str, StoredRun] = OrderedDict()

    def keep(self, page: str, run: StoredRun) -> None:
        """Store the run of a page."""
        self._runs[page] = run
        self._runs.move_to_end(page)
        while len(self._runs) > MAXIMUM_KEPT:
            self._runs.popitem(last=False)

    def of(self, page: str) -> StoredRun:
        """Return the stored run of a page; an empty one if there is none."""
        return self._runs.get(page, StoredRun())


class Playground:
    """The run of one page.

    Args:
        watched: The model.
        kept: Runs of pages that may come back.
        file: File of the model, for saved tests; None: it has none.
        make: Function that makes a model from the text and language of a link.
        scene: Scene for the map.
        clock: Function that returns the time of what is reported, in seconds since 1970-01-01 UTC.
    """

    def __init__(
        self,
        watched: WatchedModel,
        kept: StoredRuns,
        file: ModelOfTest | None,
        make: Callable[[str, str], Awaitable[SynthesizedModel]],
        scene: Any = None,
        clock: Callable[[], float] = time.time,
    ) -> None:
        self._watched = watched
        self._kept = kept
        # Name of the page; empty: the page has not sent it.
        self._page = ""
        self._file = file
        self._make = make
        self._scene = scene
        self._clock = clock
        self._commands: asyncio.Queue[RunCommand | None] = asyncio.Queue()
        self._is_changed = False
        # A model of a link takes the place of the watched one.
        self._own: SynthesizedModel | None = None
        self._is_begun = False
        self._made = watched.made
        self._run: Run | SystemRun
        self._edges: EdgesTaken | None
        self._beginning = 0

    async def _begin(self, made: SynthesizedModel, beginning: int = 0) -> None:
        # The graph of large automata takes its time, in another thread.
        self._run, self._edges = await asyncio.to_thread(_run_of, made, beginning)
        self._made, self._beginning, self._is_begun = made, beginning, True
        # The steps that were reported, and the entries of each.
        self._reported: tuple[Step, ...] = ()
        self._entries: list[list[dict[str, Any]]] = []

    async def run(self, sink: Sink) -> None:
        """Carry out what pages ask for, and send the results to the sink, until cancelled."""
        async with self._watched.listened(self._changed):
            if not self._is_begun or (self._own is None and self._made is not self._watched.made):
                await self._begin(self._watched.made)
            await self._define(sink)
            await self._show(sink, self._initial_report())
            while True:
                command = await self._commands.get()
                try:
                    if command is not None:
                        await self._do(command, sink)
                    elif self._is_changed:
                        await self._renew(sink)
                except (RefusedError, RoboscError) as error:
                    await self._show(sink, RunReport("wrong", (str(error),)))

    def submit(self, command: RunCommand) -> None:
        """Submit a command for the run; it is carried out after the commands before it.

        Raises:
            RefusedError: Too much waits already.
        """
        if self._commands.qsize() >= MAXIMUM_WAITING:
            raise RefusedError("too much waits to be done")
        self._commands.put_nowait(command)

    async def order(self, command: OperatorCommand, by: str) -> None:
        """Refuse a command for the robot: no robot is running.

        Raises:
            RefusedError: Always.
        """
        raise RefusedError("nothing is executed here")

    def control_replay(self, command: ReplayCommand) -> None:
        """Refuse to control a replay: there is none.

        Raises:
            RefusedError: Always.
        """
        raise not_replayed()

    def _changed(self) -> None:
        self._is_changed = True
        self._commands.put_nowait(None)

    # Requests of the page

    async def _do(self, command: RunCommand, sink: Sink) -> None:
        run = self._run
        match command:
            case TakeEvent(line=line, way=way):
                self._require_room(1)
                before, count = run.state, len(run)
                step = await asyncio.to_thread(self._happened, line, way)
                if isinstance(step, RunReport):
                    await self._show(sink, step)
                    return
                sentences = [*step.unknown, *(f"{name} keeps its value, since what it was to take is unknown"
                                         for name in step.skipped)]  # fmt: skip
                changes = changes_text(before, step.state) or "nothing has changed"
                kind = "unknown" if sentences else "step"
                if isinstance(run, CounterRun):
                    sentences += _answer_texts(run, run.history[count + 1 :])
                await self._show(sink, RunReport(kind, (f"{event_text(step)}: {changes}", *sentences)))
            case Wait() if isinstance(run, CounterRun):
                self._require_room(1)
                answers = await asyncio.to_thread(run.wait)
                sentences = [*_answer_texts(run, answers)] or ["the surroundings wait, too"]
                await self._show(sink, RunReport("step", ("you wait", *sentences)))
            case Wait():
                raise RefusedError("waiting is for a run against the surroundings")
            case HistoryMove.UNDO:
                step_back = run.undo()
                await self._show(sink, RunReport("step", (f"taken back: {step_back.event}",) if step_back else ()))
            case HistoryMove.REDO:
                step_again = run.redo()
                await self._show(sink, RunReport("step", (f"taken again: {step_again.event}",) if step_again else ()))
            case Restart(beginning=int(beginning)) if isinstance(run, SystemRun):
                if beginning >= len(self._made.beginnings):
                    raise RefusedError("there is no such state to begin in")
                await self._begin(self._made, beginning)
                await self._show(sink, RunReport("step", ("back in the initial state",)))
            case Restart():
                run.restart()
                await self._show(sink, RunReport("step", ("back in the initial state",)))
            case Walk(steps=steps, seed=seed, until_finding=True):
                self._require_room(steps)
                before_count = len(run)
                finding = await asyncio.to_thread(run.walk_until_finding, steps, seed)
                none = f"no finding in {len(run) - before_count} steps"
                await self._show(sink, RunReport("finding", (str(finding),)) if finding else RunReport("step", (none,)))
            case Walk(steps=steps, seed=seed):
                self._require_room(steps)
                taken = await asyncio.to_thread(run.walk, steps, seed)
                more = () if len(taken) == steps else ("nothing more can happen",)
                await self._show(sink, RunReport("step", (f"{len(taken)} events by chance, seed {seed}", *more)))
            case Save(form=form):
                sink.answer(saved_text(*await asyncio.to_thread(self._saved, form)))
            case Resume(page=page):
                await self._resume(page, sink)
            case LoadModel(packed=text, language=language):
                await self._load(unpacked(text), language, sink)

    def _require_room(self, steps: int) -> None:
        if len(self._run) + steps > MAXIMUM_STEPS:
            raise RefusedError(f"a run here has at most {MAXIMUM_STEPS} events: save it, and begin again")

    def _happened(self, line: str, way: int | None) -> Step | RunReport:
        """The step of an event; or the report of the states that it can lead to."""
        run = self._run
        # Names of plain automata may hold blanks.
        event, data = (line, NO_DATA) if line in run.events else parse_event(line)
        event, given = run.event_called(event), () if data is NO_DATA else (data,)
        if isinstance(run, Run):
            return run.step(event, *given)
        ways = run.choices(event, *given)
        if way is not None and way < len(ways):
            return run.step(event, *given, to=ways[way].parts)
        if len(ways) <= 1:
            return run.step(event, *given)
        sentence = f"{event} can lead to {len(ways)} states: choose one beside its button"
        sentence += f", which offers the first {MAXIMUM_WAYS}" if len(ways) > MAXIMUM_WAYS else ""
        sentence += ", or enter its data" if run.data_fields(event) else ""
        return RunReport("choose", (sentence,), Choice(event, line, distinguishing_parts(ways)[:MAXIMUM_WAYS]))

    def _saved(self, form: Form) -> tuple[str, str]:
        """Name and text of a file.

        Raises:
            RefusedError: It is a run of automata.
        """
        if isinstance(self._run, SystemRun):
            raise RefusedError("a run of automata is not saved: event logs and tests are of robots")
        name = self._run.supervisor.model.name.lower()
        if form is Form.LOG:
            return f"{name}.jsonl", event_log(self._run.history)
        file = self._file if self._own is None else None
        # Seen from the folder of the model, where the test is expected to go.
        model = ModelOfTest(Path(f"{name}.rscd")) if file is None else file
        return f"test_{name}.py", pytest_module(self._run, model, model.path.parent / f"test_{name}.py")

    async def _resume(self, page: str, sink: Sink) -> None:
        kept = self._kept.of(page)
        self._page = page
        is_same = not (kept.own or kept.history) and kept.beginning in ({}, self._initial_parts)
        if len(self._run) or is_same:
            return
        self._own = kept.own or self._own
        sentences = await self._repeat(kept.own or self._made, kept.beginning, kept.history)
        if kept.own is not None:
            await self._define(sink)
        report = ("changed", sentences) if sentences else ("step", ("what this page did before is here again",))
        await self._show(sink, RunReport(*report))

    @property
    def _initial_parts(self) -> Mapping[str, object]:
        """Parts of the state that automata have begun in."""
        return self._made.beginnings[self._beginning].parts if self._made.beginnings else {}

    async def _repeat(
        self, made: SynthesizedModel, beginning: Mapping[str, object], history: tuple[Step, ...]
    ) -> tuple[str, ...]:
        """Begin a model as another run did, and do what it did, as far as possible; returns what is in the way."""
        alike = [
            number
            for number, state in enumerate(made.beginnings)
            if all(state.parts.get(name, value) == value for name, value in beginning.items())
        ]
        await self._begin(made, alike[0] if alike else 0)
        lost = (
            () if alike or not beginning else (f"it cannot begin where it did, and begins anew: {self._run.initial}",)
        )
        return (*lost, *await asyncio.to_thread(self._repeated, history))

    def _repeated(self, history: tuple[Step, ...]) -> tuple[str, ...]:
        """Take the events of a run again, as far as they can happen; returns what is in their way."""
        for number, step in enumerate(history):
            try:
                if isinstance(self._run, CounterRun):
                    _repeat_turn(self._run, step, number)
                else:
                    self._repeat_step(step)
            except RoboscError as error:
                return (f"of {len(history)} events {number} happened again: {error}",)
        return ()

    def _repeat_step(self, step: Step) -> None:
        run, given = self._run, () if step.given is NO_DATA else (step.given,)
        try:
            run.step(step.event, *given)
        except ChoiceError:
            parts = run.state.parts
            to = {name: value for name, value in step.state.parts.items() if name in parts}
            cast(SystemRun, run).step(step.event, *given, to=to)

    async def _load(self, text: str, language: str, sink: Sink) -> None:
        try:
            self._own = await self._make(text, language)
        except NoSupervisorError as error:
            raise RefusedError(f"there is no supervisor of the link's model: {error}") from error
        await self._begin(self._own)
        await self._define(sink)
        await self._show(sink, RunReport("changed", ("this is the model of the link",)))

    async def _renew(self, sink: Sink) -> None:
        """The model has changed: what was done is done again on it, as far as it can be."""
        self._is_changed = False
        before, after = self._made, self._watched.made
        if self._own is not None or after is before:
            # Its warning alone is news.
            await self._show(sink, RunReport())
            return
        sentences = list(await asyncio.to_thread(model_changes, before, after))
        sentences += await self._repeat(after, self._initial_parts, self._run.history)
        await self._define(sink)
        await self._show(sink, RunReport("changed", ("the model has changed", *sentences)))

    # Reports

    def _initial_report(self) -> RunReport:
        """Report of where a run has begun; an empty one where there is no choice."""
        count = len(self._made.beginnings)
        if count <= 1:
            return RunReport()
        offered = f", of which the first {MAXIMUM_WAYS} are offered" if count > MAXIMUM_WAYS else ""
        where = distinguishing_parts(self._made.beginnings)[self._beginning]
        sentence = f"there are {count} states to begin in{offered}, and this begins where {where}"
        return RunReport("step", (f"{sentence}: choose another one, and restart",))

    async def _define(self, sink: Sink) -> None:
        robot = await asyncio.to_thread(playable, self._made, self._scene)
        await sink.define(robot)
        self._tracker = TransitionTracker(robot)

    async def _show(self, sink: Sink, report: RunReport) -> None:
        run = self._run
        history = run.history
        # A finding that is the same as when it was reported before is not reported again.
        same = 0
        while same < min(len(history), len(self._entries)) and self._reported[same] is history[same]:
            same += 1
        sink.replay_jumped()
        del self._entries[same:]
        first = sum(map(len, self._entries)) + 1
        for number, step in enumerate(history[same:], start=same + 1):
            before = history[number - 2].state if number > 1 else run.initial
            self._entries.append(self._entries_of(before, step, number))
        self._reported = history
        sink.begin(state_by_component(history[same - 1].state if same else run.initial))
        new = [entry for entries in self._entries[same:] for entry in entries]
        if new:
            sink.append_events(EventBatch(new), first)
        everything = [entry for entries in self._entries for entry in entries]
        warning = self._watched.warning if self._own is None else ""
        sink.show(
            Status(
                time_s=self._clock(),
                warnings=(Notice(_CODE, warning),) if warning else (),
                components=state_by_component(run.state),
                communications=run.locations,
                cancelling=run.cancelling,
                last=LastTaken(self._tracker, everything).after(len(everything)),
            )
        )
        sink.show_run(await asyncio.to_thread(run_text, run, len(everything), report, self._beginning))
        if self._page:
            self._kept.keep(self._page, StoredRun(self._own, history, self._initial_parts))

    def _entries_of(self, before: StateInWords, step: Step, number: int) -> list[dict[str, Any]]:
        found = list(entries_of(step, number))
        if self._edges is not None:
            # Edges are enough for automata: the state of hundreds of them is not sent once more.
            (entry,) = found
            entry["transitions"] = self._edges.of(before, step)
            del entry["state"]
        return found


def _answer_texts(run: CounterRun, steps: Sequence[Step]) -> list[str]:
    """Return what the executor and the surroundings did, in sentences; of many only the first."""
    found = [f"the {run.actor(step.event)}: {event_text(step)}" for step in steps[:MAXIMUM_ANSWERS]]
    more = len(steps) - len(found)
    return [*found, *([f"and {more} events more"] if more > 0 else [])]


def _repeat_turn(run: CounterRun, step: Step, number: int) -> None:
    """Take the turn of a run against the surroundings again that has led to a step.

    Args:
        run: The run.
        step: The step.
        number: Number of the steps before it.
    """
    # The surroundings may have answered waits, which stand in no history.
    for _ in range(len(run.came_true) + 1):
        if len(run) >= number + (run.actor(step.event) != "you"):
            break
        run.wait()
    if run.actor(step.event) == "you":
        run.step(step.event)


def _run_of(made: SynthesizedModel, beginning: int) -> tuple[Run | SystemRun, EdgesTaken | None]:
    """Return a run of a model; for automata, also the object that finds the edges which its events take."""
    if made.denied is not None:
        return CounterRun(made.denied), None
    if not isinstance(made.supervisor, SystemSupervisor):
        return Run(made.supervisor), None
    parts = made.beginnings[beginning].parts
    return SystemRun(made.supervisor, parts), EdgesTaken(made.supervisor.system)


def playable(made: SynthesizedModel, scene: Any = None) -> Robot:
    """Return the robot of a model that is stepped by hand."""
    play: dict[str, Any] = {
        "language": made.language,
        "goals": (),
        "link": None if made.text is None else packed(made.text),
        # A single state to begin in is nothing to choose.
        "beginnings": distinguishing_parts(made.beginnings)[:MAXIMUM_WAYS] if len(made.beginnings) > 1 else (),
    }
    if isinstance(made.supervisor, SystemSupervisor):
        return robot_of_automata(made.supervisor, {**play, "forms": ()})
    run = Run(made.supervisor) if made.denied is None else CounterRun(made.denied)
    events = [
        {
            "event": event,
            "controllable": run.is_controllable(event),
            "fields": [item.as_json() for item in run.data_fields(event) if item.is_read],
        }
        for event in run.events
    ]
    play |= {"events": events, "forms": tuple(Form)}
    if made.denied is not None:
        # A link, and a test, would load the model, which has no supervisor.
        model = run.supervisor.model
        goals = [f"goal {goal_text(item)}" for item in model.goals]
        missions = [f"mission {item.name}" for item in model.missions]
        play |= {"forms": (Form.LOG,), "link": None, "goals": [*goals, *missions]}
    return robot_of(made.supervisor, SourceKind.MODEL, version="", can_command=False, scene=scene, play=play)
