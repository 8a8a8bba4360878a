"""The executable system: everything that a model does, event by event, as one value.

The automata of synthesis leave out code-only variables, and the order in which an executor tries transitions. The
executable system has both, computed once: which transition each component takes in each of its states, how
services and actions move, and which requirements an event needs. Generators, the explanation of blocked requests, the
replay of logs and the properties of the controller read it. The interpreter in `robosc.execution` does not read it,
because it is the reference that the others are compared with.
"""

from collections.abc import Mapping
from functools import cached_property

import msgspec

from robosc.automata.goal_memory import Obligations, obligations, remembering
from robosc.automata.lowering import cancel_condition, to_automata
from robosc.automata.plants import PLANT_LOCATIONS, communication_plant, is_blocking
from robosc.automata.structure import System
from robosc.expressions import Expression, Type
from robosc.model.structure import (
    EVENT_KINDS,
    ISSUED_KINDS,
    Behaviour,
    Communication,
    CommunicationKind,
    Component,
    Deployment,
    EventKind,
    Model,
    Requirement,
    Transition,
)

CALLED_KINDS = frozenset(PLANT_LOCATIONS)
"""The kinds of communication whose plant has more than one location."""


class Moves(msgspec.Struct, frozen=True):
    """Moves of the plant of a service or an action on one event.

    Attributes:
        plant: Name of the plant, such as `service calibrate`.
        targets: The location that each location leads to; those from which the event is impossible are left out.
    """

    plant: str
    targets: Mapping[str, str]

    @property
    def sources(self) -> tuple[str, ...]:
        """The locations from which the event is possible."""
        return tuple(self.targets)

    @property
    def target(self) -> str | None:
        """The location that the event leads to; None where it stays."""
        found = {target for source, target in self.targets.items() if target != source}
        return found.pop() if found else None


class Participant(msgspec.Struct, frozen=True):
    """A component whose behaviour mentions an event.

    Attributes:
        component: The component.
        behaviour: Its behaviour.
        may_block: True if the event is impossible in the states where no transition is taken.
        taken: The transition that an executor takes, by state: the state's own before the behaviour's, then source
            order. States without one are left out. A tau is taken only where its guard is true.
    """

    component: str
    behaviour: Behaviour
    may_block: bool
    taken: Mapping[str, Transition]

    @property
    def branches(self) -> tuple[tuple[tuple[str, ...], Transition], ...]:
        """The states in which each transition is taken, and the transition."""
        found: dict[int, tuple[list[str], Transition]] = {}
        for state, transition in self.taken.items():
            found.setdefault(id(transition), ([], transition))[0].append(state)
        return tuple((tuple(states), transition) for states, transition in found.values())


class ExecutableEvent(msgspec.Struct, frozen=True):
    """An event, with all that happens on it.

    Attributes:
        name: The event's name.
        communication: Its communication; None for a tau.
        kind: Its kind; None for a tau.
        is_issued: True if the executor issues it (a request, cancel, reset or tau); the rest is received. In a layer
            a cancel is issued on the caller's behalf, which makes it uncontrollable there.
        received: Type of the data that it carries to the controller, or None.
        moves: Moves of its service or action; None for a message or tau.
        participants: The components whose behaviours mention it, in source order.
        requirements: The requirements on its communication; empty for any event but a request or a cancel of the
            executor's own.
        needs: The conditions that they make: of a request that of each, of a cancel that one of them does not hold.
    """

    name: str
    communication: Communication | None
    kind: EventKind | None
    is_issued: bool
    received: Type | None
    moves: Moves | None
    participants: tuple[Participant, ...]
    requirements: tuple[Requirement, ...]
    needs: tuple[Expression, ...]


