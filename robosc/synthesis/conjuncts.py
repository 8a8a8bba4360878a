"""Good states as a conjunction of predicates over few places each: what an event needs of them is near what it changes.

Unless a supervisor has to prevent that the system blocks, its good states are those in which every code stands for a
value, every invariant holds, and no run of uncontrollable events leads to where one of these does not. Each condition
reads the places near it alone. An event leads from a good state into good ones if it breaks no condition that depends
on what it changes: all other ones stay as they are. So a few small predicates decide about it, where the predicate of
all good states has nodes for every place.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from typing import Any

import msgspec

from robosc.synthesis.expression_encoder import ExpressionEncoder
from robosc.synthesis.fixed_point import SolvedProblem
from robosc.synthesis.nodes import restrict
from robosc.synthesis.transitions import Steps

SMALLEST = 100
"""Bits of a state from which conjuncts are looked for: below that, predicates of the whole are as fast."""

MAXIMUM_NODES = 1_000
"""Nodes up to which a predicate counts as small."""


class Conjunct(msgspec.Struct, frozen=True, eq=False):
    """A condition on states that all good ones meet; no uncontrollable event leads from where it holds to elsewhere.

    Attributes:
        holds: Predicate that it holds.
        names: The variables that the predicate depends on.
        invariant: Place in `System.invariants` of the invariant that it comes from; None if it comes from none.
    """

    holds: Any
    names: frozenset[str]
    invariant: int | None = None


class Conjuncts:
    """Conjuncts of the good states of a solved problem, which are exactly the states that meet all of them.

    Args:
        solved: The problem.

    Attributes:
        near: For variables the conjuncts that depend on them.
        are_safety: True if the good states are all from which nothing unsafe is inevitable.
    """

    def __init__(self, solved: SolvedProblem) -> None:
        # The problem itself may have its conjuncts: its diagrams have to end without the garbage collector.
        self._problem, self._monitor = solved.problem, solved.monitor
        self._encoding = solved.encoding
        self._manager = solved.encoding.manager
        self._only: dict[str, Any] = {}
        self.are_safety = False
        found = None
        # The states that a given supervisor keeps to may be left against it.
        if len(self._encoding.state_names) >= SMALLEST and not self._encoding.system.is_controlled:
            found = self._of_safety()
        if found is None:
            found = [self._conjunct(solved.good)]
        else:
            safe = self._encoding.all_of(item.holds for item in found)
            self.are_safety = bool(safe == solved.good)
            if not self.are_safety:
                found.append(self._conjunct(restrict(self._manager, solved.good, safe)))
        self.near: Mapping[str, list[Conjunct]] = _by_name(found, lambda item: item.names)

    def only(self, steps: Steps) -> Any:
        """Return a predicate over states: is it only good ones that an event leads to, if it happens?

        It is right for good states and means nothing for other ones.
        """
        name = steps.event.name
        found = self._only.get(name)
        if found is None:
            found = self._encoding.all_of(steps.only(item.holds) for item in self.touched(steps))
            if found.dag_size <= MAXIMUM_NODES:
                self._only[name] = found
        return found

    def possible(self, steps: Steps) -> Any:
        """Return a predicate over states: can an event happen under the supervisor?

        It is right for good states and means nothing for other ones.
        """
        return steps.plant & steps.condition & self.only(steps) if steps.event.is_controllable else steps.plant

    def touched(self, steps: Steps) -> Iterator[Conjunct]:
        """Yield the conjuncts that depend on what an event changes."""
        yield from {id(item): item for name in steps.changed for item in self.near.get(name, ())}.values()

    @cached_property
    def changing(self) -> Mapping[str, list[Steps]]:
        """For variables the events that change them."""
        return _by_name(self._problem.steps, lambda steps: steps.changed)

    def avoidable(self, states: Any) -> Any:
        """Return the states from which no run of uncontrollable events leads to some states; None where it is large."""
        found, waiting = states, True
        # Nodes of a condition of the model are there already.
        limit = max(MAXIMUM_NODES, states.dag_size)
        while waiting:
            before = found
            for steps in self.touching(self._manager.support(found)):
                if not steps.event.is_controllable:
                    self._monitor.check_stop()
                    found = found | steps.some(found)
            if found.dag_size > limit:
                return None
            waiting = found != before
        return ~found

    def touching(self, names: Iterable[str]) -> Iterator[Steps]:
        """Yield the events that change some of some variables, in an order of their own."""
        changing = self.changing
        # Sets of names have no order that is the same every time.
        yield from {id(steps): steps for name in sorted(names) for steps in changing.get(name, ())}.values()

    def _of_safety(self) -> list[Conjunct] | None:
        """The conjuncts that safety asks for; None where one of them is large."""
        encoding = self._encoding
        holds = ExpressionEncoder(encoding).holds
        conditions: list[tuple[Any, int | None]] = [(encoding.valid(bits), None) for bits in encoding.subjects.values()]
        conditions += [(holds(item), place) for place, item in enumerate(encoding.system.invariants)]
        conditions += [(~steps.bad, None) for steps in self._problem.steps]
        found: list[Conjunct] = []
        for condition, invariant in conditions:
            if condition == self._manager.true:
                continue
            kept = self.avoidable(~condition)
            if kept is None:
                return None
            found.append(self._conjunct(kept, invariant))
        return found

    def _conjunct(self, holds: Any, invariant: int | None = None) -> Conjunct:
        return Conjunct(holds, frozenset(self._manager.support(holds)), invariant)


def _by_name[T](items: Iterable[T], names_of: Callable[[T], Iterable[str]]) -> dict[str, list[T]]:
    found: defaultdict[str, list[T]] = defaultdict(list)
    for item in items:
        for name in names_of(item):
            found[name].append(item)
    return dict(found)
