"""Explanation of the effect of synthesis on a model, and of findings."""

from dataclasses import dataclass, replace
from typing import overload

from msgspec.structs import replace as replace_struct

from robosc.automata import System, check_system
from robosc.certification import OutcomeStatus, Progress, SynthesisOutcome, SynthesisProblem, make_supervisor, prepare
from robosc.certification.goals import GoalExplanation
from robosc.certification.progress import OnProgress, ShouldStop, ignored, never
from robosc.diagnostics import Page, page
from robosc.errors import Diagnostic, UnsupportedModelError
from robosc.explanation import (
    EmptyExplanation,
    Explanation,
    ModelWords,
    SystemWords,
    explain_empty,
    explain_synthesis,
)
from robosc.explanation.parts import EventReport, Remark
from robosc.model.structure import Deployment
from robosc.pipeline.automata_models import checked_automata
from robosc.pipeline.findings import Findings
from robosc.pipeline.loading import LoadedAutomata, ModelLike, loaded
from robosc.pipeline.options import DEFAULT_OPTIONS, SynthesisOptions
from robosc.pipeline.results import Explained, NoSupervisor, SynthesisStatus
from robosc.pipeline.synthesis import Unsupported, findings_of
from robosc.source import Bundle
from robosc.strategies import goals_and_missions
from robosc.synthesis import EngineOptions


@overload
def explain(model: Diagnostic) -> Page: ...


@overload
def explain(*, code: str) -> Page: ...


@overload
def explain(
    model: ModelLike | System,
    options: SynthesisOptions = DEFAULT_OPTIONS,
    *,
    event: str | None = None,
    state: str | None = None,
    after: str | None = None,
    is_modular: bool = False,
    on_progress: OnProgress = ignored,
    should_stop: ShouldStop = never,
) -> Explained: ...


def explain(
    model: ModelLike | System | Diagnostic | None = None,
    options: SynthesisOptions = DEFAULT_OPTIONS,
    *,
    code: str | None = None,
    event: str | None = None,
    state: str | None = None,
    after: str | None = None,
    is_modular: bool = False,
    on_progress: OnProgress = ignored,
    should_stop: ShouldStop = never,
) -> Explained | Page:
    """Explain the effect of synthesis on a model (restrictions of events, or the parts to blame), or explain a finding.

    Of a model whose goals or missions cannot be reached, that is explained, unless an event, a state or a run is given.

    Args:
        model: The model, as `load` returns it, the path of one, or a `robosc.automata.System`; or a finding, whose code
            is explained.
        options: Options for making the supervisor.
        code: Code of a finding to explain, such as `unknown-name`, instead of a model.
        event: The event to explain; None: all events, and warnings.
        state: Description of a state in which to explain what can happen, such as `Door.closed, Lift.n = 2`.
        after: Run after which to explain what can happen, such as `open, jam.response`.
        is_modular: True if a robot is explained module by module: each event in every module that has it, by runs of
            that module alone.
        on_progress: Function called with the progress of the work.
        should_stop: Function called before each step; once it returns true, the work ends.

    Raises:
        TypeError: Neither a model nor a code is given, or both are; or a state, a run or automata are to be explained
            in modules.
        UnknownCodeError: There is no such code.
        RequestError: The event, the part of the model, the state or the run does not exist.
        FileAccessError: The file does not exist or cannot be read.
        LanguageError: A file is too large or not UTF-8.
        InvalidSystemError: The automata do not fit together.
        NodeLimitError: Decision diagrams became larger than the options allow.
        UnknownEngineError: There is no such engine.
        SynthesisCancelled: `should_stop` became true.
    """
    if (model is None) == (code is None):
        raise TypeError("explain takes either a model or finding, or code=..., the code of a finding")
    if isinstance(model, Diagnostic):
        return page(model.code)
    if model is None:
        return page(str(code))
    asked = ExplanationSubject(event, state, after, is_modular)
    if is_modular and (state is not None or after is not None):
        raise TypeError("is_modular explains events: a state, or what follows a run, is of the whole robot")
    bundle = model if isinstance(model, System) else loaded(model)
    if is_modular and isinstance(bundle, System | LoadedAutomata):
        raise TypeError("is_modular explains robots: of automata the whole is explained")
    if isinstance(bundle, System):
        check_system(bundle)
        return explained_system(SystemWords(bundle), options.engine_options(), asked, on_progress, should_stop)
    if isinstance(bundle, LoadedAutomata):
        return _explained_automata(bundle, options, asked, on_progress, should_stop)
    try:
        found = explained(bundle, options.deployment, options.engine_options(), asked, on_progress, should_stop)
    except UnsupportedModelError as error:
        attempt = Unsupported(str(error))
        diagnostics = findings_of(attempt, bundle)
        return Explained(
            SynthesisStatus.UNSUPPORTED_MODEL, diagnostics, attempt.reason, NoSupervisor(attempt.reason, diagnostics)
        )
    return result_of(found, bundle)


def result_of(found: SynthesisOutcome | tuple[SynthesisProblem, Explanation], bundle: Bundle) -> Explained:
    """Return what `explained` has found, as the result of an explanation."""
    if isinstance(found, SynthesisOutcome):
        diagnostics, why = Findings(found.diagnostics, bundle), found.explanation
        explanation = why if isinstance(why, GoalExplanation) else NoSupervisor(found.reason, diagnostics)
        return Explained(SynthesisStatus.MODEL_ERRORS, diagnostics, found.reason, explanation)
    problem, whole = found
    return Explained(_status(whole), Findings(problem.diagnostics, bundle), "", whole)


