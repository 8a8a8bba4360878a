"""Sums of products: true where they must be, false where they must be, and no cube too many."""

from itertools import product
from random import Random

import pytest

from robosc.expressions import IntegerType
from robosc.supervisor.cover import Words, cover
from robosc.supervisor.diagram import Subject, SubjectDomain
from robosc.supervisor.multivalued import Effort, Space
from robosc.supervisor.structure import DecisionDiagram, DecisionNode

DOMAINS: dict[Subject, SubjectDomain] = {(name, "n"): SubjectDomain(range(4), IntegerType(0, 3)) for name in "ABC"}
NODES = tuple(DecisionNode(name, "n", (0, 1, 2, 3), (0, 1, 0, 1)) for name in "ABC")
SPLIT = tuple(DecisionNode(name, "n", (0, 1, 2, 3), (0, 1, 1, 0)) for name in "ABC")


@pytest.mark.parametrize("seed", range(40))
def test_random_sets(seed: int) -> None:
    dice = Random(seed)
    # Two nodes a place, so that each of the four values is a class of its own.
    diagrams = [DecisionDiagram((node,), 2) for node in (*NODES, *SPLIT)]
    space = Space(diagrams, DOMAINS, Effort(1_000_000))
    cells = [tuple(1 << index for index in cell) for cell in product(range(4), repeat=3)]
    kinds = {cell: dice.choice(["wanted", "forbidden", "free"]) for cell in cells}
    wanted, forbidden = (
        space.sum_of([cell for cell in cells if kinds[cell] == kind]) for kind in ("wanted", "forbidden")
    )
    cubes = cover(space, Words(space, DOMAINS), wanted, forbidden)
    assert space.without(wanted, space.sum_of(cubes)) == 0
    assert space.both(forbidden, space.sum_of(cubes)) == 0
    for cube in cubes:
        assert space.without(wanted, space.sum_of([item for item in cubes if item != cube])) != 0
