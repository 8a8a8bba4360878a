"""The check of supervisors that are too large to be searched state by state, on decision diagrams.

Written from the automata alone and built otherwise than synthesis: each event is one relation between the state
before and the state after it, found by going through the values of small expressions, in an order of its own. Only
the library of decision diagrams is the same.
"""

from robosc.verification.symbolic.check import DEFAULT_WORK, verify_symbolically

__all__ = ["DEFAULT_WORK", "verify_symbolically"]
