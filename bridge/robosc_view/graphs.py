"""Automata laid out as drawings, the same for the same automaton: boxes of states, edges with a place for each label.

The method is the layered one of K. Sugiyama, S. Tagawa and M. Toda (Methods for visual understanding of hierarchical
system structures, IEEE Transactions on Systems, Man, and Cybernetics 11(2), 1981, pages 109-125). Layers are by longest
paths, after the edges back to where a search from the initial state came from were turned round; igraph orders each
layer so that few edges cross. A label is a node of its own in a layer between those of the states, so that edges there
and back, and several between two states, never hide each other. What stands in a layer is then moved towards its
neighbours as far as the sizes allow: the least squares under gaps, by pooling adjacent violators (R. Barlow and
others, Statistical Inference under Order Restrictions, 1972, section 1.2). Loops are stacked to the right of their
state.
"""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.abc import MetaPathFinder
from itertools import pairwise
from threading import get_ident
from types import ModuleType
from typing import Any

MAXIMUM_STATES = 150
MAXIMUM_EDGES = 600
"""A larger automaton is not drawn: it would be unreadable."""

MAXIMUM_LABEL = 60
"""Characters of a label."""

CHARACTER = 6.7
"""Width of a label's character, in pixels: 12 px, sans-serif."""

STATE_CHARACTER = 8.0
"""The same of a state's name: 13 px, bold."""

LINE = 18.0
"""Height of a label, in pixels."""

STATE_HEIGHT = 30.0
_GAP, _LAYER_GAP, _MARGIN = 14.0, 22.0, 12.0
_LOOP = 24.0
_SWEEPS = 8
_ITERATIONS = 50


