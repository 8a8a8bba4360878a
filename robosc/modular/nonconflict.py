"""Search whether automata that share events block each other, on abstractions: none ever holds all of their states.

Two automata at a time are composed; events that no other one has are hidden, and what is left is made as small as weak
bisimulation makes it, after all that can reach no marked state has become one state. Neither changes whether the whole
is nonblocking.

Sources: H. Flordal and R. Malik, "Compositional verification in supervisory control", SIAM J. Control Optim. 48(3),
2009, pp. 1914-1938; R. Milner, "Communication and Concurrency", 1989 (weak bisimulation); S. Blom and S. Orzan,
"Distributed state space minimization", STTT 7(3), 2005, pp. 280-291 (refinement by signatures).
"""

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from robosc.errors import SynthesisCancelled

type Label = Hashable
type Edges = list[list[tuple[Label, int]]]

SILENT: Label = None
"""Label of a step that no other automaton takes part in."""


MAXIMUM_WORK = 3_000_000
"""Parts of signatures that are made for one abstraction, beyond which it is left as it is."""


class TooLargeError(Exception):
    """A composition has too many states."""


@dataclass(slots=True)
class Graph:
    """An automaton with numbered states.

    Attributes:
        labels: Labels that it takes part in.
        initial: States that it may begin in.
        edges: For each state the labels of its steps, each with the state that it leads to.
        marked: The marked states.
    """

    labels: frozenset[Label]
    initial: list[int]
    edges: Edges
    marked: set[int]


def is_nonconflicting(graphs: Iterable[Graph], *, limit: int, should_stop: Callable[[], bool] = lambda: False) -> bool:
    """Return True if automata together can always get to where all of them are marked.

    Args:
        graphs: The automata.
        limit: States of a composition beyond which the search is given up.
        should_stop: Function called between two compositions; once it returns true, the work ends.

    Raises:
        TooLargeError: A composition has more states.
        SynthesisCancelled: `should_stop` became true.
    """
    waiting = dict(enumerate(graphs))
    owners = defaultdict[Label, set[int]](set)
    for number, graph in waiting.items():
        for label in graph.labels:
            owners[label].add(number)

    def put(number: int, graph: Graph) -> None:
        shared = frozenset(label for label in graph.labels if owners[label] - {number})
        for label in graph.labels - shared:
            owners.pop(label, None)
        waiting[number] = reduced(_hidden(graph, shared))

    for number in list(waiting):
        put(number, waiting[number])
    while True:
        if should_stop():
            raise SynthesisCancelled("the search for blocking modules was stopped")
        pair = _next_pair(waiting, owners)
        if pair is None:
            break
        one, other = pair
        whole = composed(waiting.pop(one), waiting.pop(other), limit)
        for label in whole.labels:
            owners[label].discard(other)
            owners[label].add(one)
        put(one, whole)
    # Those that are left share nothing, so each is nonblocking by itself or not.
    return all(map(_is_nonblocking, waiting.values())) and all(graph.initial for graph in waiting.values())


def _next_pair(waiting: dict[int, Graph], owners: dict[Label, set[int]]) -> tuple[int, int] | None:
    """The next two automata to compose: the smallest, with the one that gives it the smallest composition."""
    for number in sorted(waiting, key=lambda item: len(waiting[item].edges)):
        shared = defaultdict[int, int](int)
        hidden = defaultdict[int, int](int)
        for label in waiting[number].labels:
            others = owners[label] - {number}
            for other in others:
                shared[other] += 1
                hidden[other] += len(others) == 1
        if shared:
            return number, min(shared, key=lambda item: (len(waiting[item].edges) / (1 + hidden[item]), item))
    return None


def _hidden(graph: Graph, kept: frozenset[Label]) -> Graph:
    edges = [[(label if label in kept else SILENT, target) for label, target in steps] for steps in graph.edges]
    return Graph(kept, graph.initial, edges, graph.marked)


def composed(one: Graph, other: Graph, limit: int) -> Graph:
    """Return the synchronous composition of two automata, as far as it can be reached.

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


# Abstraction


def reduced(graph: Graph) -> Graph:
    """Return a smaller automaton that blocks the same others: weakly bisimilar, what is lost being one state."""
    graph = _quotient(graph, _merge_blocking(graph))
    graph = _quotient(graph, _silent_circles(graph))
    blocks = _weak_blocks(graph)
    return graph if blocks is None else _quotient(graph, blocks)


def _merge_blocking(graph: Graph) -> list[int]:
    """For each state its number, or a common one for those that reach no marked state; these lose their steps."""
    alive = _leading_to(graph, graph.marked)
    lost = next((state for state in range(len(graph.edges)) if state not in alive), 0)
    for state in range(len(graph.edges)):
        if state not in alive:
            graph.edges[state] = []
    return [state if state in alive else lost for state in range(len(graph.edges))]


def _leading_to(graph: Graph, states: set[int]) -> set[int]:
    before: list[list[int]] = [[] for _ in graph.edges]
    for state, steps in enumerate(graph.edges):
        for _, target in steps:
            before[target].append(state)
    found, waiting = set(states), list(states)
    while waiting:
        for state in before[waiting.pop()]:
            if state not in found:
                found.add(state)
                waiting.append(state)
    return found


def _is_nonblocking(graph: Graph) -> bool:
    alive = _leading_to(graph, graph.marked)
    found, waiting = set(graph.initial), list(graph.initial)
    while waiting:
        state = waiting.pop()
        if state not in alive:
            return False
        for _, target in graph.edges[state]:
            if target not in found:
                found.add(target)
                waiting.append(target)
    return True


def _silent_circles(graph: Graph) -> list[int]:
    """For each state the number of its strongly connected component under silent steps (Tarjan)."""
    silent = [[target for label, target in steps if label is SILENT] for steps in graph.edges]
    return _components(silent)


def _components(following: Sequence[Sequence[int]]) -> list[int]:
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


def _weak_blocks(graph: Graph) -> list[int] | None:
    """For each state the number of its class of weak bisimulation; None where that takes too much work.

    There are no circles of silent steps.
    """
    work, count = 0, len(graph.edges)
    silent = [[target for label, target in steps if label is SILENT] for steps in graph.edges]
    # A component has a larger number than those that it leads to, so that all that follows a state is known before it.
    order = sorted(range(count), key=_components(silent).__getitem__)
    blocks, blocks_count = [0] * count, 1
    while True:
        reached: list[frozenset[int]] = [frozenset()] * count
        for state in order:
            ends = {blocks[state]}
            for target in silent[state]:
                ends |= reached[target]
            reached[state] = frozenset(ends)
            work += len(ends)
        signatures: list[frozenset[object]] = [frozenset()] * count
        for state in order:
            found: set[object] = {("marked",)} if state in graph.marked else set()
            for label, target in graph.edges[state]:
                if label is SILENT:
                    found |= signatures[target]
                else:
                    found.update((label, end) for end in reached[target])
            found.update((SILENT, end) for end in reached[state])
            signatures[state] = frozenset(found)
            work += len(found)
            if work > MAXIMUM_WORK:
                return None
        numbers: dict[tuple[int, frozenset[object]], int] = {}
        blocks = [numbers.setdefault((blocks[state], signatures[state]), len(numbers)) for state in range(count)]
        if len(numbers) == blocks_count:
            return blocks
        blocks_count = len(numbers)


def _quotient(graph: Graph, blocks: Sequence[int]) -> Graph:
    """Return the automaton whose states are classes of states, as far as they can be reached."""
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
