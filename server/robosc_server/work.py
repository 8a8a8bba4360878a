"""The work of the service, without any network: what a worker process is asked, does and answers.

A job and its outcome are plain values that travel between the server and its own worker processes.
"""

import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from robosc.errors import Diagnostic, LanguageError, UnsupportedModelError
from robosc.model.structure import Deployment
from robosc.source import Bundle

if TYPE_CHECKING:
    from robosc.supervisor import Made, Supervisor
    from robosc.synthesis import Statistics
    from robosc.targets import GenerateOptions

UNSUPPORTED_MODEL = "unsupported model"
"""The status of a correct model that cannot be handled; the other statuses are those of `MadeStatus`."""


@dataclass(frozen=True, slots=True)
class CheckJob:
    """Find everything that is wrong with a bundle."""

    bundle: Bundle


@dataclass(frozen=True, slots=True)
class SynthesizeJob:
    """Make the supervisor of a bundle; `engine` is a name or `auto`."""

    bundle: Bundle
    deployment: Deployment
    engine: str
    allow_livelock: bool = False


@dataclass(frozen=True, slots=True)
class GenerateJob:
    """Make the supervisor of a bundle and generate a target's files."""

    synthesis: SynthesizeJob
    target: str
    options: "GenerateOptions"


Job = CheckJob | SynthesizeJob | GenerateJob


@dataclass(frozen=True, slots=True)
class Report:
    """Where the work is."""

    stage: str
    message: str


@dataclass(frozen=True, slots=True)
class CheckOutcome:
    """What was found."""

    diagnostics: tuple[Diagnostic, ...]


@dataclass(frozen=True, slots=True)
class Figures:
    """A supervisor in figures and words.

    Attributes:
        controllable_events: Number of controllable events.
        uncontrollable_events: Number of uncontrollable events.
        states: Reachable controlled states, decimal.
        transitions: Transitions between them, decimal; empty where they were not counted.
        added: Event and condition, for each controllable event.
        text: The summary that `robosc synth` prints.
    """

    controllable_events: int
    uncontrollable_events: int
    states: str
    transitions: str
    added: tuple[tuple[str, str], ...]
    text: str


@dataclass(frozen=True, slots=True)
class SynthesizeOutcome:
    """How a synthesis ended.

    Attributes:
        status: A `MadeStatus` or `UNSUPPORTED_MODEL`.
        diagnostics: Every finding about the model.
        reason: Why there is no supervisor; empty where there is one.
        supervisor: The supervisor's file; empty where there is none.
        figures: The summary, or None where there is no supervisor.
        statistics: Figures of the work, or None where there was no synthesis.
        explanation: What is to blame that no supervisor exists, as JSON; else empty.
    """

    status: str
    diagnostics: tuple[Diagnostic, ...]
    reason: str = ""
    supervisor: bytes = b""
    figures: Figures | None = None
    statistics: "Statistics | None" = None
    explanation: str = ""


@dataclass(frozen=True, slots=True)
class GenerateOutcome:
    """What was generated: path, text and whether it is a program, for each file; none without a supervisor."""

    status: str
    diagnostics: tuple[Diagnostic, ...]
    reason: str = ""
    files: tuple[tuple[str, str, bool], ...] = ()
    explanation: str = ""


@dataclass(frozen=True, slots=True)
class Refused:
    """The request names something that is not there; one sentence."""

    message: str


@dataclass(frozen=True, slots=True)
class Failed:
    """A fault of ours, with its traceback for the log."""

    details: str


Outcome = CheckOutcome | SynthesizeOutcome | GenerateOutcome | Refused | Failed


def run_job(job: Job, on_report: Callable[[Report], None]) -> Outcome:
    """Do a job to its end; every exception becomes an outcome."""
    try:
        match job:
            case CheckJob():
                return _check(job)
            case SynthesizeJob():
                return _synthesize(job, on_report)
            case GenerateJob():
                return _generate(job, on_report)
    except Exception:  # The worker's border: whatever it was, the server logs it and lives on.
        return Failed(traceback.format_exc())


def _check(job: CheckJob) -> CheckOutcome:
    from robosc.model import check

    try:
        return CheckOutcome(check(job.bundle).diagnostics)
    except LanguageError as error:
        return CheckOutcome(error.diagnostics)


def _made(job: SynthesizeJob, on_report: Callable[[Report], None]) -> "Made | SynthesizeOutcome | Refused":
    """The attempt to make a supervisor, or the outcome where it ended early."""
    from robosc.supervisor.make import MadeStatus, make_supervisor
    from robosc.synthesis import UnknownEngineError

    try:
        return make_supervisor(
            job.bundle,
            deployment=job.deployment,
            engine=job.engine,
            allow_livelock=job.allow_livelock,
            on_progress=lambda progress: on_report(Report(progress.stage, progress.message)),
        )
    except LanguageError as error:
        return SynthesizeOutcome(str(MadeStatus.MODEL_ERRORS), error.diagnostics)
    except UnsupportedModelError as error:
        return SynthesizeOutcome(UNSUPPORTED_MODEL, (), str(error))
    except UnknownEngineError as error:
        return Refused(str(error))


def _synthesize(job: SynthesizeJob, on_report: Callable[[Report], None]) -> SynthesizeOutcome | Refused:
    from robosc.supervisor.codec import encode

    made = _made(job, on_report)
    if isinstance(made, SynthesizeOutcome | Refused):
        return made
    if made.supervisor is None:
        return SynthesizeOutcome(
            str(made.status),
            made.diagnostics,
            made.reason,
            statistics=made.statistics,
            explanation=_explanation(made),
        )
    try:
        content = encode(made.supervisor)
    except UnsupportedModelError as error:
        return SynthesizeOutcome(UNSUPPORTED_MODEL, made.diagnostics, str(error))
    figures = _figures(made.supervisor)
    return SynthesizeOutcome(str(made.status), made.diagnostics, "", content, figures, made.statistics)


def _explanation(made: "Made") -> str:
    from robosc.explanation import to_text

    return to_text(made.explanation) if made.explanation else ""


def _figures(supervisor: "Supervisor") -> Figures:
    from robosc.automata import to_automata
    from robosc.supervisor.summary import added_texts, summary_text

    system = to_automata(supervisor.model, supervisor.deployment)
    controllable = sum(event.is_controllable for event in system.events)
    return Figures(
        controllable_events=controllable,
        uncontrollable_events=len(system.events) - controllable,
        states=supervisor.certificate.states,
        transitions=supervisor.certificate.transitions or "",
        added=tuple(added_texts(supervisor, system).items()),
        text=summary_text(supervisor),
    )


def _generate(job: GenerateJob, on_report: Callable[[Report], None]) -> GenerateOutcome | Refused:
    from robosc.targets import UnknownTargetError, generated, require_generatable

    try:
        require_generatable(job.target)
    except UnknownTargetError as error:
        return Refused(str(error))
    made = _made(job.synthesis, on_report)
    if isinstance(made, Refused):
        return made
    if isinstance(made, SynthesizeOutcome):
        return GenerateOutcome(str(made.status), made.diagnostics, made.reason)
    try:
        made, files = generated(made, job.target, job.options)
    except UnsupportedModelError as error:
        return GenerateOutcome(UNSUPPORTED_MODEL, made.diagnostics, str(error))
    if files is None:
        return GenerateOutcome(str(made.status), made.diagnostics, made.reason, explanation=_explanation(made))
    listing = tuple((path, text, path in files.executables) for path, text in files.items())
    return GenerateOutcome(str(made.status), made.diagnostics, "", listing)
