"""The target `c99`."""

from robosc.targets.c99 import automata
from robosc.targets.code.c.package import generate
from robosc.targets.registry import Target, TargetInfo

TARGET = Target(
    TargetInfo("c99", "the supervisor and its executor as portable C99 without allocation"),
    generate,
    generate_automata=automata.generate,
)

__all__ = ["TARGET"]
