"""Drawings in which nothing hides anything else, the same each time."""

import subprocess
import sys
from itertools import combinations, pairwise
from random import Random
from typing import Any

import hypothesis.strategies as st
from hypothesis import given, settings

from robosc_view.graphs import (
    CHARACTER,
    LINE,
    MAXIMUM_EDGES,
    MAXIMUM_LABEL,
    MAXIMUM_STATES,
    Arrow,
    Node,
    layers_of,
    layout,
    shortened,
)
from support.effort import examples


def automaton(seed: int) -> tuple[list[Node], list[Arrow]]:
    dice = Random(seed)
    count = dice.randint(1, 9)
    initial = dice.randrange(count)
    nodes = [Node(f"state_{n}" * dice.randint(1, 3), n == initial, dice.random() < 0.5) for n in range(count)]
    nodes = [Node(f"{node.name}{n}", node.is_initial, node.is_marked) for n, node in enumerate(nodes)]
    arrows = [
        Arrow(
            number,
            dice.choice(nodes).name,
            dice.choice(nodes).name,
            "event" * dice.randint(1, 20),
            dice.choice(["controllable", "uncontrollable", "silent"]),
        )
        for number in range(dice.randint(0, 20))
    ]
    return nodes, arrows


def rectangle(x: float, y: float, width: float, height: float) -> tuple[float, float, float, float]:
    # Rounding may take a tenth of a pixel.
    return x - width / 2 + 0.1, y - height / 2 + 0.1, x + width / 2 - 0.1, y + height / 2 - 0.1


def boxes(graph: dict[str, Any]) -> list[tuple[float, float, float, float]]:
    states = [rectangle(item["x"], item["y"], item["width"], item["height"]) for item in graph["states"]]
    labels = [
        rectangle(item["label_x"], item["label_y"], CHARACTER * len(item["label"]), LINE) for item in graph["edges"]
    ]
    return states + labels


@given(st.integers(0, 10**6))
@settings(max_examples=examples(60))
def test_states_and_labels_lie_inside_and_apart(seed: int) -> None:
    nodes, arrows = automaton(seed)
    graph = layout(nodes, arrows)
    assert graph is not None
    assert graph == layout(nodes, arrows)
    found = boxes(graph)
    for left, top, right, bottom in found:
        assert left >= 0 and top >= 0 and right <= graph["width"] and bottom <= graph["height"]
    for one, other in combinations(found, 2):
        assert one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1]


@given(st.integers(0, 10**6))
@settings(max_examples=examples(60))
def test_edges_go_from_border_to_border_over_their_label(seed: int) -> None:
    nodes, arrows = automaton(seed)
    graph = layout(nodes, arrows)
    assert graph is not None
    assert [edge["id"] for edge in graph["edges"]] == [arrow.number for arrow in arrows]
    assert [item["name"] for item in graph["states"]] == [node.name for node in nodes]
    states = {item["name"]: item for item in graph["states"]}
    for arrow, edge in zip(arrows, graph["edges"], strict=True):
        assert (edge["from"], edge["to"], edge["kind"]) == (arrow.source, arrow.target, arrow.kind)
        assert edge["label"] == shortened(arrow.label)
        assert len(edge["label"]) <= MAXIMUM_LABEL
        for name, (x, y) in ((arrow.source, edge["points"][0]), (arrow.target, edge["points"][-1])):
            state = states[name]
            across, along = abs(x - state["x"]) - state["width"] / 2, abs(y - state["y"]) - state["height"] / 2
            assert max(across, along) == max(min(across, 0.2), min(along, 0.2))
            assert abs(max(across, along)) <= 0.2
        if arrow.source == arrow.target:
            assert edge["label_x"] > max(x for x, _ in edge["points"])
        else:
            # It runs through the middle of its label.
            assert any(
                abs(x - edge["label_x"]) < 0.2 and abs(y - edge["label_y"]) < 0.2 for x, y in edge["points"][1:-1]
            )


@given(st.integers(0, 10**6))
def test_the_initial_state_is_on_top_and_what_it_leads_to_below(seed: int) -> None:
    nodes, arrows = automaton(seed)
    layers = layers_of(nodes, arrows)
    initial = next(node.name for node in nodes if node.is_initial)
    assert layers[initial] == 0
    ways = [item for item in arrows if item.source != item.target]
    assert all(layers[item.source] != layers[item.target] for item in ways)
    reached, waiting = {initial}, [initial]
    while waiting:
        name = waiting.pop()
        for item in ways:
            if item.source == name and item.target not in reached:
                reached.add(item.target)
                waiting.append(item.target)
    # Every reachable state hangs on something above it.
    for name in reached - {initial}:
        assert any(item.target == name and layers[item.source] < layers[name] for item in ways) or any(
            item.source == name and layers[item.target] < layers[name] for item in ways
        )


def test_a_chain_stands_upright() -> None:
    nodes = [Node(name, name == "a", False) for name in "abc"]
    arrows = [Arrow(k, one, two, "go", "silent") for k, (one, two) in enumerate(pairwise("abc"))]
    graph = layout(nodes, arrows)
    assert graph is not None
    assert len({item["x"] for item in graph["states"]}) == 1
    heights = [item["y"] for item in graph["states"]]
    assert heights == sorted(set(heights))


def test_what_nobody_could_read_is_not_drawn() -> None:
    assert layout([], []) is None
    many = [Node(f"s{n}", n == 0, False) for n in range(MAXIMUM_STATES + 1)]
    assert layout(many, []) is None
    arrows = [Arrow(n, "s0", "s0", "x", "silent") for n in range(MAXIMUM_EDGES + 1)]
    assert layout(many[:1], arrows) is None
    assert layout(many[:MAXIMUM_STATES], []) is not None


def test_a_drawing_looks_through_no_fonts() -> None:
    """igraph would load Matplotlib, which takes many seconds on a machine whose fonts it has not seen."""
    code = """
import sys, threading
from robosc_view.graphs import Node, layout, _WithoutMatplotlib
layout([Node("a", True, True)], [])
assert "igraph" in sys.modules
print("matplotlib" in sys.modules, any(isinstance(item, _WithoutMatplotlib) for item in sys.meta_path))
# A thread that draws pictures meanwhile gets what it asks for.
sys.meta_path.insert(0, _WithoutMatplotlib())
thread = threading.Thread(target=lambda: __import__("matplotlib"))
thread.start()
thread.join()
print("matplotlib" in sys.modules)
"""
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.split() == ["False", "False", "True"]
