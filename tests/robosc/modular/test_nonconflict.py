"""Tests of the search for automata that block each other, against the composition of all of them."""

from collections import Counter
from random import Random

import pytest

from robosc.errors import SynthesisCancelled
from robosc.modular import nonconflict
from robosc.modular.clusters import _inflated, clusters
from robosc.modular.nonconflict import SILENT, Graph, Label, TooLargeError, composed, is_nonconflicting, reduced
from support.effort import seeds

LIMIT = 100_000


def drawn(random: Random, labels: list[str]) -> Graph:
    """An automaton of 1 to 5 states, with silent steps now and then."""
    count = random.randint(1, 5)
    mine = random.sample(labels, random.randint(1, min(3, len(labels))))
    edges: list[list[tuple[Label, int]]] = [
        [
            (random.choice([*mine, SILENT]) if random.random() < 0.3 else random.choice(mine), random.randrange(count))
            for _ in range(random.randint(0, 3))
        ]
        for _ in range(count)
    ]
    marked = {state for state in range(count) if random.random() < 0.5} or {0}
    return Graph(frozenset(mine), [0] if random.random() < 0.8 else [0, count - 1], edges, marked)


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
    good = set(whole.marked)
    while more := {state for state in reached - good if any(target in good for _, target in whole.edges[state])}:
        good |= more
    return reached <= good


@pytest.mark.random
@pytest.mark.parametrize("work", [nonconflict.MAXIMUM_WORK, 10])
def test_abstractions_tell_what_the_whole_composition_tells(work: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """With little work allowed, most are left as they are, and the answers are the same."""
    monkeypatch.setattr(nonconflict, "MAXIMUM_WORK", work)
    met: Counter[bool] = Counter()
    for seed in seeds(300):
        random = Random(seed)
        labels = [f"e{number}" for number in range(random.randint(1, 6))]
        graphs = [drawn(random, labels) for _ in range(random.randint(1, 5))]
        expected = is_nonblocking(graphs)
        copies = [
            Graph(item.labels, item.initial, [list(steps) for steps in item.edges], item.marked) for item in graphs
        ]
        assert is_nonconflicting(copies, limit=LIMIT) == expected
        met[expected] += 1
    assert min(met[True], met[False]) > 30, met


def chain(length: int, *, is_broken: bool) -> list[Graph]:
    """Buffers between machines in a row; where it is broken, the last machine waits for what never comes."""
    found = []
    for place in range(length):
        edges: list[list[tuple[Label, int]]] = [[(f"a{place}", 1)], [(f"a{place + 1}", 0)]]
        found.append(Graph(frozenset({f"a{place}", f"a{place + 1}"}), [0], edges, {0}))
    last = f"a{length}"
    edges = [[("never", 1)], [(last, 0)]] if is_broken else [[(last, 0)]]
    found.append(Graph(frozenset({last, "never"}), [0], edges, {0}))
    if is_broken:
        found.append(Graph(frozenset({"never"}), [0], [[]], {0}))
    return found


@pytest.mark.parametrize("is_broken", [False, True])
def test_what_is_local_is_forgotten_on_the_way(is_broken: bool) -> None:
    """Two hundred buffers have 2**200 states together, and no composition on the way has more than a few."""
    assert is_nonconflicting(chain(200, is_broken=is_broken), limit=50) is not is_broken


def test_a_composition_that_grows_too_large_is_given_up() -> None:
    with pytest.raises(TooLargeError):
        is_nonconflicting(chain(3, is_broken=False), limit=1)
    with pytest.raises(SynthesisCancelled):
        is_nonconflicting(chain(3, is_broken=False), limit=50, should_stop=lambda: True)


def test_weakly_bisimilar_states_become_one() -> None:
    edges: list[list[tuple[Label, int]]] = [[(SILENT, 1), (SILENT, 2)], [("a", 3)], [("a", 4)], [], [(SILENT, 3)]]
    found = reduced(Graph(frozenset({"a"}), [0], edges, {3}))
    assert (len(found.edges), found.marked) == (2, {1})
    # A choice that is made in silence is kept.
    edges = [[(SILENT, 1), (SILENT, 2)], [("a", 0)], [("b", 0)]]
    assert len(reduced(Graph(frozenset({"a", "b"}), [0], edges, {0})).edges) == 3


def test_clusters_are_where_flow_stays() -> None:
    weights = {(a, b): 1.0 for group in ((0, 1, 2, 3), (4, 5, 6, 7)) for a in group for b in group if a < b}
    assert clusters(9, {**weights, (3, 4): 0.5}) == [[0, 1, 2, 3], [4, 5, 6, 7], [8]]
    # Very many equal flows are no reason to lose all of them.
    assert len(_inflated(dict.fromkeys(range(2000), 1.0 / 2000))) == 2_000
