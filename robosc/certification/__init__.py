"""The way from a problem to a certified supervisor, and the verification of a supervisor's file.

The names are imported on use: a program that only reports progress does not load the check of models.
"""

from typing import TYPE_CHECKING

from robosc.named_on_use import named_on_use

if TYPE_CHECKING:
    from robosc.certification.pipeline import (
        OutcomeStatus,
        SynthesisOutcome,
        SynthesisProblem,
        make_supervisor,
        prepare,
    )
    from robosc.certification.progress import Progress

_HOMES = {
    "OutcomeStatus": "pipeline",
    "Progress": "progress",
    "SynthesisOutcome": "pipeline",
    "SynthesisProblem": "pipeline",
    "make_supervisor": "pipeline",
    "prepare": "pipeline",
}

__all__ = [
    "OutcomeStatus",
    "Progress",
    "SynthesisOutcome",
    "SynthesisProblem",
    "make_supervisor",
    "prepare",
]

if not TYPE_CHECKING:
    # A type checker knows the names from above, and is to find every other one wrong.
    __getattr__ = named_on_use(__name__, _HOMES)
