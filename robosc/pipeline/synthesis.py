"""Synthesis of supervisors for models and for automata."""

from dataclasses import dataclass
from typing import overload

from robosc.automata import System
from robosc.certification import SynthesisOutcome, make_supervisor
from robosc.certification.goals import GoalExplanation
from robosc.certification.progress import OnProgress, ShouldStop, ignored, never
from robosc.errors import UnsupportedModelError
from robosc.explanation import EmptyExplanation
from robosc.model.check import check
from robosc.pipeline.automata_models import automata_synthesis
from robosc.pipeline.findings import Findings
from robosc.pipeline.loading import LoadedAutomata, LoadedModel, ModelLike, loaded
from robosc.pipeline.options import DEFAULT_OPTIONS, SynthesisOptions
from robosc.pipeline.results import NoSupervisor, Outcome, Summary, SynthesisStatus
from robosc.pipeline.supervisors import Supervisor
from robosc.pipeline.systems import SystemSynthesis
from robosc.synthesis import Statistics
from robosc.verification import DEFAULT_STATES


@dataclass(frozen=True, slots=True, repr=False)
class Synthesis(Outcome):
    """Result of a synthesis.

    Attributes:
        status: Outcome of the synthesis.
        diagnostics: Every finding about the model, sorted by place.
        reason: Reason why there is no supervisor, in one sentence; empty if there is one, or if the findings are the
            reason.
        supervisor: The supervisor, or None.
        statistics: Figures of the work, or None if there was no synthesis.
        explanation: Explanation of why there is no supervisor; None if there is one.
    """

    status: SynthesisStatus
    diagnostics: Findings
    reason: str
    supervisor: Supervisor | None
    statistics: Statistics | None = None
    explanation: EmptyExplanation | GoalExplanation | NoSupervisor | None = None

    @property
    def summary(self) -> Summary | None:
        """The supervisor in figures and words, or None if there is no supervisor."""
        return None if self.supervisor is None else self.supervisor.summary

    def _product(self) -> object:
        return self.supervisor


# Automata in a file are a kind of model that gives another result.
@overload
def synthesize(  # type: ignore[overload-overlap]
    model: System | LoadedAutomata,
    options: SynthesisOptions = DEFAULT_OPTIONS,
    *,
    is_modular: bool = False,
    on_progress: OnProgress = ignored,
    should_stop: ShouldStop = never,
) -> SystemSynthesis: ...


@overload
def synthesize(
    model: ModelLike,
    options: SynthesisOptions = DEFAULT_OPTIONS,
    *,
    is_modular: bool = False,
    on_progress: OnProgress = ignored,
    should_stop: ShouldStop = never,
) -> Synthesis: ...


def synthesize(
    model: ModelLike | System,
    options: SynthesisOptions = DEFAULT_OPTIONS,
    *,
    is_modular: bool = False,
    on_progress: OnProgress = ignored,
    should_stop: ShouldStop = never,
) -> Synthesis | SystemSynthesis:
    """Synthesize, verify and certify the supervisor of a model, or synthesize the supervisor of automata.

    Args:
        model: The model, as `load` returns it, the path of its file, or a `robosc.automata.System`.
        options: Options for making the supervisor; for automata only those about the engine.
        is_modular: True for a synthesis in modules: for robots and systems of many parts, of which each requirement is
            about few.
        on_progress: Function called with the progress of the work.
        should_stop: Function called again and again; once it returns true, the work ends.

    Raises:
        ValueError: An option is for models of robots, and the file holds automata.
        FileAccessError: The file does not exist or cannot be read.
        LanguageError: A file is too large or not UTF-8.
        InvalidSystemError: The automata do not fit together.
        NodeLimitError: Decision diagrams became larger than the options allow.
        UnknownEngineError: There is no such engine.
        SynthesisCancelled: `should_stop` became true.
    """
    bundle = model if isinstance(model, System) else loaded(model)
    if isinstance(bundle, System | LoadedAutomata):
        return automata_synthesis(bundle, options, on_progress, should_stop, is_modular=is_modular)
    attempt = make(
        bundle, options, on_progress, should_stop, allow_livelock=options.allow_livelock, is_modular=is_modular
    )
    return _result(attempt, bundle)


@dataclass(frozen=True, slots=True)
class Unsupported:
    """Outcome for a model that is correct, but not supported.

    The error itself is not kept: its frames would hold predicates of an engine that has ended.

    Attributes:
        reason: Reason why it is not supported.
    """

    reason: str


type Attempt = SynthesisOutcome | Unsupported


def make(
    bundle: LoadedModel,
    options: SynthesisOptions,
    on_progress: OnProgress,
    should_stop: ShouldStop,
    *,
    allow_livelock: bool,
    only_shown: bool = False,
    is_modular: bool = False,
) -> Attempt:
    """Make a supervisor with some options."""
    states = options.verified_states
    try:
        return make_supervisor(
            bundle,
            deployment=options.deployment,
            engine=options.engine_options(),
            verify_limit=DEFAULT_STATES if states is None else states,
            allow_livelock=allow_livelock,
            only_shown=only_shown,
            is_modular=is_modular,
            should_stop=should_stop,
            on_progress=on_progress,
        )
    except UnsupportedModelError as error:
        return Unsupported(str(error))


def findings_of(attempt: Attempt, bundle: LoadedModel) -> Findings:
    """Return the findings about the model of an attempted synthesis."""
    found = attempt if isinstance(attempt, SynthesisOutcome) else check(bundle)
    return Findings(found.diagnostics, bundle, found.accepted)


def status_of(attempt: Attempt) -> tuple[SynthesisStatus, str]:
    """Return the status of an attempted synthesis, and the reason why there is no supervisor."""
    if isinstance(attempt, SynthesisOutcome):
        return SynthesisStatus(str(attempt.status)), attempt.reason
    return SynthesisStatus.UNSUPPORTED_MODEL, attempt.reason


def why_not(attempt: Attempt, diagnostics: Findings) -> EmptyExplanation | GoalExplanation | NoSupervisor:
    """Return the explanation of why an attempted synthesis has no supervisor."""
    if isinstance(attempt, SynthesisOutcome) and attempt.explanation is not None:
        return attempt.explanation
    _, reason = status_of(attempt)
    return NoSupervisor(reason, diagnostics)


def _result(attempt: Attempt, bundle: LoadedModel) -> Synthesis:
    diagnostics = findings_of(attempt, bundle)
    status, reason = status_of(attempt)
    if isinstance(attempt, SynthesisOutcome) and attempt.supervisor is not None:
        supervisor = Supervisor.of(attempt.supervisor, diagnostics)
        return Synthesis(status, diagnostics, reason, supervisor, attempt.statistics)
    statistics = attempt.statistics if isinstance(attempt, SynthesisOutcome) else None
    return Synthesis(status, diagnostics, reason, None, statistics, why_not(attempt, diagnostics))
