"""The target `python`."""

from robosc.targets.code.python.package import generate
from robosc.targets.python import automata
from robosc.targets.registry import Target, TargetInfo

TARGET = Target(
    TargetInfo("python", "the supervisor and its executor as one Python file without any dependency"),
    generate,
    generate_automata=automata.generate,
)

__all__ = ["TARGET"]
