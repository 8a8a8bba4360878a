"""Runs to a goal: shortest ones, or runs along layers around the goal if shortest ones are hard to find.

Forward search in rings finds shortest runs, but the rings may become far larger than the goal: there may be many
initial states, and components move independently. The goal is mostly simple, and so are the states that lead to it,
as long as events are chained. A run then goes from the last ring one state at a time into the next inner layer.

Source: E. M. Clarke, O. Grumberg, K. L. McMillan and X. Zhao, "Efficient generation of counterexamples and witnesses
in symbolic model checking", DAC 1995, pp. 427-432 (the way inwards through layers).
"""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

from robosc.errors import InternalError
from robosc.synthesis.closure import closure_under
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.monitor import BoundedMonitor, EffortSpentError, ProgressMonitor
from robosc.synthesis.runs import ShortestRuns, SystemRun, first_of, one_of
from robosc.synthesis.step import Step
from robosc.synthesis.transitions import Steps

MAXIMUM_STEPS = 16_000
"""Steps after which it is left open whether there is a way; most systems need fewer."""

MAXIMUM_NODES = 4_000_000
"""Nodes of all layers together, in each of both directions: up to some two seconds with the faster engine."""


class WayNotFoundError(Exception):
    """Search for a way that takes too long; whether there is one may not be known."""


class Ways:
    """Ways to one goal; layers around it are made as far as they are needed, once for all ways.

    Args:
        encoding: The variables.
        monitor: Monitor of the waiting caller.
        steps: The events, in the order in which equally short ways are preferred.
        possible: For each event the states in which it may happen.
        goal: States in which ways end.
    """

    def __init__(
        self,
        encoding: Encoding,
        monitor: ProgressMonitor,
        steps: Sequence[Steps],
        possible: Mapping[str, Any],
        goal: Any,
    ) -> None:
        self._encoding = encoding
        self._false = encoding.manager.false
        self._monitor = monitor
        self._steps = steps
        self._possible = possible
        self._goal = goal
        # Codes that stand for no value lead nowhere that counts, and would only make layers larger.
        self._layers = [goal & encoding.valid_states()]
        self._events: list[Steps] = []
        self._place = 0
        self._idle = 0

    def is_none_from(self, states: Any) -> bool:
        """Return True if it is known that no way leads from any of some states.

        Raises:
            SynthesisCancelled: The work is to end.
        """
        return self._sources is not None and bool(self._sources & states == self._false)

    def way_from(self, start: Any, *, is_led: bool = True) -> SystemRun | None:
        """Return a way from one of some states, or None if there is none; the same for every engine.

        None is shorter where the rings up to there take no more than `runs.MAXIMUM_EFFORT`.

        Args:
            start: The states.
            is_led: True to look for a longer way where a shortest one is too hard to find.

        Raises:
            SynthesisCancelled: The work is to end.
            WayNotFoundError: It takes too long.
        """
        if self.is_none_from(start):
            return None
        runs = ShortestRuns(self._encoding, self._monitor, self._steps, self._possible, start, _nodes())
        is_met = runs.rings_meet(self._goal)
        if is_met is not None:
            return runs.run_to(self._goal) if is_met else None
        if not is_led:
            raise WayNotFoundError
        try:
            return self._led(runs)
        except EffortSpentError:
            pass
        try:
            return runs.run_to(self._goal)
        except EffortSpentError:
            raise WayNotFoundError from None

    def before(self, event: str, states: Any) -> Any:
        """Return the states from which an event that is possible there leads to one of some states."""
        return self._possible[event] & self._steps_of[event].some(states)

    @cached_property
    def _steps_of(self) -> dict[str, Steps]:
        return {steps.event.name: steps for steps in self._steps}

    @cached_property
    def _sources(self) -> Any:
        """The states that a way leads from, or None if they are too hard to find."""
        monitor = BoundedMonitor(self._monitor, MAXIMUM_STEPS)
        valid = self._encoding.valid_states()
        return monitor.result_of(
            lambda: closure_under(self._encoding, map(self._step, self._steps), valid, monitor).of(
                self._layers[0], "coreachability"
            )
        )

    def _step(self, steps: Steps) -> Step:
        possible = self._possible[steps.event.name]
        names = steps.names | self._encoding.manager.support(possible)
        return Step(steps.backwards(possible), names, possible & steps.sources)

    def _led(self, runs: ShortestRuns) -> SystemRun | None:
        """Return a way that goes outwards by rings, and then inwards by layers.

        Raises:
            EffortSpentError: The layers have too many nodes.
        """
        encoding, nodes = self._encoding, _nodes()
        while self._layers[-1] & runs.reached == self._false:
            if not self._grow(nodes):
                return None
        number, _ = first_of(encoding.manager, self._layers, runs.reached)
        run = runs.run_to(self._layers[number])
        if run is None:
            raise InternalError("a layer that the rings have met is not reached")
        events, states = list(run.events), list(run.states)
        state = encoding.state(states[-1])
        while number := first_of(encoding.manager, self._layers, state)[0]:
            self._monitor.check_stop()
            steps = self._events[number - 1]
            state, values = one_of(encoding, steps.image(state) & self._layers[number - 1])
            events.append(steps.event.name)
            states.append(values)
        return SystemRun(tuple(events), tuple(states), is_shortest=False)

    def _grow(self, nodes: BoundedMonitor) -> bool:
        """Add the next layer around the last one: the states from which one event leads into it; False if none is."""
        layer = self._layers[-1]
        while self._idle < len(self._steps):
            self._monitor.check_stop()
            nodes.check_stop(layer.dag_size)
            steps = self._steps[self._place]
            self._place = (self._place + 1) % len(self._steps)
            self._idle += 1
            before = steps.backwards(self._possible[steps.event.name])(layer) & self._encoding.valid_states()
            if layer | before != layer:
                self._idle = 0
                self._layers.append(layer | before)
                self._events.append(steps)
                return True
        return False


def _nodes() -> BoundedMonitor:
    return BoundedMonitor(ProgressMonitor(lambda: False, lambda progress: None), MAXIMUM_NODES)
