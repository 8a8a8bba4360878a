"""
Outcomes of service calls and goals for the executor, and goals that were reported lost.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

from robosc.execution.runtime.runner import Runner


class Reports:
    """Outcomes of calls and goals, kept until they may be reported to the executor."""

    def __init__(self) -> None:
        self._waiting: deque[Callable[[Runner], None]] = deque()

    def add(self, report: Callable[[Runner], None]) -> None:
        """Keep a report for the executor."""
        self._waiting.append(report)

    def deliver(self, executor: Runner) -> bool:
        """
        Deliver what was kept until now; what that brings about waits for the next time.

        Return True if there was anything.
        """
        count = len(self._waiting)
        for _ in range(count):
            self._waiting.popleft()(executor)
        return count > 0


class AbandonedGoal:
    """
    A goal that was reported lost although it may be running.

    :ivar handle: Handle by which its client refers to it.
    :ivar is_served: True if its server may be there, and has only not been heard of.
    :ivar is_asked: True if its cancel was asked for since its server was seen.
    """

    __slots__ = ('handle', 'is_asked', 'is_served')

    def __init__(self, handle: Any, is_served: bool = False) -> None:
        self.handle = handle
        self.is_served = is_served
        self.is_asked = False
