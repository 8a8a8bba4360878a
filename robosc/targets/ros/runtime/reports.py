"""
Outcomes of service calls and goals, on their way to the executor.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

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
        Tell what was kept until now; what that brings about waits for the next time.

        Whether there was anything.
        """
        count = len(self._waiting)
        for _ in range(count):
            self._waiting.popleft()(executor)
        return count > 0
