"""Sums of products: true where they must be, false where they must be, and no cube too many."""

from itertools import product
from random import Random

import pytest

from robosc.conditions.cover import Words, cover
from robosc.conditions.literals import Vocabulary
from robosc.conditions.multivalued import Effort, Space
from robosc.conditions.rendering import in_words
from robosc.expressions import IntegerType
from robosc.supervisor import DecisionDiagram, DecisionNode
from robosc.supervisor.diagram import Subject, SubjectDomain

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
    cubes = cover(space, Words(space, Vocabulary(DOMAINS)), wanted, forbidden)
    assert space.without(wanted, space.sum_of(cubes)) == 0
    assert space.both(forbidden, space.sum_of(cubes)) == 0
    for cube in cubes:
        assert space.without(wanted, space.sum_of([item for item in cubes if item != cube])) != 0


@pytest.mark.parametrize(
    ("wanted", "forbidden", "text"),
    [
        ([0, 1], [2], "A.n <= 1"),
        ([0, 1, 7], [4], "A.n != 4"),
        # Values between do not matter.
        ([0, 3], [8], "A.n <= 3"),
        ([1, 4], [0, 9], "A.n >= 1 and A.n <= 4"),
        ([0, 6], [7, 9], "A.n <= 6"),
        ([2, 5], [0], "A.n >= 2"),
        ([3], [5], "A.n = 3"),
    ],
)
def test_ranges_are_not_ragged(wanted: list[int], forbidden: list[int], text: str) -> None:
    domains: dict[Subject, SubjectDomain] = {("A", "n"): SubjectDomain(range(10), IntegerType(0, 9))}
    every = DecisionNode("A", "n", tuple(range(10)), tuple(index % 2 for index in range(10)))
    space = Space([DecisionDiagram((every,), 2)], domains, Effort(10_000), apart=domains)
    words = Words(space, Vocabulary(domains))
    sets = [space.of_cube((sum(1 << value for value in values),)) for values in (wanted, forbidden)]
    cubes = cover(space, words, sets[0], sets[1])
    assert [in_words(words.test(0, cube[0]), ()) for cube in cubes] == [text]
