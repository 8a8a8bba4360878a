"""The plant of a message, a service, an action, and of a component's behaviour."""

from collections.abc import Iterable, Iterator

from robosc.automata.structure import Assignment, Automaton, DiscreteVariable, Edge
from robosc.expressions import TRUE
from robosc.model.structure import (
    Behaviour,
    Communication,
    CommunicationKind,
    EventKind,
    Transition,
    is_tau,
)

_IDLE, _WAITING, _EXECUTING, _READY, _FAILED = "idle", "waiting", "executing", "ready", "failed"


def communication_plant_name(communication: Communication) -> str:
    """Name of a communication's plant, such as `service calibrate`."""
    match communication.kind:
        case CommunicationKind.SERVICE | CommunicationKind.ACTION:
            return f"{communication.kind} {communication.name}"
        case _:
            return f"message {communication.name}"


def communication_plant(communication: Communication) -> Automaton:
    """The protocol that a message, service or action follows."""
    locations, arcs = _protocol(communication.kind)
    if not arcs:
        edges = tuple(Edge(_IDLE, event, _IDLE) for event in communication.events)
    else:
        edges = tuple(Edge(source, communication.event(kind), target) for source, kind, target in arcs)
    return Automaton(
        name=communication_plant_name(communication),
        locations=locations,
        initial=(_IDLE,),
        marked=frozenset({_IDLE}),
        alphabet=frozenset(communication.events),
        edges=edges,
    )


def _protocol(kind: CommunicationKind) -> tuple[tuple[str, ...], tuple[tuple[str, EventKind, str], ...]]:
    """Locations and arcs of a kind of communication; no arcs where every event is a self-loop."""
    match kind:
        case CommunicationKind.SERVICE:
            return (_IDLE, _WAITING, _READY, _FAILED), _call(_WAITING)
        case CommunicationKind.ACTION:
            feedback = (_EXECUTING, EventKind.FEEDBACK, _EXECUTING)
            cancel = (_EXECUTING, EventKind.CANCEL, _IDLE)
            return (_IDLE, _EXECUTING, _READY, _FAILED), (*_call(_EXECUTING), feedback, cancel)
        case _:
            return (_IDLE,), ()


def _call(busy: str) -> tuple[tuple[str, EventKind, str], ...]:
    """Return the edges that services and actions have in common."""
    return (
        (_IDLE, EventKind.REQUEST, busy),
        (busy, EventKind.RESPONSE, _READY),
        (busy, EventKind.ERROR, _FAILED),
        (_READY, EventKind.RESET, _IDLE),
        (_FAILED, EventKind.RESET, _IDLE),
    )


PLANT_LOCATIONS = {kind: _protocol(kind)[0] for kind in (CommunicationKind.SERVICE, CommunicationKind.ACTION)}
"""Locations of the plants of services and actions, by kind: those of the kinds with more than one."""


def component_plant(name: str, behaviour: Behaviour) -> Automaton:
    """The plant of a component's behaviour.

    Requests and taus are blocked where no transition is written. Every other event that the behaviour
    mentions is accepted in every state: where no transition is written it changes nothing. Code-only
    variables and their updates are left out.
    """
    variables = tuple(
        DiscreteVariable(variable.name, variable.type, (variable.initial,))
        for variable in behaviour.variables
        if variable.is_synthesis
    )
    kept = frozenset(variable.name for variable in variables)
    states = tuple(state.name for state in behaviour.states)
    alphabet = dict.fromkeys(transition.event for transition in behaviour.transitions)
    written = tuple(edge for item in behaviour.transitions for edge in _edges(item, states, kept))
    return Automaton(
        name=name,
        locations=states,
        initial=(behaviour.initial,),
        marked=frozenset(state.name for state in behaviour.states if state.is_marked),
        alphabet=frozenset(alphabet),
        edges=(*written, *_self_loops(states, alphabet, written)),
        variables=variables,
    )


def _edges(transition: Transition, states: tuple[str, ...], kept: frozenset[str]) -> Iterator[Edge]:
    """The edges of one transition: one for each state that it stands in."""
    for state in states if transition.source is None else (transition.source,):
        yield Edge(
            source=state,
            event=transition.event,
            target=state if transition.target is None else transition.target,
            guard=TRUE if transition.guard is None else transition.guard,
            updates=tuple(
                Assignment(update.variable, update.expression)
                for update in transition.updates
                if update.variable in kept
            ),
        )


def _self_loops(states: tuple[str, ...], alphabet: Iterable[str], written: tuple[Edge, ...]) -> Iterator[Edge]:
    """Self-loops on the events that a behaviour never blocks, where nothing is written."""
    taken = {(edge.source, edge.event) for edge in written}
    for event in alphabet:
        if not is_blocking(event):
            yield from (Edge(state, event, state) for state in states if (state, event) not in taken)


def is_blocking(event: str) -> bool:
    """Return True if a behaviour that mentions an event blocks it in the states where it writes no transition."""
    return is_tau(event) or event.rpartition(".")[2] == EventKind.REQUEST
