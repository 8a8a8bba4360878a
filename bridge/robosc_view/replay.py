"""The source for an event log: it shows any moment of the log, and replays the log at any speed.

The log states the state of the components after each event. The states of services and actions follow from the events:
each event leads to one location of the protocol, whatever the location before.
"""

import asyncio
from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Any

from robosc.automata.plants import communication_plant
from robosc.event_logs import LoggedRun
from robosc.event_logs.entries import is_ended
from robosc.execution.runtime.progress import Progress
from robosc.model.structure import CommunicationKind, EventKind, Model
from robosc.supervisor import Supervisor
from robosc_bridge.daemon.states import OperatorCommand
from robosc_view.definition import robot_of
from robosc_view.logged_progress import LoggedProgress
from robosc_view.messages import TransitionTracker
from robosc_view.motion import MotionTrace
from robosc_view.reports import EventBatch, LogSpan, SourceKind, Status
from robosc_view.sources import Pause, Play, RefusedError, ReplayCommand, Seek, Sink, ViewError

HISTORY = 200
"""Entries before the place that is gone to which are reported again."""

MAXIMUM_STOPS = 50
"""Stops that hold at the same time; of more the oldest are forgotten. A robot has as many as it has sensors."""

MOST_AT_ONCE = 2000
"""Entries that are reported in one step of a replay; those before them count as lost."""

STEP_S = 0.04
"""Between two steps of a replay."""

_CALLED = (CommunicationKind.SERVICE, CommunicationKind.ACTION)


@dataclass(frozen=True, slots=True)
class Frame:
    """The state after some entries.

    Attributes:
        components: State and variables of each component.
        communications: Location of each service and action.
        problem: The fault that was reported last, until a restart.
        stops: Reasons why nothing was requested, each until it ended.
        cancelling: Actions whose goal was to be cancelled and had not ended.
    """

    components: Mapping[str, Any]
    communications: Mapping[str, str]
    problem: str = ""
    stops: tuple[str, ...] = ()
    cancelling: tuple[str, ...] = ()


class Recording:
    """A log with the state at each of its moments; many may replay it at once.

    Args:
        run: The log.
        supervisor: Supervisor under which the log was written, with its model.
        scene: Scene for the map.
        motion: Motion of the robot in the map; None: it was not recorded.

    Raises:
        ViewError: The log is empty, or belongs to another model.
    """

    def __init__(
        self, run: LoggedRun, supervisor: Supervisor, scene: Any = None, motion: MotionTrace | None = None
    ) -> None:
        if not run.entries:
            raise ViewError("the log has no entries")
        self.documents = [entry.document for entry in run.entries]
        # A clock that was set back would hide what came after it.
        self.times_s = list(accumulate((entry.time_s for entry in run.entries), max))
        self._frames = _frames(run, supervisor.model)
        self._progress = LoggedProgress(supervisor, self.documents, self.times_s)
        self.motion = motion
        if motion is not None:
            scene = {**(scene or {"walls": [], "line": []}), "way": motion.way()}
        span = LogSpan(self.begin_s, self.end_s, len(self.documents))
        self.robot = robot_of(supervisor, SourceKind.LOG, version="", can_command=False, log=span, scene=scene)
        self._last = LastTaken(TransitionTracker(self.robot), self.documents)

    @property
    def begin_s(self) -> float:
        """Time of the first entry."""
        return self.times_s[0]

    @property
    def end_s(self) -> float:
        """Time of the last entry."""
        return self.times_s[-1]

    def count(self, time_s: float) -> int:
        """Return the number of entries that have happened by a time."""
        return bisect_right(self.times_s, time_s)

    def frame(self, number: int) -> Frame:
        """Return the state after a number of entries."""
        return self._frames[number]

    def progress(self, number: int, time_s: float) -> Progress | None:
        """Return the strategy's progress after a number of entries; None: the log has nothing about one."""
        return self._progress.at(number, time_s)

    def last(self, number: int) -> Mapping[str, int]:
        """Return the last transition of each component that has taken one, after a number of entries."""
        return self._last.after(number)


