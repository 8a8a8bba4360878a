"""Execution of one task in a separate process, for callers without an event loop, such as threads of a Dask worker."""

import asyncio
import threading
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from typing import Any

from robosc_server.tasks.task import Outcome, Report, Task, TaskLimits
from robosc_server.workers import OnCpuTime, ignore_cpu_time
from robosc_server.workers.local import TASK_FUNCTION, LocalWorkers

_ASK_S = 0.02
_SPARE = 2


class StoppedError(Exception):
    """The process of the task was killed because the caller has cancelled it."""


class _BackgroundWorkers:
    """Workers with their own event loop, for the lifetime of this process."""

    def __init__(self, task_function: str, *, must_be_confined: bool) -> None:
        self._loop = asyncio.new_event_loop()
        # A daemon thread: workers end with this process.
        threading.Thread(target=self._loop.run_forever, name="robosc workers", daemon=True).start()
        self.workers = LocalWorkers(1, task_function, _SPARE, must_be_confined=must_be_confined)
        self._lock = threading.Lock()
        self._is_started = False

    def start[T](self, work: Coroutine[Any, Any, T]) -> Future[T]:
        """Begin a piece of work in the loop."""
        return asyncio.run_coroutine_threadsafe(work, self._loop)

    def prepare(self) -> None:
        """Start the workers, unless they are running."""
        with self._lock:
            if not self._is_started:
                self.start(self.workers.__aenter__()).result()
                self._is_started = True


_LOCK = threading.Lock()
_BACKGROUNDS: dict[tuple[str, bool], _BackgroundWorkers] = {}


def prepare(task_function: str = TASK_FUNCTION, *, must_be_confined: bool = False) -> None:
    """Start idle processes for tasks; they live as long as this process.

    Args:
        task_function: Function that does tasks, `package.module:name`.
        must_be_confined: True to start none on a machine without complete confinement.

    Raises:
        WorkersError: No worker is available.
    """
    _background(task_function, must_be_confined).prepare()


def _background(task_function: str, must_be_confined: bool) -> _BackgroundWorkers:
    kind = (task_function, must_be_confined)
    with _LOCK:
        if kind not in _BACKGROUNDS:
            _BACKGROUNDS[kind] = _BackgroundWorkers(task_function, must_be_confined=must_be_confined)
        return _BACKGROUNDS[kind]


def run_isolated(
    task: Task,
    limits: TaskLimits,
    on_report: Callable[[Report], None],
    should_stop: Callable[[], bool],
    task_function: str = TASK_FUNCTION,
    on_cpu_time: OnCpuTime = ignore_cpu_time,
    *,
    must_be_confined: bool = False,
) -> Outcome:
    """Return the outcome of a task, done in a process of its own within limits.

    Args:
        task: Task to do.
        limits: Limits of the task.
        on_report: Callback that receives each report, in another thread; must not wait.
        should_stop: Function that is called every 20 ms, in this thread; if it returns True, the process is killed.
        task_function: Function that does tasks, `package.module:name`.
        on_cpu_time: Callback that receives the CPU time of each process that ran the task, in another thread, maybe
            after the outcome; see `Workers.run`.
        must_be_confined: True to run no task on a machine without complete confinement.

    Raises:
        StoppedError: `should_stop` returned True.
        WorkersError: No process can be started.
    """
    background = _background(task_function, must_be_confined)
    background.prepare()

    async def forward(report: Report) -> None:
        on_report(report)

    work = background.start(background.workers.run(task, limits, forward, on_cpu_time))
    ended = threading.Event()
    work.add_done_callback(lambda _: ended.set())
    while not ended.wait(_ASK_S):
        if should_stop():
            work.cancel()
            raise StoppedError
    return work.result()
