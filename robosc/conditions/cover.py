"""Irredundant sums of products over multi-valued places, with states that do not matter.

A sum is built cube by cube: a state that no cube covers yet is expanded as far as the forbidden states allow. Then
redundant cubes are dropped, and literals get the shortest words that are still correct.

Sources: R. K. Brayton, G. D. Hachtel, C. T. McMullen and A. L. Sangiovanni-Vincentelli, "Logic Minimization Algorithms
for VLSI Synthesis", Kluwer, 1984, ch. 4 (expand, irredundant, reduce); R. L. Rudell and A. Sangiovanni-Vincentelli,
"Multiple-valued minimization for PLA optimization", IEEE TCAD 6(5), 1987, pp. 727-750.
"""

from collections.abc import Iterable

from robosc.conditions.literals import Indices, Size, Vocabulary, length, merged, size
from robosc.conditions.multivalued import Cube, EffortExceededError, Node, Space
from robosc.expressions import Conditional, Expression, StateTest, VariableRead, children

MAXIMUM_CUBES = 64
"""Products that a sum may have."""

MAXIMUM_PARTS = 64
"""Values and ranges that the test of one place may name."""

_Measure = tuple[int, int, int]
"""Operands of a condition, and the least and the greatest rank of the places that it tests."""


class Words:
    """Tests of places in the model's words, and their sizes.

    Args:
        space: Gives the classes of values.
        vocabulary: Puts tests into words.
    """

    def __init__(self, space: Space, vocabulary: Vocabulary) -> None:
        self._space = space
        self._vocabulary = vocabulary
        self._tests: dict[tuple[int, int], tuple[Expression, Size]] = {}
        self._measures: dict[int, tuple[Expression, _Measure]] = {}
        self._sizes: dict[int, tuple[Expression, Size]] = {}
        self._ranks = vocabulary.ranks
        self.ranks = [self._ranks[subject] for subject in space.subjects]
        """For each place where it stands in the model's text."""

    def ordered(self, conditions: Iterable[Expression]) -> list[Expression]:
        """Return conditions in order: tests of one place first, by place in the model's text, then by length."""
        keys = []
        for condition in conditions:
            count, first, last = self._measure(condition)
            keys.append(((0 if first == last else count), first, condition))
        if len({key[:2] for key in keys}) == len(keys):
            keys.sort(key=lambda key: key[:2])
        else:
            # Texts take long to write: they are only where nothing else decides.
            keys.sort(key=lambda key: (*key[:2], self._size(key[2])))
        return [key[2] for key in keys]

    def _size(self, condition: Expression) -> Size:
        known = self._sizes.get(id(condition))
        if known is None:
            known = self._sizes[id(condition)] = condition, size(condition)
        return known[1]

    def operands(self, condition: Expression) -> int:
        """Return the number of operands of a condition; parts that were measured before are not looked at again."""
        return self._measure(condition)[0]

    def shortest(self, conditions: Iterable[Expression]) -> Expression | None:
        """Return the shortest of some conditions, the first of several; None if there are none."""
        found = list(conditions)
        least = min(map(self.operands, found), default=0)
        found = [item for item in found if self.operands(item) == least]
        return min(found, key=length) if len(found) > 1 else next(iter(found), None)

    def _measure(self, condition: Expression) -> "_Measure":
        # An expression is kept with its measure: its number could otherwise become that of another one.
        known = self._measures.get(id(condition))
        if known is not None:
            return known[1]
        count, first, last = 0, len(self._ranks), -1
        stack = [condition]
        while stack:
            part = stack.pop()
            known = self._measures.get(id(part))
            if known is not None:
                more, lowest, highest = known[1]
            elif isinstance(part, StateTest | VariableRead):
                variable = part.variable if isinstance(part, VariableRead) else None
                more, lowest = 1, self._ranks[part.component, variable]
                highest = lowest
            else:
                stack += children(part)
                count += isinstance(part, Conditional)
                continue
            count += more
            first, last = min(first, lowest), max(last, highest)
        measure = count, first, last
        self._measures[id(condition)] = condition, measure
        return measure

    def test(self, variable: int, mask: int) -> Expression:
        """The shortest test whether a place holds a value of some classes, not of all."""
        return self._test(variable, mask)[0]

    def size(self, variable: int, mask: int) -> Size:
        """Return the length of the test that `test` returns; zero for the test that is always true."""
        found = self._tests.get((variable, mask))
        if found is not None:
            return found[1]
        return (0, 0) if mask == self._space.full[variable] else self._test(variable, mask)[1]

    def ranges(self, variable: int, mask: int) -> int:
        """Over how many ranges of integers its values lie; other values lie as they come."""
        return len(self._runs(variable, mask)) if variable in self._space.integers else 0

    def _runs(self, variable: int, mask: int) -> Indices:
        classes = self._space.classes[variable]
        return merged(run for place, item in enumerate(classes) if mask >> place & 1 for run in item)

    def _test(self, variable: int, mask: int) -> tuple[Expression, Size]:
        found = self._tests.get((variable, mask))
        if found is None:
            runs = self._runs(variable, mask)
            self._space.effort.spend(len(runs) + len(self._space.classes[variable]))
            test = self._vocabulary.test(self._space.subjects[variable], runs)
            self._space.effort.spend(len(test.parts))
            if len(test.parts) > MAXIMUM_PARTS:
                raise EffortExceededError
            found = self._tests[variable, mask] = (test.expression, test.size)
        return found

    def cube_size(self, cube: Cube) -> Size:
        """Return the total length of the tests of a cube."""
        count = characters = 0
        for variable, (mask, full) in enumerate(zip(cube, self._space.full, strict=True)):
            if mask != full:
                size = self.size(variable, mask)
                count += size[0]
                characters += size[1]
        return count, characters


