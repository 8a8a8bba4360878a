"""The certificate: the result of the independent verifier for a supervisor that has just been synthesized."""

from collections import Counter
from collections.abc import Callable

from robosc._version import __version__
from robosc.automata.semantics import Semantics
from robosc.errors import InternalError
from robosc.model.structure import Deployment
from robosc.source import Bundle
from robosc.supervisor import Certificate, CheckResult
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import SynthesisResult
from robosc.verification import CheckOutcome, Limits, Verification, VerificationReport, verify


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

    def report_of(part: Semantics, made: SynthesisResult) -> VerificationReport:
        report = verify(
            part.system,
            state_predicates(part.system, made.added),
            limits,
            expected_states=made.statistics.states,
            engine=made.statistics.engine,
            semantics=part,
            should_stop=should_stop,
            on_progress=on_progress,
        )
        found = report.verification
        if found.failures or found.states not in (None, made.statistics.states):
            raise InternalError(
                f"the verifier refuses the supervisor: {found.message or 'another number of states'}"
                + (f" after {', '.join(found.trace)}" if found.trace else "")
            )
        return report

    if result.parts:
        report = _together([report_of(Semantics(part), made) for part, made in result.parts])
    else:
        report = report_of(semantics, result)
    found = report.verification
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


def _together(reports: list[VerificationReport]) -> VerificationReport:
    """The report of independent parts: the whole has a property if each of them has it."""
    found = [report.verification for report in reports]

    def all_of(outcomes: list[CheckOutcome]) -> CheckOutcome:
        return CheckOutcome.PASSED if set(outcomes) == {CheckOutcome.PASSED} else CheckOutcome.NOT_CHECKED

    states: int | None = 1
    transitions: int | None = 0
    for item in found:
        if states is None or item.states is None:
            states = transitions = None
            continue
        if transitions is not None:
            transitions = None if item.transitions is None else transitions * item.states + item.transitions * states
        states *= item.states
    methods = Counter(report.method for report in reports)
    method = "; ".join(f"{count} independent parts each by: {text}" for text, count in methods.items())
    verification = Verification(
        states,
        transitions,
        all_of([item.safe for item in found]),
        all_of([item.controllable for item in found]),
        all_of([item.nonblocking for item in found]),
        all_of([item.maximally_permissive for item in found]),
    )
    return VerificationReport(verification, method)


def _result(outcome: CheckOutcome) -> CheckResult:
    return "passed" if outcome is CheckOutcome.PASSED else "not checked"
