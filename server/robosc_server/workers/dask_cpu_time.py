"""CPU time of a task on a cluster, from the events of the cluster's workers."""

import math
from collections.abc import Callable
from typing import Any

from robosc_server.workers import OnCpuTime


class CpuTimeAccount:
    """Account of the CPU time of one task, whose workers may be lost.

    A worker reports when it starts, and the CPU time of its process when that has ended. For a lost worker, the
    wall-clock time counts, until another worker starts or the task has ended.

    Args:
        on_cpu_time: Callback that receives seconds.
        clock: Seconds of a monotonic clock.
    """

    def __init__(self, on_cpu_time: OnCpuTime, clock: Callable[[], float]) -> None:
        self._on_spent = on_cpu_time
        self._clock = clock
        self._worker = ""
        self._begun_s: float | None = None
        self._stopped_s: float | None = None

    def record_event(self, event: dict[str, Any]) -> None:
        """Record an event of the cluster: `begun` or `spent`; other events are ignored."""
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
        """Stop the wall clock, since the task has ended."""
        self._stopped_s = self._clock()

    def close(self) -> None:
        """Count the wall-clock time of a worker that has not reported its CPU time."""
        if self._begun_s is not None:
            end_s = self._clock() if self._stopped_s is None else max(self._stopped_s, self._begun_s)
            self._on_spent(end_s - self._begun_s)
            self._begun_s = None
