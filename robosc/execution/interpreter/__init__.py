"""The reference implementation of `ControlledSystem`, rather simple than fast, and one for robots of many parts."""

from robosc.execution.interpreter.description import describe
from robosc.execution.interpreter.system import InterpretedSystem
from robosc.execution.interpreter.watching import WatchingSystem

__all__ = ["InterpretedSystem", "WatchingSystem", "describe"]
