"""The fixed point of synthesis, and the reachable states of the controlled system.

Source: L. Ouedraogo, R. Kumar, R. Malik and K. Akesson, "Nonblocking and safe control of discrete-event systems
modeled as extended finite automata", IEEE T-ASE 8(3), 2011, pp. 560-569, Algorithm 1, on predicates instead of
guards. Predecessors are computed by substitution, forward images with a relation for each event; `closure` determines
the order of the events.
"""

from collections.abc import Callable, Iterable, Iterator
from copy import copy
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Any

from robosc.expressions import Expression
from robosc.synthesis.chaining import Chaining
from robosc.synthesis.closure import closure_under
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.expression_encoder import ExpressionEncoder
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.race import Race, Runner
from robosc.synthesis.saturation import CompiledSaturation, Saturation
from robosc.synthesis.step import Step
from robosc.synthesis.transitions import Steps


@dataclass(frozen=True, slots=True)
class Problem:
    """Restrictions that a supervisor has to keep to.

    Attributes:
        steps: The events under their conditions, in the system's order.
        safe: States that may be entered at all, whatever events can do there.
    """

    steps: tuple[Steps, ...]
    safe: Any


@dataclass(frozen=True, slots=True)
class GoodStates:
    """States in which a supervisor can keep the system safe and nonblocking.

    Attributes:
        states: The states; where the initial one is none of them, what was left when that was found.
        rounds: Rounds of the fixed point.
        reason: Reason why the initial state is none of them; empty if it is one.
        is_of_reached: True if they are those alone that runs of the problem reach.
    """

    states: Any
    rounds: int
    reason: str = ""
    is_of_reached: bool = False


def safe_states(encoding: Encoding, invariants: Iterable[Expression]) -> Any:
    """Return the predicate that is true where every place of the state encodes a value and every invariant holds."""
    encoder = ExpressionEncoder(encoding)
    return encoding.all_of([encoding.valid_states(), *(encoder.holds(item) for item in invariants)])


def initial_states(encoding: Encoding) -> Any:
    """Return the states in which the uncontrolled system may begin."""
    system = encoding.system
    begins = map(ExpressionEncoder(encoding).holds, (system.initial, *system.plant_invariants))
    return encoding.all_of([encoding.initial_places(), *begins])


def marked_states(encoding: Encoding) -> Any:
    """The marked states."""
    return encoding.marked_locations() & ExpressionEncoder(encoding).holds(encoding.system.marker)


@dataclass(eq=False)
class SolvedProblem:
    """Problem with its solution, which is asked about.

    Attributes:
        encoding: The variables.
        monitor: Monitor of the waiting caller.
        problem: Problem that was solved.
        good: Its good states.
        reachable: States of the controlled system.
    """

    encoding: Encoding
    monitor: ProgressMonitor
    problem: Problem
    good: Any
    reachable: Any


