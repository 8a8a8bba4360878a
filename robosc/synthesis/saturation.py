"""Saturation: steps are applied only to the parts of a decision diagram that they read or change, lowest parts first.

A step that reads and changes no variable above some level does not depend on the variables above that level. So only
the subdiagrams that begin at that level are closed under the step, together with all steps below it, and equal
subdiagrams only once. The cost of a step in one part of a system then depends on the size of that part, where other
methods build the whole predicate anew from its root with each step.

Sources: G. Ciardo, G. Luettgen and R. Siminiceanu, "Saturation: an efficient iteration strategy for symbolic
state-space generation", TACAS 2001, LNCS 2031, pp. 328-342; Y. Zhao and G. Ciardo, "Symbolic CTL model checking of
asynchronous systems using constrained saturation", ATVA 2009, LNCS 5799, pp. 368-381 (the predicate that states must
satisfy is followed downwards together with them); on binary diagrams T. van Dijk, J. Meijer and J. van de Pol,
"Multi-core on-the-fly saturation", TACAS 2019, LNCS 11428, pp. 58-75.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

from robosc.recursion import allow_depth
from robosc.synthesis.compiled import Kernel, kernel_of
from robosc.synthesis.engines import Manager
from robosc.synthesis.image import Image
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.nodes import cofactors, nodes_made
from robosc.synthesis.step import Step, is_enough

PAUSE = 16
"""Steps after which work is counted, and of which the first one is looked at to estimate what the others cost."""

_STEP_NODES = 10
"""Nodes that a step counts for beside those that it makes: what it finds in caches takes about as long."""

_FRAMES_PER_LEVEL = 2
"""Python frames for each level of a diagram, and for each group of steps, that saturation goes down."""


def saturation(
    manager: Manager, levels: Mapping[str, int], steps: Sequence[Step], within: Any, monitor: ProgressMonitor
) -> "Saturation | CompiledSaturation":
    """Return the fastest saturation that a manager and some steps admit; the arguments are those of `Saturation`."""
    kernel = kernel_of(manager)
    if kernel is None or not all(isinstance(step.add, Image) for step in steps):
        return Saturation(manager, levels, steps, within, monitor)
    return CompiledSaturation(kernel, manager, levels, steps, within, monitor)


def work_of(steps: int, nodes: int) -> int:
    """Return the estimated work of some steps, as a number of nodes, from the nodes that one of them made."""
    return steps * (_STEP_NODES + nodes)


def _grouped(levels: Mapping[str, int], steps: Sequence[Step]) -> list[tuple[int, list[Step]]]:
    """Return the steps that begin at each level, topmost first."""
    groups: defaultdict[int, list[Step]] = defaultdict(list)
    for step in steps:
        # One that neither reads nor changes anything leads nowhere.
        if step.names:
            groups[min(levels[name] for name in step.names)].append(step)
    return sorted(groups.items())


class Saturation:
    """Closure of sets of states under some steps, in a manager whose order stays as it is meanwhile.

    Args:
        manager: The manager.
        levels: The level of each current-state variable.
        steps: The steps.
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
        self._levels = levels
        self._groups = _grouped(levels, steps)
        self._count = sum(len(group) for _, group in self._groups)
        allow_depth(len(levels) + len(self._groups), _FRAMES_PER_LEVEL)
        self._known: dict[tuple[Any, Any, int], Any] = {}
        self._phase = ""
        self._taken = self._reports = self._spent = self._made = 0

    def of(self, states: Any, phase: str, until: Any = None) -> Any:
        """Return `states` and all that steps from them add.

        Args:
            states: States to begin with; they satisfy the predicate for added states.
            phase: Phase for which progress is reported.
            until: States once all of which are found the rest is not; None to find everything. It is looked whenever
                the topmost steps have been taken.
        """
        if not self._groups:
            return states
        self._taken = self._reports = self._spent = self._made = 0
        self._phase = phase
        states = self._of_whole(states, until)
        self._spend()
        self._report(states)
        self._known.clear()
        return states

    def _of_whole(self, states: Any, until: Any) -> Any:
        _, topmost = self._groups[0]
        while not is_enough(states, until):
            before = states = self._saturated(states, self._within, 1)
            for step in topmost:
                if is_enough(states, until):
                    return states
                states = self._grown(states, self._within, step)
            if states == before:
                break
        return states

    def _saturated(self, states: Any, within: Any, group: int) -> Any:
        """Part of a set closed under the groups of steps from one on; `within` is the part that belongs to it."""
        if group == len(self._groups) or states == within or states == self._false:
            return states
        key = (states, within, group)
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = self._worked_out(states, within, group)
        return found

    def _worked_out(self, states: Any, within: Any, group: int) -> Any:
        top, steps = self._groups[group]
        level = min(states.level, within.level)
        if level < top:
            (low, high), (low_inside, high_inside) = _split(states, level), _split(within, level)
            low = self._saturated(low, low_inside, group)
            high = self._saturated(high, high_inside, group)
            return self._manager.ite(self._variables[level], high, low)
        states = self._saturated(states, within, group + 1)
        # Once nothing has come of any step since the last time that something has, nothing ever will.
        vain, number = 0, 0
        while vain < len(steps):
            grown = self._grown(states, within, steps[number])
            number = (number + 1) % len(steps)
            vain += 1
            if grown != states:
                states = self._saturated(grown, within, group + 1)
                vain = 0
        return states

    def _grown(self, states: Any, within: Any, step: Step) -> Any:
        self._monitor.check_stop()
        is_looked_at = self._taken % PAUSE == 0
        if is_looked_at:
            self._spend()
        if self._taken + 1 >= (self._reports + 1) * self._count:
            self._report(states)
        grown = states | step.added(states, within)
        if is_looked_at:
            self._made = nodes_made(grown, states, {self._levels[name] for name in step.names})
        self._taken += 1
        return grown

    def _spend(self) -> None:
        steps, self._spent = self._taken - self._spent, self._taken
        self._monitor.spend(work_of(steps, self._made))

    def _report(self, states: Any) -> None:
        self._reports += 1
        self._monitor.report(self._phase, self._reports, states)


