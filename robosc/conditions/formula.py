"""Short formulas of decision diagrams: factored sums of products, their duals and relations, whichever is shortest.

A formula can be exponentially larger than its diagram, so the steps of the search and the operands of the result are
bounded. Beyond either bound there is no formula, and the diagram is shown instead.

Sources: R. K. Brayton, "Factoring logic functions", IBM Journal of Research and Development 31(2), 1987, pp. 187-198
(common literals); `cover` for the sums, `relations` for the relations.
"""

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import lru_cache, partial

import msgspec

from robosc.conditions.cover import MAXIMUM_CUBES, Words, cover
from robosc.conditions.literals import Vocabulary, joined, operands, spine
from robosc.conditions.multivalued import Cube, Effort, EffortExceededError, Node, Space, space_of
from robosc.conditions.relations import Description, Relations
from robosc.expressions import FALSE, TRUE, BinaryOperator, Conditional, Expression, Unary
from robosc.supervisor import DecisionDiagram
from robosc.supervisor.diagram import Domains

OPERANDS = 40
"""Operands up to which a condition is written as a formula."""

_LONG = 5
"""Operands from which on a formula is compared with one that chooses between two shorter ones."""

_MAXIMUM_OUTCOMES = 4
"""Maximum number of outcomes of one place where a formula is divided by its values."""

_WIDE = 12
"""Operands from which on more of them allow no more products."""

_SYSTEMS = 2
"""Systems whose conditions are remembered with their formulas: many are written again after they were chosen."""

_KEPT, _KEPT_NODES = 200, 1_000
"""Conditions of one system that are remembered, and the nodes that each of them may have."""

STEPS = 30_000
"""Steps that the search for one formula may take: some hundredths of a second."""


class _Literal(msgspec.Struct, frozen=True):
    """A test of one place."""

    variable: int
    mask: int


class _Group(msgspec.Struct, frozen=True):
    """Parts joined by one operator: at least two."""

    operator: BinaryOperator
    parts: tuple["_Tree", ...]


_Tree = _Literal | _Group
"""A factored sum of products."""

_Factors = frozenset[_Literal]
"""A product; empty where it is always true."""


def _most_cubes(limit: int) -> int:
    """Cubes that a sum of so many operands can have: most of them if it is a product of sums of three."""
    return min(MAXIMUM_CUBES, max(2, round(3 ** (min(limit, _WIDE) / 3))))


def to_expression(
    diagram: DecisionDiagram, domains: Domains, *, limit: int = OPERANDS, effort: Effort | None = None
) -> Expression | None:
    """Return a short formula with the same meaning in every state, or None where none within `limit` was found.

    Args:
        diagram: A valid diagram.
        domains: Values that the places of the state can hold, in the order of the model's text.
        limit: Maximum number of operands.
        effort: Effort that the search may take, at most `STEPS` of it; without one, `STEPS`.
    """
    return formula_in(Vocabulary(domains), diagram, limit=limit, effort=Effort(STEPS) if effort is None else effort)


def formula_in(vocabulary: Vocabulary, diagram: DecisionDiagram, *, limit: int, effort: Effort) -> Expression | None:
    """The same as `to_expression`, for many diagrams in one vocabulary."""
    if diagram.root < 2:
        return TRUE if diagram.root else FALSE
    if effort.available < 1:
        # Every node takes a step: to read a large diagram for it would take long.
        return None
    # Beyond these operands the limit decides nothing in a search, so that its result is the same for other limits.
    most = min(limit, max(_WIDE, len({(node.automaton, node.variable) for node in diagram.nodes})))
    if effort.available < STEPS or len(diagram.nodes) > _KEPT_NODES:
        found = _search(vocabulary, diagram, most, effort)
    else:
        searches, key = _searches(vocabulary.words), (diagram, most)
        if key not in searches:
            left = effort.left
            if len(searches) == _KEPT:
                searches.clear()
            searches[key] = _search(vocabulary, diagram, most, effort), left - effort.left
        else:
            # Later results must not depend on earlier searches.
            with suppress(EffortExceededError):
                effort.spend(searches[key][1])
        found = searches[key][0]
    return found if found is not None and operands(found) <= limit else None


