"""The static variable order."""

from dataclasses import replace
from itertools import permutations
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc.automata import DiscreteVariable, EventCondition, System, to_automata
from robosc.automata.state import Subject, subjects
from robosc.expressions import Binary, BooleanType, StateTest, Unary, VariableRead, conjunction
from robosc.model.structure import Deployment
from robosc.synthesis.order import (
    best_order,
    block_order,
    force,
    hubs_of,
    hyperedges,
    other_order,
    slide,
    span,
    traversal,
)
from support.models import example_model
from support.random_systems import any_systems
from support.systems import automaton, system


@given(st.integers(1, 12), st.integers(0, 2**32 - 1))
def test_force_gives_a_permutation_that_is_never_worse(count: int, seed: int) -> None:
    random = Random(seed)
    edges = [random.sample(range(count), random.randint(1, min(4, count))) for _ in range(random.randint(0, 8))]
    order = force(count, edges)
    assert sorted(order) == list(range(count))
    assert span(order, edges) <= span(range(count), edges)
    assert force(count, edges) == order


@given(st.integers(1, 12), st.integers(2, 4), st.integers(0, 2**32 - 1))
def test_no_window_of_a_slid_order_can_be_better(count: int, width: int, seed: int) -> None:
    random = Random(seed)
    edges = [random.sample(range(count), random.randint(1, min(4, count))) for _ in range(random.randint(0, 8))]
    given_order = random.sample(range(count), count)
    order = slide(given_order, edges, width=width, times=1000)
    assert sorted(order) == list(range(count))
    assert span(order, edges) <= span(given_order, edges)
    for start in range(count - width + 1):
        for window in permutations(order[start : start + width]):
            other = (*order[:start], *window, *order[start + width :])
            assert span(other, edges) >= span(order, edges)


def test_an_order_that_is_best_stays() -> None:
    chain = [[place, place + 1] for place in range(19)]
    assert slide(range(20), chain) == tuple(range(20))


def test_a_shuffled_chain_is_put_in_order() -> None:
    shuffled = Random(7).sample(range(20), 20)
    edges = [shuffled[place : place + 2] for place in range(19)]
    assert span(range(20), edges) > 100
    assert span(force(20, edges), edges) <= 40


@given(st.integers(1, 12), st.booleans(), st.integers(0, 2**32 - 1))
def test_a_traversal_names_each_thing_once(count: int, is_depth_first: bool, seed: int) -> None:
    random = Random(seed)
    edges = [random.sample(range(count), random.randint(1, min(4, count))) for _ in range(random.randint(0, 8))]
    order = traversal(count, edges, is_depth_first=is_depth_first)
    assert sorted(order) == list(range(count))
    place = {item: number for number, item in enumerate(order)}
    for part in _parts(count, edges):
        # Parts that nothing joins stand one after the other.
        assert max(place[item] for item in part) - min(place[item] for item in part) == len(part) - 1
    assert span(best_order(count, edges)[1], edges) <= span(slide(force(count, edges), edges), edges)


@given(st.integers(4, 10), st.integers(0, 2**32 - 1))
def test_an_edge_of_some_weight_is_as_many_edges(count: int, seed: int) -> None:
    random = Random(seed)
    # Edges have two or four members, so that their centres are exact.
    edges = [random.sample(range(count), random.choice((2, 4))) for _ in range(random.randint(0, 8))]
    weights = [random.randint(1, 5) for _ in edges]
    repeated = [edge for edge, weight in zip(edges, weights, strict=True) for _ in range(weight)]
    order = random.sample(range(count), count)
    assert span(order, edges, weights) == span(order, repeated)
    assert force(count, edges, weights) == force(count, repeated)
    assert slide(order, edges, weights) == slide(order, repeated)


def _parts(count: int, edges: list[list[int]]) -> list[set[int]]:
    parts = [{item} for item in range(count)]
    for edge in edges:
        together = [part for part in parts if part & set(edge)]
        parts = [part for part in parts if part not in together] + [set().union(*together)]
    return parts


