"""A run that shows why a formula holds or does not hold in a state, as far as one run can show it.

A run is evidence that some run has a property, but no run is evidence that all runs have it; for a false formula it is
the other way round. So the formula is followed along a run, as long as a run is evidence for the remaining part
(E. M. Clarke, O. Grumberg, K. L. McMillan and X. Zhao, "Efficient generation of counterexamples and witnesses in
symbolic model checking", DAC 1995, pp. 427-432). A part without such evidence is named with its place in the run.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from robosc.model_checking.formulas import (
    Condition,
    Enabled,
    Finally,
    Formula,
    Globally,
    Joined,
    Next,
    Not,
    Until,
)
from robosc.model_checking.kripke import KripkeStructure
from robosc.model_checking.outcome import EvidenceRun, Remainder, RunKind
from robosc.model_checking.runs import Path, Runs


@dataclass(frozen=True, slots=True)
class _PartialRun:
    """Result so far: the way, where it closes, and what is left to show."""

    path: Path
    loop: int | None = None
    left: tuple[Remainder, ...] = ()


class Evidence:
    """Finder of runs that show something.

    Args:
        structure: Structure that runs go through.
        where: The states in which a formula holds.
        forever: The states from which a run can stay in given ones for ever.
    """

    def __init__(
        self, structure: KripkeStructure, where: Callable[[Formula], Any], forever: Callable[[Any], Any]
    ) -> None:
        self._structure = structure
        self._where = where
        self._forever = forever
        self._runs = Runs(structure)

    def run(self, formula: Formula, start: Any, *, holds: bool) -> EvidenceRun | None:
        """A run from a single state that shows that a formula holds there, or does not; None if none shows anything."""
        shown = self._show(formula, holds, Path((start,)))
        if shown.left and not shown.path.events:
            return None
        return EvidenceRun(
            RunKind.WITNESS if holds else RunKind.COUNTEREXAMPLE,
            tuple(self._structure.values(state) for state in shown.path.states),
            shown.path.events,
            shown.loop,
            shown.left,
        )

    def _show(self, formula: Formula, holds: bool, path: Path) -> _PartialRun:
        """Go on from the end of a path, where a formula is known to hold, or not to."""
        match formula:
            case Condition() | Enabled():
                return _PartialRun(path)
            case Not(operand=operand):
                return self._show(operand, not holds, path)
            case Joined(operator=operator, left=left, right=right):
                if (operator == "and") == holds:
                    return self._show_both(left, right, holds, path)
                return self._show_either(left, right, holds, path)
            case _ if (formula.quantifier == "E") != holds:
                return _PartialRun(path, left=(Remainder(len(path.events), formula, holds),))
            case Next(operand=operand):
                step = self._runs.step(path.end, self._states(operand, holds))
                return self._show(operand, holds, path.then(step))
            case Finally(operand=operand):
                if holds:
                    return self._reach(self._structure.states, operand, holds, path)
                return self._remain(self._states(operand, False), path)
            case Globally(operand=operand):
                if holds:
                    return self._remain(self._where(operand), path)
                return self._reach(self._structure.states, operand, holds, path)
            case Until(left=left, right=right):
                if holds:
                    return self._reach(self._where(left), right, holds, path)
                return self._break(left, right, path)

    def _states(self, formula: Formula, holds: bool) -> Any:
        """Return the states where a formula holds, or does not."""
        inside = self._where(formula)
        return inside if holds else self._structure.states & ~inside

    def _show_either(self, left: Formula, right: Formula, holds: bool, path: Path) -> _PartialRun:
        """Go on for the one of two parts that is the simpler to show; one at least is so."""
        false = self._structure.manager.false
        parts = [part for part in (left, right) if path.end & self._states(part, holds) != false]
        shown = [self._show(part, holds, path) for part in parts]
        return min(shown, key=lambda found: (len(found.left), len(found.path.events)))

    def _show_both(self, left: Formula, right: Formula, holds: bool, path: Path) -> _PartialRun:
        """Go on for two parts; one run goes one way, so where both need one the second is left."""
        first, second = self._show(left, holds, path), self._show(right, holds, path)
        place = len(path.events)
        if len(first.path.events) == place:
            return replace(second, left=(*first.left, *second.left))
        left_over = second.left if len(second.path.events) == place else (Remainder(place, right, holds),)
        return replace(first, left=(*first.left, *left_over))

    def _reach(self, within: Any, operand: Formula, holds: bool, path: Path) -> _PartialRun:
        """A run to a state where a formula holds, or does not, and on for what is to be shown there."""
        way = self._runs.path(path.end, within, self._states(operand, holds))
        return self._show(operand, holds, path.then(way))

    def _remain(self, states: Any, path: Path) -> _PartialRun:
        """A run that stays in some states for ever."""
        lasso, loop = self._runs.lasso(path.end, self._forever(states))
        return _PartialRun(path.then(lasso), len(path.events) + loop)

    def _break(self, left: Formula, right: Formula, path: Path) -> _PartialRun:
        """A run on which `left` ends before `right` begins; where there is none, one on which `right` never does."""
        late = self._states(right, False)
        way = self._runs.search(path.end, late, late & self._states(left, False))
        return self._remain(late, path) if way is None else self._show_both(left, right, False, path.then(way))