def _status(explanation: Explanation) -> SynthesisStatus:
    return SynthesisStatus.SUPERVISOR if explanation.empty is None else SynthesisStatus.EMPTY


@dataclass(frozen=True, slots=True)
class ExplanationSubject:
    """Subject of an explanation; if all attributes are empty, all controllable events and warnings.

    Attributes:
        event: The event to explain.
        state: Description of a state in which to explain what can happen.
        after: Run after which to explain what can happen.
        is_modular: True if events are explained module by module.
    """

    event: str | None = None
    state: str | None = None
    after: str | None = None
    is_modular: bool = False


def explained(
    bundle: Bundle,
    deployment: Deployment,
    engine: EngineOptions,
    asked: ExplanationSubject,
    on_progress: OnProgress = ignored,
    should_stop: ShouldStop = never,
) -> SynthesisOutcome | tuple[SynthesisProblem, Explanation]:
    """Return the synthesis problem with an explanation, or the outcome of an attempt without a supervisor to explain.

    An attempt ends before synthesis if the model has errors, and after it if goals are not reached; the latter matters
    only where nothing in particular is asked.
    """
    problem = prepare(bundle, deployment)
    if isinstance(problem, SynthesisOutcome):
        return problem
    has_goals = deployment is Deployment.CONTROLLER and goals_and_missions(problem.model)
    if has_goals and (asked.event, asked.state, asked.after) == (None, None, None):
        made = make_supervisor(
            bundle,
            deployment=deployment,
            engine=engine,
            verify_limit=0,
            allow_livelock=True,
            only_shown=True,
            is_modular=asked.is_modular,
            should_stop=should_stop,
            on_progress=on_progress,
        )
        if made.status is OutcomeStatus.MODEL_ERRORS:
            return made
        if isinstance(made.explanation, EmptyExplanation):
            return problem, Explanation(made.explanation)
    words = ModelWords(problem.model, problem.places, problem.system.automata, deployment)
    explain_ = _in_modules if asked.is_modular else _explanation
    return problem, explain_(words, engine, asked, on_progress, should_stop)


def explained_system(
    words: SystemWords,
    engine: EngineOptions,
    asked: ExplanationSubject,
    on_progress: OnProgress = ignored,
    should_stop: ShouldStop = never,
) -> Explained:
    """Return the explanation of a synthesis of valid automata."""
    try:
        explanation = _explanation(words, engine, asked, on_progress, should_stop)
    except UnsupportedModelError as error:
        reason = str(error)
        return Explained(SynthesisStatus.UNSUPPORTED_MODEL, Findings(), reason, NoSupervisor(reason, ()))
    return Explained(_status(explanation), Findings(), "", explanation)


def _explained_automata(
    model: LoadedAutomata,
    options: SynthesisOptions,
    asked: ExplanationSubject,
    on_progress: OnProgress,
    should_stop: ShouldStop,
) -> Explained:
    found = checked_automata(model, options)
    diagnostics = Findings(found.diagnostics, model)
    if found.system is None:
        return Explained(SynthesisStatus.MODEL_ERRORS, diagnostics, "", NoSupervisor("", diagnostics))
    words = SystemWords(found.system, found.places)
    made = explained_system(words, options.engine_options(), asked, on_progress, should_stop)
    return replace(made, diagnostics=diagnostics)


def _explanation(
    words: ModelWords | SystemWords,
    engine: EngineOptions,
    asked: ExplanationSubject,
    on_progress: OnProgress,
    should_stop: ShouldStop,
) -> Explanation:
    return explain_synthesis(
        words,
        engine=engine,
        event=asked.event,
        state=asked.state,
        after=asked.after,
        should_stop=should_stop,
        on_progress=lambda step: on_progress(Progress("synthesis", str(step))),
    )


def _in_modules(
    words: ModelWords,
    engine: EngineOptions,
    asked: ExplanationSubject,
    on_progress: OnProgress,
    should_stop: ShouldStop,
) -> Explanation:
    """Return the explanation of a robot, module by module.

    Raises:
        RequestError: There is no such event.
    """
    from robosc.modular.robots import synthesize_robot

    event = None if asked.event is None else words.requests.event(asked.event)

    def report(step: object) -> None:
        on_progress(Progress("synthesis", str(step)))

    found = synthesize_robot(
        words.model,
        words.places,
        words.system,
        words.deployment,
        engine=engine,
        should_stop=should_stop,
        on_progress=report,
    )
    modules = [(part, ModelWords(part.model, part.places, part.system, words.deployment)) for part in found.parts]
    if found.modular.unsolved is not None:
        ((_, mine),) = modules
        empty = explain_empty(mine, engine=engine, should_stop=should_stop, on_progress=report)
        return Explanation(empty=empty)
    events: list[EventReport] = []
    remarks: dict[str, Remark] = {item.message: item for item in words.remarks(found.result.answers)}
    for part, mine in modules:
        if event is not None and event not in {item.name for item in part.system.events}:
            continue
        made = explain_synthesis(mine, engine=engine, event=event, should_stop=should_stop, on_progress=report)
        events += [replace_struct(item, module=part.components) for item in made.events]
        # The robot does not reach what a module never reaches.
        remarks |= {item.message: item for item in made.remarks if item.kind == "unreachable-state"}
    return Explanation(events=tuple(events), remarks=() if event is not None else tuple(remarks.values()))