class _WithoutMatplotlib(MetaPathFinder):
    """Finder by which one thread finds no Matplotlib; other threads do."""

    def __init__(self) -> None:
        self._thread = get_ident()

    def find_spec(self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> None:
        """Find nothing.

        Raises:
            ModuleNotFoundError: It is Matplotlib, for the thread.
        """
        if fullname == "matplotlib" and get_ident() == self._thread:
            raise ModuleNotFoundError("Matplotlib is not loaded for a layout", name=fullname)


def _load_igraph() -> Any:
    """Import igraph only when something is drawn, so that without the extra `view` only drawings raise an error.

    igraph would import Matplotlib where it is installed, which looks through all fonts of a new machine first: a page
    would wait many seconds for what it does not need.
    """
    finder = _WithoutMatplotlib()
    sys.meta_path.insert(0, finder)
    try:
        import igraph
    finally:
        sys.meta_path.remove(finder)
    return igraph


@dataclass(frozen=True, slots=True)
class Node:
    """A state to be drawn."""

    name: str
    is_initial: bool
    is_marked: bool


@dataclass(frozen=True, slots=True)
class Arrow:
    """A transition to be drawn.

    Attributes:
        number: Number of the transition in the model's definition.
        source: State that it leaves.
        target: State that it enters.
        label: Text of the transition.
        kind: `controllable`, `uncontrollable` or `silent`.
    """

    number: int
    source: str
    target: str
    label: str
    kind: str


@dataclass(slots=True)
class _Box:
    """A node of the layered graph: a state, a label or a bend of a long edge."""

    layer: int
    width: float = 0.0
    height: float = 0.0
    x: float = 0.0
    above: list[int] = field(default_factory=list)
    below: list[int] = field(default_factory=list)


def layout(nodes: Sequence[Node], arrows: Sequence[Arrow]) -> dict[str, Any] | None:
    """Return the drawing for the page, in pixels; None: the automaton is too large for one.

    The place of a state or label is its middle; the points of an edge go from border to border.
    """
    if not nodes or len(nodes) > MAXIMUM_STATES or len(arrows) > MAXIMUM_EDGES:
        return None
    return _Drawing(nodes, arrows).as_json()


def layers_of(nodes: Sequence[Node], arrows: Sequence[Arrow]) -> dict[str, int]:
    """Return the layer of each state; the initial one has 0, and edges that are not reversed lead to a later one."""
    after: dict[str, list[str]] = {node.name: [] for node in nodes}
    for arrow in arrows:
        if arrow.source != arrow.target:
            after[arrow.source].append(arrow.target)
    starts = sorted(nodes, key=lambda node: not node.is_initial)
    forward: dict[str, list[str]] = {name: [] for name in after}
    # By state the search that has found it, and whether it is on the way that is being searched.
    seen: dict[str, bool] = {}
    found_in: dict[str, str] = {}
    for start in starts:
        if start.name in seen:
            continue
        way = [(start.name, iter(after[start.name]))]
        seen[start.name] = True
        found_in[start.name] = start.name
        while way:
            name, rest = way[-1]
            following = next(rest, None)
            if following is None:
                way.pop()
                seen[name] = False
            elif seen.get(following) or found_in.get(following, start.name) != start.name:
                # Back to where the search came from, or, of a state that cannot be reached, to one that can.
                forward[following].append(name)
            else:
                forward[name].append(following)
                if following not in seen:
                    seen[following] = True
                    found_in[following] = start.name
                    way.append((following, iter(after[following])))
    layers = dict.fromkeys(after, 0)
    for name in _ordered(forward):
        for following in forward[name]:
            layers[following] = max(layers[following], layers[name] + 1)
    return layers


def _ordered(forward: Mapping[str, Sequence[str]]) -> list[str]:
    """The states, each before those that it leads to."""
    waiting = dict.fromkeys(forward, 0)
    for targets in forward.values():
        for name in targets:
            waiting[name] += 1
    ready = [name for name, count in waiting.items() if count == 0]
    for name in ready:
        for following in forward[name]:
            waiting[following] -= 1
            if waiting[following] == 0:
                ready.append(following)
    return ready


class _Drawing:
    def __init__(self, nodes: Sequence[Node], arrows: Sequence[Arrow]) -> None:
        self._nodes = nodes
        self._loops = [item for item in arrows if item.source == item.target]
        self._arrows = [item for item in arrows if item.source != item.target]
        self._boxes: list[_Box] = []
        self._sizes: dict[str, tuple[float, float]] = {}
        self._ways: list[list[int]] = []
        layers = layers_of(nodes, arrows)
        for node in nodes:
            self._add_state(node, 2 * layers[node.name])
        places = {node.name: place for place, node in enumerate(nodes)}
        for arrow in self._arrows:
            self._add_bends(arrow, places[arrow.source], places[arrow.target])
        self._rows = self._order()
        self._spread()
        self._heights = self._stack()

    def _add_state(self, node: Node, layer: int) -> None:
        loops = [item for item in self._loops if item.source == node.name]
        width = STATE_CHARACTER * len(node.name) + 26.0
        height = max(STATE_HEIGHT, LINE * len(loops) + 8.0)
        self._sizes[node.name] = width, height
        beside = _LOOP + max(map(_width, loops)) if loops else 0.0
        self._boxes.append(_Box(layer, width + beside, height))

    def _add_bends(self, arrow: Arrow, source: int, target: int) -> None:
        """The label of an edge half way, and a bend in every other layer that it crosses."""
        first, last = self._boxes[source].layer, self._boxes[target].layer
        step = 1 if last > first else -1
        middle = (first + last) // 2
        # Labels stand in the odd layers, where no state does.
        middle += (middle + 1) % 2
        way = [source]
        for layer in range(first + step, last, step):
            self._boxes.append(_Box(layer, _width(arrow), LINE) if layer == middle else _Box(layer))
            way.append(len(self._boxes) - 1)
        way.append(target)
        for left, right in pairwise(way):
            upper, lower = (left, right) if step > 0 else (right, left)
            self._boxes[upper].below.append(lower)
            self._boxes[lower].above.append(upper)
        self._ways.append(way)

    def _order(self) -> list[list[int]]:
        """The boxes of each layer from left to right, as igraph orders them."""
        igraph = _load_igraph()
        edges = [(upper, lower) for upper, box in enumerate(self._boxes) for lower in box.below]
        graph = igraph.Graph(n=len(self._boxes), edges=edges, directed=True)
        layout = graph.layout_sugiyama(layers=[box.layer for box in self._boxes], maxiter=_ITERATIONS)
        rows: list[list[int]] = [[] for _ in range(max(box.layer for box in self._boxes) + 1)]
        for place, box in enumerate(self._boxes):
            rows[box.layer].append(place)
        for row in rows:
            row.sort(key=lambda place: (layout[place][0], place))
        return rows

    def _spread(self) -> None:
        """Move what stands in each layer towards its neighbours, from above and from below in turn."""
        for row in self._rows:
            self._put(row, [0.0] * len(row))
        for sweep in range(_SWEEPS):
            is_down = sweep % 2 == 0
            for row in self._rows if is_down else reversed(self._rows):
                wanted = []
                for place in row:
                    box = self._boxes[place]
                    near = (box.above or box.below) if is_down else (box.below or box.above)
                    wanted.append(sum(self._boxes[item].x for item in near) / len(near) if near else box.x)
                self._put(row, wanted)
        left = min(box.x - box.width / 2 for box in self._boxes)
        for box in self._boxes:
            box.x += _MARGIN - left

    def _put(self, row: Sequence[int], wanted: Sequence[float]) -> None:
        """Place a row as near to the wanted positions as its order and sizes allow, in the sense of least squares."""
        offsets, offset = [], 0.0
        for before, place in zip([None, *row], row, strict=False):
            if before is not None:
                offset += (self._boxes[before].width + self._boxes[place].width) / 2 + _GAP
            offsets.append(offset)
        pools: list[tuple[float, int]] = []
        for value in (want - gap for want, gap in zip(wanted, offsets, strict=True)):
            pools.append((value, 1))
            while len(pools) > 1 and pools[-2][0] >= pools[-1][0]:
                (right, count), (left, more) = pools.pop(), pools.pop()
                pools.append(((right * count + left * more) / (count + more), count + more))
        values = [value for value, count in pools for _ in range(count)]
        for place, value, gap in zip(row, values, offsets, strict=True):
            self._boxes[place].x = value + gap

    def _stack(self) -> list[float]:
        """The y of each layer's middle."""
        found, top = [], _MARGIN
        for row in self._rows:
            height = max((self._boxes[place].height for place in row), default=0.0)
            found.append(top + height / 2)
            top += height + _LAYER_GAP
        return found

    def as_json(self) -> dict[str, Any]:
        """Return the drawing as JSON values."""
        states = [self._state(place, node) for place, node in enumerate(self._nodes)]
        edges = [self._edge(arrow, way) for arrow, way in zip(self._arrows, self._ways, strict=True)]
        by_name = {state["name"]: state for state in states}
        for node in self._nodes:
            loops = [item for item in self._loops if item.source == node.name]
            edges += [self._loop(item, by_name[node.name], row, len(loops)) for row, item in enumerate(loops)]
        # The model's order stays, whatever the shape.
        edges.sort(key=lambda edge: edge["id"])
        bottom = max(
            self._heights[box.layer] + max(box.height, STATE_HEIGHT) / 2 for box in self._boxes[: len(self._nodes)]
        )
        right = max(box.x + box.width / 2 for box in self._boxes)
        return {"width": _round(right + _MARGIN), "height": _round(bottom + _MARGIN), "states": states, "edges": edges}

    def _state(self, place: int, node: Node) -> dict[str, Any]:
        box, (width, height) = self._boxes[place], self._sizes[node.name]
        return {
            "name": node.name,
            "x": _round(box.x - box.width / 2 + width / 2),
            "y": _round(self._heights[box.layer]),
            "width": _round(width),
            "height": _round(height),
            "is_initial": node.is_initial,
            "is_marked": node.is_marked,
        }

    def _edge(self, arrow: Arrow, way: Sequence[int]) -> dict[str, Any]:
        middles = [self._middle(place, arrow) for place in way]
        points = [self._border(way[0], middles[0], middles[1]), *middles[1:-1]]
        points.append(self._border(way[-1], middles[-1], middles[-2]))
        label = next(point for place, point in zip(way, middles, strict=True) if self._is_label(place))
        return _edge_label(arrow, points, label)

    def _is_label(self, place: int) -> bool:
        return place >= len(self._nodes) and self._boxes[place].height > 0

    def _middle(self, place: int, arrow: Arrow) -> tuple[float, float]:
        box = self._boxes[place]
        x = box.x
        if place < len(self._nodes):
            x += (self._sizes[self._nodes[place].name][0] - box.width) / 2
        return x, self._heights[box.layer]

    def _border(self, place: int, middle: tuple[float, float], towards: tuple[float, float]) -> tuple[float, float]:
        """Return the point where a state's way out crosses its upper or lower border, a little towards its target."""
        width, height = self._sizes[self._nodes[place].name]
        reach = max(width / 2 - 8.0, 0.0)
        x = min(max(towards[0], middle[0] - reach), middle[0] + reach)
        return x, middle[1] + (height / 2 if towards[1] > middle[1] else -height / 2)

    def _loop(self, arrow: Arrow, state: Mapping[str, Any], row: int, count: int) -> dict[str, Any]:
        right = state["x"] + state["width"] / 2
        y = state["y"] + (row - (count - 1) / 2) * LINE
        points = [(right, y - 5.0), (right + _LOOP - 6.0, y - 6.0), (right + _LOOP - 6.0, y + 6.0), (right, y + 5.0)]
        return _edge_label(arrow, points, (right + _LOOP + _width(arrow) / 2, y))


def _edge_label(arrow: Arrow, points: Sequence[tuple[float, float]], label: tuple[float, float]) -> dict[str, Any]:
    return {
        "id": arrow.number,
        "from": arrow.source,
        "to": arrow.target,
        "label": shortened(arrow.label),
        "kind": arrow.kind,
        "points": [[_round(x), _round(y)] for x, y in points],
        "label_x": _round(label[0]),
        "label_y": _round(label[1]),
    }


def _width(arrow: Arrow) -> float:
    return CHARACTER * len(shortened(arrow.label)) + 8.0


def shortened(label: str) -> str:
    """Return a label, shortened if it is too long."""
    return label if len(label) <= MAXIMUM_LABEL else label[: MAXIMUM_LABEL - 3] + "..."


def _round(value: float) -> float:
    return round(value, 1)
