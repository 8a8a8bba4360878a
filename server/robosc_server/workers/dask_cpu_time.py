"""Processor time that a task on a cluster has taken, put together from the reports of the cluster's workers."""

import math
from collections.abc import Callable
from typing import Any

from robosc_server.workers import OnCpuTime


class CpuTimeAccount:
    """The processor's time of one task, whose workers may be lost.

    A worker tells when it begins, and what its process has taken when that is gone. One that is lost tells nothing any
    more: then the time by the clock counts, until another one begins or nobody waits for the task.

    Args:
        on_cpu_time: Is told seconds.
        clock: Seconds of a monotonic clock.
    """

    def __init__(self, on_cpu_time: OnCpuTime, clock: Callable[[], float]) -> None:
        self._on_spent = on_cpu_time
        self._clock = clock
        self._worker = ""
        self._begun_s: float | None = None
        self._stopped_s: float | None = None

    def record_event(self, event: dict[str, Any]) -> None:
        """Take an event of the cluster's: `begun` or `spent`; others are nothing."""
        match event["is"]:
            case "begun":
                self.close()
                self._worker, self._begun_s = event["worker"], self._clock()
            case "spent" if self._begun_s is not None and event["worker"] == self._worker:
                cpu_s = event["cpu_s"]
                if isinstance(cpu_s, float) and math.isfinite(cpu_s) and cpu_s >= 0.0:
                    self._begun_s = None
                    self._on_spent(cpu_s)

    def stop(self) -> None:
        """Nobody waits for the task any more, which has ended or is about to."""
        self._stopped_s = self._clock()

    def close(self) -> None:
        """Wait no more for what a worker that has begun may tell."""
        if self._begun_s is not None:
            end_s = self._clock() if self._stopped_s is None else max(self._stopped_s, self._begun_s)
            self._on_spent(end_s - self._begun_s)
            self._begun_s = None
