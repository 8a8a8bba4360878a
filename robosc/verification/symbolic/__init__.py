"""Check, on decision diagrams, of supervisors and strategies that are too large for a search state by state.

It is written from the automata alone, with other methods than synthesis. Each event is one relation between the state
before and the state after it, in a variable order of its own. Small expressions are evaluated for every value, and
integers with many values are linear forms by cases. Only the library of decision diagrams is the same.
"""

from robosc.verification.symbolic.check import DEFAULT_WORK, verify_symbolically
from robosc.verification.symbolic.closed_loop import Message, Occurrence
from robosc.verification.symbolic.strategies import (
    StrategyFault,
    StrategyVerification,
    verify_strategy_symbolically,
)

__all__ = [
    "DEFAULT_WORK",
    "Message",
    "Occurrence",
    "StrategyFault",
    "StrategyVerification",
    "verify_strategy_symbolically",
    "verify_symbolically",
]
