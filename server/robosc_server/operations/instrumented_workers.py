"""Workers with metrics and traces of their tasks."""

from types import TracebackType
from typing import Any, Self

from robosc_server.clock import monotonic
from robosc_server.operations.metrics import Metrics
from robosc_server.operations.tracing import NO_TRACING, Tracing
from robosc_server.tasks.task import Failure, Outcome, Task, TaskLimits
from robosc_server.workers import OnCpuTime, OnReport, Workers, ignore_cpu_time


class InstrumentedWorkers:
    """Workers whose tasks are counted and traced.

    Args:
        workers: Workers that do the work; entered and left with this.
        metrics: Metrics that count tasks.
        tracing: Tracing that receives spans.
    """

    def __init__(self, workers: Workers, metrics: Metrics, tracing: Tracing = NO_TRACING) -> None:
        self._workers = workers
        self._metrics = metrics
        self._tracing = tracing
        self._running = 0

    async def __aenter__(self) -> Self:
        """Start the workers."""
        entered: Any = self._workers
        await entered.__aenter__()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        entered: Any = self._workers
        await entered.__aexit__(kind, error, trace)

    @property
    def capacity(self) -> int:
        """Number of tasks that they can be busy with at once."""
        return self._workers.capacity

    @property
    def running(self) -> int:
        """Number of tasks that they are busy with."""
        return self._running

    async def run(
        self, task: Task, limits: TaskLimits, on_report: OnReport, on_cpu_time: OnCpuTime = ignore_cpu_time
    ) -> Outcome:
        """Run a task, as `Workers.run`."""
        outcome: Outcome | None = None
        begun_s = monotonic()
        self._running += 1
        try:
            with self._tracing.span("worker run", {"task.kind": task.kind.value}) as span:
                outcome = await self._workers.run(task, limits, on_report, on_cpu_time)
                span.set_attribute("task.outcome", outcome.reason if isinstance(outcome, Failure) else "RESULT")
            return outcome
        finally:
            self._running -= 1
            self._metrics.task_ended(task.kind, outcome, monotonic() - begun_s)
