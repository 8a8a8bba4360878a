"""From a bundle of texts to a certified supervisor: the whole pipeline in one call.

Every door to the product (command line, service, tests) goes through `make_supervisor`, so the same
bundle gives the same supervisor wherever it is made.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import msgspec

from robosc._version import __version__
from robosc.automata import System, to_automata
from robosc.automata.controlled import TRANSITIONS_PER_STATE
from robosc.errors import Diagnostic, InternalError, sorted_diagnostics
from robosc.model import check
from robosc.model.layers import layer_findings
from robosc.model.structure import Deployment
from robosc.properties import check_controller, controller_findings
from robosc.source import Bundle
from robosc.supervisor.conditions import state_predicates
from robosc.supervisor.structure import Certificate, CheckResult, Supervisor
from robosc.synthesis import Progress as SynthesisProgress
from robosc.synthesis import Statistics, SynthesisResult, SynthesisStatus, findings, questions_about, synthesize
from robosc.verification import verify

VERIFICATION_LIMIT = 50_000
"""States up to which the explicit verifier searches; beyond, the certificate says 'not checked'."""

PERMISSIVENESS_LIMIT = 20_000
"""States of the uncontrolled system up to which permissiveness is checked by recomputing explicitly."""


LIVELOCK_REASON = "no supervisor is made, because silent steps never end (--allow-livelock overrides this)"


class MadeStatus(StrEnum):
    """How an attempt to make a supervisor ended."""

    SUPERVISOR = "supervisor"
    EMPTY = "empty"
    """No supervisor exists: a result about the model, not a fault."""
    MODEL_ERRORS = "model errors"
    """The model has errors, one that only synthesis can tell included: silent steps that never end."""


@dataclass(frozen=True, slots=True)
class Progress:
    """Where long work is.

    Attributes:
        stage: `check`, `synthesis`, `verification` or `controller`.
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
    allow_livelock: bool = False,
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[Progress], None] = lambda progress: None,
) -> Made:
    """Check a bundle, synthesize its supervisor, verify it independently and certify it.

    Args:
        bundle: The model and its libraries.
        deployment: Where the supervisor will stand.
        engine: Name of the engine for decision diagrams.
        allow_livelock: Whether a supervisor is made even if silent steps of its executor never end.
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
    certificate = _certify(system, result, bundle, deployment, should_stop)
    on_progress(Progress("controller", "finite response, confluence, nonblocking under control"))
    properties = check_controller(
        checked.model,
        deployment,
        result.added,
        is_nonblocking=certificate.nonblocking == "passed",
        states=result.statistics.states,
        should_stop=should_stop,
    )
    diagnostics = sorted_diagnostics(
        (
            *checked.diagnostics,
            *findings(checked.model, checked.places, result.answers),
            *controller_findings(checked.model, system, checked.places, properties, allow_livelock=allow_livelock),
        )
    )
    if properties.livelock is not None and not allow_livelock:
        return Made(MadeStatus.MODEL_ERRORS, None, diagnostics, result.statistics, LIVELOCK_REASON)
    certificate = msgspec.structs.replace(certificate, controller=properties.certified())
    supervisor = Supervisor(checked.model, deployment, result.added, certificate)
    return Made(MadeStatus.SUPERVISOR, supervisor, diagnostics, result.statistics)


def _certify(
    system: System,
    result: SynthesisResult,
    bundle: Bundle,
    deployment: Deployment,
    should_stop: Callable[[], bool],
) -> Certificate:
    """Let the independent verifier judge the result; a fault it finds is ours."""
    if result.statistics.states > VERIFICATION_LIMIT:
        on_limit = f"not searched: more than {VERIFICATION_LIMIT} states"
        return _certificate(result, bundle, deployment, on_limit, ("not checked",) * 4, None)
    verification = verify(
        system,
        state_predicates(system, result.added),
        limit=VERIFICATION_LIMIT,
        permissive_limit=PERMISSIVENESS_LIMIT,
        should_stop=should_stop,
    )
    if verification.states is None:
        on_limit = (
            f"not searched: more than {TRANSITIONS_PER_STATE * VERIFICATION_LIMIT} transitions, or too many in one step"
        )
        return _certificate(result, bundle, deployment, on_limit, ("not checked",) * 4, None)
    outcomes = (
        verification.safe,
        verification.controllable,
        verification.nonblocking,
        verification.maximally_permissive,
    )
    if "failed" in outcomes or verification.states != result.statistics.states:
        raise InternalError(
            f"the verifier refuses the supervisor: {verification.message or 'another number of states'}"
            + (f" after {', '.join(verification.trace)}" if verification.trace else "")
        )
    recomputed = (
        f"permissiveness not recomputed: more than {PERMISSIVENESS_LIMIT} states, or "
        f"{TRANSITIONS_PER_STATE * PERMISSIVENESS_LIMIT} transitions"
        if verification.maximally_permissive == "not checked"
        else "permissiveness by explicit recomputation"
    )
    method = f"explicit forward search; {recomputed}"
    results = tuple[CheckResult, ...]("passed" if outcome == "passed" else "not checked" for outcome in outcomes)
    return _certificate(result, bundle, deployment, method, results, verification.transitions)


def _certificate(
    result: SynthesisResult,
    bundle: Bundle,
    deployment: Deployment,
    method: str,
    outcomes: tuple[CheckResult, ...],
    transitions: int | None,
) -> Certificate:
    safe, controllable, nonblocking, permissive = outcomes
    return Certificate(
        engine_version=__version__,
        bundle_sha256=bundle.digest,
        deployment=deployment,
        method=method,
        safe=safe,
        controllable=controllable,
        nonblocking=nonblocking,
        maximally_permissive=permissive,
        states=str(result.statistics.states),
        transitions=None if transitions is None else str(transitions),
    )
