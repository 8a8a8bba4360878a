"""Independent judgement of a supervisor.

Shares nothing with synthesis but the automata and their explicit meaning (an import contract says so).
"""

from robosc.verification.explicit import ExplicitSupervisor, synthesize_explicit
from robosc.verification.judge import DEFAULT_STATES, Judgement, Limits, judge
from robosc.verification.verify import Failure, Outcome, Verification, verify

__all__ = [
    "DEFAULT_STATES",
    "ExplicitSupervisor",
    "Failure",
    "Judgement",
    "Limits",
    "Outcome",
    "Verification",
    "judge",
    "synthesize_explicit",
    "verify",
]
