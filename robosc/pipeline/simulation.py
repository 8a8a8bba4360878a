"""Manual simulation: a supervisor's controlled system, event by event, on the reference interpreter.

The user takes the part of the robot and of the executor: uncontrollable events carry data in the form of the model, and
controllable events are taken only if they are allowed.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from random import Random
from typing import Any, overload

from robosc.automata.plants import communication_plant, communication_plant_name
from robosc.certification.supervisor_file import StateInWords
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.protocol import Reading
from robosc.explanation.blocked import Requests
from robosc.expressions import Value
from robosc.expressions.text import automaton_text, expression_text
from robosc.model.structure import CommunicationKind, Deployment, EventKind, Model, is_tau
from robosc.pipeline.cancelled_goals import NONE, GoalWatch, WatchedGoals, cancelling
from robosc.pipeline.conditions import unknown_event
from robosc.pipeline.files import FileAccessError, FileName, given_path, write_whole
from robosc.pipeline.manual_run import ManualRun, UnknownEventError
from robosc.pipeline.missions import MissionProgress, progress, visits_made
from robosc.pipeline.received_data import (
    NO_DATA,
    DataError,
    DataField,
    GivenData,
    RandomData,
    data_fields,
    one_datum,
    received_type,
)
from robosc.pipeline.saved_runs import ModelOfTest, pytest_module
from robosc.pipeline.steps import Step
from robosc.pipeline.supervisors import Supervisor, SupervisorLike, supervisor_of
from robosc.pipeline.system_runs import SystemRun
from robosc.pipeline.systems import SystemSupervisor
from robosc.pipeline.walking import Walker, WalkFinding, WalkFindingKind


class Run(ManualRun):
    """A run of a robot under its supervisor, from its initial state.

    Args:
        supervisor: Supervisor of the system.
    """

    def __init__(self, supervisor: SupervisorLike) -> None:
        given = self._supervisor = supervisor_of(supervisor)
        self._model = given.model
        self._system = InterpretedSystem(given)
        self._requests = Requests(given.executable, given.added)
        self._request_events = frozenset(self._requests.events)
        self._components = frozenset(item.name for item in given.model.components)
        self._calls = {
            item.name: automaton_text(communication_plant_name(item), self._components)
            for item in given.model.communications
            if item.kind in (CommunicationKind.SERVICE, CommunicationKind.ACTION)
        }
        self._marked = {
            **{
                item.name: {state.name for state in item.behaviour.states if state.is_marked}
                for item in given.model.components
                if item.behaviour
            },
            **{
                name: set(communication_plant(given.model.communication(item)).marked)
                for item, name in self._calls.items()
            },
        }
        # The request that the strategy chooses, and which goals are true, as of the last stable state.
        self._chosen: str | None = None
        self._reached: tuple[bool, ...] = ()
        self._watch = GoalWatch(self._system, given.model)
        self._goals_watched: WatchedGoals = NONE
        super().__init__(
            given.model.name, {event.name: event.is_controllable for event in given.executable.automata.events}
        )
        self._observe()

    @property
    def supervisor(self) -> Supervisor:
        """The supervisor of the system."""
        return self._supervisor

    @property
    def has_strategy(self) -> bool:
        """True if the supervisor has a strategy, which reaches the goals and visits of its model."""
        return self._supervisor.strategy is not None

    @property
    def chosen(self) -> str | None:
        """Request that the strategy chooses now; None where it waits, and where there is no strategy.

        Each stable state counts as a decision. Before silent steps are taken, it waits.
        """
        return self._chosen

    @property
    def reached(self) -> tuple[bool, ...]:
        """For each goal True if it counts as come true in the last stable state; nothing without a strategy."""
        return self._reached

    @property
    def missions(self) -> tuple[MissionProgress, ...]:
        """Progress of each mission as of the last stable state; nothing without a strategy."""
        return tuple(map(progress, self._model.missions, self._system.missions()))

    @property
    def cancelling(self) -> tuple[str, ...]:
        """Actions whose goal an executor would be cancelling: it has asked for that, and the goal has not ended.

        The world chooses the end: as cancelled, where the supervisor allows that event, succeeded, or with an error.
        """
        return cancelling(self._goals_watched)

    @property
    def is_marked(self) -> bool:
        """True if the state is marked: every component, service and action is in a marked location."""
        state = self.state
        places = {**state.components, **state.communications}
        return all(place in self._marked[name] for name, place in places.items())

    @property
    def state(self) -> StateInWords:
        """The current state of components, with all their variables, of services and of actions."""
        found = self._system.state()
        return StateInWords(
            components={name: str(values["state"]) for name, values in found.items()},
            variables={
                f"{name}.{variable}": value
                for name, values in found.items()
                for variable, value in values["variables"].items()
            },
            communications={name: self._system.location(item) for item, name in self._calls.items()},
        )

    def event_called(self, name: str) -> str:
        """The event of a name: the event itself, or the first event of a message, service or action.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
        """
        first = {item.name: item.events[0] for item in self._model.communications}
        if name not in first and name not in self._events:
            raise UnknownEventError(unknown_event(name, (*self._events, *first)))
        return first.get(name, name)

    def data_fields(self, event: str) -> tuple[DataField, ...]:
        """The parts of the data of an event that a caller can give.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
        """
        return data_fields(self._model, self._require_event(event))

    @property
    def locations(self) -> dict[str, str]:
        """Location of each service and action, by its name."""
        return {name: self._system.location(name) for name in self._calls}

    def blocked(self) -> dict[str, tuple[str, ...]]:
        """Every event that cannot happen now, with the reasons, one sentence each."""
        blocked = self._requests.availability(self._system.state(), self.locations).blocked
        found = {item.event: item.why for item in blocked}
        return {
            event: found[event] if event in found else tuple(self._explained(event))
            for event in self._events
            if not self._can_happen(event)
        }

    def step(self, event: str, data: object = NO_DATA, /, **fields: object) -> Step:
        """Take an event; if that is not possible, nothing changes.

        The data has the type that the model declares: it is a value, or the properties of an object, as keywords or as
        a mapping. A property that is left out is unknown, as it would be to the robot. For an enum, give one of its
        values, or a value of its source type, which its rules convert. A text that names a value of the enum is that
        value.

        Args:
            event: The event, such as `scan.response` or `move.request`.
            data: Data that it carries.
            fields: Properties of the object that it carries, instead of `data`.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
            EventNotPossibleError: The event cannot happen in the current state; the message says why.
            DataError: The event does not carry such data.
        """
        self._require_event(event)
        given = one_datum(event, data, fields)
        reading = self._reading(event, given)
        self._require_possible(event)
        unknown = reading.unknown if reading is not None else ()
        provided = None
        if event in self._request_events:
            # The data of a request is made of the state before it.
            is_known, provided = self._system.provide(event.partition(".")[0])
            if not is_known:
                unknown = (*unknown, "what it sends is unknown, and an executor would not issue it")
        before = self._snapshot()
        skipped = self._system.step(event, reading) or ()
        data_seen = {} if reading is None else dict(reading.data)
        reached, visits = self._observe()
        asked, self._goals_watched = self.cancelling, self._watch.after(self._goals_watched)
        new = tuple(action for action in self.cancelling if action not in asked)
        state, is_own = self.state, self._events[event]
        step = Step(
            event, data_seen, state, provided, skipped, unknown, is_own, given, reached, self._chosen, visits, new
        )
        return self._take(step, before)

    def again(self) -> "Run":
        """Return a run of the same supervisor, from its initial state."""
        return Run(self._supervisor)

    def save(self, file: FileName, model: ModelOfTest | None = None) -> Path:
        """Write the events so far as an event log (`.jsonl`) or a test for pytest (`.py`); return the file's path.

        The log has one second for each event. The test takes the same events, and compares the enabled events and the
        state after each one.

        Args:
            file: File to write.
            model: Model that the test loads; needed only for a test.

        Raises:
            FileAccessError: The file cannot be written, or its name has another ending.
        """
        path = given_path(file)
        if model is None or path.suffix == ".jsonl":
            return super().save(path)
        if path.suffix != ".py":
            raise FileAccessError(f"{path}: the name of a saved run ends in .jsonl (an event log) or .py (a test)")
        write_whole(path, pytest_module(self, model, path).encode())
        return path

    def _can_happen(self, event: str) -> bool:
        return self._system.enabled(event) if self._events[event] else self._system.is_possible(event)

    def _why_not(self, event: str) -> tuple[str, ...]:
        if event in self._request_events:
            blocked = self._requests.availability(self._system.state(), self.locations).blocked
            return next(item.why for item in blocked if item.event == event)
        return tuple(self._explained(event))

    def _snapshot(self) -> Any:
        return self._system.snapshot(), self._reached, self._chosen, self._goals_watched

    def _restore(self, snapshot: Any) -> None:
        system, self._reached, self._chosen, self._goals_watched = snapshot
        self._system.restore(system)

    def _begin(self) -> None:
        self._system.restart()
        self._reached = ()
        self._goals_watched = NONE
        self._observe()

    def _observe(self) -> tuple[tuple[int, ...], tuple[str, ...]]:
        """Take in the state for the strategy, if it is stable; return goals that have come true, and visits made."""
        self._chosen = None
        if not self.has_strategy or not self._system.is_stable():
            return (), ()
        before, places = self._reached, self._system.missions()
        self._system.observe()
        self._reached = self._system.reached()
        number = self._system.choose()
        # Events of one message that are taken one by one can lead where no whole message does. The strategy knows
        # nothing about such states, and its choice need not be enabled.
        if number is not None and self._system.enabled(self._requests.events[number]):
            self._chosen = self._requests.events[number]
        pairs = zip(self._reached, before or [False] * len(self._reached), strict=True)
        moves = zip(self._model.missions, places, self._system.missions(), strict=True)
        return (
            tuple(place for place, (is_true, was_true) in enumerate(pairs, start=1) if is_true and not was_true),
            tuple(visit for mission, was, now in moves for visit in visits_made(mission, was, now)),
        )

    def _make_walker(self) -> Walker:
        return ModelWalker(self, self._system, self._model, RandomData(self._model))

    def _reading(self, event: str, data: object) -> Reading | None:
        """The data of an event in the form of the model; None if the event carries none.

        Raises:
            DataError: The event does not carry such data.
        """
        type_ = received_type(self._model, event)
        if type_ is None:
            if data is not NO_DATA:
                raise DataError(f"'{event}' carries no data, and was given {data!r:.100}")
            return None
        raw = None if data is NO_DATA else GivenData(self._model, event).value(type_, data)
        return self._system.read(event, raw)

    def _explained(self, event: str) -> Iterator[str]:
        """Yield the reasons why an event other than a request cannot happen."""
        found = self._supervisor.executable.events[event]
        if found.moves is not None:
            name = event.partition(".")[0]
            location = self._system.location(name)
            if location not in found.moves.targets:
                yield f"{self._calls[name]} is in {location}, not in {' or '.join(found.moves.targets)}"
                return
        for part in found.participants:
            place = self.state.components[part.component]
            if part.may_block and place not in part.taken:
                yield f"{part.component} is in {place}, not in {' or '.join(part.taken)}"
                return
            guard, changes = (
                (part.taken[place].guard, part.taken[place].target) if found.kind is None else (None, place)
            )
            if changes in (None, place) and found.kind is None:
                yield "it would change nothing"
                return
            if guard is not None and not self._system.is_possible(event):
                yield f"its condition {expression_text(guard, self._components)} does not hold"
                return
        if not self._system.is_possible(event):
            yield "it would take a variable out of its range"
        elif found.requirements and all(self._system.requirements(event.partition(".")[0])):
            yield "its requirements hold, and a controller cancels only when one of them does not"
        else:
            yield "the supervisor forbids it, because of what can follow"


class ModelWalker(Walker):
    """Walker of a robot's run: takes what an executor could in some world.

    Args:
        run: The run that it leads.
        system: The system of that run.
        model: Its model.
        data: Data that the environment sends.
    """

    def __init__(self, run: Run, system: InterpretedSystem, model: Model, data: RandomData) -> None:
        super().__init__(run)
        self._run: Run = run
        self._system = system
        self._data = data
        self._identifiers = {event: item.identifier for item in model.communications for event in item.events}
        self._sensors = {item.identifier for item in model.communications if item.max_age is not None}

    def _candidates(self) -> Iterator[str]:
        """Yield the events that an executor and its environment could have happen now."""
        silent = self._system.enabled_silent()
        if silent is None and self.follows_strategy:
            silent = self._system.due_cancel()
        if silent is not None:
            yield silent
            return
        possible = self._run.possible
        if self.follows_strategy:
            possible = tuple(event for event in possible if not self._run.is_controllable(event))
            if self._run.chosen is not None:
                # The world and the controller are as likely to have their turn.
                possible += (self._run.chosen,) * max(1, len(possible))
        is_deaf = self._is_deaf()
        for event in possible:
            if not (is_deaf and _is_request(event)) and self._may_end(event):
                yield event

    def _may_end(self, event: str) -> bool:
        """Return False for a cancel that no controller has asked for; the caller of a layer may ask at any time."""
        name, _, kind = event.rpartition(".")
        is_own = self._run.supervisor.deployment is Deployment.CONTROLLER
        return not is_own or is_tau(event) or kind != EventKind.CANCEL or name in self._run.cancelling

    def _is_deaf(self) -> bool:
        """Return True if a sensor with a `max_age` has sent no message yet."""
        silent = set(self._sensors)
        for step in self._run.history if silent else ():
            silent.discard(self._identifiers.get(step.event, ""))
            if not silent:
                break
        return bool(silent)

    def _forbidden(self) -> Iterator[str]:
        """Yield the requests that the behaviours could do and that are not enabled."""
        if self._system.enabled_silent() is None and not self.follows_strategy:
            for event in self._run.events:
                if _is_request(event) and self._system.is_possible(event) and not self._system.enabled(event):
                    yield event

    def _is_issued(self, event: str) -> bool:
        """Return False for a request whose data is unknown."""
        return not _is_request(event) or self._system.provide(event.partition(".")[0])[0]

    def _take(self, event: str, dice: Random) -> Step:
        return self._run.step(event, self._data.draw(event, dice))

    def _at_event(self, event: str, count: int) -> WalkFinding | None:
        if not _is_request(event):
            return None
        if not self._system.enabled(event):
            return WalkFinding(WalkFindingKind.BLOCKED, event, self._run.reasons(event), count)
        if not self._is_issued(event):
            why = "what it sends is unknown, so that it is not issued"
            return WalkFinding(WalkFindingKind.UNKNOWN, event, (why,), count)
        return None


def _is_request(event: str) -> bool:
    return not is_tau(event) and event.rpartition(".")[2] == EventKind.REQUEST


@overload
def simulate(supervisor: SystemSupervisor, *, initial: Mapping[str, Value] | None = None) -> SystemRun: ...


@overload
def simulate(supervisor: SupervisorLike) -> Run: ...


def simulate(
    supervisor: SupervisorLike | SystemSupervisor, *, initial: Mapping[str, Value] | None = None
) -> Run | SystemRun:
    """Return a run of the system that a supervisor controls, for manual steps.

    Args:
        supervisor: Supervisor of a model or of automata; for a model also the path of its file, or the file's bytes.
        initial: Parts of the initial state, for automata with several initial states, such as `{"Machine": "idle"}`;
            None if there is only one.

    Raises:
        FileAccessError: The file cannot be read.
        InvalidSupervisorError: The file holds no supervisor.
        ChoiceError: The automata have several initial states, or none that `initial` describes.
        TypeError: The argument is no supervisor, or `initial` is given for a model, which has one initial state.
    """
    if isinstance(supervisor, SystemSupervisor):
        return SystemRun(supervisor, initial)
    if initial is not None:
        raise TypeError("initial= chooses among the states in which automata may begin: a robot begins in one state")
    return Run(supervisor)
