"""Dispatcher of accepted tasks: a task gets its result from the cache or from a worker."""

from robosc_server.jobs import ResultCache, Scheduler
from robosc_server.operations.failures import public_failure
from robosc_server.operations.metrics import Metrics
from robosc_server.operations.quotas import Quotas
from robosc_server.tasks.task import Failure, RefusedError, Result, Task, TaskLimits
from robosc_server.workers import OnReport


class TaskDispatcher:
    """Dispatcher of the tasks of calls; a task is cancelled when its call ends.

    Args:
        results: Cache of results.
        scheduler: Queue in front of the workers.
        quotas: Quotas of callers.
        limits: Limits of one task.
        metrics: Metrics that count cache hits and misses.
    """

    def __init__(
        self, results: ResultCache, scheduler: Scheduler, quotas: Quotas, limits: TaskLimits, metrics: Metrics
    ) -> None:
        self._results = results
        self._scheduler = scheduler
        self._quotas = quotas
        self._limits = limits
        self._metrics = metrics

    def cached(self, key: str, caller: str) -> Result | None:
        """Return the result of an equal task, if it is in memory.

        Raises:
            RefusedError: The quota of the caller is used up.
        """
        result = self._results.in_memory(key)
        if result is not None:
            self._quotas.admit(caller)
            self._metrics.cache_hit("memory")
        return result

    async def result(self, task: Task, caller: str, on_report: OnReport) -> Result:
        """Return the result of a task; cancelling this ends the work.

        Raises:
            RefusedError: There is no result.
        """
        found = await self._results.find(task.key)
        if found is not None:
            self._quotas.admit(caller)
            self._metrics.cache_hit("store")
            return found
        self._metrics.cache_miss()
        # A task that is refused because of a full queue does not count for the quota.
        self._scheduler.require_room(caller)
        self._quotas.admit(caller)

        def result_in_memory() -> Result | None:
            nonlocal found
            found = self._results.in_memory(task.key)
            return found

        outcome = await self._scheduler.run(task, caller, self._limits, on_report, result_in_memory)
        if found is not None:
            self._metrics.cache_hit("memory")
            return found
        if isinstance(outcome, Failure):
            failure = public_failure(outcome)
            raise RefusedError(failure.reason, failure.message)
        return self._results.keep(task.key, task.kind, outcome, caller)
