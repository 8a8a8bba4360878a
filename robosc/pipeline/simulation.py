"""Simulation by hand: a supervisor's controlled system, event by event, on the reference interpreter.

Whoever simulates plays the robot and the executor: uncontrollable events come with data as the model sees it, and
controllable ones are taken where they are allowed.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from robosc.automata.plants import communication_plant_name
from robosc.certification.supervisor_file import StateInWords
from robosc.errors import RoboscError, UnknownNameError
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.interpreter.received import EnumChoice
from robosc.execution.runtime.protocol import Reading
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
    type_text,
    values,
)
from robosc.expressions.text import automaton_text, expression_text
from robosc.model.findings import did_you_mean
from robosc.model.structure import CommunicationKind, EventKind, Model, is_tau
from robosc.pipeline.conditions import unknown_event
from robosc.pipeline.supervisors import SupervisorLike, supervisor_of
from robosc.tables import html_table


class UnknownEventError(UnknownNameError):
    """An event that the model does not have; the message names the nearest one."""


class EventNotPossibleError(RoboscError, ValueError):
    """An event that cannot happen in the current state; the message says why."""


class DataError(RoboscError, ValueError):
    """Data that an event does not carry; the message says what it carries."""


class _NoData:
    """Placeholder for data that was not given, which is something else than None."""

    def __repr__(self) -> str:
        return "NO_DATA"


NO_DATA = _NoData()


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
        unknown: Parts of the data that were unknown or moved into their range, in words.
    """

    event: str
    data: Mapping[str, Any] = field(hash=False)
    state: StateInWords = field(hash=False)
    provided: Any = field(default=None, hash=False)
    skipped: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.event}: {self.state}"


class Run:
    """A run of the controlled system, from its initial state.

    Args:
        supervisor: Supervisor of the system.
    """

    def __init__(self, supervisor: SupervisorLike) -> None:
        given = supervisor_of(supervisor)
        self._model = given.model
        self._system = InterpretedSystem(given)
        events = given.executable.automata.events
        self._events = {event.name: event.is_controllable for event in events}
        components = {item.name for item in given.model.components}
        self._calls = {
            item.name: automaton_text(communication_plant_name(item), components)
            for item in given.model.communications
            if item.kind in (CommunicationKind.SERVICE, CommunicationKind.ACTION)
        }
        self._history: list[Step] = []
        self._initial = _values(self.state)

    @property
    def events(self) -> tuple[str, ...]:
        """Every event, in source order."""
        return tuple(self._events)

    @property
    def enabled(self) -> tuple[str, ...]:
        """Controllable events that are allowed now, in source order."""
        return tuple(name for name, is_own in self._events.items() if is_own and self._system.enabled(name))

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
        return tuple(self._history)

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
        if event not in self._events:
            raise UnknownEventError(unknown_event(event, self._events))
        if fields and data is not NO_DATA:
            raise DataError(f"the data of '{event}' is given either as one value or as keywords, not as both")
        reading = self._reading(event, fields if fields else data)
        if self._events[event] and not self._system.enabled(event):
            raise EventNotPossibleError(f"'{event}' is not allowed now: {self._obstacle(event)}; {self._allowed()}")
        name, _, kind = event.partition(".")
        is_request = not is_tau(event) and kind == EventKind.REQUEST
        # The data of a request is made of the state before it.
        _, provided = self._system.provide(name) if is_request else (True, None)
        skipped = self._system.step(event, reading)
        if skipped is None:
            raise EventNotPossibleError(f"'{event}' cannot happen now: {self._location(event)}")
        unknown = reading.unknown if reading is not None else ()
        step = Step(event, {} if reading is None else dict(reading.data), self.state, provided, skipped, unknown)
        self._history.append(step)
        return step

    def restart(self) -> None:
        """Back to the initial state, with an empty history."""
        self._system.restart()
        self._history.clear()

    def _reading(self, event: str, data: object) -> Reading | None:
        """The data of an event as the model sees it; None of an event that carries none.

        Raises:
            DataError: The event does not carry such data.
        """
        type_ = _received_type(self._model, event)
        if type_ is None or isinstance(type_, NoneType):
            if data is not NO_DATA:
                raise DataError(f"'{event}' carries no data, and was given {data!r:.100}")
            return None
        raw = None if data is NO_DATA else _Data(self._model, event).value(type_, data, "value")
        return self._system.read(event, raw)

    def _obstacle(self, event: str) -> str:
        """Return the reason why a controllable event is not allowed, in the model's words."""
        name, _, kind = event.partition(".")
        if not is_tau(event) and kind == EventKind.REQUEST:
            components = {item.name for item in self._model.components}
            requirements = self._model.requirements_on(name)
            broken = [
                expression_text(requirement.condition, components)
                for requirement, holds in zip(requirements, self._system.requirements(name), strict=True)
                if not holds
            ]
            if broken:
                return f"it needs {' and '.join(broken)}"
        return f"the behaviours or the supervisor forbid it in {self.state}"

    def _allowed(self) -> str:
        enabled = self.enabled
        return f"allowed are {', '.join(enabled)}" if enabled else "nothing is allowed"

    def _location(self, event: str) -> str:
        name = event.partition(".")[0]
        if name in self._calls:
            return f"{self._calls[name]} is {self._system.location(name)}"
        return f"the behaviours have no transition for it in {self.state}"

    def __repr__(self) -> str:
        count = len(self._history)
        return f"<run of {self._model.name}: {count} step{'s' if count != 1 else ''}; {self._allowed()}>"

    def __str__(self) -> str:
        lines = [f"{number:4}  {': '.join(filter(None, row))}" for number, row in self._rows()]
        return "\n".join([*lines, f"now {self.state}", self._allowed()])

    def __iter__(self) -> Iterator[Step]:
        return iter(self.history)

    def __len__(self) -> int:
        return len(self._history)

    def _repr_html_(self) -> str:
        rows = ((number, *row) for number, row in self._rows())
        return html_table(("", "event", "changes"), rows, caption=f"{self._model.name}: {self._allowed()}")

    def _rows(self) -> Iterator[tuple[int, tuple[str, str]]]:
        """Yield for each step its number, the event with its data, and what it changed."""
        before = self._initial
        for number, step in enumerate(self._history, start=1):
            data = ", ".join(f"{name} = {_shown(value)}" for name, value in step.data.items())
            now = _values(step.state)
            changes = ", ".join(f"{name} = {_shown(value)}" for name, value in now.items() if before[name] != value)
            before = now
            yield number, (f"{step.event} ({data})" if data else step.event, changes)


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


