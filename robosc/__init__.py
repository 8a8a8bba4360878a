"""RoboSC: supervisory controllers for robots, correct by construction.

Pipeline, one way: text -> syntax tree (`robosc.language`) -> checked model (`robosc.model`) ->
automata (`robosc.automata`) -> symbolic supervisor (`robosc.synthesis`, `robosc.supervisor`) ->
execution and targets (`robosc.execution`, `robosc.targets`).
"""

from robosc._version import __version__

__all__ = ["__version__"]
