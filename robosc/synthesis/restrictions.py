"""Restrictions without which a controlled system is the same.

Most of them are told by what is near them. Where the good states are all from which nothing unsafe is inevitable, an
invariant can only matter to events that change what it depends on. It does not if none of these leads, from a state of
the controlled system, to one that only this invariant keeps from being good. It does if one leads to such a state, and
events near it lead on into good states whatever else happens. What is left is solved anew without the restriction.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from robosc.expressions import Expression
from robosc.synthesis.conjuncts import MAXIMUM_NODES, Conjunct, Conjuncts
from robosc.synthesis.expression_encoder import ExpressionEncoder
from robosc.synthesis.fixed_point import FixedPoint, Problem, SolvedProblem, allowed
from robosc.synthesis.nodes import meets
from robosc.synthesis.questions import Restriction
from robosc.synthesis.transitions import Steps


class UnusedRestrictions:
    """Finder of restrictions that a controlled system does not need.

    Args:
        solved: The problem with its solution.
        conjuncts: Conjuncts of its good states.
    """

    def __init__(self, solved: SolvedProblem, conjuncts: Conjuncts) -> None:
        self._solved = solved
        self._conjuncts = conjuncts
        self._encoding = solved.encoding
        self._manager = solved.encoding.manager
        self._encoder = ExpressionEncoder(solved.encoding)
        self._fixed_point = FixedPoint(solved.encoding, solved.monitor)
        self._steps = {steps.event.name: steps for steps in solved.problem.steps}
        self._held: dict[int, Any] = {}
        """Predicates of the system's own conditions, by their identity: they stay as long as the system does."""

    def among(self, restrictions: Sequence[Restriction]) -> tuple[int, ...]:
        """Return those that forbid nothing in any state of the controlled system, nor where synthesis looks ahead to.

        What a restriction forbids in states beyond can make these states bad, so that synthesis keeps away from
        them: then the system would do more without it, although it never shows itself. All that are named can go
        together; of two that could stand in for each other the later one is named.
        """
        candidates = tuple(place for place, item in enumerate(restrictions) if not self._restricts(item))
        if not self._supervisor_disables():
            # The reachable states are those that plants and conditions allow, and no others.
            return candidates
        found = self._removable(restrictions, [item for item in candidates if not restrictions[item].invariants], [])
        nearby = _Neighbourhood(self._solved, self._conjuncts, self._without([restrictions[item] for item in found]))
        for place in reversed(candidates):
            # Invariants always are candidates, but mostly needed: to try several at once would be in vain.
            if restrictions[place].invariants:
                is_unused = is_told = nearby.is_unused(restrictions[place])
                if is_unused is None:
                    is_unused = self._is_the_same_without([restrictions[item] for item in (*found, place)])
                if is_unused:
                    found = [*found, place]
                    nearby.remove(restrictions[place], is_told=bool(is_told))
        return tuple(sorted(found))

    def _restricts(self, restriction: Restriction) -> bool:
        """Return True if, in a controlled system state, the plant enables an event and a condition is not true."""
        conditions = self._encoding.system.conditions
        return any(
            self._is_reached(self._steps[item.event].plant & ~self._holds(item.condition))
            for item in (*(conditions[place] for place in restriction.conditions), *restriction.watched)
        )

    def _is_reached(self, states: Any) -> bool:
        return meets(self._manager, self._solved.reachable, states)

    def _holds(self, condition: Expression) -> Any:
        self._solved.monitor.check_stop()
        found = self._held.get(id(condition))
        if found is None:
            found = self._held[id(condition)] = self._encoder.holds(condition)
        return found

    def _supervisor_disables(self) -> bool:
        return any(
            self._is_reached(steps.plant & steps.condition & ~self._conjuncts.only(steps))
            for steps in self._solved.problem.steps
            if steps.event.is_controllable
        )

    def _removable(self, restrictions: Sequence[Restriction], more: list[int], removed: list[int]) -> list[int]:
        """Return the restrictions that can be removed without any change to the controlled system.

        They are those that are removed already, and of `more` those that can go beside them, later ones first. Where
        all of them can go together, each can: the less is forbidden, the more is allowed. Else they are tried by
        halves.
        """
        if not more or self._is_the_same_without([restrictions[place] for place in (*removed, *more)]):
            return [*removed, *more]
        middle = len(more) // 2
        if middle == 0:
            return removed
        return self._removable(restrictions, more[:middle], self._removable(restrictions, more[middle:], removed))

    def _is_the_same_without(self, restrictions: Sequence[Restriction]) -> bool:
        """Return True if the controlled system of the problem without some restrictions allows nothing more."""
        problem = self._without(restrictions)
        good = self._good_states(problem)
        if good == self._solved.good:
            return not any(
                self._is_reached(self._conjuncts.possible(steps) & ~self._conjuncts.possible(before))
                for steps, before in zip(problem.steps, self._solved.problem.steps, strict=True)
                if steps is not before
            )
        # An event that changes what they read is the likeliest to be allowed where it was not.
        read = self._read(restrictions)
        return all(
            self._solved.reachable & steps.plant & allowed(steps, good)
            == self._solved.reachable & self._conjuncts.possible(self._steps[steps.event.name])
            for steps in sorted(problem.steps, key=lambda steps: -len(read.intersection(steps.changed)))
        )

    def _good_states(self, problem: Problem) -> Any:
        """The good states of a problem that forbids less."""
        if self._conjuncts.are_safety and problem.safe == self._solved.problem.safe:
            pairs = zip(problem.steps, self._solved.problem.steps, strict=True)
            if all(steps is before or steps.bad == before.bad for steps, before in pairs):
                # All that is safe is good already.
                return self._solved.good
        return self._fixed_point.solution_of_less(problem, self._solved.good).states

    def _read(self, restrictions: Sequence[Restriction]) -> set[str]:
        """The variables that restrictions read."""
        system = self._encoding.system
        conditions = [system.conditions[place].condition for item in restrictions for place in item.conditions]
        invariants = [system.invariants[place] for item in restrictions for place in item.invariants]
        return set().union(*(self._manager.support(self._holds(item)) for item in (*conditions, *invariants)))

    def _without(self, restrictions: Sequence[Restriction]) -> Problem:
        """The problem without some restrictions; what they are watched for stays as it is."""
        system = self._encoding.system
        dropped = {place for item in restrictions for place in item.conditions}
        touched = {system.conditions[place].event for place in dropped}
        left = [item for place, item in enumerate(system.conditions) if place not in dropped]

        def under_what_is_left(steps: Steps) -> Steps:
            conditions = [item.condition for item in left if item.event == steps.event.name]
            return steps.under(self._encoding.all_of(self._holds(condition) for condition in conditions))

        steps = tuple(
            under_what_is_left(steps) if steps.event.name in touched else steps for steps in self._solved.problem.steps
        )
        dropped = {place for item in restrictions for place in item.invariants}
        if not dropped:
            return Problem(steps, self._solved.problem.safe)
        left_over = (self._holds(item) for place, item in enumerate(system.invariants) if place not in dropped)
        return Problem(steps, self._encoding.all_of([self._encoding.valid_states(), *left_over]))


