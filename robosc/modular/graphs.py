"""Automata with numbered states and labels: composition, hiding of labels, and merging of classes of states."""

from collections import defaultdict
from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass

type Label = Hashable
type Edges = list[list[tuple[Label, int]]]

SILENT: Label = None
"""Label of a silent step, in which no other automaton takes part."""


class TooLargeError(Exception):
    """A composition has too many states."""


@dataclass(slots=True)
class Graph:
    """An automaton with numbered states.

    Attributes:
        labels: Labels that it takes part in.
        initial: The initial states.
        edges: For each state the labels of its steps, each with the target state.
        marked: The marked states.
    """

    labels: frozenset[Label]
    initial: list[int]
    edges: Edges
    marked: set[int]


def hidden(graph: Graph, kept: frozenset[Label]) -> Graph:
    """Return the automaton in which all labels except the given ones are silent."""
    edges = [[(label if label in kept else SILENT, target) for label, target in steps] for steps in graph.edges]
    return Graph(kept, graph.initial, edges, graph.marked)


def composed(one: Graph, other: Graph, limit: int) -> Graph:
    """Return the reachable part of the synchronous composition of two automata.

    Raises:
        TooLargeError: It has more than `limit` states.
    """
    common = one.labels & other.labels
    steps = [_by_label(other, state) for state in range(len(other.edges))]
    numbers: dict[tuple[int, int], int] = {}
    states: list[tuple[int, int]] = []

    def number_of(pair: tuple[int, int]) -> int:
        found = numbers.get(pair)
        if found is None:
            found = numbers[pair] = len(states)
            states.append(pair)
        return found

    initial = [number_of((left, right)) for left in one.initial for right in other.initial]
    edges: Edges = []
    while len(edges) < len(states):
        if len(states) > limit:
            raise TooLargeError
        left, right = states[len(edges)]
        found: list[tuple[Label, int]] = []
        for label, target in one.edges[left]:
            if label in common:
                found += [(label, number_of((target, end))) for end in steps[right].get(label, ())]
            else:
                found.append((label, number_of((target, right))))
        for label, ends in steps[right].items():
            if label not in common:
                found += [(label, number_of((left, end))) for end in ends]
        edges.append(found)
    marked = {number for number, (left, right) in enumerate(states) if left in one.marked and right in other.marked}
    return Graph(one.labels | other.labels, initial, edges, marked)


def _by_label(graph: Graph, state: int) -> dict[Label, list[int]]:
    found: dict[Label, list[int]] = {}
    for label, target in graph.edges[state]:
        found.setdefault(label, []).append(target)
    return found


def leading_to(edges: Edges, states: set[int]) -> set[int]:
    """Return the states that some states can be reached from."""
    before: list[list[int]] = [[] for _ in edges]
    for state, steps in enumerate(edges):
        for _, target in steps:
            before[target].append(state)
    return _reached(states, before)


def is_nonblocking(graph: Graph) -> bool:
    """Return True if an automaton alone can always reach a marked state."""
    after = [[target for _, target in steps] for steps in graph.edges]
    return _reached(graph.initial, after) <= leading_to(graph.edges, graph.marked)


def _reached(states: Iterable[int], after: Sequence[Sequence[int]]) -> set[int]:
    found, waiting = set(states), list(states)
    while waiting:
        for state in after[waiting.pop()]:
            if state not in found:
                found.add(state)
                waiting.append(state)
    return found


def silent_components(graph: Graph) -> list[int]:
    """For each state the number of its component under silent steps; it is larger than those of its successors."""
    silent = [[target for label, target in steps if label is SILENT] for steps in graph.edges]
    return components(silent)


def components(following: Sequence[Sequence[int]]) -> list[int]:
    """The strongly connected component of each node; a component has a larger number than those that it leads to.

    Source: R. Tarjan, "Depth-first search and linear graph algorithms", SIAM J. Comput. 1(2), 1972, pp. 146-160.
    """
    count = len(following)
    component, low, index = [-1] * count, [0] * count, [-1] * count
    stack: list[int] = []
    visited = components = 0
    for root in range(count):
        if index[root] >= 0:
            continue
        path: list[tuple[int, Iterator[int]]] = []

        def enter(node: int, path: list[tuple[int, Iterator[int]]] = path) -> None:
            nonlocal visited
            index[node] = low[node] = visited
            visited += 1
            stack.append(node)
            path.append((node, iter(following[node])))

        enter(root)
        while path:
            node, targets = path[-1]
            for target in targets:
                if index[target] < 0:
                    enter(target)
                    break
                if component[target] < 0:
                    low[node] = min(low[node], index[target])
            else:
                path.pop()
                if path:
                    low[path[-1][0]] = min(low[path[-1][0]], low[node])
                if low[node] == index[node]:
                    while component[node] < 0:
                        component[stack.pop()] = components
                    components += 1
    return component


def quotient(graph: Graph, blocks: Sequence[int]) -> Graph:
    """Return the reachable part of the automaton whose states are classes of states."""
    members = defaultdict[int, list[int]](list)
    for state, block in enumerate(blocks):
        members[block].append(state)
    numbers: dict[int, int] = {}
    found: list[int] = []

    def number_of(block: int) -> int:
        number = numbers.get(block)
        if number is None:
            number = numbers[block] = len(found)
            found.append(block)
        return number

    initial = list(dict.fromkeys(number_of(blocks[state]) for state in graph.initial))
    edges: Edges = []
    while len(edges) < len(found):
        here = len(edges)
        steps = dict.fromkeys(
            (label, number_of(blocks[target])) for state in members[found[here]] for label, target in graph.edges[state]
        )
        edges.append([(label, target) for label, target in steps if label is not SILENT or target != here])
    marked = {number for number, block in enumerate(found) if any(state in graph.marked for state in members[block])}
    return Graph(graph.labels, initial, edges, marked)
