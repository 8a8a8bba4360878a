"""A static variable order from the structure of a system.

FORCE only finds a good order near the one that it starts with, and people declare things in any order. It starts with
several: the declared one and two that follow the structure alone.

Sources: F. A. Aloul, I. L. Markov and K. A. Sakallah, "FORCE: a fast and easy-to-implement variable-ordering
heuristic", Great Lakes Symposium on VLSI, 2003, pp. 116-119; after it every window of a few neighbours takes its best
permutation (M. Fujita, Y. Matsunaga and T. Kakuda, "On variable ordering of binary decision diagrams for the
application of multi-level logic synthesis", EDAC 1991, pp. 50-54), judged by the same span. The other starts are level
by level (E. Cuthill and J. McKee, "Reducing the bandwidth of sparse symmetric matrices", ACM National Conference, 1969,
pp. 157-172), which suits rows, rings and grids, and depth first, which suits trees. Both set out from an outermost
place (A. George and J. W. H. Liu, "An implementation of a pseudoperipheral node finder", ACM TOMS 5(3), 1979, pp.
284-295).
"""

from collections import Counter, defaultdict, deque
from collections.abc import Iterable, Sequence
from functools import cache
from itertools import permutations
from operator import mul

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
from robosc.synthesis.result import Order

_WINDOW = 4
"""Neighbours that are permuted together: 24 ways."""

_CLEARLY = 0.9
"""Share of the span of the declared start up to which another start is better: within that, nothing is gained."""

_HUB_EDGES = 16
_HUB_FACTOR = 4
"""Edges that a thing is in so that it counts as a hub: so many, and so many times as many as others are in."""

_PAIR = 12
"""Weight of an edge between two, twice; longer ones weigh less, but at least one."""

_SLIDES = 4
"""Times that the window slides at most."""


Blocks = tuple[tuple[Subject, ...], ...]


def block_order(
    system: System, blocks: Sequence[tuple[Subject, ...]], conditions: Iterable[Expression] = ()
) -> tuple[Order, Blocks]:
    """The blocks of places of a state, so that those that an event touches together stand near each other.

    Args:
        system: The system.
        blocks: Each place of its state once; the places of one block have one place in the order.
        conditions: Conditions beside those of the system whose subjects are to stand near each other, too.
    """
    graph = _Graph(system, blocks, tuple(map(subjects_read, conditions)))
    name, order = best_order(len(blocks), graph.edges)
    return name, graph.ordered(order)


def other_order(
    system: System, blocks: Sequence[tuple[Subject, ...]], best: tuple[Order, Blocks]
) -> tuple[Order, Blocks]:
    """Another order than the best one of `block_order`, for systems in which that is bad.

    All members of a long edge, such as of a condition on everything, are hardly nearer to each other in one order than
    in another. So edges count by how few they join: parts of one device stay together, and devices that are alike do
    not mix. This is not better in general, but it is bad for other systems. So is another start.

    Args:
        system: The system.
        blocks: As for `block_order`.
        best: The best order.
    """
    graph = _Graph(system, blocks)
    weights = [max(1, round(_PAIR / len(edge))) for edge in graph.edges]
    is_depth_first = best[0] is Order.LEVELS
    start = traversal(len(blocks), graph.edges, is_depth_first=is_depth_first)
    found = graph.ordered(_improved(start, graph.edges, weights))
    if found == best[1]:
        return Order.REVERSED, found[::-1]
    return Order.PAIRED_DEPTHS if is_depth_first else Order.PAIRED_LEVELS, found


