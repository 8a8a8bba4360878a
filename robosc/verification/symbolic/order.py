"""An order of the places of a state in which related places are near each other.

Source: E. Cuthill and J. McKee, "Reducing the bandwidth of sparse symmetric matrices", Proc. 24th ACM National
Conference, 1969, pp. 157-172, the other way round: W.-H. Liu and A. H. Sherman, "Comparative analysis of the
Cuthill-McKee and the reverse Cuthill-McKee ordering algorithms for sparse matrices", SIAM Journal on Numerical Analysis
13(2), 1976, pp. 198-213. For synthesis it was found to be good by S. Lousberg, S. Thuijsman and M. Reniers,
"DSM-based variable ordering heuristic for reduced computational effort of symbolic supervisor synthesis", WODES 2020,
IFAC-PapersOnLine 53(4), pp. 429-436.
"""

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence, Set

from robosc.automata.compile import Path, paths_read, subjects_read
from robosc.automata.state import Subject, subjects
from robosc.automata.structure import System
from robosc.expressions import Expression, simple_parts

WIDE = 5
"""Digits from which an integer is wide."""


def place_order(system: System, followers: Mapping[Subject, Set[Subject]] | None = None) -> tuple[int, ...]:
    """The places of a state tuple in a good order.

    Args:
        system: The system.
        followers: For some places that no event moves, others: each stands right behind the last one of these.
    """
    places = {subject: place for place, subject in enumerate(subjects(system))}
    weights: list[dict[int, float]] = [{} for _ in places]
    for group in _groups(system):
        members = sorted({places[subject] for subject in group})
        for place in members:
            for other in members:
                if other != place:
                    # A condition that ties many places together ties each two of them loosely.
                    weights[place][other] = weights[place].get(other, 0.0) + 1 / (len(members) - 1)
    # The other way round: what many others look at, which is found early, stands low.
    order = cuthill_mckee(weights)[::-1]
    return _followed(order, {places[one]: {places[item] for item in read} for one, read in (followers or {}).items()})


def _followed(order: tuple[int, ...], followers: Mapping[int, Set[int]]) -> tuple[int, ...]:
    """Return an order in which each of some places stands right behind the last one of others."""
    level = {place: number for number, place in enumerate(order)}
    behind: dict[int, list[int]] = {}
    for place, others in followers.items():
        if others:
            behind.setdefault(max(others, key=lambda other: level[other]), []).append(place)
    moved = {place for places in behind.values() for place in places}
    return tuple(item for place in order if place not in moved for item in (place, *behind.get(place, ())))


def cuthill_mckee(weights: Sequence[dict[int, float]]) -> tuple[int, ...]:
    """Nodes of a graph in breadth-first order, each one's neighbours by how strongly they are tied to it.

    Args:
        weights: For each node its neighbours, with the strength of the tie.
    """
    order: list[int] = []
    placed = [False] * len(weights)
    for first in range(len(weights)):
        if placed[first]:
            continue
        # From an end of its part of the graph: the last node of a search from anywhere.
        for node in _breadth_first(weights, _breadth_first(weights, first)[-1]):
            placed[node] = True
            order.append(node)
    return tuple(order)


def _breadth_first(weights: Sequence[dict[int, float]], first: int) -> list[int]:
    order, seen = [first], {first}
    for node in order:
        tied = weights[node]
        for other in sorted(tied, key=lambda other: (-tied[other], len(weights[other]), other)):
            if other not in seen:
                seen.add(other)
                order.append(other)
    return order


def _groups(system: System) -> Iterable[set[Subject]]:
    """The places that an event, a condition or an invariant looks at together."""
    touched: dict[str, set[Subject]] = {event.name: set() for event in system.events}
    for automaton in system.automata:
        yield {Subject(automaton.name), *(Subject(automaton.name, variable.name) for variable in automaton.variables)}
        for edge in automaton.edges:
            group = touched[edge.event]
            group.add(Subject(automaton.name))
            group |= subjects_read(edge.guard)
            for update in edge.updates:
                group |= {Subject(automaton.name, update.variable), *subjects_read(update.expression)}
    for condition in (*system.conditions, *system.plant_conditions):
        touched[condition.event] |= subjects_read(condition.condition)
    yield from touched.values()
    for invariant in (*system.invariants, *system.plant_invariants):
        yield set(subjects_read(invariant))


def tied(
    system: System,
    places: Mapping[Subject, int],
    widths: Mapping[int, int],
    data: Mapping[tuple[str, Path], int],
) -> tuple[Set[Hashable], ...]:
    """Return the wide places and data that simple conditions and updates compute with together.

    Those that share one are joined.

    Args:
        system: The system.
        places: The place of each subject.
        widths: Number of digits of each place.
        data: Number of digits of each datum, by event and path.
    """
    groups: list[set[Hashable]] = []
    for expression, event, subject in _computed(system):
        read = set[Hashable](places[item] for item in subjects_read(expression) if widths[places[item]] >= WIDE)
        read |= {(event, path) for path in paths_read(expression) if data.get((event, path), 0) >= WIDE}
        if subject is not None and widths[places[subject]] >= WIDE:
            read.add(places[subject])
        if len(read) > 1:
            touched = [group for group in groups if group & read]
            groups = [*(group for group in groups if not group & read), read.union(*touched)]
    return tuple(groups)


def _computed(system: System) -> Iterator[tuple[Expression, str, Subject | None]]:
    """Every simple condition and every update, with its event and the variable that it writes."""
    for automaton in system.automata:
        for edge in automaton.edges:
            for part in simple_parts(edge.guard):
                yield part, edge.event, None
            for update in edge.updates:
                yield update.expression, edge.event, Subject(automaton.name, update.variable)
    conditions = [*system.invariants, *system.plant_invariants, system.initial, system.marker]
    conditions += [item.condition for item in (*system.conditions, *system.plant_conditions)]
    for condition in conditions:
        for part in simple_parts(condition):
            yield part, "", None
