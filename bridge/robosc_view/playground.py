"""The source for a model that nothing executes: whoever opens a page leads it by hand, each a run of its own.

The run is that of `robosc simulate`: events with data, undo and redo, walks by chance and until there is trouble, kept
as an event log or a test. When the model's file is saved, what was done so far is done again on the new model.
"""

import asyncio
import base64
import binascii
import time
import zlib
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from robosc.errors import RoboscError
from robosc.pipeline.event_scripts import parse_event
from robosc.pipeline.led_run import Step, changes_text, event_text
from robosc.pipeline.received_data import NO_DATA
from robosc.pipeline.saved_runs import ModelOfTest, entries_of, event_log, pytest_module, state_by_component
from robosc.pipeline.simulation import Run
from robosc_bridge.daemon.states import OperatorCommand
from robosc_view.definition import Robot, robot_of
from robosc_view.messages import TransitionTracker, run_text, saved_text
from robosc_view.model_changes import model_changes
from robosc_view.replay import LastTaken
from robosc_view.reports import EventBatch, Notice, RunReport, SourceKind, Status
from robosc_view.requests import Back, Form, Happen, LoadModel, Resume, RunCommand, Save, Walk
from robosc_view.sources import RefusedError, ReplayCommand, Sink, not_replayed
from robosc_view.watched_model import MadeModel, NoSupervisorError, WatchedModel

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

_CODE = "model"


def packed(text: str) -> str | None:
    """A model's text as it stands in a link; None where that would be too long."""
    found = base64.urlsafe_b64encode(zlib.compress(text.encode("utf-8", "surrogatepass"), 9)).decode().rstrip("=")
    return found if len(found) <= MAXIMUM_LINK else None


def unpacked(text: str) -> str:
    """The model's text that stands in a link.

    Raises:
        RefusedError: There is none.
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


class KeptRuns:
    """Runs of pages, for pages that come back: after a lost connection, or loaded again. The oldest are forgotten."""

    def __init__(self) -> None:
        self._runs: OrderedDict[str, tuple[MadeModel | None, tuple[Step, ...]]] = OrderedDict()

    def keep(self, page: str, own: MadeModel | None, history: tuple[Step, ...]) -> None:
        """Keep what a page has done, and the model of the link that it plays with, if it is that."""
        self._runs[page] = own, history
        self._runs.move_to_end(page)
        while len(self._runs) > MAXIMUM_KEPT:
            self._runs.popitem(last=False)

    def of(self, page: str) -> tuple[MadeModel | None, tuple[Step, ...]]:
        """Return the link's model and the steps that were kept of a page; nothing where none were."""
        return self._runs.get(page, (None, ()))


