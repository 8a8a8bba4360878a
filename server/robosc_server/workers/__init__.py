"""Workers, on this machine or in a Dask cluster; each task runs in a separate process with limits."""

from collections.abc import Awaitable, Callable
from typing import Protocol

from robosc_server.tasks.task import Outcome, Report, Task, TaskLimits

type OnReport = Callable[[Report], Awaitable[None]]
type OnCpuTime = Callable[[float], None]


def ignore_cpu_time(cpu_s: float) -> None:
    """Ignore the CPU time of a process."""


class WorkersError(Exception):
    """No worker is available; one sentence for the operator."""


class WorkerLostError(WorkersError):
    """The starters of workers ended more than once during a task, which may be the cause."""


class Workers(Protocol):
    """Workers; an asynchronous context that starts and ends them."""

    @property
    def capacity(self) -> int:
        """Number of tasks that they can be busy with at once; may change."""

    async def run(
        self, task: Task, limits: TaskLimits, on_report: OnReport, on_cpu_time: OnCpuTime = ignore_cpu_time
    ) -> Outcome:
        """Run a task at once and return its outcome; the caller runs at most `capacity` tasks at a time.

        However the task ends, `on_cpu_time` receives the CPU time of each process that ran it, as soon as it is known:
        usually when the process has ended, which may be after this has returned. If the CPU time is lost, it receives
        the wall-clock time.

        Cancelling this kills the process within 200 ms. A process that dies or reaches a limit is a Failure, and harms
        no other task.

        Raises:
            WorkersError: No worker is available (the cluster is unavailable); the task has not started, or was lost.
            WorkerLostError: The worker was lost, and the task may be the cause.
        """
