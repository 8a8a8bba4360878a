"""The supervisor as a value: its conditions and certificate, how it is written and read, and what makes it valid."""

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