class LastTaken:
    """Last transition of each component, after any number of entries since the start of the model.

    Args:
        tracker: Tracker of the transitions that entries take; in the initial state.
        documents: The entries.
    """

    def __init__(self, tracker: TransitionTracker, documents: Iterable[Mapping[str, Any]]) -> None:
        # Numbers of entries after which a component has taken transitions, and these transitions.
        self._taken: dict[str, tuple[list[int], list[int]]] = {}
        self._begins = [0]
        tracker.begin({})
        for count, document in enumerate(documents, 1):
            if document.get("kind") == "restart":
                self._begins.append(count)
            for component, transition in tracker.of(document):
                counts, transitions = self._taken.setdefault(component, ([], []))
                counts.append(count)
                transitions.append(transition)

    def after(self, count: int) -> dict[str, int]:
        """Return the numbers of the transitions by component, after a number of entries."""
        begin = self._begins[bisect_right(self._begins, count) - 1]
        found = {}
        for component, (counts, transitions) in self._taken.items():
            place = bisect_right(counts, count) - 1
            if place >= 0 and counts[place] > begin:
                found[component] = transitions[place]
        return found


def _frames(run: LoggedRun, model: Model) -> list[Frame]:
    known = {event for item in model.communications for event in item.events} | set(model.taus)
    leads_to = {
        edge.event: (item.name, edge.target)
        for item in model.communications
        if item.kind in _CALLED
        for edge in communication_plant(item).edges
    }
    ends = {
        f"{item.name}.{kind}": item.name
        for item in model.communications
        if item.kind is CommunicationKind.ACTION
        for kind in (EventKind.REQUEST, EventKind.RESPONSE, EventKind.ERROR, EventKind.CANCEL)
    }
    names = {component.name for component in model.components if component.behaviour}
    first = first_frame(model)
    frames, frame = [first], first
    for entry in run.entries:
        match entry.kind:
            case "event":
                if entry.event not in known or entry.state.keys() != names:
                    raise ViewError(
                        f"line {entry.line}: the model has no such event or state: give the log's own model"
                    )
                places = frame.communications
                if entry.event in leads_to:
                    name, location = leads_to[entry.event]
                    places = places if places[name] == location else {**places, name: location}
                # The end of a goal that took too long, or from before a restart, is no event: the next request shows it.
                cancelling = frame.cancelling
                if entry.event in ends:
                    cancelling = tuple(item for item in cancelling if item != ends[entry.event])
                frame = replace(frame, components=entry.state, communications=places, cancelling=cancelling)
            case "cancelling":
                action = entry.text("action")
                if action not in frame.cancelling:
                    frame = replace(frame, cancelling=(*frame.cancelling, action))
            case "restart":
                # A goal of the old run goes on until it has ended.
                frame = replace(first, cancelling=frame.cancelling)
            case "fault":
                frame = replace(frame, problem=entry.text("what"))
            case "stop":
                what = entry.text("what")
                stops = (*(item for item in frame.stops if item != what), what)[-MAXIMUM_STOPS:]
                frame = replace(frame, stops=stops)
            case "resume":
                stops = tuple(item for item in frame.stops if not is_ended(item, entry.text("what")))
                frame = replace(frame, stops=stops)
        frames.append(frame)
    return frames


def first_frame(model: Model) -> Frame:
    """Return the state before the first entry."""
    components = {
        component.name: {
            "state": component.behaviour.initial,
            "variables": {variable.name: variable.initial for variable in component.behaviour.variables},
        }
        for component in model.components
        if component.behaviour
    }
    return Frame(components, {item.name: "idle" for item in model.communications if item.kind in _CALLED})


