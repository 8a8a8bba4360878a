"""The way from a problem to a certified supervisor, and the verification of a supervisor's file."""

from robosc.certification.pipeline import (
    OutcomeStatus,
    Progress,
    SynthesisOutcome,
    SynthesisProblem,
    make_supervisor,
    prepare,
)

__all__ = [
    "OutcomeStatus",
    "Progress",
    "SynthesisOutcome",
    "SynthesisProblem",
    "make_supervisor",
    "prepare",
]
