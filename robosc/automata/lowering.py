"""From a checked model to the extended finite automata of its synthesis problem.

Plants stand in one stable order: for each component, in source order, the plants of its messages,
services and actions, then its own behaviour. Events follow the same order: those of the component's
communications, then its taus. Data plants only observe and are left out.
"""

from collections.abc import Iterator

from robosc.automata.plants import communication_plant, component_plant
from robosc.automata.structure import Automaton, Event, EventCondition, InputVariable, System
from robosc.errors import UnsupportedModelError
from robosc.expressions import (
    ArrayType,
    Expression,
    ObjectType,
    PathStep,
    Received,
    Type,
    Unary,
    conjunction,
    is_finite,
    leaves,
    type_text,
)
from robosc.model.structure import (
    EVENT_KINDS,
    ISSUED_KINDS,
    Communication,
    CommunicationKind,
    Component,
    Deployment,
    EventKind,
    Model,
    is_tau,
)


def to_automata(model: Model, deployment: Deployment) -> System:
    """Return the plants and event conditions of a model.

    Args:
        model: A checked robot.
        deployment: Deployment of its supervisor: in a layer, cancel is the caller's own.

    Raises:
        UnsupportedModelError: A synthesis variable takes received data with infinitely many values.
    """
    return System(
        name=model.name,
        events=tuple(_events(model, deployment)),
        automata=tuple(_automata(model)),
        inputs=tuple(_inputs(model)),
        conditions=(*_request_conditions(model), *_cancel_conditions(model, deployment)),
        invariants=tuple(item.condition for item in model.invariants),
    )


def _communications(model: Model) -> Iterator[tuple[Component, tuple[Communication, ...]]]:
    """Every component with its communications."""
    found: dict[str, list[Communication]] = {}
    for item in model.communications:
        found.setdefault(item.component, []).append(item)
    for component in model.components:
        yield component, tuple(found.get(component.name, ()))


def _events(model: Model, deployment: Deployment) -> Iterator[Event]:
    for component, communications in _communications(model):
        for communication in communications:
            for kind in EVENT_KINDS[communication.kind]:
                yield Event(communication.event(kind), _is_controllable(kind, deployment))
        if component.behaviour:
            events = (transition.event for transition in component.behaviour.transitions)
            yield from (Event(event, is_controllable=True) for event in dict.fromkeys(events) if is_tau(event))


def _is_controllable(kind: EventKind, deployment: Deployment) -> bool:
    if kind is EventKind.CANCEL and deployment is Deployment.LAYER:
        return False
    return kind in ISSUED_KINDS


def _automata(model: Model) -> Iterator[Automaton]:
    for component, communications in _communications(model):
        yield from (communication_plant(item) for item in communications)
        if component.behaviour:
            yield component_plant(component.name, component.behaviour)


def _inputs(model: Model) -> Iterator[InputVariable]:
    """Received data that updates of synthesis variables read, by event and then by first use."""
    read: dict[str, dict[tuple[PathStep, ...], None]] = {}
    for component in model.components:
        for event, path in _received(component):
            read.setdefault(event, {})[path] = None
    for _, communications in _communications(model):
        for communication in communications:
            for kind in EVENT_KINDS[communication.kind]:
                for path in read.get(communication.event(kind), ()):
                    yield _input(model, communication, kind, path)


def _received(component: Component) -> Iterator[tuple[str, tuple[PathStep, ...]]]:
    """The event and path of every received datum that a kept update reads."""
    if component.behaviour is None:
        return
    kept = {variable.name for variable in component.behaviour.variables if variable.is_synthesis}
    for transition in component.behaviour.transitions:
        for update in transition.updates:
            if update.variable in kept:
                for leaf in leaves(update.expression):
                    if isinstance(leaf, Received):
                        yield transition.event, leaf.path


def _input(model: Model, communication: Communication, kind: EventKind, path: tuple[PathStep, ...]) -> InputVariable:
    declared = communication.received_type(kind)
    found = None if declared is None else _type_at(model, declared, path)
    if found is None or not is_finite(found):
        text = "no data" if found is None else f"a value of type {type_text(found)}"
        raise UnsupportedModelError(
            f"{communication.event(kind)}: an update that synthesis depends on reads {text} at "
            f"{'.'.join(('value', *map(str, path)))}; synthesis needs finitely many values"
        )
    is_element = any(isinstance(step, int) for step in path)
    return InputVariable(communication.event(kind), path, found, may_be_unknown=is_element)


def _type_at(model: Model, declared: Type, path: tuple[PathStep, ...]) -> Type | None:
    """The type of a part of received data, or None where there is no such part."""
    found = declared
    for step in path:
        match found:
            case ArrayType(element=element) if isinstance(step, int):
                found = element
            case ObjectType(name=name):
                properties = {item.name: item.type for item in model.object(name).properties}
                if step not in properties:
                    return None
                found = properties[str(step)]
            case _:
                return None
    return found


def _request_conditions(model: Model) -> Iterator[EventCondition]:
    for requirement in model.requirements:
        for name in requirement.communications:
            event = model.communication(name).event(EventKind.REQUEST)
            yield EventCondition(event, requirement.condition)


def _cancel_conditions(model: Model, deployment: Deployment) -> Iterator[EventCondition]:
    for communication in model.communications:
        condition = cancel_condition(model, communication, deployment)
        if condition is not None:
            yield EventCondition(communication.event(EventKind.CANCEL), condition)


def cancel_condition(model: Model, communication: Communication, deployment: Deployment) -> Expression | None:
    """Return the condition for a cancel: one of the action's requirements does not hold.

    It is None where a cancel needs nothing: the action has no requirements, or the caller of a layer cancels.
    """
    requirements = model.requirements_on(communication.name)
    if communication.kind is not CommunicationKind.ACTION or deployment is Deployment.LAYER or not requirements:
        return None
    return Unary("not", Unary("holds", conjunction(*(item.condition for item in requirements))))