def _received_type(model: Model, event: str) -> Type | None:
    """The declared type of what comes with an event, or None."""
    if is_tau(event):
        return None
    name, _, kind = event.partition(".")
    return model.communication(name).received_type(EventKind(kind))


class _Data:
    """Checks data that a person gives by hand against the types of the model."""

    def __init__(self, model: Model, event: str) -> None:
        self._objects = {item.name: {part.name: part.type for part in item.properties} for item in model.objects}
        self._enums = {item.name: item for item in model.enums}
        self._event = event

    def value(self, type_: Type, given: object, path: str) -> object:
        """A value as the interpreter reads it.

        Args:
            type_: Its declared type.
            given: The value as given.
            path: Its place in the data, for messages.

        Raises:
            DataError: It is no value of that type.
        """
        match type_:
            case ObjectType(name=name):
                return self._object(type_, self._objects[name], given, path)
            case ArrayType(element=element):
                return self._array(type_, element, given, path)
            case EnumType(name=name):
                return self._enum(type_, self._enums[name].source, given, path)
            case BooleanType():
                fits = values.read_boolean(given) is not None
            case IntegerType():
                fits = values.read_whole(given) is not None
            case DoubleType():
                fits = values.read_double(given) is not None
            case StringType():
                fits = values.read_string(given) is not None
            case _:
                fits = False
        if not fits:
            raise self._wrong(type_, given, path)
        return given

    def _object(self, type_: Type, parts: Mapping[str, Type], given: object, path: str) -> object:
        if not isinstance(given, Mapping):
            raise self._wrong(type_, given, path)
        for name in given:
            if name not in parts:
                near = did_you_mean(str(name), parts)
                hint = f"did you mean '{near}'?" if near else f"there are {', '.join(parts)}"
                raise DataError(f"{path} of '{self._event}' has no property '{name}'; {hint}")
        return {name: self.value(parts[name], item, f"{path}.{name}") for name, item in given.items()}

    def _array(self, type_: Type, element: Type, given: object, path: str) -> object:
        if isinstance(given, str | bytes | Mapping):
            raise self._wrong(type_, given, path)
        try:
            elements = list(given)  # type: ignore[call-overload]  # whatever it is, it is asked for its elements
        except TypeError:
            raise self._wrong(type_, given, path) from None
        return [self.value(element, item, f"{path}[{index}]") for index, item in enumerate(elements)]

    def _enum(self, type_: EnumType, source: Type, given: object, path: str) -> object:
        if isinstance(given, str):
            if given in type_.values:
                return EnumChoice(given)
            if not isinstance(source, StringType):
                near = did_you_mean(given, type_.values)
                hint = f"did you mean '{near}'?" if near else f"there are {', '.join(type_.values)}"
                raise DataError(f"{path} of '{self._event}' is {given!r:.100}, which is no {type_text(type_)}; {hint}")
        try:
            return self.value(source, given, path)
        except DataError as error:
            raise DataError(f"{error}, or one of {', '.join(type_.values)}") from None

    def _wrong(self, type_: Type, given: object, path: str) -> DataError:
        parts = self._objects.get(type_.name) if isinstance(type_, ObjectType) else None
        wanted = type_text(type_) + (f" with {', '.join(parts)}" if parts else "")
        return DataError(f"{path} of '{self._event}' is {given!r:.100}, and must be {wanted}")
