"""Warnings that only synthesis can give about a model, such as events that never happen.

- `never-enabled`: an event that can happen in no state of the controlled system. If a communication can never be
  requested, only the request is reported, not also its replies. A request counts even if no behaviour reacts to it,
  because it is declared to be used. A cancel counts only if a behaviour reacts to it: otherwise it is not in the text,
  and an action whose requirements hold as long as it runs needs none. Resets belong to the protocol and count.
- `unused-requirement`: a written requirement that never restricts any of its communications. A requirement on an action
  also restricts if it turns false while the action runs, because it then causes a cancel. Any requirement also
  restricts if synthesis avoids states because of it, as for one that must always (or never) hold. In short, a
  requirement is used if the controlled system would do more without it. All reported requirements can be removed
  together. A communication that is never requested is never restricted.
- `unreachable-state`: a state that its component never reaches, even if its behaviour alone would reach it.
- `unprompted-request`: a service or action that an executor, which takes resets and silent steps first, can request
  again and again, with only requests, their replies and silent steps in between, and no message of the robot that would
  prompt it; likewise a message whose request changes the state, as where two of them alternate. It is a note, because a
  patrol is meant to go on for ever. A loop is reported once, for its service or action that is declared first, or its
  message where it has none. It is only for the controller, because in a layer the existing controller makes the
  requests. In a large system the search is given up.
- `competing-requests`: two communications of one kind (topics, services and actions have name spaces of their own)
  with one identifier that can be requested in one state, with a shortest run to such a state. It is only for the
  controller, because in a layer the existing controller chooses.

Where goals are given, a strategy chooses what is requested: neither of the last two is reported, nor a cancel that
never happens.
"""

from collections import defaultdict, deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice

from robosc.automata.structure import EventCondition, System
from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.model.places import Places
from robosc.model.structure import (
    Behaviour,
    Communication,
    CommunicationKind,
    Component,
    Deployment,
    EventKind,
    Model,
    Transition,
    is_tau,
)
from robosc.source import Location
from robosc.synthesis.questions import Answers, Cause, EnabledTogether, NeverEnabled, Questions, Restriction, Unprompted

MAXIMUM_EVENTS = 12
"""Events of a run that a message shows."""

MAXIMUM_NAMES = 5
"""Names, and other places, that a message shows."""


def questions_about(model: Model, system: System, deployment: Deployment) -> Questions:
    """Return the questions that `findings` needs answered about the controlled system of a model's automata."""
    # A strategy requests what its goals need, and no more.
    is_open = deployment is Deployment.CONTROLLER and not model.has_goals
    return Questions(
        events=tuple(event.name for event in system.events),
        restrictions=(
            *_restrictions(model, system),
            *(Restriction(invariants=(place,)) for place in range(len(model.invariants))),
        ),
        rivals=_rivals(model) if is_open else (),
        locations=tuple(
            (component.name, state.name)
            for component in model.components
            for state in (component.behaviour.states if component.behaviour else ())
        ),
        prompted=tuple(item.event(EventKind.REQUEST) for item in _repeated(model)) if is_open else (),
        changing=frozenset(
            item.event(EventKind.REQUEST)
            for item in model.communications
            if item.kind is CommunicationKind.INCOMING_MESSAGE
        ),
        prompts=frozenset(
            event
            for item in model.communications
            if item.kind is CommunicationKind.OUTGOING_MESSAGE
            for event in item.events
        ),
        silent=tuple(
            event.name for event in system.events if is_tau(event.name) or event.name.endswith(f".{EventKind.RESET}")
        ),
    )


def _called(model: Model) -> tuple[Communication, ...]:
    """The services and actions of a model."""
    return tuple(
        item for item in model.communications if item.kind in (CommunicationKind.SERVICE, CommunicationKind.ACTION)
    )


def _repeated(model: Model) -> tuple[Communication, ...]:
    """The services and actions of a model, then its incoming messages."""
    messages = (item for item in model.communications if item.kind is CommunicationKind.INCOMING_MESSAGE)
    return (*_called(model), *messages)


def _restrictions(model: Model, system: System) -> Iterator[Restriction]:
    """Yield the restriction of each requirement on requests: the n-th on a request is that event's n-th condition."""
    communications = {item.name: item for item in model.communications}
    places = defaultdict[str, deque[int]](deque)
    for place, condition in enumerate(system.conditions):
        places[condition.event].append(place)
    for requirement in model.requirements:
        restricted = [communications[name] for name in requirement.communications]
        yield Restriction(
            conditions=tuple(places[item.event(EventKind.REQUEST)].popleft() for item in restricted),
            watched=tuple(
                EventCondition(item.event(EventKind.CANCEL), requirement.condition)
                for item in restricted
                if item.kind is CommunicationKind.ACTION
            ),
        )


