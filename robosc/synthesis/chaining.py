"""Chaining: steps are applied to whole predicates, one after the other, in an order that keeps diagrams small.

Steps wait in a work list. Those whose variables are closest to each other come first; among equally close ones, the
lowest. Once a step has added states, every step that shares a variable with it waits again. So local steps reach their
fixed point before steps that connect parts are taken. This is the idea of saturation (G. Ciardo, G. Luettgen and R.
Siminiceanu, "Saturation: an efficient iteration strategy for symbolic state-space generation", TACAS 2001, LNCS 2031,
pp. 328-342), here with whole predicates instead of nodes. Sweeps over all events would move every part of a system a
little at a time, and their intermediate predicates would depend on all parts together: for dining philosophers these
are exponential, and those of chaining are not.
"""

import heapq
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.step import Step, is_enough

_STEP_NODES = 200
"""Nodes that a step counts for, whatever it is about."""


class Chaining:
    """Closure of sets of states under some steps, whatever an engine does with its order meanwhile.

    Args:
        levels: The level of each current-state variable at the beginning.
        steps: The steps; of equally close and low ones the first is taken first.
        within: Predicate that added states have to satisfy.
        monitor: Monitor of the waiting caller.
    """

    def __init__(self, levels: Mapping[str, int], steps: Sequence[Step], within: Any, monitor: ProgressMonitor) -> None:
        def distance_and_height(step: Step) -> tuple[int, int]:
            touched = [levels[name] for name in step.names]
            return (max(touched) - min(touched), -min(touched)) if touched else (0, 0)

        self._steps = sorted(steps, key=distance_and_height)
        self._within = within
        self._monitor = monitor
        users: defaultdict[str, set[int]] = defaultdict(set)
        for number, step in enumerate(self._steps):
            for name in step.names:
                users[name].add(number)
        self._after = [sorted(set().union(*(users[name] for name in step.names))) for step in self._steps]

    def of(self, states: Any, phase: str, until: Any = None) -> Any:
        """Return `states` and all that steps from them add.

        Args:
            states: States to begin with; they satisfy the predicate for added states.
            phase: Phase for which progress is reported.
            until: States once all of which are found the rest is not; None to find everything.
        """
        if not self._steps:
            return states
        work = _Work(len(self._steps))
        taken = reported = 0
        while True:
            number = work.next()
            if number is None:
                # The conditions of the states may read more than a step does, so each has the last word.
                number = next((n for n, step in enumerate(self._steps) if self._grown(step, states) != states), None)
                if number is None:
                    self._monitor.report(phase, reported + 1, states)
                    return states
            grown = self._grown(self._steps[number], states)
            taken += 1
            while grown != states:
                states = grown
                work.add(self._after[number])
                if is_enough(states, until):
                    self._monitor.report(phase, reported + 1, states)
                    return states
                grown = self._grown(self._steps[number], states)
                taken += 1
            if taken >= (reported + 1) * len(self._steps):
                reported += 1
                self._monitor.report(phase, reported, states)

    def _grown(self, step: Step, states: Any) -> Any:
        self._monitor.check_stop()
        # The sizes of diagrams depend on the engine while it changes its order.
        self._monitor.spend(_STEP_NODES)
        return states | step.added(states, self._within)


class _Work:
    """Numbers that wait, each once, the least first; at the beginning all of them."""

    def __init__(self, count: int) -> None:
        self._waiting = list(range(count))
        self._is_waiting = [True] * count

    def next(self) -> int | None:
        """The least number, which then waits no more."""
        if not self._waiting:
            return None
        number = heapq.heappop(self._waiting)
        self._is_waiting[number] = False
        return number

    def add(self, numbers: Sequence[int]) -> None:
        """Let numbers wait."""
        for number in numbers:
            if not self._is_waiting[number]:
                self._is_waiting[number] = True
                heapq.heappush(self._waiting, number)
