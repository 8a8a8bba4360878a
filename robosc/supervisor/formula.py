"""Short formulas of decision diagrams: sums of products and products of sums, factored, whichever is shortest.

A formula can be exponentially larger than its diagram, so the work is bounded in steps and the result in operands;
beyond either bound there is none, and the diagram itself is what can be shown.

Sources: R. K. Brayton, "Factoring logic functions", IBM Journal of Research and Development 31(2), 1987, pp. 187-198
(common literals); `cover` for the sums.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial

from robosc.expressions import FALSE, TRUE, BinaryOperator, Conditional, Expression, Unary
from robosc.supervisor.cover import Words, cover
from robosc.supervisor.diagram import Domains
from robosc.supervisor.literals import joined, operands, size
from robosc.supervisor.multivalued import Cube, Effort, GaveUp, Node, Space
from robosc.supervisor.structure import DecisionDiagram

OPERANDS = 40
"""Operands up to which a condition is written as a formula."""

_LONG = 5
"""Operands from which on a formula is compared with one that chooses between two shorter ones."""

STEPS = 30_000
"""Steps that the search for one formula may take: some hundredths of a second."""


@dataclass(frozen=True, slots=True)
class _Literal:
    """A test of one place."""

    variable: int
    mask: int


@dataclass(frozen=True, slots=True)
class _Group:
    """Parts joined by one operator: at least two."""

    operator: BinaryOperator
    parts: tuple["_Tree", ...]


_Tree = _Literal | _Group
"""A factored sum of products."""

_Factors = frozenset[_Literal]
"""A product; empty where it is always true."""


def to_expression(
    diagram: DecisionDiagram, domains: Domains, *, limit: int = OPERANDS, effort: Effort | None = None
) -> Expression | None:
    """A short formula with the same meaning in every state, or None where none of at most `limit` operands was found.

    Args:
        diagram: A valid diagram.
        domains: What the places of the state can hold, in the order of the model's text.
        limit: Operands that it may have.
        effort: What the search may take, at most `STEPS` of it; without one, `STEPS`.
    """
    if diagram.root < 2:
        return TRUE if diagram.root else FALSE
    own = Effort(STEPS) if effort is None else effort.part(STEPS)
    try:
        space = Space([diagram], domains, own)
        found = _Formulas(space, domains, limit).shortest(space.of(diagram))
    except GaveUp:
        return None
    return found if found is not None and size(found)[0] <= limit else None


class _Formulas:
    """Finds formulas of the nodes of one store."""

    def __init__(self, space: Space, domains: Domains, limit: int) -> None:
        self._space = space
        self._words = Words(space, domains)
        self._limit = limit
        self._known: dict[Node, Expression | None] = {0: FALSE, 1: TRUE}

    def shortest(self, node: Node) -> Expression | None:
        """The shortest of the formulas that are found; the first of several."""
        if node not in self._known:
            self._known[node] = self._searched(node)
        return self._known[node]

    def _searched(self, node: Node) -> Expression | None:
        if len(self._support(node)) > self._limit:
            # Whatever a node tests matters, so it stands in every formula.
            return None
        opposite = self._space.without(1, node)
        found: list[Expression] = []
        # What has fewer ways to true mostly has the shorter sum.
        for is_negated in sorted((False, True), key=lambda negated: self._space.paths(opposite if negated else node)):
            pair = (opposite, node) if is_negated else (node, opposite)
            cubes = self._tried(partial(cover, self._space, self._words, *pair))
            found += self._tried(partial(self._of_sum, cubes, is_negated))
            if len(cubes) == 1:
                # One product is a sum of its literals the other way round: there is nothing shorter.
                return min(found, key=size, default=None)
        if not found or min(map(operands, found)) >= _LONG:
            found += self._tried(partial(self._choice, node))
        return min(found, key=size, default=None)

    def _tried[Found](self, search: Callable[[], Iterable[Found]]) -> list[Found]:
        """What a search finds with a third of the steps that are left; nothing where it needs more."""
        try:
            with self._space.within(self._space.effort.part(self._space.effort.left // 3)):
                return list(search())
        except GaveUp:
            return []

    def _of_sum(self, cubes: list[Cube], is_negated: bool) -> Iterator[Expression]:
        """A sum of products, or, where it was found for the opposite, the product of sums and the negation."""
        if not cubes:
            return
        groups = self._apart(cubes)
        if 1 < len(groups) < len(cubes):
            # Parts that share no place: each may have a shorter form of its own.
            sums = [self._space.sum_of(group) for group in groups]
            parts = [self.shortest(self._space.without(1, node) if is_negated else node) for node in sums]
            if all(part is not None for part in parts):
                yield self._join("and" if is_negated else "or", [part for part in parts if part is not None])
        tree = self._factored([self._factors(cube) for cube in cubes])
        if is_negated:
            yield self._expression(self._opposite(tree))
            if isinstance(tree, _Group):
                yield Unary("not", self._expression(tree))
        else:
            yield self._expression(tree)

    def _choice(self, node: Node) -> Iterator[Expression]:
        """`if ... then ... else ...`, where the first test has two outcomes that both need more tests."""
        children = self._space.children(node)
        outcomes = list(dict.fromkeys(children))
        if len(outcomes) != 2 or min(outcomes) < 2:
            return
        variable = self._space.variable(node)
        masks = [sum(1 << place for place, child in enumerate(children) if child == outcome) for outcome in outcomes]
        if self._words.size(variable, masks[1]) < self._words.size(variable, masks[0]):
            masks.reverse()
            outcomes.reverse()
        then, otherwise = (self.shortest(outcome) for outcome in outcomes)
        if then is not None and otherwise is not None:
            yield Conditional(self._words.test(variable, masks[0]), then, otherwise)

    # Sums

    def _support(self, node: Node) -> set[int]:
        found, seen, stack = set(), {0, 1}, [node]
        while stack:
            item = stack.pop()
            if item not in seen:
                seen.add(item)
                self._space.effort.spend()
                found.add(self._space.variable(item))
                stack.extend(self._space.children(item))
        return found

    def _factors(self, cube: Cube) -> _Factors:
        return frozenset(
            _Literal(variable, mask) for variable, mask in enumerate(cube) if mask != self._space.full[variable]
        )

    def _apart(self, cubes: list[Cube]) -> list[list[Cube]]:
        """The cubes in groups that test no place in common."""
        groups: list[tuple[set[int], list[Cube]]] = []
        for cube in cubes:
            tested, together = {item.variable for item in self._factors(cube)}, [cube]
            for group in [item for item in groups if item[0] & tested]:
                groups.remove(group)
                tested |= group[0]
                together = [*group[1], *together]
            groups.append((tested, together))
        return [group for _, group in groups]

    # Factoring

    def _factored(self, products: list[_Factors]) -> _Tree:
        """A sum of products, each tested somewhere, with common literals written once."""
        if len(products) == 1:
            return self._group("and", list(products[0]))
        common = frozenset.intersection(*products)
        if common:
            rest = self._factored([product - common for product in products])
            return self._group("and", [*common, rest])
        literal = self._most_frequent(products)
        if literal is None:
            return self._group("or", [self._group("and", list(product)) for product in products])
        with_it = [product for product in products if literal in product]
        others = [product for product in products if literal not in product]
        return self._group("or", [self._factored(with_it), self._factored(others)])

    def _most_frequent(self, products: list[_Factors]) -> _Literal | None:
        """The literal that saves most if it is written once; None if there is none in two products."""
        counts = Counter(literal for product in products for literal in product)
        several = [literal for literal, count in counts.items() if count > 1]

        def saved(literal: _Literal) -> tuple[int, int, int, int]:
            operands, characters = self._words.size(literal.variable, literal.mask)
            times = counts[literal] - 1
            return times * operands, times * characters, -self._words.ranks[literal.variable], literal.mask

        return max(several, key=saved, default=None)

    def _group(self, operator: BinaryOperator, parts: list[_Tree]) -> _Tree:
        if len(parts) == 1:
            return parts[0]
        flat: list[_Tree] = []
        for part in parts:
            flat += part.parts if isinstance(part, _Group) and part.operator == operator else (part,)
        return _Group(operator, tuple(flat))

    def _opposite(self, tree: _Tree) -> _Tree:
        if isinstance(tree, _Literal):
            return _Literal(tree.variable, self._space.full[tree.variable] & ~tree.mask)
        operator: BinaryOperator = "or" if tree.operator == "and" else "and"
        return _Group(operator, tuple(self._opposite(part) for part in tree.parts))

    # Words

    def _expression(self, tree: _Tree) -> Expression:
        if isinstance(tree, _Literal):
            return self._words.test(tree.variable, tree.mask)
        return self._join(tree.operator, [self._expression(part) for part in tree.parts])

    def _join(self, operator: BinaryOperator, parts: list[Expression]) -> Expression:
        """Short parts first, then in the order of the model's text."""
        return joined(operator, sorted(parts, key=self._words.key))
