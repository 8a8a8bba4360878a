"""The target `cif`: the synthesis problem and the controlled system for the tools of Eclipse ESCET."""

from robosc.targets.cif.generate import generate
from robosc.targets.registry import Target, TargetInfo

TARGET = Target(
    TargetInfo("cif", "the synthesis problem and the controlled system in CIF, for Eclipse ESCET"), generate
)

__all__ = ["TARGET"]
