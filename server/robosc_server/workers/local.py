"""Workers of this machine: each task runs in a separate process that was forked in advance."""

import asyncio
import contextlib
from typing import Self

from robosc_server.clock import monotonic
from robosc_server.tasks.exceeded import time_exceeded
from robosc_server.tasks.task import Outcome, Task, TaskLimits
from robosc_server.workers import OnCpuTime, OnReport, WorkerLostError, ignore_cpu_time
from robosc_server.workers.pool import WorkerPool
from robosc_server.workers.process import ForkServerLostError, WorkerProcess

TASK_FUNCTION = "robosc_server.tasks.run:run_task"
"""Does tasks; `package.module:name`."""

_ATTEMPTS = 2
_GONE_S = 5.0


class LocalWorkers:
    """Bounded number of worker processes; an asynchronous context that starts and ends them."""

    def __init__(
        self,
        size: int,
        task_function: str = TASK_FUNCTION,
        spare: int | None = None,
        *,
        must_be_confined: bool = False,
    ) -> None:
        """Prepare the workers, without starting them.

        Args:
            size: Tasks under way at once.
            task_function: Function that does them, `package.module:name`; imported by the processes alone.
            spare: Idle processes in addition to busy ones; None: `size`.
            must_be_confined: True to start none on a machine without complete confinement.
        """
        self._size = size
        self._pool = WorkerPool(task_function, size if spare is None else spare, must_be_confined=must_be_confined)

    async def __aenter__(self) -> Self:
        await self._pool.__aenter__()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._pool.__aexit__(None)

    @property
    def capacity(self) -> int:
        """Number of tasks that can be under way; 0 while no process can be started."""
        return 0 if self._pool.is_failing else self._size

    @property
    def pids(self) -> frozenset[int]:
        """Process ids of all workers, idle and busy."""
        return self._pool.pids

    @property
    def fault(self) -> str:
        """Reason why no process can be started now, in one sentence; empty where there are some."""
        return self._pool.fault

    @property
    def missing(self) -> tuple[str, ...]:
        """Parts of the workers' confinement that this machine does not have, one sentence for each."""
        return self._pool.missing or ()

    @property
    def restarts(self) -> int:
        """Number of times that the process that starts workers ended and was started again."""
        return self._pool.restarts

    async def run(
        self, task: Task, limits: TaskLimits, on_report: OnReport, on_cpu_time: OnCpuTime = ignore_cpu_time
    ) -> Outcome:
        """Run a task and return its outcome; see `Workers.run`.

        Raises:
            WorkersError: No process can be started.
            WorkerLostError: The fork server ended during the task, each time.
        """
        for _ in range(_ATTEMPTS):
            with contextlib.suppress(ForkServerLostError):
                return await self._run_once(task, limits, on_report, on_cpu_time)
        raise WorkerLostError("the fork server of the workers ended twice during one task")

    async def _run_once(self, task: Task, limits: TaskLimits, on_report: OnReport, on_cpu_time: OnCpuTime) -> Outcome:
        worker = await self._pool.acquire()
        begun_s = monotonic()
        limit = asyncio.timeout(limits.seconds)
        is_answered = False
        try:
            async with limit:
                outcome = await worker.run(task, limits, on_report)
            is_answered = True
            return outcome
        except TimeoutError:
            if not limit.expired():
                raise
            return time_exceeded(limits)
        finally:
            termination = self._pool.terminate(worker)
            termination.add_done_callback(lambda _: on_cpu_time(_cpu_s(worker, monotonic() - begun_s)))
            if not is_answered:  # A cancelled task has ended when this returns.
                await asyncio.wait([termination], timeout=_GONE_S)


def _cpu_s(worker: WorkerProcess, clock_s: float) -> float:
    """Return the CPU time of an ended process, or its wall-clock time if the CPU time is unknown."""
    known = worker.exit.done() and not worker.exit.cancelled()
    end = worker.exit.result() if known else None
    return clock_s if end is None else end.cpu_s