class ExecutableSystem:
    """Executable system of a model in a deployment.

    Args:
        model: A checked robot.
        deployment: Deployment of its supervisor.
    """

    def __init__(self, model: Model, deployment: Deployment) -> None:
        self.model = model
        self.deployment = deployment

    @cached_property
    def automata(self) -> System:
        """The plants and requirements of synthesis (UnsupportedModelError as `to_automata`)."""
        return to_automata(self.model, self.deployment)

    @cached_property
    def executed_automata(self) -> System:
        """The same with those transitions only that an executor takes; `automata` itself if that is all of them."""
        components = tuple(map(self._executed, self.model.components))
        if all(mine is given for mine, given in zip(components, self.model.components, strict=True)):
            return self.automata
        return to_automata(msgspec.structs.replace(self.model, components=components), self.deployment)

    @cached_property
    def obligations(self) -> Obligations:
        """The goals and assumptions of the model, with the memory that judging them needs."""
        return obligations(self)

    @cached_property
    def remembering_automata(self) -> System:
        """The executed automata with that memory beside them."""
        return remembering(self.executed_automata, self.obligations.places)

    @cached_property
    def events(self) -> Mapping[str, ExecutableEvent]:
        """Every event by name: of the communications in source order, then the taus."""
        found: dict[str, ExecutableEvent] = {}
        for communication in self.model.communications:
            plant = communication_plant(communication)
            for kind in EVENT_KINDS[communication.kind]:
                name = communication.event(kind)
                targets = {edge.source: edge.target for edge in plant.edges if edge.event == name}
                requirements, needs = self._requirements(communication, kind)
                found[name] = ExecutableEvent(
                    name,
                    communication,
                    kind,
                    kind in ISSUED_KINDS,
                    communication.received_type(kind),
                    Moves(plant.name, targets) if communication.kind in CALLED_KINDS else None,
                    self._participants.get(name, ()),
                    requirements,
                    needs,
                )
        for name in self.model.taus:
            participants = self._participants[name]
            found[name] = ExecutableEvent(name, None, None, True, None, None, participants, (), ())
        return found

    @cached_property
    def issued(self) -> tuple[str, ...]:
        """The events that the executor issues: requests, cancels and resets in source order, then taus."""
        return tuple(event.name for event in self.events.values() if event.is_issued)

    @cached_property
    def received(self) -> tuple[str, ...]:
        """The events of the environment, in source order."""
        return tuple(event.name for event in self.events.values() if not event.is_issued)

    @cached_property
    def requests(self) -> tuple[str, ...]:
        """The events of requests, in source order."""
        return tuple(event.name for event in self.events.values() if event.kind is EventKind.REQUEST)

    @cached_property
    def batches(self) -> tuple[tuple[str, ...], ...]:
        """The events of each step of the environment: messages on one identifier together, every other event alone."""
        topics: dict[str, tuple[str, ...]] = {}
        others: list[tuple[str, ...]] = []
        uncontrollable = {event.name for event in self.automata.events if not event.is_controllable}
        for event in self.events.values():
            if event.communication and event.communication.kind is CommunicationKind.OUTGOING_MESSAGE:
                identifier = event.communication.identifier
                topics[identifier] = (*topics.get(identifier, ()), event.name)
            elif event.name in uncontrollable:
                others.append((event.name,))
        return (*topics.values(), *others)

    @cached_property
    def behaviours(self) -> tuple[tuple[str, Behaviour], ...]:
        """Components that have a behaviour, in source order, with it."""
        return tuple((item.name, item.behaviour) for item in self.model.components if item.behaviour)

    @cached_property
    def resets_and_taus(self) -> tuple[str, ...]:
        """The silent steps that an executor takes whenever they are enabled, in its order."""
        resets = (item.event(EventKind.RESET) for item in self.model.communications if item.kind in CALLED_KINDS)
        return (*resets, *self.model.taus)

    @cached_property
    def _participants(self) -> Mapping[str, tuple[Participant, ...]]:
        found: dict[str, list[Participant]] = {}
        for component, behaviour in self.behaviours:
            for event, taken in _transitions_by_event(behaviour).items():
                participant = Participant(component, behaviour, is_blocking(event), taken)
                found.setdefault(event, []).append(participant)
        return {event: tuple(participants) for event, participants in found.items()}

    def _requirements(
        self, communication: Communication, kind: EventKind
    ) -> tuple[tuple[Requirement, ...], tuple[Expression, ...]]:
        """The requirements on an event, and the conditions that they make."""
        requirements = self.model.requirements_on(communication.name)
        if kind is EventKind.REQUEST:
            return requirements, tuple(item.condition for item in requirements)
        condition = cancel_condition(self.model, communication, self.deployment) if kind is EventKind.CANCEL else None
        return ((), ()) if condition is None else (requirements, (condition,))

    def _executed(self, component: Component) -> Component:
        """The component with those transitions only that an executor takes."""
        behaviour = component.behaviour
        if behaviour is None:
            return component
        states = [state.name for state in behaviour.states]
        taken = {
            event: next(item.taken for item in self._participants[event] if item.component == component.name)
            for event in {item.event for item in behaviour.transitions}
        }
        kept: list[Transition] = []
        for item in behaviour.transitions:
            stands = states if item.source is None else [item.source]
            where = [state for state in stands if taken[item.event].get(state) is item]
            if len(where) == len(stands):
                kept.append(item)
            else:
                kept.extend(msgspec.structs.replace(item, source=state) for state in where)
        if len(kept) == len(behaviour.transitions) and all(
            mine is given for mine, given in zip(kept, behaviour.transitions, strict=True)
        ):
            return component
        return Component(component.name, msgspec.structs.replace(behaviour, transitions=tuple(kept)))


def _transitions_by_event(behaviour: Behaviour) -> dict[str, dict[str, Transition]]:
    """For each event that a behaviour mentions, the transition that is taken in each state, in the states' order."""
    states = [state.name for state in behaviour.states]
    found: dict[str, dict[str, Transition]] = {}
    for item in sorted(behaviour.transitions, key=lambda item: item.source is None):
        by_state = found.setdefault(item.event, {})
        for state in states if item.source is None else [item.source]:
            by_state.setdefault(state, item)
    order = {state: place for place, state in enumerate(states)}
    return {
        event: dict(sorted(by_state.items(), key=lambda entry: order[entry[0]])) for event, by_state in found.items()
    }