class _Neighbourhood:
    """Verdicts on invariants by what is near them.

    Args:
        solved: The problem with its solution.
        conjuncts: Conjuncts of its good states.
        problem: The problem without the conditions that are removed already.
    """

    def __init__(self, solved: SolvedProblem, conjuncts: Conjuncts, problem: Problem) -> None:
        self._solved = solved
        self._conjuncts = conjuncts
        self._manager = solved.encoding.manager
        self._all_of = solved.encoding.all_of
        self._before = {steps.event.name: steps for steps in solved.problem.steps}
        self._now = {steps.event.name: steps for steps in problem.steps}
        self._is_able = conjuncts.are_safety and all(
            self._now[name].bad == steps.bad for name, steps in self._before.items()
        )
        self._by_invariant: dict[int, Conjunct] = {}
        for items in conjuncts.near.values():
            self._by_invariant |= {item.invariant: item for item in items if item.invariant is not None}
        self._removed: set[int] = set()
        self._untold: list[int] = []

    def remove(self, restriction: Restriction, *, is_told: bool) -> None:
        """Count a restriction as removed from now on; `is_told` is true if `is_unused` has told that it can be."""
        self._is_able = self._is_able and not restriction.conditions
        self._removed.update(restriction.invariants)
        if not is_told:
            self._untold += restriction.invariants

    def is_unused(self, restriction: Restriction) -> bool | None:
        """Return whether the controlled system stays the same without a restriction of invariants; None: not known."""
        if not self._is_able or restriction.conditions:
            return None
        dropped = self._removed.union(restriction.invariants)
        own = self._of(restriction.invariants)
        # The events near what `is_unused` has removed lead nowhere else without it; those near the rest may.
        new = [
            steps
            for steps in self._controllable([*own, *self._of(self._untold)])
            if self._is_reached(self._no_longer_forbidden(steps, dropped, ()))
        ]
        if not new:
            return True
        names = frozenset[str]().union(*(item.names for item in own))
        apart = [item for item in self._of(sorted(dropped)) if item.names & names]
        returning = self._returning(apart)
        if returning is None:
            return None
        lost = {item.invariant for item in apart}
        if any(self._is_reached(self._no_longer_forbidden(steps, lost, (returning,))) for steps in new):
            return False
        return None

    def _of(self, invariants: Iterable[int]) -> list[Conjunct]:
        """The conjuncts of invariants, but of those that hold everywhere."""
        return [self._by_invariant[place] for place in invariants if place in self._by_invariant]

    def _is_reached(self, states: Any) -> bool:
        self._solved.monitor.check_stop()
        return meets(self._manager, self._solved.reachable, states)

    def _controllable(self, conjuncts: Iterable[Conjunct]) -> Iterator[Steps]:
        """The controllable events that change what some conjuncts depend on."""
        names = frozenset[str]().union(*(item.names for item in conjuncts))
        for steps in self._conjuncts.touching(names):
            if steps.event.is_controllable:
                yield self._now[steps.event.name]

    def _no_longer_forbidden(self, steps: Steps, dropped: Iterable[int | None], more: Sequence[Any]) -> Any:
        """The good states from which an event, forbidden there, leads only to where all but some conjuncts hold.

        Args:
            steps: The event.
            dropped: Invariants that need not hold.
            more: Predicates that must hold as well after it.
        """
        before = self._conjuncts.possible(self._before[steps.event.name])
        return steps.plant & steps.condition & ~before & self._only(steps, dropped, more)

    def _only(self, steps: Steps, dropped: Iterable[int | None], more: Sequence[Any]) -> Any:
        return self._all_of(steps.only(item) for item in (*self._kept(steps, dropped), *more))

    def _kept(self, steps: Steps, dropped: Iterable[int | None]) -> Iterator[Any]:
        """Predicates of the conjuncts, without those of some invariants, on which an event has an effect."""
        for item in self._conjuncts.touched(steps):
            if item.invariant is None or item.invariant not in dropped:
                yield item.holds

    def _returning(self, apart: Sequence[Conjunct]) -> Any:
        """Return a predicate that makes states good in which some conjuncts need not hold; None where it is large.

        All other conjuncts hold in these states. Whatever the uncontrollable events do, the predicate stays true, and
        from wherever it is true events near the conjuncts lead to where they hold: to the good states.
        """
        names = frozenset[str]().union(*(item.names for item in apart))
        lost = {item.invariant for item in apart}
        holds = self._all_of(item.holds for item in apart)
        events = [self._now[steps.event.name] for steps in self._conjuncts.touching(names)]
        inside = self._manager.true
        while True:
            found, before = holds, None
            while found != before:
                before = found
                for steps in events:
                    found = found | (inside & self._leading(steps, lost, found))
                if found.dag_size > MAXIMUM_NODES:
                    return None
            kept = self._conjuncts.avoidable(~found)
            if kept is None or kept == inside:
                return kept
            inside = kept

    def _leading(self, steps: Steps, lost: Iterable[int | None], states: Any) -> Any:
        """The states from which an event leads to some states where all but some conjuncts hold, and to no others."""
        self._solved.monitor.check_stop()
        leading = steps.some(self._all_of([*self._kept(steps, lost), states]))
        if steps.event.is_controllable:
            return leading & steps.plant & steps.condition & self._only(steps, lost, (states,))
        return leading