def _rivals(model: Model) -> tuple[tuple[str, ...], ...]:
    """The requests on each identifier, where there are several."""
    found: dict[tuple[CommunicationKind, str], list[str]] = {}
    for item in model.communications:
        if item.kind is not CommunicationKind.OUTGOING_MESSAGE:
            found.setdefault((item.kind, item.identifier), []).append(item.event(EventKind.REQUEST))
    return tuple(tuple(group) for group in found.values() if len(group) > 1)


def findings(
    model: Model, places: Places, answers: Answers, told: Mapping[str, tuple[str, str]] | None = None
) -> tuple[Diagnostic, ...]:
    """Return the warnings about a model.

    Args:
        model: The checked model.
        places: Source locations of its parts.
        answers: The answers to `questions_about` it.
        told: For events that can never happen, reason and remedy, where more is known than the kind of cause.
    """
    never = {item.event: item for item in answers.never}
    return (
        *_never_requested(model, places, never, told or {}),
        *_never_taken(model, places, never),
        *(_unused(model, places, number) for number in answers.unused if not _is_empty(model, number)),
        *(_competing(model, places, pair) for pair in answers.together),
        *(_unreached(model, places, component, state) for component, state in answers.unreached),
        *(_unprompted(model, places, item) for item in answers.unprompted),
    )


def _warning(code: str, message: str, location: Location, fix: str, related: Iterable[RelatedPlace] = ()) -> Diagnostic:
    return Diagnostic(Severity.WARNING, code, message, location, fix, tuple(related))


# Events that can never happen

_EXPLANATIONS = {
    (Cause.PLANT, False): (
        "the behaviours never get to states that allow it",
        "Let every behaviour that reacts to it get to a state where it may happen, or remove it.",
    ),
    (Cause.REQUIREMENT, True): (
        "wherever the behaviours allow it, a requirement on it does not hold",
        "Relax the requirements on it, or let the components get to where they hold.",
    ),
    (Cause.REQUIREMENT, False): (
        "requirements keep the behaviours from the states that allow it",
        "Relax the requirements on what leads to these states.",
    ),
    (Cause.INVARIANT, True): (
        "wherever it is allowed, what must always hold would not hold after it, or could not be kept",
        "Relax what must always (or never) hold, or let it happen only from where that can be kept.",
    ),
    (Cause.INVARIANT, False): (
        "what must always hold keeps the behaviours from the states that allow it",
        "Relax what must always (or never) hold, or let the behaviours get to these states while it does.",
    ),
    (Cause.SUPERVISOR, True): (
        "synthesis forbids it everywhere, because of what could follow it",
        "Give a way back to marked states and into every variable's range from wherever it leads; run "
        "'robosc explain-synthesis' to see what prevents it.",
    ),
    (Cause.SUPERVISOR, False): (
        "synthesis keeps the behaviours from the states that allow it, because of what could follow there",
        "Give a way back to marked states and into every variable's range from these states; run "
        "'robosc explain-synthesis' to see what prevents it.",
    ),
}
"""Reason and remedy, by the cause and by whether the event would be allowed without it in a state that is reached."""

_NEVER_TAKEN = (
    "its component never gets to a state where it stands and its guard holds",
    "Correct its guard or the way to its state, or remove it.",
)


_NEVER_CANCELLED = (
    "Nothing needs fixing if it is to run to its end; else add a requirement that turns false while it runs, since a "
    "controller cancels only then."
)


def _never_requested(
    model: Model, places: Places, never: Mapping[str, NeverEnabled], told: Mapping[str, tuple[str, str]]
) -> Iterator[Diagnostic]:
    """Findings about the events of communications."""
    reactions = {item.event for component in model.components for item in _transitions(component)}
    for item in model.communications:
        request, cancel = item.event(EventKind.REQUEST), item.event(EventKind.CANCEL)
        # A strategy cancels nothing for its own sake.
        is_wanted = cancel in reactions and not model.has_goals
        found = [event for event in item.events if event in never and (event != cancel or is_wanted)]
        for event in found[:1] if request in never else found:
            what = f"'{item.name}' can never be requested" if event == request else f"'{event}' can never happen"
            why, fix = _EXPLANATIONS[never[event].cause, never[event].is_reached]
            if event in told:
                why, fix = told[event]
            elif event == cancel and never[event].cause is Cause.REQUIREMENT:
                fix = _NEVER_CANCELLED
            related = _blamed(model, places, item.name, never[event])
            yield _warning("never-enabled", f"{what}: {why}", places.communications[item.name], fix, related)


def _blamed(model: Model, places: Places, communication: str | None, never: NeverEnabled) -> tuple[RelatedPlace, ...]:
    """The first requirements that are the cause, where it is known which."""
    if never.cause is Cause.REQUIREMENT and never.is_reached and communication is not None:
        return _requirements_on(model, places, communication)
    shown = islice(never.invariants, MAXIMUM_NAMES)
    return tuple(RelatedPlace("this would not hold after it", places.invariants[place]) for place in shown)


