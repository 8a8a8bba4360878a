"""Tests of the search for automata that block each other, against the composition of all of them."""

from collections import Counter
from random import Random

import pytest

from robosc.errors import SynthesisCancelled
from robosc.modular import abstraction, nonconflict
from robosc.modular.clusters import _inflated, clusters
from robosc.modular.graphs import Graph, Label, TooLargeError, composed
from robosc.modular.nonconflict import is_nonconflicting
from support.effort import seeds
from support.graphs import LIMIT, cycle, drawn, is_nonblocking


@pytest.mark.random
@pytest.mark.parametrize(
    ("work", "limits"),
    [(abstraction.MAXIMUM_WORK, nonconflict.SMALL_LIMITS), (10, (1_000,)), (abstraction.MAXIMUM_WORK, (1, 3))],
)
def test_abstractions_agree_with_the_whole_composition(
    work: int, limits: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With little work allowed, most are left as they are; with few states, larger ones are tried in the end."""
    monkeypatch.setattr(abstraction, "MAXIMUM_WORK", work)
    monkeypatch.setattr(nonconflict, "SMALL_LIMITS", limits)
    met: Counter[bool] = Counter()
    for seed in seeds(400):
        random = Random(seed)
        labels = [f"e{number}" for number in range(random.randint(1, 5))]
        draw = random.choice((drawn, cycle))
        graphs = [draw(random, labels, states=random.randint(1, 5)) for _ in range(random.randint(1, 6))]
        expected = is_nonblocking(graphs)
        assert is_nonconflicting(graphs, limit=LIMIT) == expected, seed
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
    """Two that go round in step have three states together."""
    cells = [graph(["abc"], [(0, "a", 1), (1, "b", 2), (2, "c", 0)]) for _ in range(2)]
    cells[1].edges[0].append(("b", 2))
    with pytest.raises(TooLargeError):
        is_nonconflicting(cells, limit=1)
    with pytest.raises(SynthesisCancelled):
        is_nonconflicting(cells, limit=50, should_stop=lambda: True)
    assert is_nonconflicting(cells, limit=50)


def graph(labels: list[str], moves: list[tuple[int, str, int]], marked: frozenset[int] = frozenset({0})) -> Graph:
    """An automaton that begins in its first state."""
    count = 1 + max((max(begin, end) for begin, _, end in moves), default=0)
    edges: list[list[tuple[Label, int]]] = [[] for _ in range(count)]
    for begin, label, end in moves:
        edges[begin].append((label, end))
    return Graph(frozenset("".join(labels)), [0], edges, set(marked))


def compositions(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The sizes of all compositions from now on."""
    sizes: list[int] = []

    def counted(one: Graph, other: Graph, limit: int) -> Graph:
        whole = composed(one, other, limit)
        sizes.append(len(whole.edges))
        return whole

    monkeypatch.setattr(nonconflict, "composed", counted)
    return sizes


def test_an_event_that_one_never_allows_is_dropped_by_all(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = compositions(monkeypatch)
    waits = graph(["x"], [(0, "x", 1)], frozenset({1}))
    never = graph(["x"], [])
    free = graph(["x"], [(0, "x", 1), (1, "x", 0)], frozenset({0, 1}))
    assert not is_nonconflicting([waits, never, free], limit=50)
    assert is_nonconflicting([free, never], limit=50)
    assert not sizes


def test_an_event_that_changes_nothing_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = compositions(monkeypatch)
    lamps = [graph(["x"], [(0, "x", 0)]), graph(["x"], [(0, "x", 0)])]
    assert is_nonconflicting(lamps, limit=50)
    # Modules that always let it happen, and do not care, are not asked; a state that is blocked anyway does not count.
    careless = graph(["xy"], [(0, "x", 0), (0, "y", 1)])
    moving = graph(["x"], [(0, "x", 1), (1, "x", 0)])
    assert not is_nonconflicting([careless, moving], limit=50)
    assert is_nonconflicting([careless, moving, graph(["y"], [])], limit=50)
    assert not sizes
    # One that lets it happen now and then is: after y, x cannot happen any more.
    careful = graph(["xy"], [(0, "x", 0), (0, "y", 1)], frozenset({0, 1}))
    assert not is_nonconflicting([careful, graph(["x"], [(0, "x", 1), (1, "x", 0)], frozenset({1}))], limit=50)
    assert sizes


def test_clusters_are_where_flow_stays() -> None:
    weights = {(a, b): 1.0 for group in ((0, 1, 2, 3), (4, 5, 6, 7)) for a in group for b in group if a < b}
    assert clusters(9, {**weights, (3, 4): 0.5}) == [[0, 1, 2, 3], [4, 5, 6, 7], [8]]
    # Very many equal flows are no reason to lose all of them.
    assert len(_inflated(dict.fromkeys(range(2000), 1.0 / 2000))) == 2_000


def test_a_composition_of_automata_that_have_changed_is_not_used() -> None:
    """One that was tried and left for later is made anew once an event has turned out never to happen.

    After `p`, the first automaton needs `d` before the next one. It is tried together with the last automaton; then the
    two in the middle, which wait for each other from the start, turn out never to allow `d`.
    """
    waits = graph(["d", "p"], [(0, "d", 1), (0, "p", 1), (1, "d", 0)], frozenset({1}))
    first = graph(["a", "b", "d"], [(0, "a", 1), (1, "b", 2), (2, "d", 3), (3, "a", 4), (4, "b", 0)])
    second = graph(["a", "b"], [(0, "b", 1), (1, "a", 2), (2, "b", 3), (3, "a", 4), (4, "b", 5), (5, "a", 0)])
    steps = graph(["p"], [(0, "p", 0), (0, "p", 2), (2, "p", 1)], frozenset({1, 2}))
    assert not is_nonblocking([waits, first, second, steps])
    assert not is_nonconflicting([waits, first, second, steps], limit=50)
