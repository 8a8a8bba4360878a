"""Plain automata: as they are read, with the places of their parts and names that may be wrong; as all of a system."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from robosc.automata import Automaton, Edge, Event, Role, System, SystemPlaces
from robosc.errors import UnsupportedModelError
from robosc.expressions import TRUE, StateTest, Unary
from robosc.model.findings import Findings
from robosc.source import Location

MAXIMUM_PARTS = 1_000_000
"""States and transitions of a file beyond which it is refused."""


@dataclass(frozen=True, slots=True)
class Named:
    """A name, and where it stands."""

    text: str
    at: Location


@dataclass(slots=True)
class Draft:
    """An automaton under way.

    Attributes:
        name: Its name.
        role: Its role.
        states: Its states.
        edges: Source, event and target of each transition.
        events: The events of its alphabet.
        initial: Initial states.
        marked: Marked states.
        forbidden: States that must not be entered.
    """

    name: Named
    role: Role = Role.PLANT
    states: list[Named] = field(default_factory=list)
    edges: list[tuple[Named, Named, Named]] = field(default_factory=list)
    events: list[Named] = field(default_factory=list)
    initial: list[Named] = field(default_factory=list)
    marked: list[Named] = field(default_factory=list)
    forbidden: list[Named] = field(default_factory=list)


def system_of(
    name: str, drafts: Sequence[Draft], events: Mapping[str, bool], findings: Findings
) -> tuple[System, SystemPlaces]:
    """The system of some automata, with the places of its parts; of use only if no error is found.

    Args:
        name: Name of the system.
        drafts: The automata.
        events: Every event that is declared, and whether it is controllable.
        findings: Collection of what is wrong.
    """
    named = set[str]()
    for draft in drafts:
        for item in (draft.name, *draft.states, *draft.events):
            if not item.text:
                findings.error("automata-name", "a name is empty", item.at, "Write one.")
        _check(draft, events, findings)
        if draft.name.text in named:
            message = f"there is another automaton '{draft.name.text}'"
            findings.error("automata-name", message, draft.name.at, "Give one of them another name.")
        named.add(draft.name.text)
    used = {event.text for draft in drafts for event in draft.events}
    forbidden = [(draft, state) for draft in drafts for state in draft.forbidden]
    system = System(
        name=name,
        events=tuple(Event(event, is_controllable) for event, is_controllable in events.items() if event in used),
        automata=tuple(map(_automaton, drafts)),
        invariants=tuple(Unary("not", StateTest(draft.name.text, state.text)) for draft, state in forbidden),
    )
    places = {draft.name.text: draft.name.at for draft in drafts}
    return system, SystemPlaces(automata=places, invariants=tuple(state.at for _, state in forbidden))


def _check(draft: Draft, events: Mapping[str, bool], findings: Findings) -> None:
    states = set[str]()
    for item in draft.states:
        if item.text in states:
            message = f"'{draft.name.text}' has another state '{item.text}'"
            findings.error("automata-name", message, item.at, "Leave one of them out, or name it otherwise.")
        states.add(item.text)
    alphabet = {item.text for item in draft.events}
    uses = [item for source, _, target in draft.edges for item in (source, target)]
    for item in (*uses, *draft.initial, *draft.marked, *draft.forbidden):
        if item.text not in states:
            message = f"'{draft.name.text}' has no state '{item.text}'"
            findings.error("automata-name", message, item.at, "Correct the name, or add the state.")
            states.add(item.text)
    for item in (*draft.events, *(event for _, event, _ in draft.edges)):
        if item.text not in events:
            message = f"the event '{item.text}' is not declared"
        elif item.text not in alphabet:
            message = f"the event '{item.text}' is not in the alphabet of '{draft.name.text}'"
        else:
            continue
        findings.error("automata-name", message, item.at, "Correct the name, or declare the event.")
        alphabet.add(item.text)


def _automaton(draft: Draft) -> Automaton:
    states = tuple(dict.fromkeys(item.text for item in draft.states))
    return Automaton(
        name=draft.name.text,
        locations=states or ("",),
        initial=tuple(dict.fromkeys(item.text for item in draft.initial)),
        marked=frozenset(item.text for item in draft.marked),
        alphabet=frozenset(item.text for item in draft.events),
        edges=tuple(dict.fromkeys(Edge(source.text, event.text, target.text) for source, event, target in draft.edges)),
        role=draft.role,
    )


def require_plain(system: System) -> None:
    """Do nothing if a system consists of automata without variables, guards and conditions.

    Raises:
        UnsupportedModelError: It does not.
    """
    has_more = (
        system.inputs or system.conditions or system.invariants or system.plant_conditions or system.plant_invariants
    )
    if has_more or (system.initial, system.marker) != (TRUE, TRUE):
        raise UnsupportedModelError(f"{system.name} has conditions beside its automata, which no plain automata have")
    for automaton in system.automata:
        has_guards = any(edge.guard != TRUE or edge.updates for edge in automaton.edges)
        if automaton.variables or automaton.monitors or has_guards:
            raise UnsupportedModelError(
                f"{automaton.name} has variables, guards or monitors, and is not a plain automaton"
            )
