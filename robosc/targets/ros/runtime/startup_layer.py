"""
A supervision layer that takes in messages from before its start.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from robosc.execution.runtime.layer import Layer
from robosc.targets.ros.runtime.startup import StartupBufferingRunner


class StartupBufferingLayer(StartupBufferingRunner, Layer):
    """A supervision layer that starts with what came before, and passes it on then."""
