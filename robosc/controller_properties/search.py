"""Forward search of the controller automaton, and its result for finite response and nonblocking.

Stable states are visited in the order of the number of events that lead to them (E. W. Dijkstra, "A note on two
problems in connexion with graphs", Numerische Mathematik 1, 1959, pp. 269-271), so every trace is a shortest one.
"""

from collections import defaultdict
from collections.abc import Callable
from heapq import heappop, heappush

import msgspec

from robosc.controller_properties.confluence import ConfluenceSearch
from robosc.controller_properties.controller import Controller, Node
from robosc.controller_properties.outcome import Blocking, Conflict, ForbiddenCancel, Livelock
from robosc.errors import SynthesisCancelled

STOP_INTERVAL = 64
"""States that are visited between two calls of `should_stop`."""

MAXIMUM_EFFORT = 5_000_000
"""Maximum number of moves of a search, multiplied by the places of a state: some seconds of work."""


class Searched(msgspec.Struct):
    """Findings of a search.

    Attributes:
        states: Stable states that were visited.
        is_complete: True if every stable state was visited.
        livelock: Silent steps that do not end, the first by the number of events, or None.
        conflict: Silent steps whose order matters, or None.
        blocking: The nearest state, or cycle of silent steps, from which no marked state is reachable; None if there is
            none, or if the search is not complete.
        forbidden: For each action, by the name of its cancel, the nearest state in which it is asked for and forbidden.
    """

    states: int = 0
    is_complete: bool = False
    livelock: Livelock | None = None
    conflict: Conflict | None = None
    blocking: Blocking | None = None
    forbidden: dict[str, ForbiddenCancel] = msgspec.field(default_factory=dict)


class _Graph(msgspec.Struct):
    """Stable states by number, with their connections.

    Attributes:
        nodes: The states.
        numbers: Their numbers.
        distances: Fewest events that lead to each state, as found so far.
        parents: For each state the number of the state before it, and the events in between.
        before: The states from which each state can be reached under every setting.
        good: States that are marked, or that pass a marked state on a way that exists under every setting.
    """

    nodes: list[Node] = msgspec.field(default_factory=list)
    numbers: dict[Node, int] = msgspec.field(default_factory=dict)
    distances: list[int] = msgspec.field(default_factory=list)
    parents: list[tuple[int | None, tuple[str, ...]]] = msgspec.field(default_factory=list)
    before: defaultdict[int, list[int]] = msgspec.field(default_factory=lambda: defaultdict(list))
    good: set[int] = msgspec.field(default_factory=set)

    def meet(self, node: Node, parent: int | None, events: tuple[str, ...]) -> tuple[int, bool]:
        """The number of a state that events reach, and whether they are the shortest way so far."""
        distance = len(events) + (0 if parent is None else self.distances[parent])
        number = self.numbers.setdefault(node, len(self.nodes))
        if number == len(self.nodes):
            self.nodes.append(node)
            self.distances.append(distance)
            self.parents.append((parent, events))
            return number, True
        if distance < self.distances[number]:
            self.distances[number] = distance
            self.parents[number] = (parent, events)
            return number, True
        return number, False

    def trace(self, number: int | None) -> tuple[str, ...]:
        """The events that lead to a state."""
        parts: list[tuple[str, ...]] = []
        while number is not None:
            number, events = self.parents[number]
            parts.append(events)
        return tuple(event for part in reversed(parts) for event in part)


