"""Abstractions of an automaton that preserve conflicts: its composition with any other automaton stays blocking or not.

Each rule is independent of the others, and turns an automaton into one that is no larger.

Sources: H. Flordal and R. Malik, "Compositional verification in supervisory control", SIAM J. Control Optim. 48(3),
2009, pp. 1914-1938 (the rules); R. Malik, "The language of certain conflicts of a nondeterministic process", Working
Paper 05/2010, University of Waikato (certain conflicts); R. Milner, "Communication and Concurrency", 1989 (weak
bisimulation); S. Blom and S. Orzan, "Distributed state space minimization", STTT 7(3), 2005, pp. 280-291 (refinement by
signatures).
"""

from collections.abc import Callable, Iterable

from robosc.modular.graphs import SILENT, Edges, Graph, Label, leading_to, quotient, silent_components

MAXIMUM_WORK = 3_000_000
"""Maximum number of parts of signatures for one abstraction; beyond it the automaton is left unchanged."""

MAXIMUM_ROUNDS = 100
"""Maximum number of rounds of the search for certain conflicts: each finding may lead to others."""

MAXIMUM_SPREAD = 8
"""Maximum number of steps that replace one step: an automaton with fewer states must not have many more steps."""

type Rule = Callable[[Graph], Graph]


def reduced(graph: Graph) -> Graph:
    """Return a smaller automaton with the same conflicts, which no rule can reduce further."""
    graph = certain_conflicts(_reachable(graph))
    size = len(graph.edges) + 1
    while len(graph.edges) < size:
        size = len(graph.edges)
        for rule in RULES:
            graph = rule(graph)
    return graph


def certain_conflicts(graph: Graph) -> Graph:
    """Rule of certain conflicts, as far as they are found quickly: states that certainly block become one state.

    Such states reach no marked state, or have a silent step to such a state, which no other automaton can prevent. If
    a label leads to such a state, other steps with the same label are no way out, because another automaton cannot
    choose between them. These steps are dropped, and then more states may reach no marked state.
    """
    edges: Edges = [list(steps) for steps in graph.edges]
    marked, lost = set(graph.marked), set[int]()
    for _ in range(MAXIMUM_ROUNDS):
        alive = leading_to(edges, marked)
        found = {state for state in range(len(edges)) if state not in alive}
        found = leading_to([[step for step in steps if step[0] is SILENT] for steps in edges], found)
        if found == lost:
            break
        lost, marked = found, marked - found
        edges = [_surely(steps, lost) if state not in lost else [] for state, steps in enumerate(edges)]
    if not lost:
        return graph
    first = min(lost)
    blocks = [first if state in lost else state for state in range(len(edges))]
    return quotient(Graph(graph.labels, graph.initial, edges, marked), blocks)


def _surely(steps: list[tuple[Label, int]], lost: set[int]) -> list[tuple[Label, int]]:
    """The steps whose label does not also lead to a blocking state."""
    leading = {label for label, target in steps if target in lost}
    return [(label, target) for label, target in steps if label not in leading or target in lost]


def silent_circles(graph: Graph) -> Graph:
    """Merge states that reach each other by silent steps; these states are weakly bisimilar."""
    components = silent_components(graph)
    is_alone = max(components, default=-1) == len(components) - 1
    if is_alone and not any((SILENT, state) in steps for state, steps in enumerate(graph.edges)):
        return graph
    return quotient(graph, components)


def only_silent_outgoing(graph: Graph) -> Graph:
    """Rule of only silent outgoing steps: an unmarked state that has no other outgoing steps is left out.

    Steps to this state lead to the targets of its own steps instead.
    """
    graph = silent_circles(graph)
    instead: dict[int, frozenset[int]] = {}
    for state in _later_first(graph):
        steps = graph.edges[state]
        if steps and state not in graph.marked and all(label is SILENT for label, _ in steps):
            ends = frozenset[int]().union(*(instead.get(target, {target}) for _, target in steps))
            if len(ends) <= MAXIMUM_SPREAD:
                instead[state] = ends
    if not instead:
        return graph
    edges: Edges = [
        [(label, end) for label, target in steps for end in sorted(instead.get(target, {target}))]
        for steps in graph.edges
    ]
    initial = [end for state in graph.initial for end in sorted(instead.get(state, {state}))]
    return _reachable(Graph(graph.labels, initial, edges, graph.marked))


