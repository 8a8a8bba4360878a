"""Findings for editors, which show only findings, about results that the command line prints as text."""

from robosc.errors import Diagnostic, Severity
from robosc.source import Location


def no_supervisor(reason: str, place: Location) -> Diagnostic:
    """The finding that a robot has no supervisor.

    Args:
        reason: Reason in one sentence.
        place: Place of the robot's name.
    """
    fix = "Run 'robosc synth': it shows what is to blame."
    return Diagnostic(Severity.WARNING, "no-supervisor", reason.rstrip("."), place, fix)


__all__ = ["no_supervisor"]
