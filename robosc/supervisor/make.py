"""From a bundle of texts to a certified supervisor: the whole pipeline in one call.

Every door to the product (command line, service, tests) goes through `make_supervisor`, so the same
bundle gives the same supervisor wherever it is made.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from robosc.automata import to_automata
from robosc.errors import Diagnostic, sorted_diagnostics
from robosc.model import check
from robosc.model.layers import layer_findings
from robosc.model.structure import Deployment
from robosc.source import Bundle
from robosc.supervisor.certify import certify
from robosc.supervisor.structure import Supervisor
from robosc.synthesis import Progress as SynthesisProgress
from robosc.synthesis import Statistics, SynthesisStatus, findings, questions_about, synthesize
from robosc.verification import DEFAULT_STATES, Limits


class MadeStatus(StrEnum):
    """How an attempt to make a supervisor ended."""

    SUPERVISOR = "supervisor"
    EMPTY = "empty"
    """No supervisor exists: a result about the model, not a fault."""
    MODEL_ERRORS = "model errors"


@dataclass(frozen=True, slots=True)
class Progress:
    """Where long work is.

    Attributes:
        stage: `check`, `synthesis` or `verification`.
        message: One short line.
    """

    stage: str
    message: str


@dataclass(frozen=True, slots=True)
class Made:
    """The outcome of `make_supervisor`.

    Attributes:
        status: How it ended.
        supervisor: The supervisor, or None.
        diagnostics: Every finding about the model, sorted by place; with a supervisor, also what only synthesis
            can tell.
        statistics: Figures of the synthesis, or None where there was none.
        reason: Why there is no supervisor, in one sentence; empty where there is one.
    """

    status: MadeStatus
    supervisor: Supervisor | None
    diagnostics: tuple[Diagnostic, ...]
    statistics: Statistics | None = None
    reason: str = ""


def make_supervisor(
    bundle: Bundle,
    *,
    deployment: Deployment = Deployment.CONTROLLER,
    engine: str = "auto",
    verify_limit: int = DEFAULT_STATES,
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[Progress], None] = lambda progress: None,
) -> Made:
    """Check a bundle, synthesize its supervisor, verify it independently and certify it.

    Args:
        bundle: The model and its libraries.
        deployment: Where the supervisor will stand.
        engine: Name of the engine for decision diagrams.
        verify_limit: States up to which the independent verifier searches one by one; see `Limits.of`.
        should_stop: Asked again and again; once true, the work ends.
        on_progress: Told where the work is.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        UnsupportedModelError: The model is outside what synthesis handles.
        InternalError: The verifier found fault with the result.
    """
    on_progress(Progress("check", bundle.main.name))
    checked = check(bundle)
    if checked.model is None or checked.places is None:
        reason = "" if checked.has_errors else "a library has no robot to make a supervisor for"
        return Made(MadeStatus.MODEL_ERRORS, None, checked.diagnostics, reason=reason)
    if deployment is Deployment.LAYER:
        ambiguous = layer_findings(checked.model, checked.places)
        if ambiguous:
            return Made(MadeStatus.MODEL_ERRORS, None, sorted_diagnostics((*checked.diagnostics, *ambiguous)))
    system = to_automata(checked.model, deployment)

    def report(progress: SynthesisProgress) -> None:
        on_progress(Progress("synthesis", str(progress)))

    result = synthesize(
        system,
        engine=engine,
        questions=questions_about(checked.model, system, deployment),
        should_stop=should_stop,
        on_progress=report,
    )
    if result.status is SynthesisStatus.EMPTY:
        reason = f"no supervisor exists: {result.reason}"
        return Made(MadeStatus.EMPTY, None, checked.diagnostics, result.statistics, reason)
    on_progress(Progress("verification", f"{result.statistics.states} states"))
    certificate = certify(
        system,
        result,
        bundle,
        deployment,
        Limits.of(verify_limit),
        should_stop=should_stop,
        on_progress=lambda message: on_progress(Progress("verification", message)),
    )
    supervisor = Supervisor(checked.model, deployment, result.added, certificate)
    diagnostics = sorted_diagnostics((*checked.diagnostics, *findings(checked.model, checked.places, result.answers)))
    return Made(MadeStatus.SUPERVISOR, supervisor, diagnostics, result.statistics)