class _Graph:
    """Blocks that belong together.

    Args:
        system: The system.
        blocks: Each place of its state once; the places of one block have one place in the order.
        more: Subjects that belong together beside those of the system.

    Attributes:
        edges: For what belongs together the numbers of the blocks. Through a hub everything is near everything: the
            order of the rest is found without.
    """

    def __init__(
        self, system: System, blocks: Sequence[tuple[Subject, ...]], more: tuple[frozenset[Subject], ...] = ()
    ) -> None:
        self._blocks = blocks
        index = {subject: place for place, block in enumerate(blocks) for subject in block}
        edges = [sorted({index[subject] for subject in edge}) for edge in (*hyperedges(system), *more)]
        edges = [edge for edge in edges if len(edge) > 1]
        # Places by which conditions of their own remember a hub have to stand near it, not below everything.
        self._hubs = frozenset[int]() if more else hubs_of(edges)
        rest = ([place for place in edge if place not in self._hubs] for edge in edges)
        self.edges = [edge for edge in rest if len(edge) > 1]

    def ordered(self, order: Sequence[int]) -> Blocks:
        """Blocks in an order of their numbers, but that hubs come last."""
        return tuple(self._blocks[place] for place in sorted(order, key=lambda place: place in self._hubs))


def hubs_of(edges: Sequence[Sequence[int]]) -> frozenset[int]:
    """The things that are in many more edges than others; they come last in the order.

    FORCE would put them in the middle. Then every edge that lies below begins at them, and saturation, which closes
    sets under the edges that begin at one level, has half of a system to close at once. If they are last, each edge
    begins at what is its own.
    """
    count_of = Counter(item for edge in edges for item in edge)
    least = max(_HUB_EDGES, _HUB_FACTOR * count_of.total() / max(1, len(count_of)))
    return frozenset(item for item, count in count_of.items() if count >= least)


def best_order(count: int, edges: Sequence[Sequence[int]]) -> tuple[Order, tuple[int, ...]]:
    """The order of `count` things with the least span that FORCE and a window find from several starts."""
    name, best = Order.DECLARED, _improved(range(count), edges)
    least = _CLEARLY * span(best, edges)
    for other_name, is_depth_first in ((Order.LEVELS, False), (Order.DEPTHS, True)):
        other = _improved(traversal(count, edges, is_depth_first=is_depth_first), edges)
        found = span(other, edges)
        if found < least:
            name, best, least = other_name, other, found
    return name, best


def _improved(
    start: Sequence[int], edges: Sequence[Sequence[int]], weights: Sequence[int] | None = None
) -> tuple[int, ...]:
    """The order that FORCE and a window find from a start; weights say how often an edge counts."""
    position = {item: place for place, item in enumerate(start)}
    renamed = [sorted(position[item] for item in edge) for edge in edges]
    found = slide(force(len(start), renamed, weights), renamed, weights)
    return tuple(start[place] for place in found)


def traversal(count: int, edges: Sequence[Sequence[int]], *, is_depth_first: bool) -> tuple[int, ...]:
    """An order of `count` things that follows the edges from the outermost things on, each part for itself.

    Smaller edges are followed first, and in them things in fewer edges.

    Args:
        count: Number of things.
        edges: Things that belong together.
        is_depth_first: True if what was found last is followed first, false if level by level.
    """
    of_item: list[list[int]] = [[] for _ in range(count)]
    for number in sorted(range(len(edges)), key=lambda number: len(edges[number])):
        for item in edges[number]:
            of_item[item].append(number)
    found: dict[int, None] = {}
    for item in sorted(range(count), key=lambda item: len(of_item[item])):
        if item not in found:
            # The last thing found, and the last one from there, is about as far out as anything.
            start = _followed(_followed(item, edges, of_item)[-1], edges, of_item)[-1]
            found |= dict.fromkeys(_followed(start, edges, of_item, is_depth_first=is_depth_first))
    return tuple(found)


