"""A static variable order from the structure of a system.

Source: F. A. Aloul, I. L. Markov and K. A. Sakallah, "FORCE: a fast and easy-to-implement variable-ordering
heuristic", Great Lakes Symposium on VLSI, 2003, pp. 116-119.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence

from robosc.automata.state import Subject, subjects
from robosc.automata.structure import System
from robosc.expressions import Expression, PathStep, Received, StateTest, VariableRead, leaves


def subject_order(system: System) -> tuple[Subject, ...]:
    """The places of a state, so that those that an event touches together stand near each other."""
    places = subjects(system)
    index = {subject: place for place, subject in enumerate(places)}
    edges = [[index[subject] for subject in edge] for edge in hyperedges(system)]
    return tuple(places[place] for place in force(len(places), edges))


def hyperedges(system: System) -> tuple[frozenset[Subject], ...]:
    """For each event and each condition, the subjects it touches; each set once, in first order."""
    found: dict[frozenset[Subject], None] = {}
    for event in system.events:
        touched = set[Subject]()
        for automaton in system.automata:
            for edge in automaton.edges:
                if edge.event == event.name:
                    touched.add(Subject(automaton.name))
                    touched |= _read(edge.guard)
                    for update in edge.updates:
                        touched.add(Subject(automaton.name, update.variable))
                        touched |= _read(update.expression)
        found[frozenset(touched)] = None
    for condition in system.conditions:
        found[frozenset(_read(condition.condition))] = None
    for invariant in system.invariants:
        found[frozenset(_read(invariant))] = None
    return tuple(edge for edge in found if len(edge) > 1)


def _read(expression: Expression) -> set[Subject]:
    found = set[Subject]()
    for leaf in leaves(expression):
        match leaf:
            case VariableRead(component=component, variable=variable):
                found.add(Subject(component, variable))
            case StateTest(component=component):
                found.add(Subject(component))
    return found


def input_targets(system: System) -> dict[tuple[str, tuple[PathStep, ...]], set[Subject]]:
    """For each received datum, by event and path, the variables it is written to, directly or computed with."""
    found: defaultdict[tuple[str, tuple[PathStep, ...]], set[Subject]] = defaultdict(set)
    for automaton in system.automata:
        for edge in automaton.edges:
            for update in edge.updates:
                for leaf in leaves(update.expression):
                    if isinstance(leaf, Received):
                        found[edge.event, leaf.path].add(Subject(automaton.name, update.variable))
    return dict(found)


def force(count: int, edges: Sequence[Sequence[int]]) -> tuple[int, ...]:
    """An order of `count` things with a small total span of `edges`; never worse than the order given."""
    best = order = list(range(count))
    best_span = span(order, edges)
    # Aloul et al. find convergence within a small multiple of log2 of the size.
    for _ in range(20 + 5 * count.bit_length()):
        position = {item: place for place, item in enumerate(order)}
        centres = [sum(position[item] for item in edge) / len(edge) for edge in edges]
        pulls: list[list[float]] = [[] for _ in range(count)]
        for edge, centre in zip(edges, centres, strict=True):
            for item in edge:
                pulls[item].append(centre)
        wanted = {item: sum(pull) / len(pull) if pull else float(position[item]) for item, pull in enumerate(pulls)}
        order = sorted(order, key=lambda item: (wanted[item], position[item]))
        now = span(order, edges)
        if now < best_span:
            best, best_span = order, now
        elif all(item == place for item, place in zip(order, position, strict=True)):
            break
    return tuple(best)


def span(order: Iterable[int], edges: Sequence[Sequence[int]]) -> int:
    """The sum over all edges of the distance between their outermost members."""
    position = {item: place for place, item in enumerate(order)}
    return sum(max(position[item] for item in edge) - min(position[item] for item in edge) for edge in edges)
