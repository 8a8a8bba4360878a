"""Independent verification of a supervisor.

It shares with synthesis only the automata and their explicit semantics; an import contract checks this.
"""

from robosc.verification.explicit_check import CheckOutcome, Failure, Verification, verify_explicitly
from robosc.verification.explicit_synthesis import ExplicitSupervisor, synthesize_explicit
from robosc.verification.modules import ModulesVerification, verify_modules
from robosc.verification.verify import DEFAULT_STATES, Limits, VerificationReport, verify

__all__ = [
    "DEFAULT_STATES",
    "CheckOutcome",
    "ExplicitSupervisor",
    "Failure",
    "Limits",
    "ModulesVerification",
    "Verification",
    "VerificationReport",
    "synthesize_explicit",
    "verify",
    "verify_explicitly",
    "verify_modules",
]
