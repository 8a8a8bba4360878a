"""The certificate: the result of the independent verifier for a supervisor that has just been synthesized."""

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence

from msgspec.structs import replace

from robosc._version import __version__
from robosc.automata.decision import Decision
from robosc.automata.semantics import Semantics
from robosc.automata.structure import System
from robosc.errors import InternalError
from robosc.model.structure import Deployment
from robosc.source import Bundle
from robosc.supervisor import Certificate, CheckResult
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import SynthesisResult
from robosc.verification import CheckOutcome, Limits, Verification, VerificationReport, verify, verify_modules


def certify(
    semantics: Semantics,
    result: SynthesisResult,
    bundle: Bundle,
    deployment: Deployment,
    limits: Limits,
    *,
    modules: Sequence[Collection[str]] = (),
    expected_states: int = 0,
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
        modules: Names of the automata of each module, for a modular synthesis.
        expected_states: States that the system has at most, where the result does not count them.
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
            expected_states=made.statistics.states or expected_states,
            engine=made.statistics.engine,
            semantics=part,
            should_stop=should_stop,
            on_progress=on_progress,
        )
        found = report.verification
        counted = {None, made.statistics.states} if made.statistics.states else {found.states}
        if found.failures or found.states not in counted:
            raise InternalError(
                f"the verifier refuses the supervisor: {found.message or 'another number of states'}"
                + (f" after {', '.join(found.trace)}" if found.trace else "")
            )
        return report

    if result.parts:
        report = _together([report_of(Semantics(part), made) for part, made in result.parts])
    else:
        report = report_of(semantics, result)
    if modules and not result.parts:
        added = state_predicates(semantics.system, result.added)
        report = with_modules(report, semantics.system, added, modules, limits, should_stop=should_stop)
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
        states=str(result.statistics.states or found.states or 0),
        transitions=None if found.transitions is None else str(found.transitions),
    )


def with_modules(
    report: VerificationReport,
    system: System,
    added: Mapping[str, Decision],
    modules: Sequence[Collection[str]],
    limits: Limits,
    *,
    should_stop: Callable[[], bool] = lambda: False,
) -> VerificationReport:
    """Return a report with what modules show of what was not checked of the whole.

    Args:
        report: Report on the whole system.
        system: Plants and event conditions.
        added: For each event to which the supervisor adds a condition, that condition.
        modules: Names of the automata of each module.
        limits: Limits of the check.
        should_stop: Function called now and then; once it returns true, the work ends.

    Raises:
        SynthesisCancelled: `should_stop` became true.
    """
    found = report.verification
    open_ = CheckOutcome.NOT_CHECKED
    if found.failures or open_ not in (found.safe, found.maximally_permissive):
        return report
    shown = verify_modules(system, added, modules, limit=limits.recomputed, should_stop=should_stop)
    free = {event.name for event in system.events if not event.is_controllable}
    # A supervisor that adds nothing to uncontrollable events disables none.
    controllable = open_ if free.intersection(added) else CheckOutcome.PASSED
    verification = replace(
        found,
        safe=shown.safe if found.safe is open_ else found.safe,
        controllable=controllable if found.controllable is open_ else found.controllable,
        maximally_permissive=(
            shown.maximally_permissive if found.maximally_permissive is open_ else found.maximally_permissive
        ),
    )
    method = report.method.removesuffix("; permissiveness not recomputed")
    return VerificationReport(verification, f"{method}; {shown.method}")


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
