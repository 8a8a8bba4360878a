"""Blocks of places that are compared or computed with each other, so that their bits are interleaved.

If all bits of one integer are above those of another, the diagram of a comparison or a sum must represent every value
of the first: it is exponential in the bits. With bits of equal weight side by side, it only represents a carry.

But it represents one carry for each relation between places whose bits stand side by side, in all their combinations:
for a long chain of places, each compared with the next one, that is far more than the values of one place. Such places
stand one after the other, each compared with its neighbour.

Source: R. E. Bryant, "Graph-based algorithms for Boolean function manipulation", IEEE Trans. Computers C-35(8), 1986,
pp. 677-691, section 4 (the order of a comparison's and an adder's inputs).
"""

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import chain

import msgspec

from robosc.automata.compile import subjects_read
from robosc.automata.state import Subject, subject_domain, subjects
from robosc.automata.structure import System
from robosc.expressions import (
    Binary,
    Call,
    Conditional,
    Constant,
    Expression,
    PathStep,
    Received,
    Unary,
    VariableRead,
    children,
    domain,
)
from robosc.synthesis.order import best_order

MINIMUM_BITS = 5
"""Bits from which an integer is wide: what a diagram has to remember of a narrower one is little."""

CASES_OF_A_RELATION = 11
"""Cases of what a diagram remembers of a relation between places that stand among each other.

They are less, equal or greater for the relation itself and for the one after a step, and what the locations of the
places add that stand away from them. A sum of several counters is as many relations, less one: its diagram is small,
but each step of a counter goes through all of it. Measured on chains and sums of two to ten places of 51 to 1,001
values.
"""

Datum = tuple[str, tuple[PathStep, ...]]
"""A received datum: its event and its path."""

_COMPARISONS = frozenset({"=", "!=", "<", "<=", ">", ">="})


class Blocks(msgspec.Struct, frozen=True):
    """Places and data whose bits stand between each other.

    Attributes:
        places: Every place of a state once, those together that belong together, in the order of `subjects`.
        data: For each wide received datum that is computed with together with places, the first of these.
    """

    places: tuple[tuple[Subject, ...], ...]
    data: Mapping[Datum, Subject]


def blocks_of(system: System) -> Blocks:
    """The places and data of a system that are compared, added or assigned to each other, directly or by others."""
    sizes: dict[Subject | Datum, int] = {(item.event, item.path): len(domain(item.type)) for item in system.inputs}

    def is_wide(item: Subject | Datum) -> bool:
        if item not in sizes:
            sizes[item] = len(subject_domain(system, item)) if isinstance(item, Subject) else 1
        return (sizes[item] - 1).bit_length() >= MINIMUM_BITS

    groups: list[list[Subject | Datum]] = []
    for group in _groups(system):
        wide = [item for item in dict.fromkeys(group) if is_wide(item)]
        if len(wide) > 1:
            groups.append(wide)
    sets = _Sets()
    for group in groups:
        sets.join(group)
    found: defaultdict[Subject | Datum, list[Subject]] = defaultdict(list)
    for subject in subjects(system):
        found[sets.root(subject)].append(subject)
    together = defaultdict[Subject | Datum, list[list[Subject | Datum]]](list)
    for group in groups:
        together[sets.root(group[0])].append(group)
    counters = set(_counters(system))
    apart = {root for root, block in found.items() if _are_better_apart(block, together[root], sizes, counters)}
    places = [[(item,) for item in block] if root in apart else [tuple(block)] for root, block in found.items()]
    homes: dict[Datum, Subject] = {}
    for item in ((item.event, item.path) for item in system.inputs):
        root = sets.root(item)
        if root in found:
            beside = [other for group in together[root] if root in apart and item in group for other in group]
            homes[item] = next((other for other in beside if isinstance(other, Subject)), found[root][0])
    return Blocks(tuple(chain.from_iterable(places)), homes)


def _counters(system: System) -> Iterator[Subject]:
    """Yield the places of which some event computes the next value from their value."""
    for automaton in system.automata:
        for update in (update for edge in automaton.edges for update in edge.updates):
            place = Subject(automaton.name, update.variable)
            if place in subjects_read(update.expression):
                yield place


