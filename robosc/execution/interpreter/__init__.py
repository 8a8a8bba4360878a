"""The reference implementation of `ControlledSystem`: it interprets a supervisor, and is simple rather than fast."""

from robosc.execution.interpreter.description import describe
from robosc.execution.interpreter.system import InterpretedSystem

__all__ = ["InterpretedSystem", "describe"]
