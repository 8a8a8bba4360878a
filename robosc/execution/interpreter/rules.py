"""Rules of a supervisor, one for each event: its participants, its conditions, its updates."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from robosc.automata.plants import communication_plant, is_blocking
from robosc.execution.interpreter.functions import (
    Function,
    Path,
    Place,
    State,
    diagram_function,
    function_of,
    holds,
    no_data,
)
from robosc.expressions import DoubleType, IntegerType, Type, Value, domain, values
from robosc.model.received import converted_paths, received_paths, required_parts
from robosc.model.structure import (
    ISSUED_KINDS,
    Behaviour,
    Communication,
    Component,
    Deployment,
    EventKind,
    Model,
    ObjectValue,
    ProvidedValue,
    Transition,
    Variable,
)
from robosc.supervisor import Supervisor


@dataclass(frozen=True, slots=True)
class UpdateRule:
    """`variable := expression`, reading the state before the event."""

    place: Place
    variable: Variable
    function: Function

    def assigned(self, value: Value | None) -> Value | None:
        """Return the value that the variable takes, or None if the update is skipped."""
        match self.variable.type:
            case IntegerType(low=int(low), high=int(high)):
                return values.assignable_integer(value, low, high)  # type: ignore[no-any-return]
            case DoubleType():
                return values.assignable_double(value)  # type: ignore[no-any-return]
            case _:
                return value

    def leaves_range(self, value: Value | None) -> bool:
        """Return True if a synthesis variable would leave its range."""
        return self.variable.is_synthesis and value is not None and self.assigned(value) is None


@dataclass(frozen=True, slots=True)
class TransitionRule:
    """A transition of a behaviour; its target is None if it stays."""

    guard: Function | None
    updates: tuple[UpdateRule, ...]
    target: str | None


@dataclass(frozen=True, slots=True)
class Participant:
    """A component that takes part in an event.

    Attributes:
        name: The component.
        may_block: True if the event is blocked in the states where it writes no transition.
        transitions: Transitions by state: the state's own first, then the behaviour's, each in source order.
    """

    name: str
    may_block: bool
    transitions: dict[str, tuple[TransitionRule, ...]]


@dataclass(frozen=True, slots=True)
class EventRule:
    """Compiled rule of one event.

    Attributes:
        is_controllable: True if it is one that the executor takes by itself.
        plant: Service or action that it belongs to, with its moves, or None for a message or tau.
        participants: Components with the event in their alphabet.
        conditions: Conditions that must be true beside plants and ranges.
        added: Condition that the supervisor adds, or None.
        received: Declared type of its data, or None.
        paths: The parts of its data that are converted.
        required: The parts of its data that cannot be unknown by their types.
    """

    is_controllable: bool
    plant: tuple[str, dict[str, str]] | None
    participants: tuple[Participant, ...]
    conditions: tuple[Function, ...]
    added: Callable[[State], bool] | None
    received: Type | None
    paths: tuple[Path, ...]
    required: tuple[tuple[Path, Type], ...]


@dataclass(frozen=True, slots=True)
class WhenRule:
    """Rule for the messages that count as an incoming message.

    Attributes:
        type: Its declared type.
        paths: The parts of a message that are converted.
        condition: Condition that must be true of them.
    """

    type: Type | None
    paths: tuple[Path, ...]
    condition: Function

    @classmethod
    def of(cls, communication: Communication) -> "WhenRule":
        """The rule of a communication that has a condition."""
        assert communication.when is not None  # noqa: S101  # The caller has seen to that.
        return cls(communication.request, received_paths(communication.when), function_of(communication.when))


def initial_state(model: Model) -> dict[Place, Value]:
    """Locations and variables at the start: of components with a behaviour, of services and actions."""
    state: dict[Place, Value] = {}
    for component in model.components:
        if component.behaviour:
            state[component.name, None] = component.behaviour.initial
            for variable in component.behaviour.variables:
                initial = variable.initial
                state[component.name, variable.name] = (
                    float(initial) if isinstance(variable.type, DoubleType) else initial
                )
    for communication in model.communications:
        plant = communication_plant(communication)
        if len(plant.locations) > 1:
            (state[plant.name, None],) = plant.initial
    return state


def event_rules(supervisor: Supervisor) -> dict[str, EventRule]:
    """The rule of every event, by name."""
    model = supervisor.model
    domains = place_domains(model)
    events: dict[str, EventRule] = {}
    for communication in model.communications:
        for event in communication.events:
            kind = EventKind(event.rpartition(".")[2])
            conditions = _conditions(supervisor, communication, kind)
            events[event] = _event(supervisor, event, kind, communication, conditions, domains)
    for event in model.taus:
        events[event] = _event(supervisor, event, None, None, (), domains)
    return events


def _event(
    supervisor: Supervisor,
    event: str,
    kind: EventKind | None,
    communication: Communication | None,
    conditions: tuple[Function, ...],
    domains: dict[Place, Sequence[Value]],
) -> EventRule:
    model = supervisor.model
    diagram = supervisor.added_condition(event)
    return EventRule(
        is_controllable=kind is None or kind in ISSUED_KINDS,
        plant=None if communication is None else _moves(communication, event),
        participants=tuple(
            _participant(component, component.behaviour, event)
            for component in model.components
            if component.behaviour and any(item.event == event for item in component.behaviour.transitions)
        ),
        conditions=conditions,
        added=None if diagram is None else diagram_function(diagram, domains),
        received=None if communication is None or kind is None else communication.received_type(kind),
        paths=converted_paths(model, event),
        required=required_parts(model, event),
    )


def place_domains(model: Model) -> dict[Place, Sequence[Value]]:
    """All values of each place that an added condition may read."""
    domains: dict[Place, Sequence[Value]] = {}
    for component in model.components:
        if component.behaviour:
            domains[component.name, None] = tuple(state.name for state in component.behaviour.states)
            for variable in component.behaviour.variables:
                if variable.is_synthesis:
                    domains[component.name, variable.name] = domain(variable.type)
    for communication in model.communications:
        plant = communication_plant(communication)
        domains[plant.name, None] = plant.locations
    return domains


def _moves(communication: Communication, event: str) -> tuple[str, dict[str, str]] | None:
    plant = communication_plant(communication)
    if len(plant.locations) == 1:
        return None
    return plant.name, {edge.source: edge.target for edge in plant.edges if edge.event == event}


def _conditions(supervisor: Supervisor, communication: Communication, kind: EventKind) -> tuple[Function, ...]:
    """Requirements: all on a request; for a cancel that one of them does not hold, if there are any."""
    conditions = tuple(
        function_of(requirement.condition) for requirement in supervisor.model.requirements_on(communication.name)
    )
    if kind is EventKind.REQUEST:
        return conditions
    if kind is EventKind.CANCEL and conditions and supervisor.deployment is Deployment.CONTROLLER:
        return (lambda state, data: not all(holds(condition, state) for condition in conditions),)
    return ()


def _participant(component: Component, behaviour: Behaviour, event: str) -> Participant:
    on_event = [item for item in behaviour.transitions if item.event == event]
    variables = {variable.name: variable for variable in behaviour.variables}

    def compiled(transition: Transition) -> TransitionRule:
        return TransitionRule(
            guard=None if transition.guard is None else function_of(transition.guard),
            updates=tuple(
                UpdateRule((component.name, item.variable), variables[item.variable], function_of(item.expression))
                for item in transition.updates
            ),
            target=transition.target,
        )

    everywhere = tuple(compiled(item) for item in on_event if item.source is None)
    return Participant(
        name=component.name,
        may_block=is_blocking(event),
        transitions={
            state.name: (*(compiled(item) for item in on_event if item.source == state.name), *everywhere)
            for state in behaviour.states
        },
    )


def provided_function(provided: ProvidedValue) -> Callable[[State], tuple[bool, Any]]:
    """Provided data as a function: (is known, data)."""
    if not isinstance(provided, ObjectValue):
        function = function_of(provided)

        def single(state: State) -> tuple[bool, Any]:
            value = function(state, no_data)
            return value is not None, value

        return single
    parts = tuple((name, provided_function(value)) for name, value in provided.properties)

    def record(state: State) -> tuple[bool, Any]:
        found = [(name, part(state)) for name, part in parts]
        if not all(is_known for _, (is_known, _) in found):
            return False, None
        return True, {name: value for name, (_, value) in found}

    return record
