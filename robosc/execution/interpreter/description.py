"""The static part of a controlled system, for the interpreter and for generated code alike."""

from math import prod

from robosc.execution.runtime.protocol import CommunicationInfo, Description
from robosc.expressions import conjuncts
from robosc.model.structure import Communication, CommunicationKind, EventKind, Model, Transition, is_tau
from robosc.supervisor import Supervisor

_MAXIMUM_BOUND = 2**63 - 1
"""No run of this length ends in anybody's lifetime; a longer number is of no use."""

_WITH_RESET = (CommunicationKind.SERVICE, CommunicationKind.ACTION)


def describe(supervisor: Supervisor) -> Description:
    """Return what the executor must know beforehand of a supervisor's controlled system."""
    model = supervisor.model
    return Description(
        name=model.name,
        deployment=str(supervisor.deployment),
        bundle_sha256=supervisor.certificate.bundle_sha256,
        communications=tuple(_info(model, item) for item in model.communications),
        resets=tuple(item.event(EventKind.RESET) for item in model.communications if item.kind in _WITH_RESET),
        taus=tuple(transition.event for transition in _taus(model)),
        silent_bound=silent_bound(model),
        has_strategy=supervisor.strategy is not None,
    )


def silent_bound(model: Model) -> int:
    """Silent steps in a row that a run which ends cannot exceed.

    A tau changes one component's state and nothing else, so that taus alone pass through at most as many states
    as the components that have taus can form. A service or action adds one reset or cancel at most: it
    needs another request before the next.
    """
    states = [
        len(component.behaviour.states)
        for component in model.components
        if component.behaviour and any(is_tau(item.event) for item in component.behaviour.transitions)
    ]
    others = sum(item.kind in _WITH_RESET for item in model.communications)
    return min((prod(states) - 1) * (others + 1) + others, _MAXIMUM_BOUND)


def _info(model: Model, communication: Communication) -> CommunicationInfo:
    requirements = model.requirements_on(communication.name)
    interface = communication.interface
    return CommunicationInfo(
        name=communication.name,
        component=communication.component,
        kind=str(communication.kind),
        identifier=communication.identifier,
        package=interface.package if interface else None,
        interface=interface.type if interface else None,
        requirement_count=len(requirements),
        conjunct_count=sum(len(conjuncts(item.condition)) for item in requirements),
        max_age_s=communication.max_age,
        has_condition=communication.when is not None,
    )


def _taus(model: Model) -> tuple[Transition, ...]:
    """Tau transitions that can change something, in source order."""
    return tuple(
        transition
        for component in model.components
        if component.behaviour
        for transition in component.behaviour.transitions
        if is_tau(transition.event) and transition.target not in (None, transition.source)
    )