class Playground:
    """The run of one page.

    Args:
        watched: The model.
        kept: Runs of pages that may come back.
        file: File of the model, for saved tests; None: it has none.
        make: Function that makes a model of a text: of a link that is opened.
        scene: Scene for the map.
        clock: Function that returns the time of what is told, in seconds since 1970-01-01 UTC.
    """

    def __init__(
        self,
        watched: WatchedModel,
        kept: KeptRuns,
        file: ModelOfTest | None,
        make: Callable[[str], Awaitable[MadeModel]],
        scene: Any = None,
        clock: Callable[[], float] = time.time,
    ) -> None:
        self._watched = watched
        self._kept = kept
        # Name of the page; empty: it has not told it.
        self._page = ""
        self._file = file
        self._make = make
        self._scene = scene
        self._clock = clock
        self._commands: asyncio.Queue[RunCommand | None] = asyncio.Queue()
        self._is_changed = False
        # A model of a link takes the place of the watched one.
        self._own: MadeModel | None = None
        self._begin(watched.made)

    @property
    def robot(self) -> Robot:
        """Robot that is shown."""
        return playable(self._made, self._scene)

    def _begin(self, made: MadeModel) -> None:
        self._made = made
        self._run = Run(made.supervisor)
        # The steps that were told, and the entries of each.
        self._told: tuple[Step, ...] = ()
        self._entries: list[list[dict[str, Any]]] = []

    async def run(self, sink: Sink) -> None:
        """Do what is wanted, and tell what it leads to, until cancelled."""
        async with self._watched.listened(self._changed):
            if self._own is None and self._made is not self._watched.made:
                self._begin(self._watched.made)
            await self._define(sink)
            self._show(sink, RunReport())
            while True:
                command = await self._commands.get()
                try:
                    if command is not None:
                        await self._do(command, sink)
                    elif self._is_changed:
                        await self._renew(sink)
                except (RefusedError, RoboscError) as error:
                    self._show(sink, RunReport("wrong", (str(error),)))

    def lead(self, command: RunCommand) -> None:
        """Want something of the run; it is done after what was wanted before.

        Raises:
            RefusedError: Too much waits already.
        """
        if self._commands.qsize() >= MAXIMUM_WAITING:
            raise RefusedError("too much waits to be done")
        self._commands.put_nowait(command)

    async def order(self, command: OperatorCommand, by: str) -> None:
        """Not here: nothing is executed.

        Raises:
            RefusedError: Always.
        """
        raise RefusedError("nothing is executed here")

    def control_replay(self, command: ReplayCommand) -> None:
        """Not here.

        Raises:
            RefusedError: Always.
        """
        raise not_replayed()

    def _changed(self) -> None:
        self._is_changed = True
        self._commands.put_nowait(None)

    # What is wanted

    async def _do(self, command: RunCommand, sink: Sink) -> None:
        run = self._run
        match command:
            case Happen(line=line):
                self._require_room(1)
                event, data = parse_event(line)
                before = run.state
                step = run.step(run.event_called(event), *(() if data is NO_DATA else (data,)))
                told = [*step.unknown, *(f"{name} keeps its value, since what it was to take is unknown"
                                         for name in step.skipped)]  # fmt: skip
                changes = changes_text(before, step.state) or "nothing has changed"
                self._show(sink, RunReport("unknown" if told else "step", (f"{event_text(step)}: {changes}", *told)))
            case Back.UNDO:
                step_back = run.undo()
                self._show(sink, RunReport("step", (f"taken back: {step_back.event}",) if step_back else ()))
            case Back.REDO:
                step_again = run.redo()
                self._show(sink, RunReport("step", (f"taken again: {step_again.event}",) if step_again else ()))
            case Back.RESTART:
                run.restart()
                self._show(sink, RunReport("step", ("back in the initial state",)))
            case Walk(steps=steps, seed=seed, until_trouble=True):
                self._require_room(steps)
                before_count = len(run)
                trouble = await asyncio.to_thread(run.walk_until_trouble, steps, seed)
                none = f"no trouble in {len(run) - before_count} steps"
                self._show(sink, RunReport("trouble", (str(trouble),)) if trouble else RunReport("step", (none,)))
            case Walk(steps=steps, seed=seed):
                self._require_room(steps)
                taken = await asyncio.to_thread(run.walk, steps, seed)
                more = () if len(taken) == steps else ("nothing more can happen",)
                self._show(sink, RunReport("step", (f"{len(taken)} events by chance, seed {seed}", *more)))
            case Save(form=form):
                sink.answer(saved_text(*await asyncio.to_thread(self._saved, form)))
            case Resume(page=page):
                await self._resume(page, sink)
            case LoadModel(packed=text):
                await self._load(unpacked(text), sink)

    def _require_room(self, steps: int) -> None:
        if len(self._run) + steps > MAXIMUM_STEPS:
            raise RefusedError(f"a run here has at most {MAXIMUM_STEPS} events: save it, and begin again")

    def _saved(self, form: Form) -> tuple[str, str]:
        """Name and text of a file."""
        name = self._run.supervisor.model.name.lower()
        if form is Form.LOG:
            return f"{name}.jsonl", event_log(self._run)
        file = self._file if self._own is None else None
        # Seen from the folder of the model, where the test is expected to go.
        model = ModelOfTest(Path(f"{name}.rscd")) if file is None else file
        return f"test_{name}.py", pytest_module(self._run, model, model.path.parent / f"test_{name}.py")

    async def _resume(self, page: str, sink: Sink) -> None:
        own, history = self._kept.of(page)
        self._page = page
        if len(self._run) or not (history or own):
            return
        if own is not None:
            self._own = own
            self._begin(own)
            await self._define(sink)
        told = await asyncio.to_thread(self._again, history)
        self._show(sink, RunReport("changed" if told else "step", told or ("what this page did before is here again",)))

    def _again(self, history: tuple[Step, ...]) -> tuple[str, ...]:
        """Take the events of a run again, as far as they can happen; returns what is in their way."""
        for number, step in enumerate(history):
            try:
                self._run.step(step.event, *(() if step.given is NO_DATA else (step.given,)))
            except RoboscError as error:
                return (f"of {len(history)} events {number} happened again: {error}",)
        return ()

    async def _load(self, text: str, sink: Sink) -> None:
        try:
            self._own = await self._make(text)
        except NoSupervisorError as error:
            raise RefusedError(f"there is no supervisor of the link's model: {error}") from error
        self._begin(self._own)
        await self._define(sink)
        self._show(sink, RunReport("changed", ("this is the model of the link",)))

    async def _renew(self, sink: Sink) -> None:
        """The model has changed: what was done is done again on it, as far as it can be."""
        self._is_changed = False
        before, after = self._made, self._watched.made
        if self._own is not None or after is before:
            # Its warning alone is news.
            self._show(sink, RunReport())
            return
        told = list(await asyncio.to_thread(model_changes, before, after))
        history = self._run.history
        self._begin(after)
        told += await asyncio.to_thread(self._again, history)
        await self._define(sink)
        self._show(sink, RunReport("changed", ("the model has changed", *told)))

    # What is told

    async def _define(self, sink: Sink) -> None:
        await sink.define(self.robot)
        self._tracker = TransitionTracker(self.robot)

    def _show(self, sink: Sink, report: RunReport) -> None:
        run = self._run
        history = run.history
        # A trouble that is as it was when it was told before is not told again.
        same = 0
        while same < min(len(history), len(self._entries)) and self._told[same] is history[same]:
            same += 1
        sink.replay_jumped()
        del self._entries[same:]
        first = sum(map(len, self._entries)) + 1
        for number, step in enumerate(history[same:], start=same + 1):
            self._entries.append(list(entries_of(step, number)))
        self._told = history
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
                last=LastTaken(self._tracker, everything).after(len(everything)),
            )
        )
        sink.show_run(run_text(run, len(everything), report))
        if self._page:
            self._kept.keep(self._page, self._own, history)


def playable(made: MadeModel, scene: Any = None) -> Robot:
    """Return the robot of a model that is played with."""
    run = Run(made.supervisor)
    play = {
        "events": [
            {
                "event": event,
                "controllable": run.is_controllable(event),
                "fields": [
                    {
                        "path": item.path,
                        "type": item.type,
                        "choices": item.choices,
                        "is_boolean": item.type == "boolean",
                    }
                    for item in run.data_fields(event)
                    if item.is_read
                ],
            }
            for event in run.events
        ],
        "link": None if made.text is None else packed(made.text),
    }
    return robot_of(made.supervisor, SourceKind.MODEL, version="", can_command=False, scene=scene, play=play)
