"""From a bundle of texts to a certified supervisor: the whole pipeline in one call.

The command line, the service and the tests all call `make_supervisor`, so the same bundle gives the same supervisor
everywhere.
"""

import dataclasses
from collections.abc import Callable
from contextlib import suppress
from enum import StrEnum
from math import prod
from typing import TYPE_CHECKING

import msgspec
from msgspec.structs import replace

from robosc import explanation as explanations
from robosc.automata import ExecutableSystem, Semantics
from robosc.automata.goal_memory import counted
from robosc.certification.certify import certify
from robosc.certification.progress import Progress
from robosc.certification.troubles import (
    Synthesized,
    forbidden_cancel_findings,
    told_troubles,
    without_consequences,
)
from robosc.controller_properties import Controller, check_controller, controller_findings
from robosc.errors import Diagnostic, InternalError, NodeLimitError, sorted_diagnostics
from robosc.model.acceptances import AFTER_SYNTHESIS, accept
from robosc.model.check import check
from robosc.model.layers import layer_findings, layer_warnings, without_controller_findings
from robosc.model.places import Places
from robosc.model.structure import Deployment, Model
from robosc.source import Bundle
from robosc.strategies.findings import layer_goal_findings
from robosc.supervisor import CheckResult, Strategy, SupervisedModule, Supervisor
from robosc.synthesis import (
    EngineOptions,
    Statistics,
    SynthesisProgress,
    SynthesisResult,
    SynthesisStatus,
    findings,
    synthesize_in_parts,
)
from robosc.verification import DEFAULT_STATES, CheckOutcome, Limits

if TYPE_CHECKING:
    from robosc.certification.goals import GoalExplanation
    from robosc.explanation import EmptyExplanation
    from robosc.modular.robots import RobotSynthesis

CANCEL_REASON = "no supervisor is made, because it would have to forbid a cancel that must be possible"
"""Reason why there is no supervisor where it forbids what its executor asks for."""

MAXIMUM_NAMES = 20
"""Maximum number of components that are named for a module without a supervisor."""

LIVELOCK_REASON = "no supervisor is made, because silent steps never end (--allow-livelock overrides this)"


class OutcomeStatus(StrEnum):
    """Outcome of an attempt to make a supervisor."""

    SUPERVISOR = "supervisor"
    EMPTY = "empty"
    """No supervisor exists: a result about the model, not a fault."""
    MODEL_ERRORS = "model errors"


class SynthesisOutcome(msgspec.Struct, frozen=True):
    """The outcome of `make_supervisor`.

    Attributes:
        status: Status at the end.
        supervisor: The supervisor, or None.
        diagnostics: Every finding about the model, sorted by place; with a supervisor, also those of synthesis.
        statistics: Figures of the synthesis, or None where there was none.
        reason: Reason why there is no supervisor, in one sentence; empty where there is one.
        explanation: Explanation of what is to blame where no supervisor exists, or goals cannot be reached.
        accepted: The findings that the text accepts; they are none of `diagnostics`.
    """

    status: OutcomeStatus
    supervisor: Supervisor | None
    diagnostics: tuple[Diagnostic, ...]
    statistics: Statistics | None = None
    reason: str = ""
    explanation: "EmptyExplanation | GoalExplanation | None" = None
    accepted: tuple[Diagnostic, ...] = ()


@dataclasses.dataclass(frozen=True)
class _Result:
    """The outcome of synthesis.

    Attributes:
        result: The supervisor, or why there is none.
        words: The automata with the words for them; without a supervisor perhaps only those of a module that has none.
        expected_states: States that the system has at most, where they were not counted.
        modules: The modules of a modular synthesis.
        robot: The robot in modules, for a modular synthesis with a supervisor.
        effort: Most nodes of diagrams that the whole system can be expected to need.
    """

    result: SynthesisResult
    words: "explanations.ModelWords"
    expected_states: int
    effort: int
    modules: tuple[SupervisedModule, ...] = ()
    robot: "RobotSynthesis | None" = None


