"""
Content of `/diagnostics` about a controller or a supervision layer.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import NamedTuple

from robosc.execution.runtime.progress import mission_texts, owed_texts, Progress, standing_text
from robosc.execution.runtime.recorder import Counters
from robosc.execution.runtime.runner import Runner, Status

STILL_S = 3.0
"""Simulated time that stands still for so long is worth a warning, in seconds."""


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


class ClockWatch:
    """
    Watch of simulated time, without which stamps are zero and nothing may be decided.

    :param now_ns: Function that returns the time of ROS in nanoseconds; 0 before the first message
        on `/clock`.
    """

    def __init__(self, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._seen_ns = 0
        self._moved_s = 0.0

    def trouble(self, steady_s: float) -> str:
        """
        Return why no time passes, in words; empty if it does. To be called again and again.

        :param steady_s: Reading of a steady clock.
        """
        now_ns = self._now_ns()
        if now_ns != self._seen_ns:
            self._moved_s, self._seen_ns = steady_s, now_ns
        if now_ns == 0:
            return 'use_sim_time is true, and no time has come on /clock'
        is_still = steady_s >= self._moved_s + STILL_S
        return 'use_sim_time is true, and the time of /clock stands still' if is_still else ''


class HealthMonitor:
    """
    Judges an executor.

    :param executor: The executor.
    :ivar missing_servers: Servers that the start waits for.
    :ivar troubles: Reasons why its surroundings are of no use to the node, in words.
    """

    def __init__(self, executor: Runner) -> None:
        self._executor = executor
        self._before = executor.counters
        self._decision_us: float | None = None
        self.missing_servers: tuple[str, ...] = ()
        self.troubles: tuple[str, ...] = ()

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
        warnings = list(self.troubles)
        if status is Status.NEW:
            names = ', '.join(self.missing_servers)
            warnings.insert(0, f'waiting for servers: {names}' if names else 'not started')
            return Level.WARN, '; '.join(warnings)
        if status is Status.WAITING and self._executor.old_goals:
            names = ', '.join(self._executor.old_goals)
            warnings.insert(0, f'waiting for the end of goals from before the restart: {names}')
            return Level.WARN, '; '.join(warnings)
        if status is Status.WAITING and self._executor.old_calls:
            names = ', '.join(self._executor.old_calls)
            warnings.insert(0, f'waiting for the end of calls from before the restart: {names}')
            return Level.WARN, '; '.join(warnings)
        if status is Status.WAITING:
            warnings.insert(0, 'waiting for the first message of every sensor with a maximum age')
            return Level.WARN, '; '.join(warnings)
        new = [
            f'{after - before} {name}'
            for name, before, after in (
                (name, getattr(self._before, name), getattr(counters, name))
                for name in counters._fields
                # The model wants numbers to be moved.
                if name != 'limited'
            )
            if after > before
        ]
        if progress is not None:
            warnings.extend(owed_texts(progress))
        if new:
            warnings.append('since the last report: ' + ', '.join(new))
        if warnings:
            return Level.WARN, '; '.join(warnings)
        cancelling = ', '.join(self._executor.cancelling)
        return Level.OK, f'running, cancelling {cancelling}' if cancelling else 'running'
