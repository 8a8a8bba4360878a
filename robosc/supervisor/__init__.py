"""The supervisor as a value: its conditions and certificate, writing and reading of its file, and validation."""

from robosc.supervisor.codec import decode, encode
from robosc.supervisor.structure import (
    AddedCondition,
    Certificate,
    CheckResult,
    ControllerProperties,
    DecisionDiagram,
    DecisionNode,
    PropertyResult,
    Supervisor,
)

__all__ = [
    "AddedCondition",
    "Certificate",
    "CheckResult",
    "ControllerProperties",
    "DecisionDiagram",
    "DecisionNode",
    "PropertyResult",
    "Supervisor",
    "decode",
    "encode",
]
