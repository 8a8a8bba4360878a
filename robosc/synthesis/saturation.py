"""Saturation: steps are applied to the part of a decision diagram that they are about, lowest parts first.

A step that reads and changes no variable above some level cannot tell two states apart by what stands above it. So
instead of a whole predicate, the parts of its diagram that begin at that level are closed under the step, each together
with all steps below, and equal parts only once. What happens in one corner of a system then costs as much as that
corner is large, where a whole predicate would be built anew from its root with each step.

Sources: G. Ciardo, G. Luettgen and R. Siminiceanu, "Saturation: an efficient iteration strategy for symbolic
state-space generation", TACAS 2001, LNCS 2031, pp. 328-342; Y. Zhao and G. Ciardo, "Symbolic CTL model checking of
asynchronous systems using constrained saturation", ATVA 2009, LNCS 5799, pp. 368-381 (what states have to keep to is
followed downwards with them); on binary diagrams T. van Dijk, J. Meijer and J. van de Pol, "Multi-core on-the-fly
saturation", TACAS 2019, LNCS 11428, pp. 58-75.
"""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from robosc.synthesis.engines import Manager
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.nodes import cofactors
from robosc.synthesis.step import Step, never_done


class Saturation:
    """Closure of sets of states under some steps, in a manager whose order stays as it is meanwhile.

    Args:
        manager: The manager.
        levels: The level of each current-state variable.
        steps: The steps; of those that begin at one level the first is taken first.
        within: Predicate that added states have to satisfy.
        monitor: Monitor of the waiting caller.
    """

    def __init__(
        self, manager: Manager, levels: Mapping[str, int], steps: Sequence[Step], within: Any, monitor: ProgressMonitor
    ) -> None:
        self._manager = manager
        self._false = manager.false
        self._variables = {level: manager.var(name) for name, level in levels.items()}
        self._within = within
        self._monitor = monitor
        groups: defaultdict[int, list[Step]] = defaultdict(list)
        for step in steps:
            # One that neither reads nor changes anything leads nowhere.
            if step.names:
                groups[min(levels[name] for name in step.names)].append(step)
        self._groups = sorted(groups.items())
        self._count = sum(len(group) for group in groups.values())
        self._known: dict[tuple[int, int, int], tuple[Any, Any, Any]] = {}
        self._phase = ""
        self._taken = self._told = 0

    def of(self, states: Any, phase: str, is_done: Callable[[Any], bool] = never_done) -> Any:
        """Return `states` and all that steps from them add.

        Args:
            states: States to begin with; they satisfy the predicate for added states.
            phase: Phase for which progress is reported.
            is_done: Function called with what has been found whenever the topmost steps have added to it; once it
                returns true, the rest is not found.
        """
        if not self._groups:
            return states
        self._taken = self._told = 0
        self._phase = phase
        states = self._of_whole(states, is_done)
        self._tell(states)
        self._known.clear()
        return states

    def _of_whole(self, states: Any, is_done: Callable[[Any], bool]) -> Any:
        _, topmost = self._groups[0]
        while not is_done(states):
            before = states = self._saturated(states, self._within, 1)
            for step in topmost:
                if is_done(states):
                    return states
                states = self._grown(states, self._within, step, states)
            if states == before:
                break
        return states

    def _saturated(self, states: Any, within: Any, group: int) -> Any:
        """Part of a set closed under the groups of steps from one on; `within` is the part that belongs to it."""
        if group == len(self._groups) or states == within or states == self._false:
            return states
        key = (int(states), int(within), group)
        found = self._known.get(key)
        if found is None:
            # The nodes are kept with what was found: their numbers could otherwise be given to others.
            found = self._known[key] = (states, within, self._worked_out(states, within, group))
        return found[2]

    def _worked_out(self, states: Any, within: Any, group: int) -> Any:
        top, steps = self._groups[group]
        level = min(states.level, within.level)
        if level < top:
            parts = zip(_split(states, level), _split(within, level), strict=True)
            low, high = (self._saturated(part, inside, group) for part, inside in parts)
            return self._manager.ite(self._variables[level], high, low)
        states = self._saturated(states, within, group + 1)
        # The targets of states that a step has seen are there already: it is asked about new ones only.
        seen = [self._false] * len(steps)
        # Once nothing has come of any step since the last time that something has, nothing ever will.
        vain, number = 0, 0
        while vain < len(steps):
            grown = self._grown(states, within, steps[number], states & ~seen[number])
            seen[number] = states
            number = (number + 1) % len(steps)
            vain += 1
            if grown != states:
                states = self._saturated(grown, within, group + 1)
                vain = 0
        return states

    def _grown(self, states: Any, within: Any, step: Step, new: Any) -> Any:
        self._monitor.check_stop()
        self._taken += 1
        if self._taken >= (self._told + 1) * self._count:
            self._tell(states)
        return states if new == self._false else step.grown(states, within, new)

    def _tell(self, states: Any) -> None:
        self._told += 1
        self._monitor.tell(self._phase, self._told, states)


def _split(predicate: Any, level: int) -> tuple[Any, Any]:
    """Return the cofactors of a predicate where the variable of a level is false and where it is true.

    None of the predicate's own variables stands above that level.
    """
    return cofactors(predicate) if predicate.level == level else (predicate, predicate)
