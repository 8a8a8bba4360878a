"""Symbolic model checking of computation tree logic: a set of states for every part of a formula, by fixed points.

Sources: E. M. Clarke, E. A. Emerson and A. P. Sistla, "Automatic verification of finite-state concurrent systems using
temporal logic specifications", ACM TOPLAS 8(2), 1986, pp. 244-263 (semantics, reduction to EX, EU and EG);
J. R. Burch, E. M. Clarke, K. L. McMillan, D. L. Dill and L. J. Hwang, "Symbolic model checking: 10^20 states and
beyond", Information and Computation 98(2), 1992, pp. 142-170, sec. 5 (fixed points of predicates). Least fixed points
are closures (see `robosc.synthesis.closure`), so their events are taken in an order that keeps diagrams small.
"""

from collections.abc import Callable, Sequence
from typing import Any

from robosc.automata.structure import System
from robosc.model_checking.evidence import Evidence
from robosc.model_checking.formulas import (
    Condition,
    Enabled,
    Finally,
    Formula,
    Globally,
    Joined,
    Next,
    Not,
    Property,
    Until,
)
from robosc.model_checking.kripke import KripkeStructure
from robosc.model_checking.outcome import Verdict
from robosc.supervisor import AddedCondition
from robosc.synthesis import EngineOptions, SynthesisProgress
from robosc.synthesis.expression_encoder import ExpressionEncoder
from robosc.synthesis.workspace import workspace


def verify_properties(
    system: System,
    added: Sequence[AddedCondition],
    properties: Sequence[Property],
    *,
    engine: str | EngineOptions = "auto",
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[SynthesisProgress], None] = lambda progress: None,
) -> tuple[Verdict, ...]:
    """Verify whether properties hold in the controlled system, in their order; the same for every engine.

    Args:
        system: Plants and event conditions.
        added: Conditions that the supervisor adds to events.
        properties: The properties.
        engine: Name of the engine for decision diagrams, or more about it. The order changes, if it may, until all
            states are known.
        should_stop: Function called before each step of the work with one event; once true, the work ends.
        on_progress: Function called with the progress of the work.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        NodeLimitError: Diagrams became larger than the engine's options allow.
        UnknownEngineError: There is no such engine.
        UnsupportedModelError: A condition computes with too many doubles.
    """
    with workspace(system, engine, should_stop, on_progress) as place:
        structure = KripkeStructure(system, place, added)
        return tuple(_Checker(structure).verdict(item) for item in properties)


class _Checker:
    """Checker of one property."""

    def __init__(self, structure: KripkeStructure) -> None:
        self._structure = structure
        self._manager = structure.manager
        self._monitor = structure.monitor
        self._encoder = ExpressionEncoder(structure.encoding)
        # By identity: to compare formulas would take longer than to work them out. The formula lives in the property.
        self._known: dict[int, tuple[Formula, Any]] = {}

    def verdict(self, claim: Property) -> Verdict:
        """Return the verdict on whether a property holds in every initial state, with a run that shows it."""
        outside = self._structure.initial & ~self._whole(claim.formula)
        holds = bool(outside == self._manager.false)
        start = self._structure.one(self._structure.initial if holds else outside)
        evidence = Evidence(self._structure, self.where, self._forever)
        return Verdict(claim, holds, evidence.run(claim.formula, start, holds=holds))

    def where(self, formula: Formula) -> Any:
        """The states in which a formula holds."""
        found = self._known.get(id(formula))
        if found is None:
            self._monitor.check_stop()
            found = self._known[id(formula)] = (formula, self._structure.states & self._work_out(formula))
        return found[1]

    def _whole(self, formula: Formula) -> Any:
        """The states in which a whole property holds, exact only for the initial states."""
        initial = self._structure.initial
        match formula:
            case Finally(quantifier="E", operand=operand):
                return self._leading_to(self.where(operand), initial)
            case Globally(quantifier="A", operand=operand):
                return ~self._leading_to(self._not(self.where(operand)), initial)
            case _:
                return self.where(formula)

    def _not(self, states: Any) -> Any:
        return self._structure.states & ~states

    def _work_out(self, formula: Formula) -> Any:
        match formula:
            case Condition(expression=expression):
                return self._encoder.holds(expression)
            case Enabled(event=event):
                return self._structure.enabled(event)
            case Not(operand=operand):
                return self._not(self.where(operand))
            case Joined(operator=operator, left=left, right=right):
                first, second = self.where(left), self.where(right)
                return first & second if operator == "and" else first | second
            case Next(quantifier=quantifier, operand=operand):
                inside = self.where(operand)
                if quantifier == "E":
                    return self._structure.before(inside)
                return self._not(self._structure.before(self._not(inside)))
            case Finally(quantifier=quantifier, operand=operand):
                inside = self.where(operand)
                return self._leading_to(inside) if quantifier == "E" else self._not(self._forever(self._not(inside)))
            case Globally(quantifier=quantifier, operand=operand):
                inside = self.where(operand)
                return self._forever(inside) if quantifier == "E" else self._not(self._leading_to(self._not(inside)))
            case Until(quantifier=quantifier, left=left, right=right):
                first, second = self.where(left), self.where(right)
                if quantifier == "E":
                    return self._until(first, second)
                late, never = self._not(second), self._not(first | second)
                return self._not(self._until(late, never) | self._forever(late))

    def _leading_to(self, states: Any, until: Any = None) -> Any:
        return self._until(self._structure.states, states, until)

    def _until(self, through: Any, goal: Any, until: Any = None) -> Any:
        """The least fixed point of `goal or (through and EX ...)`."""
        if goal == self._manager.false:
            return goal
        return self._structure.leading_to(goal, through, until)

    def _forever(self, states: Any) -> Any:
        """The greatest fixed point of `states and EX ...`."""
        return self._structure.lasting(states, self._structure.before, "states that can stay")
