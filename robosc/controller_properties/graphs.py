"""Strongly connected components of a graph."""

from collections.abc import Hashable, Mapping, Sequence


def components[Node: Hashable](graph: Mapping[Node, Sequence[Node]]) -> dict[Node, int]:
    """The strongly connected component of every node with arcs.

    R. E. Tarjan, "Depth-first search and linear graph algorithms", SIAM Journal on Computing 1(2), 1972, pp. 146-160,
    with a stack of its own instead of recursion.
    """
    order: dict[Node, int] = {}
    lowest: dict[Node, int] = {}
    found: dict[Node, int] = {}
    waiting: list[Node] = []
    for root in graph:
        calls: list[tuple[Node, int]] = [(root, 0)] if root not in order else []
        while calls:
            node, place = calls.pop()
            if place == 0:
                order[node] = lowest[node] = len(order)
                waiting.append(node)
            targets = graph.get(node, ())
            if place > 0:
                lowest[node] = min(lowest[node], lowest[targets[place - 1]])
            while place < len(targets):
                target = targets[place]
                place += 1
                if target not in order:
                    calls += [(node, place), (target, 0)]
                    break
                if target not in found:
                    lowest[node] = min(lowest[node], order[target])
            else:
                if lowest[node] == order[node]:
                    while node not in found:
                        found[waiting.pop()] = order[node]
    return found
