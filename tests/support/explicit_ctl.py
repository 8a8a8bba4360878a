"""Model checking on an explicit graph, by the definitions: the slow and obvious twin of `robosc.model_checking`.

Every operator has its own least or greatest fixed point of Clarke, Emerson and Sistla (ACM TOPLAS 8(2), 1986), none is
reduced to another. A state without successors is its own successor.
"""

from collections.abc import Sequence

from robosc.automata import Semantics, System
from robosc.automata.compile import NO_DATA, compile_expression
from robosc.automata.controlled import Added, ControlledGraph, controlled_graph
from robosc.automata.state import subjects
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
from robosc.model_checking.outcome import EvidenceRun

States = frozenset[int]


class ExplicitChecker:
    """Checker of formulas on the graph of a controlled system.

    Args:
        system: Plants and event conditions.
        added: Conditions that the supervisor adds.
        limit: States beyond which there is no graph.

    Attributes:
        graph: The graph; None if it is too large.
    """

    def __init__(self, system: System, added: Added, limit: int = 5_000) -> None:
        self.graph: ControlledGraph | None = controlled_graph(Semantics(system), added, limit=limit)
        self._places = {subject: place for place, subject in enumerate(subjects(system))}
        steps = self.graph.steps if self.graph else ()
        self._next = [
            frozenset(target for _, targets in events for target in targets) or frozenset({number})
            for number, events in enumerate(steps)
        ]
        self._all = frozenset(range(len(self._next)))

    def holds(self, formula: Formula) -> bool:
        """Return True if a formula holds in the initial state."""
        return 0 in self.where(formula)

    def where(self, formula: Formula) -> States:
        """The numbers of the states in which a formula holds."""
        assert self.graph is not None
        match formula:
            case Condition(expression=expression):
                function = compile_expression(expression, self._places)
                return frozenset(n for n, state in enumerate(self.graph.states) if function(state, NO_DATA) is True)
            case Enabled(event=event):
                return frozenset(n for n, events in enumerate(self.graph.steps) if event in dict(events))
            case Not(operand=operand):
                return self._all - self.where(operand)
            case Joined(operator="and", left=left, right=right):
                return self.where(left) & self.where(right)
            case Joined(left=left, right=right):
                return self.where(left) | self.where(right)
            case Next(quantifier=quantifier, operand=operand):
                return self._before(quantifier, self.where(operand))
            case Finally(quantifier=quantifier, operand=operand):
                return self._until(quantifier, self._all, self.where(operand))
            case Until(quantifier=quantifier, left=left, right=right):
                return self._until(quantifier, self.where(left), self.where(right))
            case Globally(quantifier=quantifier, operand=operand):
                kept = inside = self.where(operand)
                while (after := inside & self._before(quantifier, kept)) != kept:
                    kept = after
                return kept

    def _until(self, quantifier: str, through: States, goal: States) -> States:
        found = goal
        while (after := goal | (through & self._before(quantifier, found))) != found:
            found = after
        return found

    def _before(self, quantifier: str, states: States) -> States:
        if quantifier == "E":
            return frozenset(n for n, targets in enumerate(self._next) if targets & states)
        return frozenset(n for n, targets in enumerate(self._next) if targets <= states)

    # Runs

    def replay(self, run: EvidenceRun) -> "Replayed":
        """A run on the graph; an assertion fails where it is none."""
        assert self.graph is not None
        numbers = {state: number for number, state in enumerate(self.graph.states)}
        path = [numbers[state] for state in run.states]
        assert path[0] == 0
        assert len(run.events) == len(path) - 1
        for source, event, target in zip(path, run.events, path[1:], strict=False):
            if event is None:
                assert not self.graph.steps[source]
                assert source == target
            else:
                assert target in dict(self.graph.steps[source])[event]
        assert run.loop is None or (run.loop < len(path) - 1 and path[run.loop] == path[-1])
        return Replayed(self, run, path)


class Replayed:
    """A run of the graph, asked what it shows."""

    def __init__(self, checker: ExplicitChecker, run: EvidenceRun, path: Sequence[int]) -> None:
        self._checker = checker
        self._run = run
        self._path = path

    def shows(self, formula: Formula, holds: bool, place: int = 0) -> bool:
        """Return True if the run shows that a formula holds, or does not, in the state at a place of it.

        Parts that the run leaves to be shown are excepted.
        """
        if any(item.formula is formula and (item.place, item.holds) == (place, holds) for item in self._run.left):
            return self._is_so(formula, holds, place)
        match formula:
            case Condition() | Enabled():
                return self._is_so(formula, holds, place)
            case Not(operand=operand):
                return self.shows(operand, not holds, place)
            case Joined(operator=operator, left=left, right=right):
                parts = [self.shows(part, holds, place) for part in (left, right)]
                return all(parts) if (operator == "and") == holds else any(parts)
            case Next(quantifier=quantifier, operand=operand) if (quantifier == "E") == holds:
                return place + 1 < len(self._path) and self.shows(operand, holds, place + 1)
            case Finally(quantifier=quantifier, operand=operand) if (quantifier == "E") == holds:
                return self._comes(None, operand, place) if holds else self._stays(operand, False, place)
            case Globally(quantifier=quantifier, operand=operand) if (quantifier == "E") == holds:
                return self._stays(operand, True, place) if holds else self._comes(None, Not(operand), place)
            case Until(quantifier=quantifier, left=left, right=right) if (quantifier == "E") == holds:
                if holds:
                    return self._comes(left, right, place)
                return self._stays(right, False, place) or any(
                    self.shows(left, False, later)
                    and self.shows(right, False, later)
                    and all(self._is_so(right, False, before) for before in range(place, later))
                    for later in range(place, len(self._path))
                )
            case _:
                return False

    def _is_so(self, formula: Formula, holds: bool, place: int) -> bool:
        return (self._path[place] in self._checker.where(formula)) == holds

    def _comes(self, through: Formula | None, goal: Formula, place: int) -> bool:
        return any(
            self.shows(goal, True, later)
            and (through is None or all(self._is_so(through, True, before) for before in range(place, later)))
            for later in range(place, len(self._path))
        )

    def _stays(self, formula: Formula, holds: bool, place: int) -> bool:
        return (
            self._run.loop is not None
            and self._run.loop >= place
            and all(self._is_so(formula, holds, later) for later in range(place, len(self._path)))
        )
