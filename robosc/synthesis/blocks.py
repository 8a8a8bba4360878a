"""Blocks of places that are compared or computed with each other, so that their bits are interleaved.

If all bits of one integer are above those of another, the diagram of a comparison or a sum must represent every value
of the first: it is exponential in the bits. With bits of equal weight side by side, it only represents a carry.

Source: R. E. Bryant, "Graph-based algorithms for Boolean function manipulation", IEEE Trans. Computers C-35(8), 1986,
pp. 677-691, section 4 (the order of a comparison's and an adder's inputs).
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping

import msgspec

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

MINIMUM_BITS = 5
"""Bits from which an integer is wide: what a diagram has to remember of a narrower one is little."""

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

    sets = _Sets()
    for group in _groups(system):
        if len(group) > 1:
            sets.join(item for item in group if is_wide(item))
    found: defaultdict[Subject | Datum, list[Subject]] = defaultdict(list)
    for subject in subjects(system):
        found[sets.root(subject)].append(subject)
    data = [(item.event, item.path) for item in system.inputs]
    return Blocks(
        tuple(tuple(block) for block in found.values()),
        {item: found[sets.root(item)][0] for item in data if sets.root(item) in found},
    )


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
    """The operands of each comparison, sum and choice in an expression."""
    stack = [expression]
    while stack:
        node = stack.pop()
        match node:
            case Binary(operator=operator, left=left, right=right) if operator in _COMPARISONS:
                yield [*_operands(left, event), *_operands(right, event)]
            case Binary(operator="+" | "-") | Call():
                yield _operands(node, event)
        stack += children(node)


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
            case Binary(operator="+" | "-", left=left, right=right):
                stack += [right, left]
            # Each bit of a factor meets all bits of the other: no order helps.
            case (
                Binary(operator="*", left=factor, right=Constant())
                | Binary(operator="*", left=Constant(), right=factor)
            ):
                stack.append(factor)
            case Binary(operator="div" | "mod", left=dividend, right=Constant()):
                stack.append(dividend)
            case Unary(operator="-", operand=operand):
                stack.append(operand)
            case Conditional(then=then, otherwise=otherwise):
                stack += [otherwise, then]
            case Call(arguments=arguments):
                stack += reversed(arguments)
    return found