def cover(space: Space, words: Words, wanted: Node, forbidden: Node, *, most: int = MAXIMUM_CUBES) -> list[Cube]:
    """Return cubes that together are true where `wanted` is and false where `forbidden` is; none is redundant.

    Args:
        space: The store of both.
        words: Sizes of tests, by which cubes are compared for length.
        wanted: Node of the states where they must be true.
        forbidden: Node of the states where they must be false; disjoint from `wanted`.
        most: Number of cubes that there may be before some of them are dropped.

    Raises:
        EffortExceededError: There would be too many, or it takes too many steps.
    """
    cubes: list[Cube] = []
    rest = wanted
    while rest != 0:
        if len(cubes) == most:
            raise EffortExceededError
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
        # A cube is free of forbidden states if it is so for each value by itself.
        masks[variable] = space.full[variable] & ~space.meeting(forbidden, tuple(masks), variable)
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
                masks[variable] = _shortest(
                    space, words, variable, space.meeting(own, space.full, variable) & mask, mask
                )
        kept.append(tuple(masks))
    return kept


def _shortest(space: Space, words: Words, variable: int, low: int, high: int) -> int:
    """The set of classes between two sets that takes the fewest words, as far as it is found; rather one range."""
    candidates = [_filled(space, variable, low, high)] if variable in space.integers else []
    candidates += [_stepwise(words, variable, high, high & ~low), _stepwise(words, variable, low, high & ~low)]

    def rank(mask: int) -> tuple[int, int, int]:
        operands, characters = words.size(variable, mask)
        return operands, words.ranges(variable, mask), characters

    return min(candidates, key=rank)


def _filled(space: Space, variable: int, low: int, high: int) -> int:
    """The lower set with each gap between its values, and before and after them, that the upper set fills whole."""
    runs = sorted((run.start, 1 << place) for place, item in enumerate(space.classes[variable]) for run in item)
    found, gap = low, 0
    for _, place in runs:
        if not place & low:
            gap |= place
            continue
        if not gap & ~high:
            found |= gap
        gap = 0
    return found if gap & ~high else found | gap


def _stepwise(words: Words, variable: int, mask: int, free: int) -> int:
    """A set with the free classes in or out that make its test shorter, one after the other."""
    for place in range(free.bit_length()):
        if free >> place & 1:
            other = mask ^ (1 << place)
            if words.size(variable, other) < words.size(variable, mask):
                mask = other
    return mask
