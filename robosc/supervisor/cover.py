"""Irredundant sums of products over multi-valued places, with states that do not matter.

A sum is found cube by cube: a state that is not covered yet, made as large as the forbidden states allow. Then cubes
that the others cover are dropped, and literals are given the shortest words that still do.

Sources: R. K. Brayton, G. D. Hachtel, C. T. McMullen and A. L. Sangiovanni-Vincentelli, "Logic Minimization Algorithms
for VLSI Synthesis", Kluwer, 1984, ch. 4 (expand, irredundant, reduce); R. L. Rudell and A. Sangiovanni-Vincentelli,
"Multiple-valued minimization for PLA optimization", IEEE TCAD 6(5), 1987, pp. 727-750.
"""

from robosc.expressions import Expression, StateTest, VariableRead, leaves
from robosc.supervisor.diagram import Domains, Subject
from robosc.supervisor.literals import Membership, Size, membership, merged, operands, size
from robosc.supervisor.multivalued import Cube, GaveUp, Node, Space

MAXIMUM_CUBES = 64
"""Products that a sum may have."""

MAXIMUM_PARTS = 64
"""Values and ranges that the test of one place may name."""


class Words:
    """Tests of places in the model's words, and their sizes.

    Args:
        space: Gives the classes of values.
        domains: Give the values.
    """

    def __init__(self, space: Space, domains: Domains) -> None:
        self._space = space
        self._domains = domains
        self._tests: dict[tuple[int, int], tuple[Membership, Size]] = {}
        self._ranks: dict[Subject, int] = {subject: rank for rank, subject in enumerate(domains)}
        self.ranks = [self._ranks[subject] for subject in space.subjects]
        """For each place where it stands in the model's text."""

    def key(self, condition: Expression) -> tuple[int, int, Size]:
        """How conditions are sorted: tests of one place first, by its place in the model's text, then by length."""
        tested = {
            self._ranks[leaf.component, leaf.variable if isinstance(leaf, VariableRead) else None]
            for leaf in leaves(condition)
            if isinstance(leaf, StateTest | VariableRead)
        }
        return (0 if len(tested) == 1 else operands(condition)), min(tested), size(condition)

    def test(self, variable: int, mask: int) -> Expression:
        """The shortest test whether a place holds a value of some classes, not of all."""
        return self._test(variable, mask)[0].expression

    def size(self, variable: int, mask: int) -> Size:
        """How long that test is; nothing for the test that is always true."""
        return (0, 0) if mask == self._space.full[variable] else self._test(variable, mask)[1]

    def _test(self, variable: int, mask: int) -> tuple[Membership, Size]:
        found = self._tests.get((variable, mask))
        if found is None:
            classes = self._space.classes[variable]
            runs = merged(run for place, item in enumerate(classes) if mask >> place & 1 for run in item)
            self._space.effort.spend(len(runs) + len(classes))
            subject = self._space.subjects[variable]
            test = membership(subject, self._domains[subject], runs)
            self._space.effort.spend(len(test.parts))
            if len(test.parts) > MAXIMUM_PARTS:
                raise GaveUp
            found = self._tests[variable, mask] = (test, test.size)
        return found

    def cube_size(self, cube: Cube) -> Size:
        """How long the tests of a cube are together."""
        sizes = [self.size(variable, mask) for variable, mask in enumerate(cube)]
        return sum(item[0] for item in sizes), sum(item[1] for item in sizes)


def cover(space: Space, words: Words, wanted: Node, forbidden: Node) -> list[Cube]:
    """Cubes that together are true where `wanted` is and false where `forbidden` is; none of them can go.

    Args:
        space: The store of both.
        words: They tell which cubes are short.
        wanted: Where they must be true.
        forbidden: Where they must be false; apart from `wanted`.

    Raises:
        GaveUp: There would be too many, or it takes too many steps.
    """
    cubes: list[Cube] = []
    rest = wanted
    while rest != 0:
        if len(cubes) == MAXIMUM_CUBES:
            raise GaveUp
        cube = _expanded(space, words, space.shortest_path(rest), forbidden)
        cubes.append(cube)
        rest = space.without(rest, space.of_cube(cube))
    return _shortened(space, words, _irredundant(space, words, cubes, wanted), wanted)


