"""Pace at which somebody receives reports of the progress."""

from collections.abc import Callable

from robosc_server.clock import monotonic
from robosc_server.tasks.task import Report

PAUSE_S = 0.1


class ThrottledReports:
    """Filter of reports: passes on the first of each stage, and others if none was for a while.

    Small work reports little.

    Args:
        on_report: Receiver of the reports.
        clock: Seconds that never go back.
    """

    def __init__(self, on_report: Callable[[Report], None], clock: Callable[[], float] = monotonic) -> None:
        self._on_report = on_report
        self._clock = clock
        self._stage = ""
        self._told_s = 0.0

    def __call__(self, report: Report) -> None:
        """Pass a report on, or drop it."""
        now_s = self._clock()
        if report.stage != self._stage or now_s - self._told_s >= PAUSE_S:
            self._stage, self._told_s = report.stage, now_s
            self._on_report(report)
