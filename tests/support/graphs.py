"""Random automata with numbered states, and the slow way to find out whether some block each other."""

from random import Random

from robosc.modular.graphs import SILENT, Graph, Label, composed

LIMIT = 100_000


def drawn(random: Random, labels: list[str], *, states: int, silent: float = 0.3) -> Graph:
    """An automaton with some of the labels, of whose steps some are silent."""
    mine = random.sample(labels, random.randint(1, min(4, len(labels))))
    edges: list[list[tuple[Label, int]]] = [
        [
            (random.choice(mine) if random.random() > silent else SILENT, random.randrange(states))
            for _ in range(random.randint(0, 4))
        ]
        for _ in range(states)
    ]
    marked = {state for state in range(states) if random.random() < 0.4} or {0}
    return Graph(frozenset(mine), [0] if random.random() < 0.8 else [0, states - 1], edges, marked)


def cycle(random: Random, labels: list[str], *, states: int) -> Graph:
    """An automaton that goes through all of its states again and again: little can be left out."""
    mine = random.sample(labels, random.randint(min(2, len(labels)), len(labels)))
    edges: list[list[tuple[Label, int]]] = [[(random.choice(mine), (state + 1) % states)] for state in range(states)]
    for _ in range(random.randint(0, 2 * states)):
        edges[random.randrange(states)].append((random.choice(mine), random.randrange(states)))
    return Graph(frozenset(mine), [0], edges, {0, random.randrange(states)})


def is_nonblocking(graphs: list[Graph]) -> bool:
    """Look at every state of the composition."""
    whole = graphs[0]
    for graph in graphs[1:]:
        whole = composed(whole, graph, LIMIT)
    reached, waiting = set(whole.initial), list(whole.initial)
    while waiting:
        for _, target in whole.edges[waiting.pop()]:
            if target not in reached:
                reached.add(target)
                waiting.append(target)
    good, before = set[int](), set(whole.marked)
    while before:
        good |= before
        before = {state for state in reached - good if any(target in before for _, target in whole.edges[state])}
    return reached <= good
