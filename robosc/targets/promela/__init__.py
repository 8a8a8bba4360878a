"""The target `promela`."""

from robosc.targets.promela.model import promela_model
from robosc.targets.promela.package import generate
from robosc.targets.registry import Target, TargetInfo

TARGET = Target(TargetInfo("promela", "the controlled system as a model for the model checker spin"), generate)

__all__ = ["TARGET", "promela_model"]
