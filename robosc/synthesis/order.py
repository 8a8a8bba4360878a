"""A static variable order from the structure of a system.

Source: F. A. Aloul, I. L. Markov and K. A. Sakallah, "FORCE: a fast and easy-to-implement variable-ordering
heuristic", Great Lakes Symposium on VLSI, 2003, pp. 116-119; after it every window of a few neighbours takes its best
permutation (M. Fujita, Y. Matsunaga and T. Kakuda, "On variable ordering of binary decision diagrams for the
application of multi-level logic synthesis", EDAC 1991, pp. 50-54), judged by the same span.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from functools import cache
from itertools import permutations

from robosc.automata.compile import subjects_read
from robosc.automata.state import Subject
from robosc.automata.structure import System
from robosc.expressions import (
    Expression,
    PathStep,
    Received,
    leaves,
    simple_parts,
)

_WINDOW = 4
"""Neighbours that are permuted together: 24 ways."""

_SLIDES = 4
"""Times that the window slides at most."""


def block_order(
    system: System, blocks: Sequence[tuple[Subject, ...]], conditions: Iterable[Expression] = ()
) -> tuple[tuple[Subject, ...], ...]:
    """The blocks of places of a state, so that those that an event touches together stand near each other.

    Args:
        system: The system.
        blocks: Each place of its state once; the places of one block have one place in the order.
        conditions: Conditions beside those of the system whose subjects are to stand near each other, too.
    """
    index = {subject: place for place, block in enumerate(blocks) for subject in block}
    together = (*hyperedges(system), *map(subjects_read, conditions))
    edges = [sorted({index[subject] for subject in edge}) for edge in together]
    edges = [edge for edge in edges if len(edge) > 1]
    return tuple(blocks[place] for place in slide(force(len(blocks), edges), edges))


def hyperedges(system: System) -> tuple[frozenset[Subject], ...]:
    """For each event, each condition and each part of one, the subjects it touches; each set once, in first order."""
    found: dict[frozenset[Subject], None] = {}
    touched = defaultdict[str, set[Subject]](set)
    for automaton in system.automata:
        for edge in automaton.edges:
            together = touched[edge.event]
            together.add(Subject(automaton.name))
            together |= subjects_read(edge.guard)
            for update in edge.updates:
                together.add(Subject(automaton.name, update.variable))
                together |= subjects_read(update.expression)
    for item in system.plant_conditions:
        touched[item.event] |= subjects_read(item.condition)
    found.update((frozenset(touched[event.name]), None) for event in system.events)
    on_events = (item.condition for item in (*system.conditions, *system.plant_conditions))
    for condition in (*on_events, *system.invariants, *system.plant_invariants):
        found[subjects_read(condition)] = None
        # Compared subjects belong closer together than those that a long condition merely lists.
        for part in simple_parts(condition):
            found[subjects_read(part)] = None
    return tuple(edge for edge in found if len(edge) > 1)


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
    known = {tuple(order)}
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
        if tuple(order) in known:
            break  # The following orders have been seen.
        known.add(tuple(order))
    return tuple(best)


def slide(
    order: Sequence[int], edges: Sequence[Sequence[int]], *, width: int = _WINDOW, times: int = _SLIDES
) -> tuple[int, ...]:
    """The order after a window of `width` neighbours has slid over it and has taken its best permutation everywhere.

    It slides again as long as that helps, at most `times`; the span never grows.
    """
    best = list(order)
    of_item = defaultdict[int, list[int]](list)
    for number, edge in enumerate(edges):
        for item in edge:
            of_item[item].append(number)
    position = {item: place for place, item in enumerate(best)}
    for _ in range(times):
        has_changed = False
        for start in range(len(best) - width + 1):
            window = best[start : start + width]
            touched = [edges[number] for number in sorted({number for item in window for number in of_item[item]})]
            chosen = _best_permutation(window, start, touched, position)
            if chosen != window:
                best[start : start + width] = chosen
                has_changed = True
        if not has_changed:
            break
    return tuple(best)


def _best_permutation(
    window: list[int], start: int, edges: Sequence[Sequence[int]], position: dict[int, int]
) -> list[int]:
    """The permutation of a window with the least span of the edges that touch it; leaves `position` at it."""
    members = {item: 1 << number for number, item in enumerate(window)}
    # An edge reaches as far outside of the window as it does, however the window is ordered: of what is inside, by the
    # set of its members, the last place counts where nothing is beyond it, and the first one where nothing is before.
    firsts, lasts = defaultdict[int, int](int), defaultdict[int, int](int)
    for edge in edges:
        inside = 0
        is_beyond = is_before = False
        for item in edge:
            member = members.get(item)
            if member is not None:
                inside |= member
            elif position[item] < start:
                is_before = True
            else:
                is_beyond = True
        if not is_beyond:
            lasts[inside] += 1
        if not is_before:
            firsts[inside] += 1
    best, least = tuple(range(len(window))), None
    for candidate, first, last in _permutations(len(window)):
        total = 0
        for inside, count in lasts.items():
            total += count * last[inside]
        for inside, count in firsts.items():
            total -= count * first[inside]
        if least is None or total < least:
            best, least = candidate, total
    chosen = [window[number] for number in best]
    position.update((item, start + offset) for offset, item in enumerate(chosen))
    return chosen


@cache
def _permutations(width: int) -> tuple[tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]], ...]:
    """Each permutation of a window, with the first and the last place of each set of its members (its bits)."""
    found = []
    for candidate in permutations(range(width)):
        places = [
            [candidate.index(member) for member in range(width) if inside >> member & 1] for inside in range(2**width)
        ]
        found.append(
            (
                candidate,
                tuple(min(some, default=0) for some in places),
                tuple(max(some, default=0) for some in places),
            )
        )
    return tuple(found)


def span(order: Iterable[int], edges: Sequence[Sequence[int]]) -> int:
    """The sum over all edges of the distance between their outermost members."""
    position = {item: place for place, item in enumerate(order)}
    return sum(max(position[item] for item in edge) - min(position[item] for item in edge) for edge in edges)