def _expanded(space: Space, words: Words, cube: Cube, forbidden: Node) -> Cube:
    """A cube made as large as it can be without a forbidden state, in the order of places that gives fewer words."""
    tested = [variable for variable, mask in enumerate(cube) if mask != space.full[variable]]
    tested.sort(key=lambda variable: words.ranks[variable])
    first = _expanded_in(space, cube, forbidden, tested[::-1])
    if sum(mask != full for mask, full in zip(first, space.full, strict=True)) < 2:
        return first
    return min(first, _expanded_in(space, cube, forbidden, tested), key=words.cube_size)


def _expanded_in(space: Space, cube: Cube, forbidden: Node, order: list[int]) -> Cube:
    masks = list(cube)
    kept = []
    for variable in order:
        before = masks[variable]
        masks[variable] = space.full[variable]
        if space.meets(forbidden, tuple(masks)):
            masks[variable] = before
            kept.append(variable)
    for variable in kept:
        mask = masks[variable]
        for place in range(len(space.classes[variable])):
            if not mask >> place & 1:
                # A cube is free of forbidden states if it is so for each value by itself.
                masks[variable] = 1 << place
                if not space.meets(forbidden, tuple(masks)):
                    mask |= 1 << place
        masks[variable] = mask
    return tuple(masks)


def _irredundant(space: Space, words: Words, cubes: list[Cube], wanted: Node) -> list[Cube]:
    """The cubes without those that the others make unnecessary, the longest tried first."""
    cubes = sorted(cubes, key=words.cube_size, reverse=True)
    kept: list[Cube] = []
    for cube, rest in zip(cubes, _rests(space, cubes, wanted), strict=True):
        if _outside(space, rest, kept) != 0:
            kept.append(cube)
    return kept


def _rests(space: Space, cubes: list[Cube], wanted: Node) -> list[Node]:
    """For each cube what is wanted and lies in none of those after it."""
    rests = [wanted]
    for cube in reversed(cubes[1:]):
        rests.append(space.without(rests[-1], space.of_cube(cube)))
    return rests[::-1]


def _outside(space: Space, node: Node, cubes: list[Cube]) -> Node:
    for cube in cubes:
        node = space.without(node, space.of_cube(cube))
    return node


def _shortened(space: Space, words: Words, cubes: list[Cube], wanted: Node) -> list[Cube]:
    """The cubes with each literal between what only it covers and what it may cover, in the fewest words."""
    kept: list[Cube] = []
    for cube, rest in zip(cubes, _rests(space, cubes, wanted), strict=True):
        own = _outside(space, rest, kept)
        masks = list(cube)
        for variable, mask in enumerate(cube):
            if mask != space.full[variable]:
                masks[variable] = _shortest(words, variable, _values(space, own, variable, mask), mask)
        kept.append(tuple(masks))
    return kept


def _values(space: Space, node: Node, variable: int, mask: int) -> int:
    """The classes of `mask` that a place has anywhere in a predicate."""
    found = 0
    for place in range(len(space.classes[variable])):
        if mask >> place & 1:
            cube = list(space.full)
            cube[variable] = 1 << place
            if space.meets(node, tuple(cube)):
                found |= 1 << place
    return found


def _shortest(words: Words, variable: int, low: int, high: int) -> int:
    """The set of classes between two sets that is told in the fewest words, as far as single steps find it."""
    candidates = [_stepwise(words, variable, high, high & ~low), _stepwise(words, variable, low, high & ~low)]
    return min(candidates, key=lambda mask: words.size(variable, mask))


def _stepwise(words: Words, variable: int, mask: int, free: int) -> int:
    """A set with the free classes in or out that make its test shorter, one after the other."""
    for place in range(free.bit_length()):
        if free >> place & 1:
            other = mask ^ (1 << place)
            if words.size(variable, other) < words.size(variable, mask):
                mask = other
    return mask