def _are_better_apart(
    places: Sequence[Subject],
    groups: Iterable[Sequence[Subject | Datum]],
    sizes: Mapping[Subject | Datum, int],
    counters: Collection[Subject],
) -> bool:
    """Return True if work on diagrams is less with places one after the other than with their bits among each other.

    One after the other, what a diagram remembers between two places are the values of those before it that are related
    to some after it, or for each of these relations one value, such as a sum.
    """
    if len(places) < 3:
        return False
    numbers = {place: number for number, place in enumerate(places)}
    related = dict.fromkeys(tuple(sorted(numbers[item] for item in group if item in numbers)) for group in groups)
    edges = [edge for edge in related if len(edge) > 1]
    values = [sizes[place] for place in places]
    left = {edge: len(edge) for edge in edges}
    of_place = defaultdict[int, list[tuple[int, ...]]](list)
    for edge in edges:
        for item in edge:
            of_place[item].append(edge)
    crossing: dict[tuple[int, ...], list[int]] = {}
    most = 0
    for item in best_order(len(places), edges)[1]:
        for edge in of_place[item]:
            left[edge] -= 1
            crossing.setdefault(edge, []).append(item)
            if not left[edge]:
                del crossing[edge]
        remembered = set(chain.from_iterable(crossing.values()))
        by_place = sum((values[other] - 1).bit_length() for other in remembered)
        by_relation = sum((sum(values[other] for other in edge) - 1).bit_length() for edge in crossing)
        most = max(most, min(by_place, by_relation))
    relations = sum(max(1, sum(places[item] in counters for item in edge) - 1) for edge in edges)
    # Nor are there more cases than orders of all places.
    cases: int = min(CASES_OF_A_RELATION**relations, (2 * len(places)) ** len(places))
    return cases > 1 << most


class _Sets:
    """Disjoint sets that grow together."""

    def __init__(self) -> None:
        self._above: dict[Subject | Datum, Subject | Datum] = {}

    def root(self, item: Subject | Datum) -> Subject | Datum:
        """Return the representative of the set of an item."""
        path = []
        while item in self._above:
            path.append(item)
            item = self._above[item]
        for passed in path:
            self._above[passed] = item
        return item

    def join(self, items: Iterable[Subject | Datum]) -> None:
        """Make one set of those of some items."""
        roots = list(dict.fromkeys(self.root(item) for item in items))
        for other in roots[1:]:
            self._above[other] = roots[0]


def _groups(system: System) -> Iterator[list[Subject | Datum]]:
    """Yield the groups of subjects and data that are computed with together."""
    for automaton in system.automata:
        for edge in automaton.edges:
            yield from _together(edge.guard, edge.event)
            for update in edge.updates:
                yield from _together(update.expression, edge.event)
                yield [Subject(automaton.name, update.variable), *_operands(update.expression, edge.event)]
    for condition in (*system.conditions, *system.plant_conditions):
        yield from _together(condition.condition, condition.event)
    for state_condition in (*system.invariants, *system.plant_invariants, system.initial, system.marker):
        yield from _together(state_condition, "")


def _together(expression: Expression, event: str) -> Iterator[list[Subject | Datum]]:
    """The operands of each comparison, sum and choice in an expression that is not a part of one of them."""
    stack = [(expression, False)]
    while stack:
        node, is_part = stack.pop()
        parts: list[Expression] = _summands(node)
        match node:
            case Binary(operator=operator, left=left, right=right) if operator in _COMPARISONS:
                parts = [left, right]
                yield [*_operands(left, event), *_operands(right, event)]
            case Binary(operator="+" | "-") | Call() if not is_part:
                yield _operands(node, event)
        stack += [(child, any(child is part for part in parts)) for child in children(node)]


def _operands(expression: Expression, event: str) -> list[Subject | Datum]:
    """The places and data whose bits go, weight by weight, into the value of an expression."""
    found: list[Subject | Datum] = []
    stack = [expression]
    while stack:
        match stack.pop():
            case VariableRead(component=component, variable=variable):
                found.append(Subject(component, variable))
            case Received(path=path):
                found.append((event, path))
            case node:
                stack += reversed(_summands(node))
    return found


def _summands(expression: Expression) -> list[Expression]:
    """The parts of an expression whose bits go, weight by weight, into its value."""
    match expression:
        case Binary(operator="+" | "-", left=left, right=right):
            return [left, right]
        # Each bit of a factor meets all bits of the other: no order helps.
        case Binary(operator="*", left=factor, right=Constant()) | Binary(operator="*", left=Constant(), right=factor):
            return [factor]
        case Binary(operator="div" | "mod", left=dividend, right=Constant()):
            return [dividend]
        case Unary(operator="-", operand=operand):
            return [operand]
        case Conditional(then=then, otherwise=otherwise):
            return [then, otherwise]
        case Call(arguments=arguments):
            return list(arguments)
        case _:
            return []