def _followed(
    start: int, edges: Sequence[Sequence[int]], of_item: Sequence[Sequence[int]], *, is_depth_first: bool = False
) -> list[int]:
    """The things connected with one, in the order in which they are found."""
    found: dict[int, None] = {}
    followed = set[int]()
    waiting = deque([start])
    while waiting:
        item = waiting.pop() if is_depth_first else waiting.popleft()
        if item in found:
            continue
        found[item] = None
        new: list[int] = []
        for number in of_item[item]:
            if number not in followed:
                followed.add(number)
                new += sorted((other for other in edges[number] if other not in found), key=lambda o: len(of_item[o]))
        waiting.extend(reversed(new) if is_depth_first else new)
    return list(found)


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
    for item in (*system.conditions, *system.plant_conditions):
        touched[item.event] |= subjects_read(item.condition)
    found.update((frozenset(touched[event.name]), None) for event in system.events)
    on_events = (item.condition for item in (*system.conditions, *system.plant_conditions))
    # The initial and the marked predicate are mostly one long list, of which the parts alone say anything.
    for condition in (system.initial, system.marker):
        found.update((subjects_read(part), None) for part in simple_parts(condition))
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


def force(count: int, edges: Sequence[Sequence[int]], weights: Sequence[int] | None = None) -> tuple[int, ...]:
    """An order of `count` things with a small total span of `edges`, weighted; never worse than the order given."""
    weights = weights or [1] * len(edges)
    best = order = list(range(count))
    best_span = span(order, edges, weights)
    known = {tuple(order)}
    # Aloul et al. find convergence within a small multiple of log2 of the size.
    for _ in range(20 + 5 * count.bit_length()):
        position = {item: place for place, item in enumerate(order)}
        centres = [sum(position[item] for item in edge) / len(edge) for edge in edges]
        pulls, forces = [0.0] * count, [0] * count
        for edge, centre, weight in zip(edges, centres, weights, strict=True):
            for item in edge:
                pulls[item] += weight * centre
                forces[item] += weight
        wanted = [pulls[item] / forces[item] if forces[item] else float(position[item]) for item in range(count)]
        order = sorted(order, key=lambda item: (wanted[item], position[item]))
        now = span(order, edges, weights)
        if now < best_span:
            best, best_span = order, now
        if tuple(order) in known:
            break  # The following orders have been seen.
        known.add(tuple(order))
    return tuple(best)


def slide(
    order: Sequence[int],
    edges: Sequence[Sequence[int]],
    weights: Sequence[int] | None = None,
    *,
    width: int = _WINDOW,
    times: int = _SLIDES,
) -> tuple[int, ...]:
    """The order after a window of `width` neighbours has slid over it and has taken its best permutation everywhere.

    It slides again as long as that helps, at most `times`; the span never grows.
    """
    weights = weights or [1] * len(edges)
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
            numbers = sorted({number for item in window for number in of_item[item]})
            touched = [(edges[number], weights[number]) for number in numbers]
            chosen = _best_permutation(window, start, touched, position)
            if chosen != window:
                best[start : start + width] = chosen
                has_changed = True
        if not has_changed:
            break
    return tuple(best)


def _best_permutation(
    window: list[int], start: int, edges: Sequence[tuple[Sequence[int], int]], position: dict[int, int]
) -> list[int]:
    """The permutation of a window with the least span of the edges that touch it; leaves `position` at it."""
    members = {item: 1 << number for number, item in enumerate(window)}
    # An edge reaches as far outside of the window as it does, however the window is ordered: of what is inside, by the
    # set of its members, the last place counts where nothing is beyond it, and the first one where nothing is before.
    firsts, lasts = defaultdict[int, int](int), defaultdict[int, int](int)
    for edge, weight in edges:
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
            lasts[inside] += weight
        if not is_before:
            firsts[inside] += weight
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


def span(order: Iterable[int], edges: Sequence[Sequence[int]], weights: Sequence[int] | None = None) -> int:
    """The sum over all edges of the distance between their outermost members, times its weight."""
    position = {item: place for place, item in enumerate(order)}
    spans = (max(position[item] for item in edge) - min(position[item] for item in edge) for edge in edges)
    return sum(map(mul, weights, spans)) if weights else sum(spans)
