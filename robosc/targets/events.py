"""Facts about a model's events for every generator: their order, who causes them, how they move a plant."""

from collections.abc import Iterable

from robosc.automata.plants import communication_plant_name
from robosc.model.structure import (
    ISSUED_KINDS,
    Behaviour,
    Communication,
    CommunicationKind,
    EventKind,
    Model,
    Transition,
    is_tau,
)


def events(model: Model) -> tuple[str, ...]:
    """Every event of a model: of its communications in source order, then its taus."""
    return tuple(event for item in model.communications for event in item.events) + model.taus


def split(event: str) -> tuple[str, str]:
    """`move.request` -> (`move`, `request`)."""
    name, _, kind = event.rpartition(".")
    return name, kind


def is_controllable(event: str) -> bool:
    """Return True if an event is caused by the executor rather than the environment."""
    return is_tau(event) or split(event)[1] in ISSUED_KINDS


def has_plant_location(communication: Communication) -> bool:
    """Return True if its plant has more than one location."""
    return communication.kind in (CommunicationKind.SERVICE, CommunicationKind.ACTION)


def plant_step(model: Model, event: str) -> tuple[str, tuple[str, ...], str | None] | None:
    """The plant of an event's service or action, and the event there; None for an event of no such plant.

    Returns:
        Name of the plant, the locations from which the event is possible, and the one that it leads to (None: it
        stays); semantics part 1.
    """
    name, kind = split(event)
    if is_tau(event) or not has_plant_location(model.communication(name)):
        return None
    communication = model.communication(name)
    busy = "waiting" if communication.kind is CommunicationKind.SERVICE else "executing"
    sources, target = {
        EventKind.REQUEST: (("idle",), busy),
        EventKind.RESPONSE: ((busy,), "ready"),
        EventKind.ERROR: ((busy,), "failed"),
        EventKind.FEEDBACK: ((busy,), None),
        EventKind.CANCEL: ((busy,), "idle"),
        EventKind.RESET: (("ready", "failed"), "idle"),
    }[EventKind(kind)]
    return communication_plant_name(communication), sources, target


def taken_transition(behaviour: Behaviour, event: str, state: str) -> Transition | None:
    """The transition that takes an event in a state: the state's own first, then the behaviour's."""
    fitting = [item for item in behaviour.transitions if item.event == event and item.source in (state, None)]
    own = [item for item in fitting if item.source is not None]
    return next(iter([*own, *fitting]), None)


Branch = tuple[tuple[str, ...], Transition]
"""States, and the transition that is taken in them."""


def branches_of(behaviours: Iterable[tuple[str, Behaviour]], event: str) -> list[tuple[str, Behaviour, list[Branch]]]:
    """Return the transition that each component takes, by state; components that take none are left out."""
    found = []
    for component, behaviour in behaviours:
        by_transition: dict[int, list[str]] = {}
        for state in behaviour.states:
            transition = taken_transition(behaviour, event, state.name)
            if transition is not None:
                by_transition.setdefault(behaviour.transitions.index(transition), []).append(state.name)
        if by_transition:
            taken = [(tuple(states), behaviour.transitions[index]) for index, states in by_transition.items()]
            found.append((component, behaviour, taken))
    return found