class SynthesisProblem(msgspec.Struct, frozen=True):
    """A model without errors, ready for synthesis.

    Attributes:
        model: The model.
        places: Source locations of its parts.
        system: All that it does.
        diagnostics: Every finding about it.
        accepted: The findings that the text accepts.
    """

    model: Model
    places: Places
    system: ExecutableSystem
    diagnostics: tuple[Diagnostic, ...]
    accepted: tuple[Diagnostic, ...] = ()


def prepare(bundle: Bundle, deployment: Deployment) -> SynthesisProblem | SynthesisOutcome:
    """The automata of a bundle's model, or how the attempt to make a supervisor of it ends before synthesis.

    Raises:
        UnsupportedModelError: The model is outside what synthesis handles.
    """
    checked = check(bundle)
    if checked.model is None or checked.places is None:
        reason = "" if checked.has_errors else "a library has no robot to make a supervisor for"
        return SynthesisOutcome(
            OutcomeStatus.MODEL_ERRORS, None, checked.diagnostics, reason=reason, accepted=checked.accepted
        )
    diagnostics = checked.diagnostics
    if deployment is Deployment.LAYER:
        diagnostics = without_controller_findings(diagnostics)
        ambiguous = layer_findings(checked.model, checked.places)
        if ambiguous:
            return SynthesisOutcome(OutcomeStatus.MODEL_ERRORS, None, sorted_diagnostics((*diagnostics, *ambiguous)))
        diagnostics = (*diagnostics, *layer_warnings(checked.model, checked.places))
    diagnostics = sorted_diagnostics((*diagnostics, *layer_goal_findings(checked.model, checked.places, deployment)))
    system = ExecutableSystem(checked.model, deployment)
    # A model that synthesis cannot handle is refused here.
    _ = system.automata
    return SynthesisProblem(checked.model, checked.places, system, diagnostics, checked.accepted)


def make_supervisor(
    bundle: Bundle,
    *,
    deployment: Deployment = Deployment.CONTROLLER,
    engine: str | EngineOptions = "auto",
    verify_limit: int = DEFAULT_STATES,
    allow_livelock: bool = False,
    only_shown: bool = False,
    is_modular: bool = False,
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[Progress], None] = lambda progress: None,
) -> SynthesisOutcome:
    """Check a bundle, synthesize its supervisor, verify it independently and certify it.

    Args:
        bundle: The model and its libraries.
        deployment: Intended deployment of the supervisor.
        engine: Name of the engine for decision diagrams, or its options.
        verify_limit: States up to which the result is verified one by one; see `Limits.of`.
        allow_livelock: True if a supervisor is made even if silent steps of its executor never end.
        only_shown: True if the supervisor is not to be executed: then one is made even if it forbids a cancel that must
            be possible.
        is_modular: True for a modular synthesis: for robots of many components, of which each requirement is about few.
        should_stop: Function called again and again; once it returns true, the work ends.
        on_progress: Function called with the progress of the work.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        NodeLimitError: Decision diagrams became larger than the engine's options allow.
        UnsupportedModelError: The model is outside what synthesis handles.
        InternalError: The verifier found fault with the result.
    """
    on_progress(Progress("check", bundle.main.name))
    problem = prepare(bundle, deployment)
    if isinstance(problem, SynthesisOutcome):
        return problem
    outcome = _supervised(
        bundle,
        problem,
        deployment,
        engine,
        verify_limit,
        should_stop,
        on_progress,
        allow_livelock=allow_livelock,
        only_shown=only_shown,
        is_modular=is_modular,
    )
    is_judged = outcome.status is OutcomeStatus.SUPERVISOR and deployment is Deployment.CONTROLLER
    # Several modules do not find all that the whole would.
    is_judged = is_judged and (outcome.supervisor is None or len(outcome.supervisor.modules) < 2)
    diagnostics, accepted = accept(bundle, outcome.diagnostics, lambda code: is_judged and code in AFTER_SYNTHESIS)
    return replace(outcome, diagnostics=diagnostics, accepted=sorted_diagnostics((*problem.accepted, *accepted)))


