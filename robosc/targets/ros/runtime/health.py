"""
Content of `/diagnostics` about a controller or a supervision layer.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from robosc.execution.runtime.progress import mission_texts, owed_texts, Progress, standing_text
from robosc.execution.runtime.recorder import Counters
from robosc.execution.runtime.runner import Runner, Status


class Level(IntEnum):
    """The levels of diagnostic_msgs/msg/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


class Health(NamedTuple):
    """
    One report.

    :ivar level: Severity.
    :ivar message: Reason, in words.
    :ivar values: Further values, by name.
    """

    level: Level
    message: str
    values: dict[str, str]


class HealthMonitor:
    """
    Judges an executor.

    :param executor: The executor.
    :ivar missing_servers: Servers that the start waits for.
    """

    def __init__(self, executor: Runner) -> None:
        self._executor = executor
        self._before = executor.counters
        self._decision_us: float | None = None
        self.missing_servers: tuple[str, ...] = ()

    def decided(self, took_s: float) -> None:
        """Note how long a decision took."""
        self._decision_us = took_s * 1e6

    def next_interval(self) -> None:
        """From now on only what goes wrong later is worth a warning."""
        self._before = self._executor.counters

    def report(self) -> Health:
        """Return the health of the executor."""
        executor = self._executor
        counters, status = executor.counters, executor.status
        values = {'status': status.value, 'reason': '; '.join(executor.reasons)}
        values.update((name, str(number)) for name, number in counters._asdict().items())
        values['cancelling'] = ', '.join(executor.cancelling)
        values['last decision (us)'] = (
            '' if self._decision_us is None else f'{self._decision_us:.1f}'
        )
        progress = executor.progress
        if progress is not None:
            for item in (*progress.aims, *progress.assumptions):
                values[item.name] = standing_text(item)
            values.update(mission_texts(progress))
            values.update(approached=progress.approached or '', chosen=progress.chosen or '')
        level, message = self._judge(status, counters, progress)
        return Health(level, message, values)

    def _judge(
        self, status: Status, counters: Counters, progress: Progress | None
    ) -> tuple[Level, str]:
        reasons = self._executor.reasons
        overdue = [
            f'the goal of {action} has not ended although its cancel was asked for'
            for action in self._executor.overdue_cancels
        ]
        if reasons:
            return Level.ERROR, '; '.join(['stopped: ' + '; '.join(reasons), *overdue])
        if overdue:
            return Level.ERROR, '; '.join(overdue)
        if status is Status.NEW:
            names = ', '.join(self.missing_servers)
            return Level.WARN, f'waiting for servers: {names}' if names else 'not started'
        if status is Status.WAITING and self._executor.old_goals:
            names = ', '.join(self._executor.old_goals)
            return Level.WARN, f'waiting for the end of goals from before the restart: {names}'
        if status is Status.WAITING:
            return Level.WARN, 'waiting for the first message of every sensor with a maximum age'
        new = [
            f'{after - before} {name}'
            for name, before, after in (
                (name, getattr(self._before, name), getattr(counters, name))
                for name in counters._fields
                # What limits move is how the model wants it.
                if name != 'limited'
            )
            if after > before
        ]
        warnings = [] if progress is None else owed_texts(progress)
        if new:
            warnings.append('since the last report: ' + ', '.join(new))
        if warnings:
            return Level.WARN, '; '.join(warnings)
        cancelling = ', '.join(self._executor.cancelling)
        return Level.OK, f'running, cancelling {cancelling}' if cancelling else 'running'
