"""Reason why an event can never happen in the controlled system: the first that applies, from the plants onwards."""

from collections.abc import Callable
from functools import cached_property
from typing import Any

from robosc.synthesis.closure import closure_under
from robosc.synthesis.expression_encoder import ExpressionEncoder
from robosc.synthesis.fixed_point import FixedPoint, Problem, SolvedProblem, allowed, initial_states, safe_states
from robosc.synthesis.questions import Cause, NeverEnabled
from robosc.synthesis.step import Step
from robosc.synthesis.transitions import Steps


class Causes(SolvedProblem):
    """Finder of causes; what they are judged by is worked out once it is needed."""

    def of(self, steps: Steps) -> NeverEnabled:
        """Return the cause why an event of the problem can never happen in the controlled system."""
        event = steps.event.name
        if self._is_nowhere(steps.plant) or self._is_nowhere(steps.plant & self._by_plants):
            return NeverEnabled(event, Cause.PLANT, is_reached=False)
        enabled = steps.plant & self._under_conditions
        if self._is_nowhere(enabled & steps.condition):
            return NeverEnabled(event, Cause.REQUIREMENT, is_reached=not self._is_nowhere(enabled))
        enabled = self.reachable & steps.plant & steps.condition
        is_reached = not self._is_nowhere(enabled)
        if not self._is_possible_without_invariants(steps):
            return NeverEnabled(event, Cause.SUPERVISOR, is_reached)
        return NeverEnabled(event, Cause.INVARIANT, is_reached, self._broken(steps.image(enabled)))

    def _is_nowhere(self, states: Any) -> bool:
        return bool(states == self.encoding.manager.false)

    @cached_property
    def _by_plants(self) -> Any:
        """States that the plants reach by themselves."""
        return self._reached(lambda steps: steps.plant)

    @cached_property
    def _under_conditions(self) -> Any:
        """States that they reach where event conditions are respected and nothing else is."""
        return self._reached(lambda steps: steps.plant & steps.condition)

    def _reached(self, possible: Callable[[Steps], Any]) -> Any:
        def onwards(steps: Steps) -> Step:
            return Step(steps.forwards(possible(steps)), steps.names)

        steps = map(onwards, self.problem.steps)
        closure = closure_under(self.encoding, steps, self.encoding.manager.true, self.monitor)
        return closure.of(initial_states(self.encoding), "reachability")

    def _is_possible_without_invariants(self, steps: Steps) -> bool:
        if not self.encoding.system.invariants:
            return False
        good, reachable = self._without_invariants
        return not self._is_nowhere(reachable & steps.plant & allowed(steps, good))

    @cached_property
    def _without_invariants(self) -> tuple[Any, Any]:
        """Good states, and states of the controlled system, if nothing had to hold always."""
        fixed_point = FixedPoint(self.encoding, self.monitor)
        problem = Problem(self.problem.steps, safe_states(self.encoding, ()))
        good = fixed_point.solution_of_less(problem, self.good).states
        return good, fixed_point.reachable_states(problem, good)

    def _broken(self, states: Any) -> tuple[int, ...]:
        """The invariants that some of the states break."""
        holds = ExpressionEncoder(self.encoding).holds
        invariants = enumerate(self.encoding.system.invariants)
        return tuple(place for place, item in invariants if not self._is_nowhere(states & ~holds(item)))