class FixedPoint:
    """Computation of good states and controlled systems.

    Args:
        encoding: The variables.
        monitor: Monitor of the waiting caller.
    """

    def __init__(self, encoding: Encoding, monitor: ProgressMonitor) -> None:
        self._encoding = encoding
        self._monitor = monitor
        self.initial = initial_states(encoding)
        """The initial states."""
        self.marked = marked_states(encoding)
        """The marked states."""
        self._ways_of_less = list(product((False, True), (FixedPoint.good_states, FixedPoint.reached_good_states)))
        """Ways to solve a problem that restricts less, each with a flag whether it begins with what is known; the best
        one is the first."""

    def solution(self, problem: Problem, known: Any) -> GoodStates:
        """The good states, of which some that no run reaches may be left out.

        From the marked states backwards there may be very many that no run reaches, with large diagrams; onwards from
        the initial ones there may be very many that are not good. Neither is known beforehand, so there is a race.

        Args:
            problem: The problem.
            known: States that are known beforehand to be good.
        """
        return self._first_of(
            lambda solver: solver.good_states(problem, known), lambda solver: solver.reached_good_states(problem, known)
        )

    def solution_of_less(self, problem: Problem, good: Any) -> GoodStates:
        """The solution of a problem that restricts less than another one whose good states are known.

        Those are good here, too. But what else is to be found from them may come in few steps, each of which works on
        their whole diagram, or from the marked states alone in steps that cost far less. So all ways race, and the
        winner of one problem has the head start in the next one.

        Args:
            problem: The problem.
            good: The good states of the other one.
        """
        ways, nothing = self._ways_of_less, self._encoding.manager.false
        found, place = self._first_of(
            *(
                partial(_way_of_less, way, problem, good if begins else nothing, place)
                for place, (begins, way) in enumerate(ways)
            )
        )
        ways.insert(0, ways.pop(place))
        return found

    def _given(self, problem: Problem) -> GoodStates:
        """The states that a supervisor may be in which is in the system already: all that it lets be."""
        is_lost = self._is_lost(problem.safe)
        return GoodStates(problem.safe, 0, "there is no initial state" if is_lost else "")

    def nonblocking_ahead(self, problem: Problem, states: Any) -> Any:
        """Return those of some safe states that reach a marked one through transitions that stay in them.

        As in `solution` some may be left out, but none that a step leads to which may lead out of the safe states, too:
        a supervisor never lets it happen, and whoever asks why looks at all of its targets.
        """
        return self._first_of(
            lambda solver: solver.nonblocking_states(problem, states),
            lambda solver: solver.nonblocking_states(problem, states & solver._states_ahead(problem)),
        )

    def _states_ahead(self, problem: Problem) -> Any:
        """The safe states that steps lead to from the initial ones and from each other, wherever else they may lead."""
        everywhere = self._encoding.manager.true
        closure = self._closure((self._onwards(steps, everywhere) for steps in self._each(problem)), problem.safe)
        return closure.of(self.initial & problem.safe, "reachability")

    def _first_of[T](self, *works: "Callable[[FixedPoint], T]") -> T:
        """Return the result of the work that comes to its end first."""
        race = Race(self._monitor)
        solver = self.under(race)
        return race.first_of([Runner(partial(work, solver)) for work in works])

    def under(self, monitor: ProgressMonitor) -> "FixedPoint":
        """The same under another monitor."""
        other = copy(self)
        other._monitor = monitor
        return other

    def reached_good_states(self, problem: Problem, known: Any) -> GoodStates:
        """The good states among those that the problem lets runs reach; `known` states are known to be good."""
        reached = self.states_from(problem, self.initial & problem.safe, problem.safe)
        found = self.good_states(Problem(problem.steps, reached), known & reached)
        return replace(found, is_of_reached=True)

    def good_states(self, problem: Problem, known: Any) -> GoodStates:
        """The states from which a supervisor can solve a problem; `known` states are known beforehand to be good."""
        if self._encoding.system.is_controlled:
            return self._given(problem)
        good, rounds = problem.safe, 0
        if self.initial == self._encoding.manager.false:
            where = " in which the plant invariants are true" if self._encoding.system.plant_invariants else ""
            return GoodStates(good, rounds, f"there is no initial state{where}")
        if self._is_lost(good):
            return GoodStates(good, rounds, "the initial state is against a state invariant")
        nothing = self._encoding.manager.false
        for steps in problem.steps:
            if steps.bad == nothing:
                continue
            good = good & ~steps.bad
            if self._is_lost(good):
                return GoodStates(good, rounds, f"{steps.event.name} can do harm in the initial state already")
        # A step with one target only stays in whatever it was found to lead into.
        is_closed = all(steps.is_deterministic for steps in problem.steps if steps.event.is_controllable)
        while True:
            before = good
            nonblocking = self._nonblocking(problem, good, known)
            if self._is_lost(nonblocking):
                return GoodStates(nonblocking, rounds, "from the initial state no marked state can be reached safely")
            good = self._controllable(problem, nonblocking)
            if self._is_lost(good):
                reason = "uncontrollable events can lead from the initial state into states to be avoided"
                return GoodStates(good, rounds, reason)
            rounds += 1
            self._monitor.report("fixed point", rounds, good)
            if good == before or (is_closed and good == nonblocking):
                return GoodStates(good, rounds)

    def nonblocking_states(self, problem: Problem, states: Any) -> Any:
        """Those of some states that reach a marked one through transitions that stay in them."""
        return self._nonblocking(problem, states, self._encoding.manager.false)

    def _is_lost(self, good: Any) -> bool:
        return bool(self.initial & good == self._encoding.manager.false)

    def _nonblocking(self, problem: Problem, good: Any, known: Any) -> Any:
        """The states of `good` that reach a marked state through transitions that stay in `good`."""
        closure = self._closure((self._towards(steps, good) for steps in self._each(problem)), good)
        return closure.of((good & self.marked) | known, "coreachability")

    def _towards(self, steps: Steps, good: Any) -> Step:
        def make() -> Step:
            source, names = self._source(steps, good)
            return Step(steps.backwards(source), names, source & steps.sources)

        return _kept(steps, "towards", make)

    def _controllable(self, problem: Problem, good: Any) -> Any:
        """The states of `good` that no run of uncontrollable events leaves."""
        closure = self._closure(
            (self._towards(steps, good) for steps in self._each(problem) if not steps.event.is_controllable),
            self._encoding.manager.true,
        )
        # Once the initial state is among them there is nothing left to find out.
        return ~closure.of(~good, "controllability", until=self.initial)

    def reachable_states(self, problem: Problem, good: Any) -> Any:
        """Every state of the controlled system; it begins in those initial states that are good."""
        return self.states_from(problem, self.initial & good, good)

    def states_from(self, problem: Problem, start: Any, good: Any) -> Any:
        """Some states, and what can be reached from the good ones of them by what is allowed without leaving them."""
        closure = self._closure((self._onwards(steps, good) for steps in self._each(problem)), good)
        return start | closure.of(start & good, "reachability")

    def _onwards(self, steps: Steps, good: Any) -> Step:
        def make() -> Step:
            source, names = self._source(steps, good)
            return Step(steps.forwards(source), names, steps.arrival)

        return _kept(steps, "onwards", make)

    def _source(self, steps: Steps, good: Any) -> tuple[Any, frozenset[str]]:
        """Return the predicate of where an event may happen, and the variables that decide that.

        The predicate leaves out what the event's source or target already decides.
        """
        if not steps.event.is_controllable:
            return self._encoding.manager.true, steps.names
        source = steps.plant & steps.condition
        if steps.is_deterministic:
            # Its one target is good wherever one of its targets is.
            return source, steps.names
        source = source & steps.only(good)
        return source, steps.names | self._encoding.manager.support(source)

    def _closure(self, steps: Iterable[Step], within: Any) -> Chaining | Saturation | CompiledSaturation:
        return closure_under(self._encoding, steps, within, self._monitor)

    def _each(self, problem: Problem) -> Iterator[Steps]:
        for steps in problem.steps:
            self._monitor.check_stop()
            yield steps


Way = Callable[[FixedPoint, Problem, Any], GoodStates]
"""Function that finds the good states of a problem, given some that are known to be good."""


def _way_of_less(way: Way, problem: Problem, known: Any, place: int, solver: FixedPoint) -> tuple[GoodStates, int]:
    """Return what one of several ways finds, with its place among them."""
    return way(solver, problem, known), place


def _kept(steps: Steps, name: str, make: Callable[[], Step]) -> Step:
    """Return the step of an event, which is made once if the states to stay in do not decide about it."""
    if steps.event.is_controllable and not steps.is_deterministic:
        return make()
    if name not in steps.made:
        steps.made[name] = make()
    found: Step = steps.made[name]
    return found


def allowed(steps: Steps, good: Any) -> Any:
    """The states of `good` in which an event may happen as far as the supervisor goes."""
    return good & steps.condition & steps.only(good) & steps.plant if steps.event.is_controllable else good
