"""
A controller that takes in messages from before its start.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from typing import Any

from robosc.execution.runtime.executor import Executor
from robosc.targets.ros.runtime.startup import StartupBufferingRunner


class StartupBufferingExecutor(StartupBufferingRunner, Executor):
    """
    The executor of a controller that starts with what came before.

    Nothing is decided before the last of it.
    """

    def _take_in(self, messages: list[tuple[str, Any, float]]) -> None:
        decides = self._decides_after_batch
        self._decides_after_batch = False
        super()._take_in(messages)
        self._decides_after_batch = decides
