"""Independent judgement of a synthesized supervisor.

Shares nothing with synthesis but the automata and their explicit meaning (an import contract says so).
"""

from robosc.verification.explicit import ExplicitSupervisor, synthesize_explicit
from robosc.verification.verify import Failure, Outcome, Verification, verify

__all__ = ["ExplicitSupervisor", "Failure", "Outcome", "Verification", "synthesize_explicit", "verify"]
