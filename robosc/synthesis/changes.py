"""Values that edges write as constants, and all other ones: only the other ones need next-state variables."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from enum import Enum, auto

from robosc.automata.state import Subject
from robosc.automata.structure import Automaton, Edge, Role, System
from robosc.expressions import Constant, EnumValue


class Leads(Enum):
    """Kind of target of the edges of an automaton for one event."""

    NOWHERE = auto()
    """None of them leaves its location."""
    TO_ONE_PLACE = auto()
    """All of them lead to one location, some of them from elsewhere."""
    AWAY = auto()
    """Edges lead to several locations."""


def leads_of(edges: Sequence[Edge]) -> Leads:
    """Return the kind of target of the edges of an automaton for one event."""
    if all(edge.source == edge.target for edge in edges):
        return Leads.NOWHERE
    return Leads.TO_ONE_PLACE if len({edge.target for edge in edges}) == 1 else Leads.AWAY


def computed_subjects(system: System) -> frozenset[Subject]:
    """The places of a state that some event changes otherwise than to one constant."""
    return frozenset(subject for automaton in system.automata for subject in _computed(automaton))


def changed_subjects(system: System) -> frozenset[Subject]:
    """The places of a state that some event changes."""
    found = set()
    for automaton in system.automata:
        for edge in automaton.edges:
            if edge.source != edge.target:
                found.add(Subject(automaton.name))
            found |= {Subject(automaton.name, update.variable) for update in edge.updates}
    return frozenset(found)


def _computed(automaton: Automaton) -> Iterable[Subject]:
    by_event = defaultdict[str, list[Edge]](list)
    for edge in automaton.edges:
        by_event[edge.event].append(edge)
    for event, edges in by_event.items():
        # A requirement or monitor without an edge for an event stays as it is: nothing that it writes is one constant.
        stays = automaton.role is Role.REQUIREMENT or event in automaton.monitors
        leads = leads_of(edges)
        if leads is Leads.AWAY or (stays and leads is Leads.TO_ONE_PLACE):
            yield Subject(automaton.name)
        for variable in dict.fromkeys(update.variable for edge in edges for update in edge.updates):
            written = [
                next((update.expression for update in edge.updates if update.variable == variable), None)
                for edge in edges
            ]
            if stays or not isinstance(written[0], Constant | EnumValue) or any(item != written[0] for item in written):
                yield Subject(automaton.name, variable)
