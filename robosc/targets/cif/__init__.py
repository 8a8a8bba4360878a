"""The target `cif`: the synthesis problem and the controlled system for the tools of Eclipse ESCET."""

from robosc.targets.cif.automata import generate as generate_automata
from robosc.targets.cif.generate import generate
from robosc.targets.registry import Target, TargetInfo

TARGET = Target(
    TargetInfo("cif", "the synthesis problem and the controlled system in CIF, for Eclipse ESCET"),
    generate,
    generate_automata=generate_automata,
)

__all__ = ["TARGET"]
