"""The certificate: the result of the independent verifier for a supervisor that has just been synthesized."""

from collections.abc import Callable

from robosc._version import __version__
from robosc.automata.semantics import Semantics
from robosc.errors import InternalError
from robosc.model.structure import Deployment
from robosc.source import Bundle
from robosc.supervisor import Certificate, CheckResult
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import SynthesisResult
from robosc.verification import CheckOutcome, Limits, verify


def certify(
    semantics: Semantics,
    result: SynthesisResult,
    bundle: Bundle,
    deployment: Deployment,
    limits: Limits,
    *,
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[str], None] = lambda message: None,
) -> Certificate:
    """Let the independent verifier check the result; a fault it finds is an internal error.

    Args:
        semantics: Semantics of plants and event conditions.
        result: A supervisor of them.
        bundle: The texts that they were made from.
        deployment: Intended deployment of the supervisor.
        limits: Limits of the check.
        should_stop: Function called now and then; once it returns true, the work ends.
        on_progress: Function called now and then with the progress of the work, in one short line.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        InternalError: The verifier found fault with the result.
    """
    system = semantics.system
    report = verify(
        system,
        state_predicates(system, result.added),
        limits,
        expected_states=result.statistics.states,
        engine=result.statistics.engine,
        semantics=semantics,
        should_stop=should_stop,
        on_progress=on_progress,
    )
    found = report.verification
    if found.failures or found.states not in (None, result.statistics.states):
        raise InternalError(
            f"the verifier refuses the supervisor: {found.message or 'another number of states'}"
            + (f" after {', '.join(found.trace)}" if found.trace else "")
        )
    return Certificate(
        engine_version=__version__,
        bundle_sha256=bundle.digest,
        deployment=deployment,
        method=report.method,
        safe=_result(found.safe),
        controllable=_result(found.controllable),
        nonblocking=_result(found.nonblocking),
        maximally_permissive=_result(found.maximally_permissive),
        states=str(result.statistics.states),
        transitions=None if found.transitions is None else str(found.transitions),
    )


def _result(outcome: CheckOutcome) -> CheckResult:
    return "passed" if outcome is CheckOutcome.PASSED else "not checked"