@lru_cache(maxsize=_SYSTEMS)
def _searches(words: Hashable) -> dict[tuple[DecisionDiagram, int], tuple[Expression | None, int]]:
    """Return the searches that are done for a vocabulary: what each found for a diagram and a limit, and its steps.

    Args:
        words: All that decides about the vocabulary's tests.
    """
    return {}


def _search(vocabulary: Vocabulary, diagram: DecisionDiagram, limit: int, effort: Effort) -> Expression | None:
    try:
        space = space_of([diagram], vocabulary.domains, effort.part(STEPS))
        return _Formulas(space, vocabulary, limit).shortest(space.of(diagram))
    except EffortExceededError:
        return None


class _Formulas:
    """Finds formulas of the nodes of one store."""

    def __init__(self, space: Space, vocabulary: Vocabulary, limit: int) -> None:
        self._space = space
        self._words = Words(space, vocabulary)
        self._relations = Relations(space, self._words, vocabulary.domains)
        self._limit = limit
        self._known: dict[Node, Expression | None] = {0: FALSE, 1: TRUE}
        self._covers: dict[Node, list[Cube]] = {}
        self._supports: dict[Node, frozenset[int]] = {}

    def shortest(self, node: Node) -> Expression | None:
        """The shortest of the formulas that are found; the first of several."""
        if node not in self._known:
            # The node has no formula while one is sought: a formula in terms of itself would not end.
            self._known[node] = None
            try:
                self._known[node] = self._searched(node)
            except EffortExceededError:
                del self._known[node]
                raise
        return self._known[node]

    def _searched(self, node: Node) -> Expression | None:
        tested = self._support(node)
        if len(tested) > self._limit:
            # Every variable that a node tests matters, so it stands in every formula.
            return None
        opposite = self._space.without(1, node)
        compared = self._relations.comparable(tested)
        # A sum that is not the smallest may have some more.
        most = 2 + 2 * _most_cubes(self._limit)
        found: list[Expression] = []
        if compared:
            # A formula that tests each place once has few products, and is found soon.
            found += self._of_sums(node, opposite, max(2, len(tested)))
            if not found or self._least(found) > len(tested):
                found += self._of_relations(node, opposite, compared, len(tested))
            if found:
                most = _most_cubes(self._least(found))
        if not found or self._least(found) > len(tested):
            found += self._of_sums(node, opposite, min(most, MAXIMUM_CUBES))
            if len(self._covers.get(node, ())) == 1 or len(self._covers.get(opposite, ())) == 1:
                # One product is a sum of its literals the other way round: only relations are shorter.
                return self._words.shortest(found)
            if not found or self._least(found) >= _LONG:
                found += self._tried(partial(self._choice_at, node, self._best(found)))
            if compared and (not found or self._least(found) > len(tested)):
                found += self._tried(partial(self._divided, node, tested, self._best(found)))
        return self._words.shortest(found)

    def _best(self, found: list[Expression]) -> int:
        """Return the operands of the shortest of some formulas; as many as any may have if there are none."""
        best = self._least(found) if found else max(OPERANDS, self._limit)
        # A limit below _WIDE is that of the caller, who has no use for longer formulas.
        return min(best, self._limit) if self._limit < _WIDE else best

    def _least(self, found: list[Expression]) -> int:
        return min(map(self._words.operands, found))

    def _of_sums(self, node: Node, opposite: Node, most: int) -> list[Expression]:
        """The formulas of a sum of at most so many products, and of the negation of such a sum."""
        found: list[Expression] = []
        # A diagram with fewer ways to true mostly has the shorter sum.
        for is_negated in sorted((False, True), key=lambda negated: self._space.paths(opposite if negated else node)):
            wanted, forbidden = (opposite, node) if is_negated else (node, opposite)
            if wanted not in self._covers:
                cubes = self._tried(partial(cover, self._space, self._words, wanted, forbidden, most=most))
                if cubes:
                    self._covers[wanted] = cubes
            cubes = self._covers.get(wanted, [])
            found += self._tried(partial(self._of_sum, cubes, is_negated))
            if len(cubes) == 1:
                break
        return found

    def _tried[Found](self, search: Callable[[], Iterable[Found]]) -> list[Found]:
        """Return the results that a search finds with a third of the steps that are left."""
        found: list[Found] = []
        try:
            with self._space.within(self._space.effort.part(self._space.effort.left // 3)):
                for item in search():
                    found.append(item)  # what was found before it gives up is kept
        except EffortExceededError:
            pass
        return found

    def _of_relations(self, node: Node, opposite: Node, compared: tuple[int, ...], least: int) -> list[Expression]:
        """Formulas with relations, if there are any; no further ones after one with the least operands."""
        pairs = [(node, opposite, False), (opposite, node, True)]
        exact = [pair for pair in pairs if self._tried(partial(self._enough, *pair[:2], compared))]
        found: list[Expression] = []
        for pair in exact or pairs:
            found += self._tried(partial(self._related, *pair, compared, least))
            if found and self._least(found) <= least:
                break
        return found

    def _enough(self, wanted: Node, forbidden: Node, compared: tuple[int, ...]) -> list[bool]:
        return [True] if self._relations.are_enough(wanted, forbidden, compared) else []

    def _related(
        self, wanted: Node, forbidden: Node, is_negated: bool, compared: tuple[int, ...], least: int
    ) -> Iterator[Expression]:
        """Relations and whatever else they need, or, where they were found for the opposite, the negation of that."""
        for description in self._relations.descriptions(wanted, forbidden, compared):
            parts = self._described(description, is_negated)
            if parts is not None:
                found = self._join("or" if is_negated else "and", parts)
                yield found
                if self._words.operands(found) <= least:
                    return

    def _described(self, description: Description, is_negated: bool) -> list[Expression] | None:
        """The parts of a description, or of its negation; None where one of them has no formula."""
        operator: BinaryOperator = "or" if is_negated else "and"
        terms = [self._relations.expression(item.opposite if is_negated else item) for item in description.relations]
        if description.single != 1:
            single = self._space.without(1, description.single) if is_negated else description.single
            part = self.shortest(single)
            if part is None:
                return None
            terms += spine(operator, part)
        if description.inner is not None:
            inner = self._described(description.inner, not is_negated)
            if inner is None:
                return None
            terms += spine(operator, self._join("and" if is_negated else "or", inner))
        return terms

    def _divided(self, node: Node, tested: Iterable[int], best: int) -> Iterator[Expression]:
        """Yield formulas by cases over each place's values: what is left for a case may be relations alone."""
        for variable in tested:
            outcomes: dict[Node, int] = {}
            for place, outcome in enumerate(self._space.fixed(node, variable)):
                outcomes[outcome] = outcomes.get(outcome, 0) | 1 << place
            if len(outcomes) <= _MAXIMUM_OUTCOMES:
                for found in self._cases(variable, outcomes, best):
                    best = min(best, self._words.operands(found))
                    yield found

    def _are_too_long(
        self, variable: int, outcomes: Mapping[Node, int], best: int, known: Mapping[Node, Expression | None]
    ) -> bool:
        """Return True if cases over a place's values need more operands than the best formula has.

        Args:
            variable: The place.
            outcomes: Remainders for some of its values, with these values.
            best: Operands of the best formula.
            known: Formulas of some outcomes.
        """
        count = {
            outcome: len(self._support(outcome)) if found is None else self._words.operands(found)
            for outcome in outcomes
            if outcome > 1
            for found in [known.get(outcome)]
        }
        tests = {outcome: self._words.size(variable, mask)[0] for outcome, mask in outcomes.items()}
        least = sum(count.values())
        if len(outcomes) == 2 and 1 in outcomes:
            least += tests[1]
        elif len(count) == 2 == len(outcomes):
            # One choice may be shorter than two tests.
            least += min(sum(tests.values()), 1 + min(tests.values()))
        else:
            least += sum(tests[outcome] for outcome in outcomes if outcome)
        return least > best

    def _parts(self, variable: int, outcomes: dict[Node, int], best: int) -> dict[Node, Expression | None] | None:
        """Return formulas of what is left for a place's values; None where they are not shorter than the best one."""
        parts: dict[Node, Expression | None] = {}
        for outcome in outcomes:
            if self._are_too_long(variable, outcomes, best, parts):
                return None
            if outcome > 1:
                parts[outcome] = self.shortest(outcome)
        return parts

    def _cases(self, variable: int, outcomes: dict[Node, int], best: int) -> Iterator[Expression]:
        """Tests of one place, each with what is left for its values, unless they are longer than the best formula."""
        parts = self._parts(variable, outcomes, best)
        if parts is None:
            return
        terms = []
        for outcome, mask in outcomes.items():
            part = parts.get(outcome, TRUE)
            if part is None:
                return
            if outcome == 1 or (outcome and 1 in outcomes and len(outcomes) == 2):
                # A part that is true for the other values needs no test of its own.
                terms.append(part if outcome > 1 else self._words.test(variable, mask))
            elif outcome:
                terms.append(self._join("and", [self._words.test(variable, mask), part]))
        yield self._join("or", terms)
        if len(parts) == len(outcomes) == 2:
            yield from self._choice(variable, outcomes)

    def _of_sum(self, cubes: list[Cube], is_negated: bool) -> Iterator[Expression]:
        """A sum of products, or, where it was found for the opposite, the product of sums and the negation."""
        if not cubes:
            return
        groups = self._independent(cubes)
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

    def _choice_at(self, node: Node, best: int) -> Iterator[Expression]:
        """`if ... then ... else ...`, where the first test has two outcomes that both need more tests."""
        outcomes: dict[Node, int] = {}
        for place, child in enumerate(self._space.children(node)):
            outcomes[child] = outcomes.get(child, 0) | 1 << place
        variable = self._space.variable(node)
        if len(outcomes) == 2 and min(outcomes) > 1 and self._parts(variable, outcomes, best) is not None:
            yield from self._choice(variable, outcomes)

    def _choice(self, variable: int, outcomes: dict[Node, int]) -> Iterator[Expression]:
        """`if ... then ... else ...` with the shorter test."""
        (first, mask), (second, other) = outcomes.items()
        if self._words.size(variable, other) < self._words.size(variable, mask):
            first, mask, second = second, other, first
        then, otherwise = self.shortest(first), self.shortest(second)
        if then is not None and otherwise is not None:
            yield Conditional(self._words.test(variable, mask), then, otherwise)

    # Sums

    def _support(self, node: Node) -> frozenset[int]:
        known = self._supports.get(node)
        if known is not None:
            return known
        found, seen, stack = set[int](), {0, 1}, [node]
        while stack:
            item = stack.pop()
            if item not in seen:
                seen.add(item)
                self._space.effort.spend()
                found.add(self._space.variable(item))
                stack.extend(self._space.children(item))
        self._supports[node] = frozenset(found)
        return self._supports[node]

    def _factors(self, cube: Cube) -> _Factors:
        return frozenset(
            _Literal(variable, mask) for variable, mask in enumerate(cube) if mask != self._space.full[variable]
        )

    def _independent(self, cubes: list[Cube]) -> list[list[Cube]]:
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
        return joined(operator, self._words.ordered(parts))
