"""Tests of abstractions that keep conflicts: composed with random others, the answers before and after are the same."""

from collections import Counter
from random import Random

import pytest

from robosc.modular import abstraction
from robosc.modular.abstraction import (
    RULES,
    Rule,
    active_events,
    certain_conflicts,
    only_silent_outgoing,
    reduced,
    silent_circles,
    silent_continuation,
    silent_incoming,
    weak_bisimulation,
)
from robosc.modular.graphs import SILENT, Edges, Graph, Label
from support.effort import seeds
from support.graphs import drawn, is_nonblocking

CONTEXTS = 12
"""Automata that each one is composed with."""

ALL = (silent_circles, *RULES, reduced)


def named(rule: Rule) -> str:
    return getattr(rule, "__name__", "rule")


def contexts(random: Random, labels: frozenset[Label]) -> list[Graph]:
    """Automata with the same labels: those that allow little find more conflicts."""
    return [drawn(random, sorted(map(str, labels)), states=random.randint(1, 4)) for _ in range(CONTEXTS)]


def copied(graph: Graph) -> Graph:
    return Graph(graph.labels, list(graph.initial), [list(steps) for steps in graph.edges], set(graph.marked))


@pytest.mark.random
@pytest.mark.parametrize("rule", ALL, ids=named)
def test_what_is_composed_with_it_is_nonblocking_as_before(rule: Rule) -> None:
    met: Counter[bool] = Counter()
    smaller = 0
    for seed in seeds(400):
        random = Random(seed)
        labels = ["a", "b", "c"][: random.randint(1, 3)]
        graph = drawn(random, labels, states=random.randint(2, 8), silent=random.choice([0.2, 0.5, 0.7]))
        before = copied(graph)
        found = rule(graph)
        assert graph == before, "it is left as it is"
        assert len(found.edges) <= len(graph.edges)
        smaller += len(found.edges) < len(graph.edges)
        for context in (*contexts(random, graph.labels), Graph(graph.labels, [0], [[]], {0})):
            expected = is_nonblocking([graph, context])
            assert is_nonblocking([found, context]) == expected, (seed, context)
            met[expected] += 1
    assert min(met[True], met[False]) > 100, met
    assert smaller > 20


def graph_of(edges: Edges, marked: set[int]) -> Graph:
    labels = frozenset(label for steps in edges for label, _ in steps if label is not SILENT)
    return Graph(labels, [0], edges, marked)


def test_states_that_are_surely_blocked_become_one() -> None:
    # A silent step leads to where nothing is marked, and then so does every way out of the first state but b.
    found = certain_conflicts(graph_of([[("a", 1), ("a", 2), ("b", 2)], [(SILENT, 3), ("a", 2)], [], []], {1, 2}))
    assert found == graph_of([[("a", 1), ("b", 2)], [], []], {2})
    # No edge is left without b.
    assert certain_conflicts(graph_of([[("a", 1), ("a", 2)], [], []], {2})).edges == [[]]


def test_conflicts_because_of_others_are_looked_for_so_many_times(monkeypatch: pytest.MonkeyPatch) -> None:
    length = 10
    edges: Edges = [[("a", place + 1), ("a", length + 1)] for place in range(length)]
    graph = graph_of([*edges, [], []], {length + 1})
    assert len(certain_conflicts(graph).edges) == 1
    monkeypatch.setattr(abstraction, "MAXIMUM_ROUNDS", 3)
    assert len(certain_conflicts(graph).edges) == length


def test_states_with_silent_steps_alone_are_left_out() -> None:
    found = only_silent_outgoing(graph_of([[("a", 1)], [(SILENT, 2), (SILENT, 3)], [("b", 0)], [("c", 0)]], {0}))
    assert found == graph_of([[("a", 1), ("a", 2)], [("b", 0)], [("c", 0)]], {0})
    # One that is marked stays.
    assert len(only_silent_outgoing(graph_of([[("a", 1)], [(SILENT, 2)], [("b", 0)]], {1})).edges) == 3


def test_states_that_silent_steps_alone_lead_to_and_from_are_left_out() -> None:
    found = silent_incoming(graph_of([[("c", 3), (SILENT, 1)], [(SILENT, 2), ("a", 3)], [("b", 3)], []], {1, 3}))
    assert found == Graph(frozenset("abc"), [0], [[("c", 1), (SILENT, 2), ("a", 1)], [], [("b", 1)]], {0, 1}), (
        "what it was marked for is marked"
    )
    # One that no silent step leaves may be where all is held back.
    stays = graph_of([[(SILENT, 1), ("c", 2)], [("a", 2)], []], {2})
    assert silent_incoming(stays) == stays


def test_states_that_the_same_leads_to_become_one_where_silent_steps_leave_them() -> None:
    edges: Edges = [[("a", 1), ("a", 2)], [(SILENT, 3), ("b", 0)], [(SILENT, 4), ("c", 0)], [("d", 0)], [("e", 0)]]
    assert len(silent_continuation(graph_of(edges, {0})).edges) == 4
    assert len(weak_bisimulation(graph_of(edges, {0})).edges) == 5
    # The ways to them are not the same.
    edges[0] = [("a", 1), ("b", 2)]
    assert len(silent_continuation(graph_of(edges, {0})).edges) == 5


def test_states_that_the_same_leads_to_become_one_where_the_same_labels_are_next() -> None:
    edges: Edges = [[("a", 1), ("a", 2)], [("b", 3)], [("b", 4)], [("c", 0)], [("d", 0)]]
    assert len(active_events(graph_of(edges, {0})).edges) == 4
    assert len(weak_bisimulation(graph_of(edges, {0})).edges) == 5
    # Being marked counts as a label.
    assert len(active_events(graph_of(edges, {0, 1})).edges) == 5


def test_weakly_bisimilar_states_become_one() -> None:
    edges: Edges = [[(SILENT, 1), (SILENT, 2)], [("a", 3)], [("a", 4)], [], [(SILENT, 3)]]
    found = weak_bisimulation(graph_of(edges, {3}))
    assert (len(found.edges), found.marked) == (2, {1})
    # A choice that is made in silence is kept.
    edges = [[(SILENT, 1), (SILENT, 2)], [("a", 0)], [("b", 0)]]
    assert len(reduced(graph_of(edges, {0})).edges) == 3


def test_what_takes_too_much_work_is_left_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    edges: Edges = [[("a", 1), ("a", 2), ("a", 3)], [(SILENT, 3), ("b", 0)], [(SILENT, 3), ("c", 0)], [("b", 0)]]
    graph = graph_of(edges, {0})
    assert len(silent_continuation(graph).edges) == 3
    monkeypatch.setattr(abstraction, "MAXIMUM_WORK", 0)
    for rule in (silent_continuation, active_events, weak_bisimulation):
        assert rule(graph) == graph
    monkeypatch.setattr(abstraction, "MAXIMUM_SPREAD", 0)
    for rule in (only_silent_outgoing, silent_incoming):
        assert rule(graph) == graph