class Player:
    """Position of a replay, independent of any clock.

    Args:
        recording: Recording that is replayed.

    Attributes:
        time_s: Position in the log's time.
        speed: Seconds of the log in a second.
        is_playing: True if the replay advances with time.
    """

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self.time_s = recording.begin_s
        self.speed = 1.0
        self.is_playing = False

    def control_replay(self, command: ReplayCommand) -> None:
        """Seek, play or pause."""
        recording = self._recording
        match command:
            case Seek(time_s=time_s):
                self.time_s = min(max(time_s, recording.begin_s), recording.end_s)
            case Play(speed=speed):
                self.speed, self.is_playing = speed, True
                if self.time_s >= recording.end_s:
                    self.time_s = recording.begin_s
            case Pause():
                self.is_playing = False

    def advance(self, passed_s: float) -> None:
        """Advance the position by the time that has passed."""
        if self.is_playing:
            self.time_s = min(self.time_s + passed_s * self.speed, self._recording.end_s)
            self.is_playing = self.time_s < self._recording.end_s


class Replay:
    """A replay for one page.

    Args:
        recording: Recording that is replayed.
    """

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._player = Player(recording)
        self._is_steered = asyncio.Event()
        self._commands: list[ReplayCommand] = []

    async def run(self, sink: Sink) -> None:
        """Send the state of the robot at the position of the replay to the sink, until cancelled."""
        loop = asyncio.get_running_loop()
        player = self._player
        await sink.define(self._recording.robot)
        shown = self._go_to(sink)
        last_s = loop.time()
        while True:
            if player.is_playing:
                await asyncio.sleep(STEP_S)
            else:
                await self._is_steered.wait()
                last_s = loop.time()
            now_s = loop.time()
            player.advance(now_s - last_s)
            last_s = now_s
            commands, self._commands = self._commands, []
            self._is_steered.clear()
            before_s = player.time_s
            for command in commands:
                player.control_replay(command)
            if player.time_s != before_s or any(isinstance(command, Seek) for command in commands):
                shown = self._go_to(sink)
            else:
                shown = self._go_on(sink, shown)

    async def order(self, command: OperatorCommand, by: str) -> None:
        """Refuse a command for the robot: the run is over.

        Raises:
            RefusedError: Always.
        """
        raise RefusedError("what is replayed cannot be commanded")

    def control_replay(self, command: ReplayCommand) -> None:
        """Seek, play or pause; takes effect with the next step."""
        if len(self._commands) >= MOST_AT_ONCE:
            del self._commands[0]
        self._commands.append(command)
        self._is_steered.set()

    def _go_to(self, sink: Sink) -> int:
        """Send a place anew, with what came before it; returns how many entries were reported."""
        count = self._recording.count(self._player.time_s)
        first = max(count - HISTORY, 0)
        sink.replay_jumped()
        self._send_position(sink)
        sink.begin(self._recording.frame(first).components)
        entries: Sequence[Any] = self._recording.documents[first:count]
        if entries:
            sink.append_events(EventBatch(entries), first + 1)
        sink.show(self._status(count))
        return count

    def _go_on(self, sink: Sink, shown: int) -> int:
        """Send the entries since the last step to the sink."""
        count = self._recording.count(self._player.time_s)
        if count > shown:
            first = max(shown, count - MOST_AT_ONCE)
            sink.begin(self._recording.frame(first).components)
            entries: Sequence[Any] = self._recording.documents[first:count]
            sink.append_events(EventBatch(entries, first - shown), first + 1)
        self._send_position(sink)
        sink.show(self._status(count))
        return max(count, shown)

    def _send_position(self, sink: Sink) -> None:
        sink.show_position(self._player.time_s, self._player.speed, is_playing=self._player.is_playing)

    def _status(self, count: int) -> Status:
        frame, motion = self._recording.frame(count), self._recording.motion
        return Status(
            time_s=self._player.time_s,
            problem=frame.problem,
            stops=frame.stops,
            components=frame.components,
            communications=frame.communications,
            last=self._recording.last(count),
            progress=self._recording.progress(count, self._player.time_s),
            cancelling=frame.cancelling,
            drive=None if motion is None else motion.drive(self._player.time_s),
        )
