"""The static part of a controlled system, for the interpreter and for generated code alike."""

from collections.abc import Iterator
from math import prod

from robosc.conditions.goals import aims_in_words, assumptions_in_words
from robosc.execution.runtime.protocol import Aim, CommunicationInfo, Description, MissionInfo
from robosc.expressions import conjuncts
from robosc.model.structure import Communication, CommunicationKind, EventKind, Model, Transition, is_tau
from robosc.supervisor import Supervisor

_MAXIMUM_BOUND = 2**63 - 1
"""Largest bound that is of use: no run of this length would end in a lifetime."""

_WITH_RESET = (CommunicationKind.SERVICE, CommunicationKind.ACTION)


def describe(supervisor: Supervisor) -> Description:
    """Return the static part of a supervisor's controlled system, which the executor needs."""
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
        aims=() if supervisor.strategy is None else tuple(_aims(supervisor)),
        assumptions=() if supervisor.strategy is None else tuple(Aim(*item) for item in assumptions_in_words(model)),
        missions=() if supervisor.strategy is None else tuple(_missions(model)),
    )


def _aims(supervisor: Supervisor) -> Iterator[Aim]:
    aims, missions = supervisor.executable.obligations.aims, supervisor.model.missions
    for aim, (name, words) in zip(aims, aims_in_words(supervisor), strict=True):
        yield Aim(name, words, None if aim.mission is None else missions[aim.mission].name)


def _missions(model: Model) -> Iterator[MissionInfo]:
    first = len(model.goals)
    for mission in model.missions:
        detours = tuple(len(detour.visits) for detour in mission.detours)
        yield MissionInfo(mission.name, first, len(mission.visits), detours)
        first += len(mission.visits) + sum(detours)


def silent_bound(model: Model) -> int:
    """Maximum number of silent steps in a row, if the run ends.

    A tau changes only the state of one component, so taus alone pass through at most as many states as the components
    with taus can form together. A service or action adds at most one reset or cancel, because it needs another request
    before the next.
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
        has_condition=communication.has_condition,
        is_when_default=communication.is_when_default,
        has_limits=bool(model.limits_for(communication.name)),
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
