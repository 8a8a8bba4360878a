"""The checked model: what a robot is once every name is bound and every type is known."""

from robosc.model.check import Checked, check
from robosc.model.places import Places

__all__ = ["Checked", "Places", "check"]
