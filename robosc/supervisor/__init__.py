"""The supervisor as a value: how it is made, written, read, checked and summed up.

The names are imported on use, so that a reader of a supervisor file does not load the synthesizer.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from robosc.supervisor.codec import decode, encode
    from robosc.supervisor.make import (
        OutcomeStatus,
        Progress,
        SynthesisOutcome,
        SynthesisProblem,
        make_supervisor,
        prepare,
    )
    from robosc.supervisor.structure import (
        AddedCondition,
        Certificate,
        DecisionDiagram,
        DecisionNode,
        Supervisor,
    )
    from robosc.supervisor.summary import summary_json, summary_text

_HOMES = {
    "AddedCondition": "structure",
    "Certificate": "structure",
    "DecisionDiagram": "structure",
    "DecisionNode": "structure",
    "SynthesisOutcome": "make",
    "OutcomeStatus": "make",
    "SynthesisProblem": "make",
    "Progress": "make",
    "Supervisor": "structure",
    "decode": "codec",
    "encode": "codec",
    "make_supervisor": "make",
    "prepare": "make",
    "summary_json": "summary",
    "summary_text": "summary",
}

__all__ = [
    "AddedCondition",
    "Certificate",
    "DecisionDiagram",
    "DecisionNode",
    "OutcomeStatus",
    "Progress",
    "Supervisor",
    "SynthesisOutcome",
    "SynthesisProblem",
    "decode",
    "encode",
    "make_supervisor",
    "prepare",
    "summary_json",
    "summary_text",
]


def __getattr__(name: str) -> Any:
    """Import a public name from its module on first use."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
