"""Synthesis of the maximally permissive supervisor: encoding, fixed point, added conditions, figures."""

from collections.abc import Callable

from robosc.automata.structure import System
from robosc.supervisor import AddedCondition, DecisionDiagram
from robosc.synthesis.closure import closure_in
from robosc.synthesis.controlled import ControlledSystem
from robosc.synthesis.engines import EngineOptions
from robosc.synthesis.fixed_point import FixedPoint, GoodStates, Problem, safe_states
from robosc.synthesis.nodes import count_models
from robosc.synthesis.questions import Questions
from robosc.synthesis.result import (
    Closure,
    Search,
    Statistics,
    SynthesisProgress,
    SynthesisResult,
    SynthesisStatus,
)
from robosc.synthesis.simplify import Simplifier
from robosc.synthesis.transitions import Steps, transition_of
from robosc.synthesis.workspace import Workspace, workspace

_NOTHING = Questions()


def _never() -> bool:
    return False


def _silent(progress: SynthesisProgress) -> None:
    """Report nothing."""


def synthesize(
    system: System,
    *,
    engine: str | EngineOptions = "auto",
    questions: Questions = _NOTHING,
    should_stop: Callable[[], bool] = _never,
    on_progress: Callable[[SynthesisProgress], None] = _silent,
) -> SynthesisResult:
    """Synthesize the safe, controllable, nonblocking and maximally permissive supervisor of a system.

    Args:
        system: Plants and event conditions.
        engine: Name of the engine for decision diagrams, or its options; `auto` is the fastest installed.
        questions: Other questions about the controlled system.
        should_stop: Function called before each step of the work with one event; once it returns true, the work ends.
        on_progress: Function called after each event's encoding and after each round.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        NodeLimitError: Diagrams became larger than the options allow.
        UnknownEngineError: There is no such engine.
        UnsupportedModelError: An expression computes with too many doubles, or a condition would be too large.
    """
    with workspace(system, engine, should_stop, on_progress) as place:
        return _Synthesis(system, place).result(questions)


class _Synthesis:
    """One synthesis: its manager is its own."""

    def __init__(self, system: System, place: Workspace) -> None:
        self._place = place
        self._monitor = place.monitor
        self._encoding = place.encoding
        self._manager = place.encoding.manager
        self._problem = Problem(self._steps(), safe_states(self._encoding, system.invariants))

    def _steps(self) -> tuple[Steps, ...]:
        found: list[Steps] = []
        for event in self._encoding.system.events:
            self._monitor.check_stop()
            found.append(Steps(self._encoding, transition_of(self._encoding, event)))
            self._monitor.report("encoding", len(found), found[-1].plant)
        return tuple(found)

    def result(self, questions: Questions) -> SynthesisResult:
        """The supervisor, or why there is none."""
        fixed_point = FixedPoint(self._encoding, self._monitor)
        with self._place.reordering():
            good = fixed_point.solution(self._problem, self._manager.false)
            reachable = None if good.reason else fixed_point.reachable_states(self._problem, good.states)
            closure = closure_in(self._manager)
        if good.reason:
            statistics = self._statistics(good, 0, closure)
            return SynthesisResult(SynthesisStatus.EMPTY, (), statistics, good.reason)
        states = count_models(self._manager, reachable, self._encoding.state_names)
        added: list[AddedCondition] = []
        simplifier = Simplifier(self._encoding, self._place.condition_seconds)
        controlled = ControlledSystem(self._encoding, self._monitor, self._problem, good.states, reachable)
        for steps in self._problem.steps:
            self._monitor.check_stop()
            condition = self._added(simplifier, steps, controlled)
            if condition is not None:
                added.append(AddedCondition(steps.event.name, condition))
        initial = simplifier.condition(good.states, fixed_point.initial)
        # The figures are those of the synthesis: what the questions take on top is not in them.
        statistics = self._statistics(good, states, closure)
        return SynthesisResult(
            SynthesisStatus.SUPERVISOR,
            tuple(added),
            statistics,
            answers=controlled.answers(questions),
            initial=initial,
        )

    def _statistics(self, good: GoodStates, states: int, closure: Closure) -> Statistics:
        return Statistics(
            engine=self._place.engine,
            state_bits=len(self._encoding.state_names),
            iterations=good.rounds,
            peak_nodes=self._monitor.peak_nodes,
            states=states,
            search=Search.REACHABLE_FIRST if good.is_of_reached else Search.BACKWARDS,
            closure=closure,
        )

    def _added(self, simplifier: Simplifier, steps: Steps, controlled: ControlledSystem) -> DecisionDiagram | None:
        """The condition to add to an event, simplified where it does not matter; None if there is nothing to add."""
        if not controlled.is_disabled(steps):
            return None
        only = controlled.conjuncts.only(steps)
        return simplifier.condition(only, controlled.reachable & steps.plant & steps.condition)
