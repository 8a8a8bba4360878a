"""Confluence: whether the order of silent steps matters.

All orders are followed, not only the executor's. They agree if they have one outcome: the same stable state, with the
same cancels asked for on the way, or no end at all. Newman's lemma says that it is enough to compare single steps, but
only if every order ends (M. H. A. Newman, "On theories with a combinatorial definition of 'equivalence'", Annals of
Mathematics 43(2), 1942, pp. 223-243). So outcomes are compared here, and the lemma is used only if
`robosc.controller_properties.silent_steps` has proved that every order ends.
"""

from collections.abc import Callable

from robosc.controller_properties.controller import Controller, Node
from robosc.controller_properties.outcome import Conflict, Order

_Outcome = Node | None
"""The stable state in which silent steps end, with the executor's memory, or None if they do not end."""

_Step = tuple[str, Node]


class ConfluenceSearch:
    """Comparison of the orders of silent steps; each state is visited once.

    Args:
        controller: The automaton.
        limit: Maximum number of states that silent steps pass through.

    Attributes:
        is_exhausted: True if the limit was exceeded; then no more orders are compared.
    """

    def __init__(self, controller: Controller, limit: int) -> None:
        self._controller = controller
        self._limit = limit
        # The only outcome of every state that was compared so far.
        self._only: dict[Node, _Outcome] = {}
        self.is_exhausted = False

    def conflict(self, start: Node, trace: Callable[[], tuple[str, ...]]) -> Conflict | None:
        """Two orders of the silent steps from a state whose outcomes differ, or None if there are none.

        Args:
            start: The state.
            trace: Function that returns the events that lead to the state.
        """
        if start in self._only or self.is_exhausted:
            return None
        steps, outcomes = self._explore(start)
        if self.is_exhausted:
            return None
        if len(outcomes) == 1:
            self._only.update(dict.fromkeys(steps, outcomes.pop()))
            return None
        chosen, end = self._chosen(start)
        return Conflict(trace(), chosen, self._other_order(start, steps, end))

    def _chosen(self, start: Node) -> tuple[Order, _Outcome]:
        """The executor's order, and its outcome."""
        run = self._controller.run(start)
        if run.end is None:
            return Order(run.events, run.cycle, None), None
        end = start
        for _ in run.events:
            _, end = next(self._controller.silent_steps(end))
        return self._ended(run.events, end), end

    def _ended(self, events: tuple[str, ...], end: Node) -> Order:
        return Order(events, (), end[0], tuple(goal.action for goal in self._controller.asked(end)))

    def _explore(self, start: Node) -> tuple[dict[Node, list[_Step]], set[_Outcome]]:
        """The states that silent steps reach in any order, with their steps, and every outcome, within the limit."""
        steps: dict[Node, list[_Step]] = {}
        outcomes: set[_Outcome] = set()
        # Depth first: a step to a state whose steps are still being followed closes a cycle.
        open_: set[Node] = set()
        stack: list[tuple[Node, int]] = [(start, 0)]
        while stack:
            node, place = stack.pop()
            if place == 0:
                if len(steps) + len(self._only) > self._limit:
                    self.is_exhausted = True
                    return steps, outcomes
                steps[node] = list(self._controller.silent_steps(node))
                open_.add(node)
                if not steps[node]:
                    outcomes.add(node)
            if place == len(steps[node]):
                open_.discard(node)
                continue
            stack.append((node, place + 1))
            target = steps[node][place][1]
            if target in open_:
                outcomes.add(None)
            elif target in self._only:
                outcomes.add(self._only[target])
            elif target not in steps:
                stack.append((target, 0))
        return steps, outcomes

    def _other_order(self, start: Node, steps: dict[Node, list[_Step]], unwanted: _Outcome) -> Order:
        """A shortest order that ends in another state than `unwanted`; if there is none, an order that does not end."""
        parents: dict[Node, tuple[Node, str] | None] = {start: None}
        queue = [start]
        for node in queue:
            following = steps[node] if node in steps else list(self._controller.silent_steps(node))
            if not following and node != unwanted:
                return self._ended(_events_to(parents, node), node)
            for event, target in following:
                if target not in parents:
                    parents[target] = (node, event)
                    queue.append(target)
        # Every order that ends does so where the executor ends, so some order has no end.
        return self._endless(start, queue)

    def _endless(self, start: Node, nodes: list[Node]) -> Order:
        """An order that does not end; `nodes` are all that silent steps reach, and some order does not end."""
        steps = {node: list(self._controller.silent_steps(node)) for node in nodes}
        # Nodes without a step lead to no cycle, nor do those that lead only to such nodes.
        sources: dict[Node, list[Node]] = {node: [] for node in nodes}
        for node in nodes:
            for _, target in steps[node]:
                sources[target].append(node)
        left = {node: len(steps[node]) for node in nodes}
        ending = [node for node in nodes if not left[node]]
        for node in ending:
            for source in sources[node]:
                left[source] -= 1
                if not left[source]:
                    ending.append(source)
        events: list[str] = []
        places: dict[Node, int] = {}
        node = start
        while node not in places:
            places[node] = len(events)
            event, node = next(step for step in steps[node] if left[step[1]])
            events.append(event)
        return Order(tuple(events[: places[node]]), tuple(events[places[node] :]), None)


def _events_to(parents: dict[Node, tuple[Node, str] | None], node: Node) -> tuple[str, ...]:
    events: list[str] = []
    parent = parents[node]
    while parent is not None:
        node, event = parent
        events.append(event)
        parent = parents[node]
    return tuple(reversed(events))
