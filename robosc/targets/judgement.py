"""Outcome as a target sees it: some warnings of the check are errors for whoever generates (language A.7, B.11)."""

from dataclasses import replace

from robosc.errors import Severity
from robosc.supervisor.make import OutcomeStatus, SynthesisOutcome
from robosc.targets.registry import errors_for


def judged_for(made: SynthesisOutcome, target: str) -> SynthesisOutcome:
    """The outcome of `make_supervisor` with a target's own errors; without a supervisor where there are any.

    Raises:
        UnknownTargetError: There is no such target.
    """
    codes = errors_for(target)
    if not any(item.code in codes for item in made.diagnostics):
        return made
    diagnostics = tuple(
        replace(item, severity=Severity.ERROR) if item.code in codes else item for item in made.diagnostics
    )
    return replace(made, status=OutcomeStatus.MODEL_ERRORS, supervisor=None, diagnostics=diagnostics)
