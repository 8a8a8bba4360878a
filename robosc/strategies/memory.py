"""The memory of a game, as it changes when a stable state is observed, on decision diagrams.

Places are written part by part: a tour, of whose places at most one is true, is one part with a case for each of its
stages, and each other place is a part with two cases. So no diagram holds the memory before and after at once, which
for several long tours would be as many nodes as they have stages in all combinations.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import reduce
from typing import Any

import msgspec

from robosc.automata.goal_memory import MEMORY, Obligations
from robosc.automata.state import Subject
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.expression_encoder import ExpressionEncoder
from robosc.synthesis.nodes import renamed

MAXIMUM_TOGETHER = 400
"""Combinations of stages of tours that are followed together; the others are followed one by one."""


class _Part(msgspec.Struct, frozen=True):
    """Places of the memory that are written together.

    Attributes:
        names: Their variables.
        cases: For each combination of values that they can take, the predicate under which they take it, and the
            predicate that they have it.
        read: Variables of the memory that decide about them.
        is_tour: True for those of a tour.
    """

    names: tuple[str, ...]
    cases: tuple[tuple[Any, Any], ...]
    read: frozenset[str]
    is_tour: bool

    def with_all_of(self, other: "_Part") -> "_Part":
        """Return the places of both as one part."""
        cases = ((a & b, x & y) for a, x in self.cases for b, y in other.cases)
        return _Part((*self.names, *other.names), tuple(cases), self.read | other.read, self.is_tour or other.is_tour)


class ObservedMemory:
    """Memory of a game.

    Args:
        encoding: The variables.
        owed: Aims and assumptions with the memory.

    Attributes:
        updates: For the variable of each place, the predicate that it is true once a state is observed.
        possible: Predicate that of the places of each tour at most one is true.
    """

    def __init__(self, encoding: Encoding, owed: Obligations) -> None:
        self._encoding = encoding
        self._manager = encoding.manager
        encoder = ExpressionEncoder(encoding)
        names = {place.name: encoding.subjects[Subject(MEMORY, place.name)].names[0] for place in owed.places}
        self.updates = {names[place.name]: encoder.holds(place.update) for place in owed.places}
        tours = [tuple(names[place.name] for place in tour.places) for tour in owed.tours]
        toured = {name for tour in tours for name in tour}
        singles = ((name,) for name in self.updates if name not in toured)
        parts = [self._part(item, is_tour=False) for item in singles]
        parts += [self._part(item, is_tour=True) for item in tours if item]
        self._parts = tuple(_in_order(parts))
        self.possible = encoding.all_of(
            encoding.any_of(value for _, value in part.cases) for part in self._parts if part.is_tour
        )

    def _part(self, names: tuple[str, ...], *, is_tour: bool) -> _Part:
        every = self._encoding.all_of(~self._manager.var(name) for name in names)
        cases = [(self._encoding.all_of(~self.updates[name] for name in names), every)]
        for name in names:
            others = self._manager.exist([name], every)
            cases.append((self.updates[name], others & self._manager.var(name)))
        read = set[str]().union(*(self._manager.support(self.updates[name]) for name in names))
        return _Part(names, tuple(cases), frozenset(read & self.updates.keys()), is_tour)

    def before(self, predicate: Any) -> Any:
        """Return the stable states that are in a predicate once they are observed."""
        return self._manager.let(self.updates, predicate) if self.updates else predicate

    def updates_of(self, names: Mapping[str, str]) -> dict[str, Any]:
        """Return what variables stand for in a state that is observed and has variables called otherwise.

        Args:
            names: Variables of the state, and how they are called instead.
        """
        found = {name: renamed(self._manager, names, update) for name, update in self.updates.items()}
        return {**found, **{name: self._manager.var(new) for name, new in names.items()}}

    def after(self, states: Any, forgotten: Collection[str] = ()) -> Any:
        """Return what stable states become once they are observed.

        Args:
            states: Stable states, without the memory that is forgotten.
            forgotten: Variables of the memory that are not looked at, and decide about no others.
        """
        for part in self._parts:
            if not part.names or part.names[0] in forgotten:
                continue
            found = self._manager.false
            for condition, value in part.cases:
                found = found | (value & self._manager.exist(part.names, states & condition))
            states = found
        return states

    def forgetting(self, states: Any, forgotten: Collection[str]) -> Any:
        """Return states with any value of some variables."""
        return self._manager.exist(forgotten, states) if forgotten else states

    def apart(self) -> Iterator[frozenset[str]]:
        """Yield sets of the memory's variables that can be forgotten, so that all others are followed exactly.

        Every variable is followed in one of these ways. Where tours have few stages, there is one way, in which nothing
        is forgotten.
        """
        always = {name for part in self._parts if not part.is_tour for name in (*part.names, *part.read)}
        groups: list[tuple[int, set[str]]] = []
        for part in self._parts:
            if not part.is_tour:
                continue
            kept = self._deciding(part.names)
            number = len(part.cases)
            if groups and groups[-1][0] * number <= MAXIMUM_TOGETHER:
                groups[-1] = groups[-1][0] * number, groups[-1][1] | kept
            else:
                groups.append((number, kept))
        for _, kept in groups or [(1, set())]:
            yield frozenset(self.updates.keys() - kept - self._deciding(always))

    def _deciding(self, names: Collection[str]) -> set[str]:
        """Return some variables of the memory with all that decide about them."""
        found, before = set(names), set[str]()
        while found != before:
            before = set(found)
            for part in self._parts:
                if not found.isdisjoint(part.names):
                    found |= part.read | set(part.names)
        return found


def _in_order(parts: Sequence[_Part]) -> Iterator[_Part]:
    """Yield the parts of a memory so that each is written before those that decide about it."""
    left = list(parts)
    while left:
        ready = [part for part in left if all(part is other or other.read.isdisjoint(part.names) for other in left)]
        if not ready:
            # The parts that are left decide about each other.
            yield reduce(_Part.with_all_of, left)
            return
        yield from ready
        left = [part for part in left if part not in ready]
