"""Those who do tasks: processes of this machine, or of a cluster; each task in a process of its own, with limits."""

from collections.abc import Awaitable, Callable
from typing import Protocol

from robosc_server.tasks.task import Outcome, Report, Task, TaskLimits

type OnReport = Callable[[Report], Awaitable[None]]
type OnCpuTime = Callable[[float], None]


def ignore_cpu_time(cpu_s: float) -> None:
    """Note for nobody what a process has taken."""


class WorkersError(Exception):
    """No worker can be had; one sentence for the operator."""


class WorkerLostError(WorkersError):
    """Those who start workers ended under a task, more than once: it may be what they end of."""


class Workers(Protocol):
    """Some workers; an asynchronous context that starts and ends them."""

    @property
    def capacity(self) -> int:
        """Number of tasks that they can be busy with at once; may change."""

    async def run(
        self, task: Task, limits: TaskLimits, on_report: OnReport, on_cpu_time: OnCpuTime = ignore_cpu_time
    ) -> Outcome:
        """The outcome of a task, begun at once: the caller sees to it that no more than `capacity` are under way.

        However it ends, `on_cpu_time` is told how many seconds of a processor's time each process has taken that was at
        it, as soon as that is known: about when the process is gone, which may be after this has returned. Of one that
        was lost with those who knew, it is told the time by the clock.

        Cancelling this kills the process that is at it, within 200 ms. A process that dies, or reaches a limit, is a
        Failure, and harms no other task.

        Raises:
            WorkersError: No worker can be had (the cluster is away); the task has not begun, or was lost on the way.
            WorkerLostError: It was lost on the way, perhaps through its own fault.
        """
