"""The supervisor as a value: its conditions and certificate, how it is written and read, and what makes it valid."""

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
    Supervisor,
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
    "Supervisor",
    "decode",
    "encode",
]