def _split(predicate: Any, level: int) -> tuple[Any, Any]:
    """Return the cofactors of a predicate where the variable of a level is false and where it is true.

    None of the predicate's own variables stands above that level.
    """
    return cofactors(predicate) if predicate.level == level else (predicate, predicate)


class CompiledSaturation:
    """The same by the kernel: every step's images are `Image`s.

    Args:
        kernel: The kernel.
        manager: As of `Saturation`, with what follows.
        levels: The level of each current-state variable.
        steps: The steps.
        within: Predicate that added states have to satisfy.
        monitor: Monitor of the waiting caller.
    """

    def __init__(
        self,
        kernel: Kernel,
        manager: Manager,
        levels: Mapping[str, int],
        steps: Sequence[Step],
        within: Any,
        monitor: ProgressMonitor,
    ) -> None:
        self._kernel = kernel
        self._manager = manager
        self._within = within
        self._monitor = monitor
        # The kernel has the addresses of what the steps keep.
        self._steps = steps
        self._groups = tuple(
            (top, tuple(self._passed(step, step.add) for step in group if isinstance(step.add, Image)))
            for top, group in _grouped(levels, steps)
        )

    def of(self, states: Any, phase: str, until: Any = None) -> Any:
        """Return `states` and all that steps from them add, as `Saturation.of` does."""
        if not self._groups:
            return states
        rounds = 0

        def report(number: int, address: int) -> None:
            nonlocal rounds
            rounds = number
            self._monitor.report(phase, number, self._kernel.predicate(address))

        def pause(steps: int, nodes: int) -> None:
            self._monitor.check_stop(steps)
            self._monitor.spend(work_of(steps, nodes))

        states = self._kernel.closure(states, self._within, self._groups, until, pause, report)
        self._monitor.report(phase, rounds + 1, states)
        return states

    def _passed(self, step: Step, image: Image) -> tuple[object, ...]:
        if step.compiled is None:
            step.compiled = self._compiled(step, image)
        return step.compiled[0]

    def _compiled(self, step: Step, image: Image) -> tuple[tuple[object, ...], tuple[Any, ...]]:
        manager = self._manager
        constants = manager.cube(image.constants) if image.constants else None
        hidden = manager.cube(dict.fromkeys(image.hidden, True)) if image.hidden else None
        touched = manager.cube(dict.fromkeys(step.names, True))
        names = {name: manager.var(new) for name, new in image.names.items()}
        address = self._kernel.address
        passed = (
            address(image.inside),
            address(image.needed),
            address(constants),
            self._substitutions(image.functions),
            address(image.relation),
            address(hidden),
            self._substitutions(names),
            address(image.outside),
            address(step.room),
            address(touched),
        )
        return passed, (touched, constants, hidden, *names.values())

    def _substitutions(self, functions: Mapping[str, Any]) -> tuple[tuple[int, int], ...]:
        # The manager keeps its variables.
        address = self._kernel.address
        return tuple((address(self._manager.var(name)), address(function)) for name, function in functions.items())
