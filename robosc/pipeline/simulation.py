"""Simulation by hand: a supervisor's controlled system, event by event, on the reference interpreter.

Whoever simulates plays the robot and the executor: uncontrollable events come with data as the model sees it, and
controllable ones are taken where they are allowed.
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from robosc.automata.plants import communication_plant, communication_plant_name
from robosc.certification.supervisor_file import StateInWords
from robosc.errors import RoboscError, UnknownNameError
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.protocol import Reading
from robosc.explanation.blocked import Requests
from robosc.expressions.text import automaton_text, expression_text
from robosc.model.structure import CommunicationKind
from robosc.pipeline.conditions import unknown_event
from robosc.pipeline.files import FileAccessError, given_path, write_whole
from robosc.pipeline.loading import FileName
from robosc.pipeline.received_data import (
    NO_DATA,
    DataError,
    DataField,
    GivenData,
    RandomData,
    data_fields,
    received_type,
)
from robosc.pipeline.saved_runs import ModelOfTest, event_log, pytest_module
from robosc.pipeline.supervisors import Supervisor, SupervisorLike, supervisor_of
from robosc.pipeline.walking import ALL_TROUBLE, Trouble, TroubleKind, Walker
from robosc.tables import html_table

__all__ = ["NO_DATA", "DataError", "EventNotPossibleError", "Run", "Step", "UnknownEventError", "simulate"]


class UnknownEventError(UnknownNameError):
    """An event that the model does not have; the message names the nearest one."""


class EventNotPossibleError(RoboscError, ValueError):
    """An event that cannot happen in the current state; the message says why."""


@dataclass(frozen=True, slots=True)
class Step:
    """One event of a run.

    Attributes:
        event: The event.
        data: Data that it carried as the model saw it, by name (`value.front`); None where a part was unknown.
        state: The state that it led to.
        provided: Data that a request sends, by the model's `provide`; None where the middleware's default is sent, or
            where it is unknown.
        skipped: Variables that kept their value, because what they were to take was unknown.
        unknown: Descriptions of what was unknown or moved into its range: parts of the data, what a request sends.
        is_controllable: True if it is one that the controller takes by itself.
        given: Data as it was given.
    """

    event: str
    data: Mapping[str, Any] = field(hash=False)
    state: StateInWords = field(hash=False)
    provided: Any = field(default=None, hash=False)
    skipped: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    is_controllable: bool = False
    given: Any = field(default=NO_DATA, hash=False)

    def __str__(self) -> str:
        return f"{self.event}: {self.state}"


class Run:
    """A run of the controlled system, from its initial state.

    Args:
        supervisor: Supervisor of the system.
    """

    def __init__(self, supervisor: SupervisorLike) -> None:
        given = self._supervisor = supervisor_of(supervisor)
        self._model = given.model
        self._system = InterpretedSystem(given)
        self._requests = Requests(given.executable, given.added)
        self._request_events = frozenset(self._requests.events)
        events = given.executable.automata.events
        self._events = {event.name: event.is_controllable for event in events}
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
        # The steps, each with the state before it; and those that were taken back, the last one first.
        self._taken: list[tuple[Step, Any]] = []
        self._undone: list[tuple[Step, Any]] = []
        self._initial = self.state
        self._walker = Walker(self, self._system, given.model, RandomData(given.model))

    @property
    def supervisor(self) -> Supervisor:
        """The supervisor of the system."""
        return self._supervisor

    @property
    def initial(self) -> StateInWords:
        """The initial state."""
        return self._initial

    @property
    def events(self) -> tuple[str, ...]:
        """Every event, in source order."""
        return tuple(self._events)

    @property
    def enabled(self) -> tuple[str, ...]:
        """Controllable events that are allowed now, in source order."""
        return tuple(name for name, is_own in self._events.items() if is_own and self._system.enabled(name))

    @property
    def possible(self) -> tuple[str, ...]:
        """Every event that can happen now, in source order: `enabled`, and those of the environment."""
        return tuple(filter(self._can_happen, self._events))

    @property
    def is_marked(self) -> bool:
        """True if the state counts as completed: every component, service and action is in a marked location."""
        state = self.state
        places = {**state.components, **state.communications}
        return all(place in self._marked[name] for name, place in places.items())

    @property
    def state(self) -> StateInWords:
        """The current state: of components with all their variables, of services and of actions."""
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

    @property
    def history(self) -> tuple[Step, ...]:
        """The events so far."""
        return tuple(step for step, _ in self._taken)

    @property
    def undone(self) -> tuple[Step, ...]:
        """The events that were taken back, in the order in which `redo` takes them again."""
        return tuple(step for step, _ in reversed(self._undone))

    def event_called(self, name: str) -> str:
        """The event that a name stands for: itself, or of a message, service or action its first one.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
        """
        first = {item.name: item.events[0] for item in self._model.communications}
        if name not in first and name not in self._events:
            raise UnknownEventError(unknown_event(name, (*self._events, *first)))
        return first.get(name, name)

    def is_controllable(self, event: str) -> bool:
        """Return True if the controller takes an event by itself.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
        """
        return self._events[self._known(event)]

    def data_fields(self, event: str) -> tuple[DataField, ...]:
        """The parts of the data that an event carries, which can be given with it.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
        """
        return data_fields(self._model, self._known(event))

    @property
    def locations(self) -> dict[str, str]:
        """Location of each service and action, by its name."""
        return {name: self._system.location(name) for name in self._calls}

    def hindrances(self) -> dict[str, tuple[str, ...]]:
        """Every event that cannot happen now, with the reasons why not, one sentence each."""
        blocked = self._requests.availability(self._system.state(), self.locations).blocked
        found = {item.event: item.why for item in blocked}
        return {
            event: found[event] if event in found else tuple(self._hindrances(event))
            for event in self._events
            if not self._can_happen(event)
        }

    def reasons(self, event: str) -> tuple[str, ...]:
        """Return the reasons why an event cannot happen now, one sentence each; none if it can.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
        """
        if self._can_happen(self._known(event)):
            return ()
        if event in self._request_events:
            blocked = self._requests.availability(self._system.state(), self.locations).blocked
            return next(item.why for item in blocked if item.event == event)
        return tuple(self._hindrances(event))

    def step(self, event: str, data: object = NO_DATA, /, **fields: object) -> Step:
        """Take an event; where that is not possible, nothing changes.

        Data is what the event carries as the model declares it: a value, or the properties of an object as keywords or
        as a mapping. What is left out is unknown, as it would be to the robot. Of an enum either one of its values is
        given, or what it is made of: then its rules decide. A text that names a value is that value.

        Args:
            event: The event, such as `scan.response` or `move.request`.
            data: Data that it carries.
            fields: Properties of the object that it carries, instead of `data`.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
            EventNotPossibleError: It cannot happen in the current state; the message says why.
            DataError: It does not carry such data.
        """
        self._known(event)
        if fields and data is not NO_DATA:
            raise DataError(f"the data of '{event}' is given either as one value or as keywords, not as both")
        given = fields if fields else data
        reading = self._reading(event, given)
        if not self._can_happen(event):
            verb = "is not allowed" if self._events[event] else "cannot happen"
            raise EventNotPossibleError(f"'{event}' {verb} now: {'; '.join(self.reasons(event))}; {self._allowed()}")
        unknown = reading.unknown if reading is not None else ()
        provided = None
        if event in self._request_events:
            # The data of a request is made of the state before it.
            is_known, provided = self._system.provide(event.partition(".")[0])
            if not is_known:
                unknown = (*unknown, "what it sends is unknown, and an executor would not issue it")
        before = self._system.snapshot()
        skipped = self._system.step(event, reading) or ()
        data_seen = {} if reading is None else dict(reading.data)
        step = Step(event, data_seen, self.state, provided, skipped, unknown, self._events[event], given)
        self._taken.append((step, before))
        self._undone.clear()
        return step

    def undo(self) -> Step | None:
        """Take back the last event, and return it; None if there is none."""
        if not self._taken:
            return None
        step, before = self._taken.pop()
        self._undone.append((step, self._system.snapshot()))
        self._system.restore(before)
        return step

    def redo(self) -> Step | None:
        """Take the event again that was taken back last, and return it; None if there is none."""
        if not self._undone:
            return None
        step, after = self._undone.pop()
        self._taken.append((step, self._system.snapshot()))
        self._system.restore(after)
        return step

    def restart(self) -> None:
        """Back to the initial state, with an empty history."""
        self._system.restart()
        self._taken.clear()
        self._undone.clear()
        self._walker.forget()

    def walk(self, steps: int, seed: int = 0) -> tuple[Step, ...]:
        """Take events by chance, as an executor could in some world; ends early where nothing can happen.

        Resets and tau transitions are taken as soon as they are allowed, and nothing is requested before the first
        message of a sensor with a `max_age`, as an executor does. Otherwise each event that can happen is as likely
        as the others, with data that is known, and near to the numbers that the model names.

        Args:
            steps: Number of events.
            seed: Seed of the chance: the same one leads the same way.
        """
        return self._walker.walk(steps, seed)

    def walk_until_trouble(
        self, steps: int = 1000, seed: int = 0, kinds: Collection[TroubleKind] = ALL_TROUBLE
    ) -> Trouble | None:
        """Walk by chance until there is trouble, and return it; None if there was none.

        What was found stays told: the next walk of this run goes on to something else.

        Args:
            steps: Most events to take.
            seed: Seed of the chance.
            kinds: Kinds of trouble to look for.
        """
        return self._walker.walk_until_trouble(steps, seed, kinds)

    def save(self, file: FileName, model: ModelOfTest | None = None) -> Path:
        """Write the events so far, an event log (`.jsonl`) or a test for pytest (`.py`); returns the file's path.

        The log's clock counts the events, a second each. The test leads a run through the same events, and compares
        what is enabled and the state after each.

        Args:
            file: File to write.
            model: Model that the test is to load; needed for a test alone.

        Raises:
            FileAccessError: The file cannot be written, or its name ends in something else.
        """
        path = given_path(file)
        if path.suffix == ".jsonl":
            text = event_log(self)
        elif path.suffix == ".py" and model is not None:
            text = pytest_module(self, model, path)
        else:
            ends = "in .jsonl (an event log) or .py (a test)" if model is not None else "in .jsonl, as event logs do"
            raise FileAccessError(f"{path}: the name of a saved run ends {ends}")
        write_whole(path, text.encode())
        return path

    def _known(self, event: str) -> str:
        """The event, which there is.

        Raises:
            UnknownEventError: There is not.
        """
        if event not in self._events:
            raise UnknownEventError(unknown_event(event, self._events))
        return event

    def _can_happen(self, event: str) -> bool:
        return self._system.enabled(event) if self._events[event] else self._system.is_possible(event)

    def _reading(self, event: str, data: object) -> Reading | None:
        """The data of an event as the model sees it; None of an event that carries none.

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

    def _hindrances(self, event: str) -> Iterator[str]:
        """Yield the reasons why an event that is no request cannot happen."""
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

    def _allowed(self) -> str:
        enabled = self.enabled
        return f"allowed are {', '.join(enabled)}" if enabled else "nothing is allowed"

    def __repr__(self) -> str:
        count = len(self._taken)
        return f"<run of {self._model.name}: {count} step{'s' if count != 1 else ''}; {self._allowed()}>"

    def __str__(self) -> str:
        lines = [f"{number:4}  {': '.join(filter(None, row))}" for number, row in self._rows()]
        return "\n".join([*lines, f"now {self.state}", self._allowed()])

    def __iter__(self) -> Iterator[Step]:
        return iter(self.history)

    def __len__(self) -> int:
        return len(self._taken)

    def _repr_html_(self) -> str:
        rows = ((number, *row) for number, row in self._rows())
        return html_table(("", "event", "changes"), rows, caption=f"{self._model.name}: {self._allowed()}")

    def _rows(self) -> Iterator[tuple[int, tuple[str, str]]]:
        """Yield for each step its number, the event with its data, and what it changed."""
        before = self._initial
        for number, step in enumerate(self.history, start=1):
            yield number, (event_text(step), changes_text(before, step.state))
            before = step.state


def event_text(step: Step) -> str:
    """An event with the data that came with it: `level.response (value = 3)`."""
    data = ", ".join(f"{name} = {_shown(value)}" for name, value in step.data.items())
    return f"{step.event} ({data})" if data else step.event


def changes_text(before: StateInWords, after: StateInWords) -> str:
    """Changes between two states: `Base = driving, Base.charges = 2`."""
    old = _values(before)
    return ", ".join(f"{name} = {_shown(value)}" for name, value in _values(after).items() if old[name] != value)


def _values(state: StateInWords) -> dict[str, Any]:
    """Every part of a state by its name."""
    return {**state.components, **state.variables, **state.communications}


def _shown(value: object) -> str:
    if value is None:
        return "unknown"
    return str(value).lower() if isinstance(value, bool) else str(value)


def simulate(supervisor: SupervisorLike) -> Run:
    """Return a run of the system that a supervisor controls, to be led by hand.

    Args:
        supervisor: A supervisor that was made, the path of its file or its bytes.

    Raises:
        FileAccessError: The file cannot be read.
        InvalidSupervisorError: It is no supervisor.
    """
    return Run(supervisor)