@pytest.mark.parametrize("seed", range(20))
def test_rows_and_trees_are_found_again_whatever_the_declared_order(seed: int) -> None:
    shuffled = Random(seed).sample(range(63), 63)
    row = [shuffled[place : place + 2] for place in range(62)]
    assert span(best_order(63, row)[1], row) == 62
    tree = [[shuffled[place], shuffled[(place - 1) // 2]] for place in range(1, 63)]
    assert span(best_order(63, tree)[1], tree) <= 170


def test_what_is_in_many_more_edges_than_others_is_last() -> None:
    spokes = [[0, item] for item in range(1, 21)]
    assert hubs_of(spokes) == {0}
    # Fewer edges than a hub has, and not many more than others.
    assert hubs_of(spokes[:15]) == frozenset()
    assert hubs_of([*spokes, *([item, item + 1] for item in range(1, 20) for _ in range(4))]) == frozenset()
    clients = [
        automaton(f"C{number}", [f"idle -go{number}-> busy", f"busy -end{number}-> idle"]) for number in range(20)
    ]
    fault = automaton("A", ["off -fail-> on", "on -mend-> off"])
    needs = {f"go{number}": StateTest("A", "off") for number in range(20)}
    made = system(fault, *clients, conditions=needs)
    _, order = block_order(made, [(subject,) for subject in subjects(made)])
    assert order[-1] == (Subject("A"),)


@given(any_systems())
def test_every_place_of_a_state_is_ordered_once(system: System) -> None:
    blocks = [(subject,) for subject in subjects(system)]
    best = block_order(system, blocks)
    other = other_order(system, blocks, best)
    for _, order in (best, other):
        assert sorted(map(str, order)) == sorted(str((subject,)) for subject in subjects(system))
    assert best[1] != other[1] or len(blocks) < 2


@given(any_systems(), st.integers(2, 4))
def test_blocks_stay_whole(system: System, size: int) -> None:
    places = subjects(system)
    blocks = [places[start : start + size] for start in range(0, len(places), size)]
    best = block_order(system, blocks)
    other = other_order(system, blocks, best)
    assert sorted(map(str, best[1])) == sorted(map(str, other[1])) == sorted(map(str, blocks))


def test_what_an_event_touches_is_one_hyperedge() -> None:
    system = to_automata(example_model("line_follower/line_follower"), Deployment.CONTROLLER)
    edges = {frozenset(map(str, edge)) for edge in hyperedges(system)}
    assert {"LidarSensor", "LidarSensor.ahead"} in edges
    assert {"LineDetector", "LidarSensor", "EmergencyStop"} in edges


def test_what_plants_need_for_an_event_belongs_to_it() -> None:
    flag = automaton("Feature", ["on -idle-> on"], variables=[DiscreteVariable("present", BooleanType(), (False,))])
    lamp = automaton("Lamp", ["off -light-> lit", "lit -dim-> off"])
    needed = EventCondition("light", VariableRead("Feature", "present"))
    made = replace(system(flag, lamp), plant_conditions=(needed,))
    assert frozenset({Subject("Lamp"), Subject("Feature", "present")}) in hyperedges(made)
    assert hyperedges(system(flag, lamp)) == ()


def test_what_a_long_condition_compares_stands_together() -> None:
    flags = [DiscreteVariable("x", BooleanType(), (False,))]
    automata = [automaton(f"{row}{number}", ["a -go-> a"], variables=flags) for row in "AB" for number in range(4)]
    pairs = [Binary("=", VariableRead(f"A{number}", "x"), VariableRead(f"B{number}", "x")) for number in range(4)]
    made = replace(system(*automata), invariants=(Unary("not", conjunction(*pairs)),))
    found = {frozenset(map(str, edge)) for edge in hyperedges(made)}
    assert {frozenset({f"A{number}.x", f"B{number}.x"}) for number in range(4)} <= found
    assert frozenset(f"{row}{number}.x" for row in "AB" for number in range(4)) in found