def _supervised(
    bundle: Bundle,
    problem: SynthesisProblem,
    deployment: Deployment,
    engine: str | EngineOptions,
    verify_limit: int,
    should_stop: Callable[[], bool],
    on_progress: Callable[[Progress], None],
    *,
    allow_livelock: bool,
    only_shown: bool,
    is_modular: bool,
) -> SynthesisOutcome:
    """Synthesize the supervisor of a model without errors; the arguments are those of `make_supervisor`."""
    model, places, system = problem.model, problem.places, problem.system.automata

    def report(progress: SynthesisProgress | str) -> None:
        on_progress(Progress("synthesis", str(progress)))

    made = (_in_modules if is_modular else _as_a_whole)(problem, deployment, engine, should_stop, report)
    result = made.result
    if result.status is SynthesisStatus.EMPTY:
        reason = f"no supervisor exists: {result.reason}"
        explanation = None
        # The verdict, no supervisor, holds whatever the limit of nodes.
        with suppress(NodeLimitError):
            explanation = explanations.explain_empty(
                made.words,
                engine=engine,
                should_stop=should_stop,
                on_progress=report,
            )
        return SynthesisOutcome(OutcomeStatus.EMPTY, None, problem.diagnostics, result.statistics, reason, explanation)
    on_progress(Progress("verification", f"{made.expected_states} states"))
    semantics = Semantics(system)
    certificate = certify(
        semantics,
        result,
        bundle,
        deployment,
        Limits.of(verify_limit),
        modules=[item.automata for item in made.modules] if len(made.modules) > 1 else (),
        expected_states=made.expected_states,
        should_stop=should_stop,
        on_progress=lambda message: on_progress(Progress("verification", message)),
    )
    on_progress(Progress("controller", "finite response, confluence, nonblocking under control, cancels"))
    controller = Controller(problem.system, result.added, semantics)
    properties = check_controller(
        problem.system,
        result.added,
        is_nonblocking=certificate.nonblocking == "passed",
        states=int(certificate.states) or made.expected_states,
        controller=controller,
        should_stop=should_stop,
    )
    synthesized = Synthesized(made.words, made.effort, engine, should_stop)
    told = told_troubles(synthesized, result.answers)
    answers = without_consequences(model, result.answers, {item.event for item in properties.forbidden})
    diagnostics = sorted_diagnostics(
        (
            *problem.diagnostics,
            *findings(model, places, answers, told),
            *controller_findings(model, system, places, properties, allow_livelock=allow_livelock),
            *forbidden_cancel_findings(synthesized, properties, only_shown=only_shown),
        )
    )
    if properties.livelock is not None and not allow_livelock:
        return SynthesisOutcome(OutcomeStatus.MODEL_ERRORS, None, diagnostics, result.statistics, LIVELOCK_REASON)
    if properties.forbidden and not only_shown:
        return SynthesisOutcome(OutcomeStatus.MODEL_ERRORS, None, diagnostics, result.statistics, CANCEL_REASON)
    certificate = msgspec.structs.replace(certificate, controller=properties.certified())
    strategy = None
    if model.has_goals and deployment is Deployment.CONTROLLER:
        # Models without goals do not wait for what goals need.
        from robosc.certification.goals import goal_explanation
        from robosc.certification.strategies import GoalCheck, verify_strategy
        from robosc.strategies import (
            blame_goals,
            goal_findings,
            goals_and_missions,
            put_off_findings,
            synthesize_strategy,
        )

        def check_goals(strategy: Strategy) -> GoalCheck:
            return verify_strategy(
                problem.system,
                result.added,
                strategy,
                Limits.of(verify_limit),
                engine=result.statistics.engine,
                controller=controller,
                should_stop=should_stop,
                on_progress=lambda message: on_progress(Progress("strategy", message)),
            )

        on_progress(Progress("strategy", counted(problem.system.obligations.aims)))
        of_modules = None
        if made.robot is not None:
            from robosc.certification.modular_strategies import strategy_in_modules

            of_modules = strategy_in_modules(
                made.robot, problem.system, check_goals, engine=engine, should_stop=should_stop, on_progress=report
            )
        found = (
            of_modules.found
            if of_modules is not None
            else synthesize_strategy(
                problem.system, result.added, engine=engine, should_stop=should_stop, on_progress=report
            )
        )
        blame = None
        if found.unreached:
            on_progress(Progress("strategy", "what keeps the goals from being reached"))
            blame = blame_goals(
                problem.system, result.added, found, engine=engine, should_stop=should_stop, on_progress=report
            )
        diagnostics = sorted_diagnostics(
            (*diagnostics, *goal_findings(problem.system.obligations.aims, places, found, blame))
        )
        strategy = found.strategy
        if strategy is None:
            goals = None
            if blame is not None:
                without = Supervisor.supervising(problem.system, result.added, certificate)
                goals = goal_explanation(without, places, found, blame)
            reason = f"no strategy is made for the {goals_and_missions(model)}"
            return SynthesisOutcome(OutcomeStatus.MODEL_ERRORS, None, diagnostics, result.statistics, reason, goals)
        checked = check_goals(strategy) if of_modules is None else of_modules.checked
        if checked.missed is not None:
            raise InternalError(f"the strategy misses a goal after {', '.join(checked.missed.trace)}")
        late = put_off_findings(problem.system.obligations.aims, places, found, checked.put_off)
        diagnostics = sorted_diagnostics((*diagnostics, *late))
        outcome: CheckResult = "passed" if checked.outcome is CheckOutcome.PASSED else "not checked"
        method = f"{certificate.method}; {checked.method if of_modules is None else of_modules.method}"
        certificate = msgspec.structs.replace(certificate, goals=outcome, method=method)
    supervisor = Supervisor.supervising(problem.system, result.added, certificate, strategy, made.modules)
    return SynthesisOutcome(OutcomeStatus.SUPERVISOR, supervisor, diagnostics, result.statistics)