def silent_incoming(graph: Graph) -> Graph:
    """Rule of silent incoming steps: a state with only silent incoming steps and a silent outgoing step is left out.

    The states before it get its steps. A conflict in this state is also one in the target of its silent step.
    """
    graph = silent_circles(graph)
    before: list[int] = [0] * len(graph.edges)
    kept = set(graph.initial)
    for steps in graph.edges:
        for label, target in steps:
            before[target] += 1
            if label is not SILENT:
                kept.add(target)
    edges: Edges = [list(steps) for steps in graph.edges]
    marked = set(graph.marked)
    gone = set[int]()
    for state in _later_first(graph):
        found: dict[tuple[Label, int], None] = {}
        for label, target in graph.edges[state]:
            if target in gone:
                found.update(dict.fromkeys(edges[target]))
                if target in marked:
                    marked.add(state)
            else:
                found[label, target] = None
        steps = edges[state] = list(found)
        is_left = any(label is SILENT for label, _ in steps)
        if is_left and state not in kept and (before[state] == 1 or len(steps) <= MAXIMUM_SPREAD):
            gone.add(state)
    if not gone:
        return graph
    return _reachable(Graph(graph.labels, graph.initial, edges, marked))


def silent_continuation(graph: Graph) -> Graph:
    """Rule of silent continuation: states with equal incoming steps, and with silent outgoing steps, are merged.

    A conflict in one of them also occurs in a later state without silent outgoing steps, which is not merged.
    """
    graph = silent_circles(graph)
    incoming = _incoming(graph)
    if incoming is None:
        return graph
    return _with_classes(
        graph,
        (
            incoming[state] if any(label is SILENT for label, _ in steps) else state
            for state, steps in enumerate(graph.edges)
        ),
    )


def active_events(graph: Graph) -> Graph:
    """Rule of active events: states with equal incoming steps, equal next labels and equal marking are merged.

    A conflict after a next label could also have occurred from another one of the merged states.
    """
    graph = silent_circles(graph)
    incoming = _incoming(graph)
    if incoming is None:
        return graph
    active: list[frozenset[object]] = [frozenset()] * len(graph.edges)
    for state in _later_first(graph):
        found: set[object] = {("marked",)} if state in graph.marked else set()
        for label, target in graph.edges[state]:
            if label is SILENT:
                found |= active[target]
            else:
                found.add((label,))
        active[state] = frozenset(found)
    return _with_classes(graph, zip(incoming, active, strict=True))


def weak_bisimulation(graph: Graph) -> Graph:
    """Merge weakly bisimilar states: states with the same labels that lead to the same classes."""
    graph = silent_circles(graph)
    blocks = _weak_blocks(graph)
    return graph if blocks is None else _with_classes(graph, blocks)


RULES: tuple[Rule, ...] = (
    only_silent_outgoing,
    silent_incoming,
    weak_bisimulation,
    silent_continuation,
    active_events,
    certain_conflicts,
)
"""The rules, in the order in which they are tried."""


def _later_first(graph: Graph) -> list[int]:
    """The states, each after its successors by silent steps; there must be no cycle of silent steps."""
    return sorted(range(len(graph.edges)), key=silent_components(graph).__getitem__)


def _reachable(graph: Graph) -> Graph:
    return quotient(graph, range(len(graph.edges)))


def _with_classes(graph: Graph, classes: Iterable[object]) -> Graph:
    """Merge the states of each class."""
    numbers: dict[object, int] = {}
    blocks = [numbers.setdefault(item, len(numbers)) for item in classes]
    return graph if len(numbers) == len(blocks) else quotient(graph, blocks)


def _incoming(graph: Graph) -> list[frozenset[object]] | None:
    """For each state its incoming steps with a label, or the beginning, each possibly followed by silent steps.

    None if that takes too much work. There must be no cycle of silent steps.
    """
    found: list[set[object]] = [set() for _ in graph.edges]
    for state in graph.initial:
        found[state].add("begin")
    for state, steps in enumerate(graph.edges):
        for label, target in steps:
            if label is not SILENT:
                found[target].add((state, label))
    work = 0
    for state in reversed(_later_first(graph)):
        for label, target in graph.edges[state]:
            if label is SILENT:
                found[target] |= found[state]
                work += len(found[state])
                if work > MAXIMUM_WORK:
                    return None
    return [frozenset(item) for item in found]


def _weak_blocks(graph: Graph) -> list[int] | None:
    """For each state the number of its class of weak bisimulation; None if that takes too much work.

    There must be no cycle of silent steps.
    """
    work, count = 0, len(graph.edges)
    silent = [[target for label, target in steps if label is SILENT] for steps in graph.edges]
    order = _later_first(graph)
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
