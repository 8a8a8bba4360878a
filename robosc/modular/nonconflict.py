"""Check whether automata that share events block each other, on abstractions, without the product of all automata.

Two automata at a time are composed. Events that no other automaton has are hidden, and abstractions that preserve
conflicts reduce the result. Events that one automaton never allows, or that change nothing, are removed.

Sources: H. Flordal and R. Malik, "Compositional verification in supervisory control", SIAM J. Control Optim. 48(3),
2009, pp. 1914-1938; C. Pilbrow and R. Malik, "An algorithm for compositional nonblocking verification using special
events", Science of Computer Programming 113, 2015, pp. 119-148 (events that are blocked, or selfloops alone).
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator

from robosc.errors import SynthesisCancelled
from robosc.modular.abstraction import reduced
from robosc.modular.graphs import Graph, Label, TooLargeError, composed, hidden, is_nonblocking

SMALL_LIMITS = (200, 1_000)
"""Limits on the states of a composition, tried in turn, in the search for a pair that does not grow."""


def is_nonconflicting(graphs: Iterable[Graph], *, limit: int, should_stop: Callable[[], bool] = lambda: False) -> bool:
    """Return True if automata together can always reach a state in which all of them are marked.

    Args:
        graphs: The automata.
        limit: States of a composition beyond which the search is given up.
        should_stop: Function called between two compositions; once it returns true, the work ends.

    Raises:
        TooLargeError: The composition of every pair has more states.
        SynthesisCancelled: `should_stop` became true.
    """
    return _Search(graphs, limit, should_stop).result()


class _Search:
    def __init__(self, graphs: Iterable[Graph], limit: int, should_stop: Callable[[], bool]) -> None:
        self._waiting = dict(enumerate(graphs))
        self._owners = defaultdict[Label, set[int]](set)
        # For each automaton the labels that it has in self-loops alone.
        self._idle: dict[int, frozenset[Label]] = {}
        self._limit = limit
        self._should_stop = should_stop
        # For each pair that was tried its composition made smaller, or the states beyond which it was given up.
        self._tried: dict[tuple[int, int], Graph | int] = {}
        for number, graph in self._waiting.items():
            for label in graph.labels:
                self._owners[label].add(number)
        self._reduce(list(self._waiting))

    def result(self) -> bool:
        while any(self._pairs()):
            one, other, whole = self._next()
            self._join(one, other, whole)
        # Those that are left share nothing, so each is nonblocking by itself or not.
        return all(map(is_nonblocking, self._waiting.values())) and all(
            graph.initial for graph in self._waiting.values()
        )

    def _next(self) -> tuple[int, int, Graph]:
        """The next two automata and the automaton that replaces them, which is not much larger than both.

        Raises:
            TooLargeError: The composition of each pair has too many states.
        """
        found: dict[tuple[int, int], Graph] = {}
        for most in SMALL_LIMITS:
            for pair in self._pairs():
                whole = self._whole(pair, min(most, self._limit))
                if whole is not None:
                    found[pair] = whole
                    if self._growth(pair, whole) <= 0:
                        return *pair, whole
        if found:
            pair = min(found, key=lambda item: (self._growth(item, found[item]), item))
            return *pair, found[pair]
        for pair in self._pairs():
            whole = self._whole(pair, self._limit)
            if whole is not None:
                return *pair, whole
        raise TooLargeError

    def _growth(self, pair: tuple[int, int], whole: Graph) -> int:
        return len(whole.edges) - sum(len(self._waiting[number].edges) for number in pair)

    def _whole(self, pair: tuple[int, int], most: int) -> Graph | None:
        """The reduced composition of two automata; None if it has more states than allowed."""
        found = self._tried.get(pair)
        if isinstance(found, int):
            found = None if found < most else found
        if found is None:
            if self._should_stop():
                raise SynthesisCancelled("the search for blocking modules was stopped")
            found = self._tried[pair] = self._composed(pair, most)
        return None if isinstance(found, int) else found

    def _composed(self, pair: tuple[int, int], most: int) -> Graph | int:
        try:
            whole = composed(self._waiting[pair[0]], self._waiting[pair[1]], most)
        except TooLargeError:
            return most
        kept = frozenset(label for label in whole.labels if self._owners[label].difference(pair))
        return reduced(hidden(whole, kept))

    def _join(self, one: int, other: int, whole: Graph) -> None:
        """Put the composition of two automata in their place."""
        for number in (one, other):
            for label in self._waiting[number].labels:
                self._owners[label].discard(number)
        for label in whole.labels:
            self._owners[label].add(one)
        del self._waiting[other], self._idle[other]
        self._waiting[one] = whole
        self._forget(one, other)
        self._reduce([one], is_done=True)

    def _forget(self, *numbers: int) -> None:
        """Forget the compositions of automata that have changed or are gone."""
        self._tried = {pair: found for pair, found in self._tried.items() if not set(numbers).intersection(pair)}

    def _pairs(self) -> Iterator[tuple[int, int]]:
        """The pairs that share a label: those of the smallest automaton first, the most promising partners first."""
        for number in sorted(self._waiting, key=lambda item: len(self._waiting[item].edges)):
            shared = defaultdict[int, int](int)
            local = defaultdict[int, int](int)
            for label in self._waiting[number].labels:
                others = self._owners[label] - {number}
                for other in others:
                    shared[other] += 1
                    local[other] += len(others) == 1
            for other in sorted(shared, key=lambda item: (len(self._waiting[item].edges) / (1 + local[item]), item)):
                yield min(number, other), max(number, other)

    # Reduction

    def _reduce(self, numbers: list[int], *, is_done: bool = False) -> None:
        """Reduce some automata that are not reduced yet, and then others whose events this changes."""
        changed = dict.fromkeys(numbers, is_done)
        while changed:
            number = next(iter(changed))
            graph = self._waiting[number]
            shared = frozenset(label for label in graph.labels if self._owners[label] - {number})
            for label in graph.labels - shared:
                self._owners.pop(label, None)
            if not changed.pop(number):
                graph = self._waiting[number] = reduced(hidden(graph, shared))
                self._forget(number)
            self._idle[number] = idle_labels(graph)
            for label in shared - {label for steps in graph.edges for label, _ in steps}:
                changed.update(self._drop(label))
            for label in self._idle[number]:
                others = self._owners[label]
                if all(label in self._idle.get(other, ()) for other in others):
                    changed.update(self._drop(label))
                elif is_ignored(graph, label):
                    self._waiting[number] = without(self._waiting[number], label)
                    others.discard(number)
                    changed.update(dict.fromkeys(others, False))

    def _drop(self, label: Label) -> dict[int, bool]:
        """Drop a label that cannot happen, or changes nothing; returns the automata that had it."""
        owners = dict.fromkeys(sorted(self._owners.pop(label, ())), False)
        for number in owners:
            self._waiting[number] = without(self._waiting[number], label)
        return owners


def idle_labels(graph: Graph) -> frozenset[Label]:
    """Return the labels whose steps change nothing."""
    labels = {label for steps in graph.edges for label, _ in steps}
    moving = {label for state, steps in enumerate(graph.edges) for label, target in steps if target != state}
    return frozenset(labels - moving) & graph.labels


def is_ignored(graph: Graph, label: Label) -> bool:
    """Return True if an automaton has a label that changes nothing in all states; blocked states do not matter.

    From an unmarked state without a step no marked state can be reached, whatever other automata do.
    """
    return all(
        any(item == label for item, _ in steps) or not (steps or state in graph.marked)
        for state, steps in enumerate(graph.edges)
    )


def without(graph: Graph, label: Label) -> Graph:
    """Return an automaton without a label and its steps."""
    edges = [[step for step in steps if step[0] != label] for steps in graph.edges]
    return Graph(graph.labels - {label}, graph.initial, edges, graph.marked)
