"""The check of supervisors that are too large to be searched state by state, on decision diagrams.

Written from the automata alone and built otherwise than synthesis: each event is one relation between the state
before and the state after it, in an order of its own: small expressions are gone through value by value, and integers
with many values are linear forms by cases. Only the library of decision diagrams is the same.
"""

from robosc.verification.symbolic.check import DEFAULT_WORK, verify_symbolically

__all__ = ["DEFAULT_WORK", "verify_symbolically"]
