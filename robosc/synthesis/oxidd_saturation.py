"""Saturation on the functions of OxiDD, without what makes predicates of them.

The algorithm is that of `saturation`. A function belongs to the store that it was made in. When the manager has been
rebuilt into a larger one meanwhile, by this work or by another strategy on the same manager, all begins anew from what
is known for certain, and nothing is counted or reported until the work is as far as it was.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from robosc.oxidd_diagrams import BCDDFunction, BooleanOperator, OxiddManager, Predicate
from robosc.synthesis.image import Image
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.nodes import Viewed, nodes_made
from robosc.synthesis.saturation import PAUSE, Saturation
from robosc.synthesis.step import Step

_AND = BooleanOperator.AND


class _RebuiltError(Exception):
    """The functions belong to a store that has been left."""


class _Prepared(NamedTuple):
    """A step on functions: what an `Image` says, with variables as conjunctions; parts that it does not have are None.

    Attributes:
        fixed: Variables that take constants.
        moved: Substitution by predicates.
        called: Substitution by variables.
    """

    inside: BCDDFunction | None
    needed: BCDDFunction | None
    fixed: BCDDFunction | None
    moved: Any
    relation: BCDDFunction
    hidden: BCDDFunction | None
    called: Any
    outside: BCDDFunction | None
    room: BCDDFunction | None
    touched: frozenset[int]


class OxiddSaturation(Saturation):
    """Closure of sets of states under steps whose images are `Image`s; the arguments are those of `Saturation`."""

    def __init__(
        self,
        manager: OxiddManager,
        levels: Mapping[str, int],
        steps: Sequence[Step],
        within: Any,
        monitor: ProgressMonitor,
    ) -> None:
        super().__init__(manager, levels, steps, within, monitor)
        self._oxidd = manager
        self._generation = -1
        self._replayed = 0

    def _of_whole(self, states: Any, until: Any) -> Any:
        self._replayed = 0
        while True:
            try:
                found = Predicate(
                    self._oxidd, self._oxidd.attempt(lambda: self._of_function(*self._begun(states, until)))
                )
                self._monitor.check_stop(self._taken - self._spent)
                return found
            except _RebuiltError:
                continue

    def _begun(self, states: Predicate, until: Predicate | None) -> tuple[BCDDFunction, BCDDFunction | None]:
        """Begin, or begin anew: return the functions of predicates."""
        self._replayed, self._taken = max(self._replayed, self._taken), 0
        self._known.clear()
        self._begin()
        return states.function, None if until is None else until.function

    def _begin(self) -> None:
        """Take the functions of all predicates."""
        manager = self._oxidd
        if self._generation == manager.generation:
            return
        self._generation = manager.generation
        self._at = manager.by_level()
        self._no = manager.false.function
        self._end = len(self._groups)
        self._inside = self._within.function
        self._prepared = [
            (top, [_prepared(manager, step, self._levels) for step in steps]) for top, steps in self._groups
        ]

    def _of_function(self, states: BCDDFunction, until: BCDDFunction | None) -> BCDDFunction:
        _, topmost = self._prepared[0]
        while not self._is_done(states, until):
            before = states = self._closed(states, self._inside, 1)
            for step in topmost:
                if self._is_done(states, until):
                    return states
                states = self._more(states, self._inside, step)
            if states == before:
                break
        return states

    def _is_done(self, states: BCDDFunction, until: BCDDFunction | None) -> bool:
        return until is not None and (until & ~states) == self._no

    def _closed(self, states: BCDDFunction, within: BCDDFunction, group: int) -> BCDDFunction:
        if group == self._end or states == within or states == self._no:
            return states
        key = (states, within, group)
        found: BCDDFunction | None = self._known.get(key)
        if found is not None:
            return found
        top, steps = self._prepared[group]
        level, other = states.node_level(), within.node_level()
        if level is None or (other is not None and other < level):
            level = other
        if level is not None and level < top:
            high, low = (states.node_level() == level and states.cofactors()) or (states, states)
            high_inside, low_inside = (other == level and within.cofactors()) or (within, within)
            low = self._closed(low, low_inside, group)
            found = self._at[level].ite(self._closed(high, high_inside, group), low)
        else:
            found = self._repeated(self._closed(states, within, group + 1), within, group, steps)
        self._known[key] = found
        return found

    def _repeated(
        self, states: BCDDFunction, within: BCDDFunction, group: int, steps: Sequence[_Prepared]
    ) -> BCDDFunction:
        vain, number, count = 0, 0, len(steps)
        while vain < count:
            grown = self._more(states, within, steps[number])
            number = (number + 1) % count
            vain += 1
            if grown != states:
                states = self._closed(grown, within, group + 1)
                vain = 0
        return states

    def _more(self, states: BCDDFunction, within: BCDDFunction, step: _Prepared) -> BCDDFunction:
        self._before(states)
        more = states | self._added(states, within, step)
        if self._taken % PAUSE == 0:
            self._made = nodes_made(more, states, step.touched, _viewed)
        self._taken += 1
        return more

    def _added(self, states: BCDDFunction, within: BCDDFunction, step: _Prepared) -> BCDDFunction:
        new, no = states, self._no
        inside, needed, fixed, moved, relation, hidden, called, outside, room, _ = step
        if room is not None and (within & room & ~states) == no:
            return states
        if inside is not None:
            new = new & inside
        if needed is not None and fixed is not None:
            new = new.apply_exists(_AND, needed, fixed)
            if new == no:
                return no
        if moved is not None:
            new = new.substitute(moved)
        new = new & relation if hidden is None else new.apply_exists(_AND, relation, hidden)
        if new == no:
            return no
        if called is not None:
            new = new.substitute(called)
        if outside is not None:
            new = new & outside
        return within & new

    def _before(self, states: BCDDFunction) -> None:
        if self._taken < self._replayed:
            return
        if self._taken % PAUSE == 0:
            self._monitor.check_stop(self._taken - self._spent)
            self._spend()
            if self._generation != self._oxidd.generation:
                raise _RebuiltError
        if self._taken + 1 >= (self._reports + 1) * self._count:
            self._report(Predicate(self._oxidd, states))


def _viewed(function: BCDDFunction) -> Viewed:
    # The same one of a function and its complement stands for both.
    node = min(function, ~function)
    level, below = node.node_level(), node.cofactors()
    return Viewed(node, math.inf, ()) if level is None or below is None else Viewed(node, level, below[::-1])


def _prepared(manager: OxiddManager, step: Step, levels: Mapping[str, int]) -> _Prepared:
    image: Image = step.add  # type: ignore[assignment]  # closure_under has looked

    def function(predicate: Any) -> BCDDFunction | None:
        return None if predicate is None else predicate.function

    inside, needed, outside = function(image.inside), function(image.needed), function(image.outside)
    relation: BCDDFunction = image.relation.function
    # Two predicates that are conjoined one after the other are conjoined once for all sets of states.
    if inside is not None and needed is not None:
        needed = needed & inside
        inside = None
    elif inside is not None and not image.functions:
        relation = relation & inside
        inside = None
    if outside is not None and not image.names and not image.hidden:
        relation = relation & outside
        outside = None
    return _Prepared(
        inside=inside,
        needed=needed if image.constants else None,
        fixed=manager.variables(image.constants) if image.constants else None,
        moved=manager.substitution(image.functions) if image.functions else None,
        relation=relation,
        hidden=manager.variables(image.hidden) if image.hidden else None,
        called=manager.substitution(image.names) if image.names else None,
        outside=outside,
        room=function(step.room),
        touched=frozenset(levels[name] for name in step.names),
    )
