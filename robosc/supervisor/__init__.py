"""The supervisor as a value: its conditions and certificate, writing and reading of its file, and validation."""

from robosc.supervisor.codec import decode, encode
from robosc.supervisor.structure import (
    AddedCondition,
    Certificate,
    CheckResult,
    Choice,
    ControllerProperties,
    DecisionDiagram,
    DecisionNode,
    PropertyResult,
    Strategy,
    SupervisedModule,
    Supervisor,
    certified_states,
)

__all__ = [
    "AddedCondition",
    "Certificate",
    "CheckResult",
    "Choice",
    "ControllerProperties",
    "DecisionDiagram",
    "DecisionNode",
    "PropertyResult",
    "Strategy",
    "SupervisedModule",
    "Supervisor",
    "certified_states",
    "decode",
    "encode",
]
