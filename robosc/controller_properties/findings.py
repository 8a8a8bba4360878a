"""Findings about the controller: endless silent steps, steps whose order matters, tasks that are never completed."""

from collections.abc import Iterable, Sequence

from robosc.automata.compile import State
from robosc.automata.plants import communication_plant_name
from robosc.automata.state import Subject, subjects
from robosc.automata.structure import System
from robosc.controller_properties.outcome import Blocking, Conflict, Livelock, Order, Properties
from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.expressions.text import automaton_text
from robosc.model.places import Places
from robosc.model.structure import Model, is_tau
from robosc.source import Location

MAXIMUM_EVENTS = 12
"""Events of a run that a message shows."""

MAXIMUM_NAMES = 5
"""Names, and other places, that a message shows."""


def controller_findings(
    model: Model, system: System, places: Places, properties: Properties, *, allow_livelock: bool
) -> tuple[Diagnostic, ...]:
    """Return the diagnostics about what is wrong with a controller.

    Args:
        model: The checked robot.
        system: Its automata.
        places: Source locations of its parts.
        properties: Results of the check of the controller.
        allow_livelock: True if silent steps that do not end are a warning only.
    """
    found: list[Diagnostic] = []
    if properties.livelock is not None:
        severity = Severity.WARNING if allow_livelock else Severity.ERROR
        found.append(_livelock(model, places, properties.livelock, severity))
    if properties.conflict is not None:
        found.append(_conflict(model, system, places, properties.conflict))
    if properties.blocking is not None:
        found.append(_blocking(model, system, places, properties.blocking))
    return tuple(found)


def _livelock(model: Model, places: Places, livelock: Livelock, severity: Severity) -> Diagnostic:
    first, *others = dict.fromkeys(livelock.cycle)
    return Diagnostic(
        severity,
        "livelock",
        f"silent steps never end: {_when(livelock.trace)}, {_listed(livelock.cycle)} "
        f"{'repeats itself' if len(livelock.cycle) == 1 else 'repeat themselves'} for ever",
        _place(model, places, first),
        "Let the guards of these transitions exclude that they lead back to where they began, or remove one of them.",
        _related("this one takes part", model, places, others),
    )


def _conflict(model: Model, system: System, places: Places, conflict: Conflict) -> Diagnostic:
    chosen, other = conflict.chosen, conflict.other
    same = 0
    while same < min(len(chosen.events), len(other.events)) and chosen.events[same] == other.events[same]:
        same += 1
    differing = [order.events[same:] + order.cycle for order in (chosen, other)]
    candidates = [events[0] for events in differing if events]
    at = next((event for event in candidates if is_tau(event)), candidates[0])
    return Diagnostic(
        Severity.WARNING,
        "not-confluent",
        f"the order of silent steps matters: {_when(conflict.trace)}, the executor's order "
        f"{_order_words(model, system, chosen, other)}, but the order {_order_words(model, system, other, chosen)}",
        _place(model, places, at),
        "Let guards decide which of these steps is wanted, so that they are not enabled together.",
        _related(
            "this step comes first in the other order", model, places, (item for item in candidates if item != at)
        ),
    )


def _order_words(model: Model, system: System, order: Order, beside: Order) -> str:
    """An order in words, with the part of its end state that differs from the end of another order."""
    listed = _listed((*order.events, *order.cycle))
    if order.end is None:
        return f"{listed} never ends"
    if beside.end is None:
        return f"{listed} ends"
    if order.end == beside.end:
        cancels = ", ".join(order.asked)
        return f"{listed} asks for {f'the cancel of {cancels}' if cancels else 'no cancel'}"
    return f"{listed} ends with {_difference(model, system, order.end, beside.end)}"


def _difference(model: Model, system: System, state: State, other: State) -> str:
    parts = [
        f"{_name(model, subject)} = {str(value).lower() if isinstance(value, bool) else value}"
        for subject, value, beside in zip(subjects(system), state, other, strict=True)
        if value != beside
    ]
    return ", ".join(parts[:MAXIMUM_NAMES]) + (", ..." if parts[MAXIMUM_NAMES:] else "")


def _name(model: Model, subject: Subject) -> str:
    components = {item.name for item in model.components}
    return str(subject) if subject.variable is not None else automaton_text(subject.automaton, components)


def _blocking(model: Model, system: System, places: Places, blocking: Blocking) -> Diagnostic:
    # Name the first part that never is marked again; it may be that only all together never are.
    located = {subject.automaton: place for place, subject in enumerate(subjects(system)) if subject.variable is None}
    lost = next(
        (
            item.name
            for item in system.automata
            if all(state[located[item.name]] not in item.marked for state in blocking.states)
        ),
        None,
    )
    homes = {communication_plant_name(item): places.communications[item.name] for item in model.communications}
    homes.update(places.components)
    what = (
        "all parts of the robot are never marked together again"
        if lost is None
        else f"'{_name(model, Subject(lost))}' is never marked again"
    )
    return Diagnostic(
        Severity.WARNING,
        "blocking-under-control",
        f"{_when(blocking.trace)}, no marked state can be reached: as silent steps come first, {what}",
        places.robot if lost is None else homes[lost],
        "Let guards hold back silent steps that lead away from marked states, or mark the states where it may rest.",
    )


def _place(model: Model, places: Places, event: str) -> Location:
    """Return the source location of an event: the transition of a tau, else its communication."""
    name = event.rpartition(".")[0]
    if not is_tau(event):
        return places.communications[name]
    behaviour = model.component(name).behaviour
    transitions = behaviour.transitions if behaviour else ()
    number = next(number for number, item in enumerate(transitions) if item.event == event)
    return places.transitions[name][number]


def _related(message: str, model: Model, places: Places, events: Iterable[str]) -> tuple[RelatedPlace, ...]:
    return tuple(RelatedPlace(message, _place(model, places, event)) for event in list(events)[:MAXIMUM_NAMES])


def _when(trace: Sequence[str]) -> str:
    return f"after {_listed(trace)}" if trace else "from the initial state"


def _listed(events: Sequence[str]) -> str:
    """Events, cut where there are many."""
    shown = ", ".join(events[:MAXIMUM_EVENTS])
    return shown + (f", ... ({len(events)} in all)" if len(events) > MAXIMUM_EVENTS else "")