def _requirements_on(model: Model, places: Places, communication: str) -> tuple[RelatedPlace, ...]:
    """The first requirements on a communication."""
    found = (
        RelatedPlace("a requirement on it", place)
        for requirement, place in zip(model.requirements, places.requirements, strict=True)
        if communication in requirement.communications
    )
    return tuple(islice(found, MAXIMUM_NAMES))


def _never_taken(model: Model, places: Places, never: Mapping[str, NeverEnabled]) -> Iterator[Diagnostic]:
    """Findings about tau transitions."""
    for component in model.components:
        for location, transition in zip(
            places.transitions.get(component.name, ()), _transitions(component), strict=True
        ):
            event = transition.event
            if is_tau(event) and event in never:
                found = never[event]
                why, fix = _NEVER_TAKEN if found.cause is Cause.PLANT else _EXPLANATIONS[found.cause, found.is_reached]
                related = _blamed(model, places, None, found)
                yield _warning("never-enabled", f"'{event}' can never happen: {why}", location, fix, related)


def _transitions(component: Component) -> tuple[Transition, ...]:
    return component.behaviour.transitions if component.behaviour else ()


# Requirements that never restrict


def _is_empty(model: Model, number: int) -> bool:
    """Return True if a requirement names no communication, which is a finding of its own."""
    return number < len(model.requirements) and not model.requirements[number].communications


def _unused(model: Model, places: Places, number: int) -> Diagnostic:
    # First the requirements on events, then those that must always hold.
    is_lasting = number >= len(model.requirements)
    names = [] if is_lasting else [f"'{name}'" for name in model.requirements[number].communications]
    shown = ", ".join(names[:MAXIMUM_NAMES]) + (
        f" and {len(names) - MAXIMUM_NAMES} more" if names[MAXIMUM_NAMES:] else ""
    )
    return _warning(
        "unused-requirement",
        f"this requirement never restricts {shown or 'anything'}",
        places.invariants[number - len(model.requirements)] if is_lasting else places.requirements[number],
        "Correct its condition, which holds whenever it matters, or remove it.",
    )


# Requests that compete


def _competing(model: Model, places: Places, pair: EnabledTogether) -> Diagnostic:
    first, second = (event.rpartition(".")[0] for event in (pair.first, pair.second))
    identifier = next(item.identifier for item in model.communications if item.name == second)
    return _warning(
        "competing-requests",
        f"'{second}' and '{first}' can both be requested on '{identifier}' {_after(pair.trace)}",
        places.communications[second],
        "Put them into the deployment's priority list, or let a requirement forbid the one where the other is wanted.",
        [RelatedPlace("the other one is here", places.communications[first])],
    )


def _after(trace: Sequence[str]) -> str:
    """Return the words for when it happens: a run, cut where it is long."""
    if not trace:
        return "in the initial state"
    return f"after {_shown(trace)}"


def _shown(events: Sequence[str]) -> str:
    """Return events in order, cut where there are many."""
    shown = ", ".join(events[:MAXIMUM_EVENTS])
    return shown + (f", ... ({len(events)} in all)" if len(events) > MAXIMUM_EVENTS else "")


# Requests that no message prompts


def _unprompted(model: Model, places: Places, found: Unprompted) -> Diagnostic:
    looping = [item for item in _repeated(model) if item.event(EventKind.REQUEST) in found.loop]
    first, *others = [item.name for item in looping]
    is_message = looping[0].kind is CommunicationKind.INCOMING_MESSAGE
    return Diagnostic(
        Severity.NOTE,
        "unprompted-request",
        f"'{first}' can be {'sent' if is_message else 'requested'} again and again with no message of the robot in "
        f"between, {_after(found.trace)}: "
        f"{_shown(found.loop)}, and so on",
        places.communications[first],
        "Require an order message before it, or accept the note if the robot should repeat it: write "
        "'// robosc: accept unprompted-request: REASON' above it.",
        tuple(RelatedPlace("requested in the same loop", places.communications[name]) for name in others),
    )


# States that are never reached


def _unreached(model: Model, places: Places, component: str, state: str) -> Diagnostic:
    behaviour = model.component(component).behaviour
    if behaviour is not None and state not in _led_to(behaviour):
        why, fix = "no transition leads there", "Give it a transition that leads there, or remove it."
    else:
        why = "what would lead there never happens under the supervisor"
        fix = "Relax a requirement, or remove the state; run 'robosc explain-synthesis' to see what prevents it."
    place = places.states[component, state]
    return _warning("unreachable-state", f"{component} never gets to '{state}': {why}", place, fix)


def _led_to(behaviour: Behaviour) -> frozenset[str]:
    """The states to which a behaviour's transitions lead, whatever their guards."""
    found, waiting = {behaviour.initial}, [behaviour.initial]
    while waiting:
        state = waiting.pop()
        for item in behaviour.transitions:
            if item.source in (None, state) and item.target is not None and item.target not in found:
                found.add(item.target)
                waiting.append(item.target)
    return frozenset(found)