def _as_a_whole(
    problem: SynthesisProblem,
    deployment: Deployment,
    engine: str | EngineOptions,
    should_stop: Callable[[], bool],
    on_progress: Callable[[SynthesisProgress | str], None],
) -> _Result:
    """The supervisor of a model, of all its automata together or of independent parts."""
    words = explanations.ModelWords(problem.model, problem.places, problem.system.automata, deployment)
    result = synthesize_in_parts(
        words.system, engine=engine, questions=words.questions, should_stop=should_stop, on_progress=on_progress
    )
    return _Result(result, words, result.statistics.states, result.statistics.peak_nodes)


def _in_modules(
    problem: SynthesisProblem,
    deployment: Deployment,
    engine: str | EngineOptions,
    should_stop: Callable[[], bool],
    on_progress: Callable[[SynthesisProgress | str], None],
) -> _Result:
    """The same, module by module."""
    from robosc.modular.robots import synthesize_robot

    model, places, system = problem.model, problem.places, problem.system.automata
    found = synthesize_robot(
        model, places, system, deployment, engine=engine, should_stop=should_stop, on_progress=on_progress
    )
    figures = [item.result.statistics for item in found.modular.modules]
    effort = sum(item.peak_nodes for item in figures)
    if found.result.status is SynthesisStatus.EMPTY:
        part = found.parts[0]
        words = explanations.ModelWords(part.model, part.places, part.system, deployment)
        names = ", ".join(part.components[:MAXIMUM_NAMES]) + ", ..." * (len(part.components) > MAXIMUM_NAMES)
        result = dataclasses.replace(found.result, reason=f"{names}: {found.result.reason}")
        return _Result(result, words, 0, effort)
    words = explanations.ModelWords(model, places, system, deployment)
    group_of = found.modular.group_of
    modules = tuple(
        SupervisedModule(
            tuple(item.name for item in part.system.automata),
            part.requirements,
            part.invariants,
            str(figures[place].states),
            group_of[place],
        )
        for place, part in enumerate(found.parts)
    )
    most = prod(item.states for item in figures)
    return _Result(found.result, words, found.result.statistics.states or most, effort, modules, found)