def search(
    controller: Controller,
    *,
    limit: int,
    confluence: ConfluenceSearch | None,
    should_stop: Callable[[], bool] = lambda: False,
) -> Searched:
    """Visit every stable state of a controller, the same for the same input.

    Args:
        controller: The automaton.
        limit: Maximum number of stable states to visit; `MAXIMUM_EFFORT` is another limit.
        confluence: Comparison of the orders of silent steps of every visited state, or None for no comparison.
        should_stop: Function called now and then; once it returns true, the work ends.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        TooManyChoicesError: Received data of one step has too many values that matter.
    """
    graph = _Graph()
    found = Searched()
    queue: list[tuple[int, int]] = []

    def enter(parent: int | None, events: tuple[str, ...], is_sure: bool, node: Node) -> None:
        """Enter a run from a stable state after events, or from the executor's start."""
        run = controller.run(node)
        if run.end is None or run.events:
            if run.end is None:
                livelock = Livelock((*graph.trace(parent), *events, *run.events), run.cycle)
                if found.livelock is None or livelock.size < found.livelock.size:
                    found.livelock = livelock
                if not run.is_marked:
                    found.blocking = _shorter(found.blocking, Blocking(livelock.trace, run.cycle_states))
                if run.is_marked and is_sure and parent is not None:
                    graph.good.add(parent)
            if confluence is not None and found.conflict is None:
                found.conflict = confluence.conflict(node, lambda: (*graph.trace(parent), *events))
        if run.end is None:
            return
        number, is_nearer = graph.meet(run.end, parent, (*events, *run.events))
        if is_nearer:
            heappush(queue, (graph.distances[number], number))
        if controller.is_marked(run.end):
            graph.good.add(number)
        if parent is not None and is_sure:
            if run.is_marked:
                graph.good.add(parent)
            graph.before[number].append(parent)

    enter(None, (), True, controller.start)
    visited: set[int] = set()
    moves = 0
    while queue:
        _, number = heappop(queue)
        if number in visited:
            continue
        if len(visited) >= limit or moves * controller.width > MAXIMUM_EFFORT:
            found.states = len(visited)
            # Nodes that were not visited may lead to a marked state.
            found.blocking = None
            return found
        if len(visited) % STOP_INTERVAL == 0 and should_stop():
            raise SynthesisCancelled("the search of the controller was stopped")
        visited.add(number)
        for goal in controller.forbidden(graph.nodes[number]):
            if goal.cancel not in found.forbidden:
                state = graph.nodes[number][0]
                fallen = tuple(bit for bit in range(len(goal.requirements)) if not goal.holding(state) >> bit & 1)
                found.forbidden[goal.cancel] = ForbiddenCancel(
                    graph.trace(number), goal.action, goal.cancel, state, fallen
                )
        for events, is_sure, node in controller.moves(graph.nodes[number]):
            moves += 1
            enter(number, events, is_sure, node)
    found.states = len(visited)
    found.is_complete = True
    found.blocking = _shorter(found.blocking, _blocking(graph))
    return found


def _shorter(first: Blocking | None, second: Blocking | None) -> Blocking | None:
    """The finding with the shorter trace; the first one if both are equally long."""
    found = [item for item in (first, second) if item is not None]
    return min(found, key=lambda item: len(item.trace), default=None)


def _blocking(graph: _Graph) -> Blocking | None:
    """The nearest state from which no marked state is reachable."""
    good = set(graph.good)
    stack = list(good)
    while stack:
        for number in graph.before[stack.pop()]:
            if number not in good:
                good.add(number)
                stack.append(number)
    bad = [number for number in range(len(graph.nodes)) if number not in good]
    if not bad:
        return None
    nearest = min(bad, key=lambda number: (graph.distances[number], number))
    states = (graph.nodes[number][0] for number in sorted(_reachable(graph, nearest)))
    return Blocking(graph.trace(nearest), tuple(dict.fromkeys(states)))


def _reachable(graph: _Graph, start: int) -> set[int]:
    """Stable states that can be reached from one under every setting."""
    after = defaultdict[int, list[int]](list)
    for number, sources in graph.before.items():
        for source in sources:
            after[source].append(number)
    found = {start}
    stack = [start]
    while stack:
        for number in after[stack.pop()]:
            if number not in found:
                found.add(number)
                stack.append(number)
    return found
