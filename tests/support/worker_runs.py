"""Workers of this machine that run in the background, and what their tasks report."""

from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import Future

import pytest

from robosc_server.tasks.task import Failure, Outcome, Report, TaskKind, TaskLimits
from robosc_server.workers import Workers
from robosc_server.workers.local import LocalWorkers
from support.background import BackgroundLoop
from support.fake_tasks import TASK_FUNCTION, fake_task
from support.waiting import eventually

LIMITS = TaskLimits(seconds=60, cpu_seconds=20, memory_bytes=512 * 2**20, result_bytes=10**6)


class Running:
    """Workers that run in the background, and what their tasks report."""

    def __init__(self, loop: BackgroundLoop, workers: LocalWorkers) -> None:
        self.workers: Workers = workers
        self.local = workers
        self._loop = loop
        self.spent: list[float] = []

    def start(
        self,
        text: str,
        limits: TaskLimits = LIMITS,
        on_report: Callable[[Report], Awaitable[None]] | None = None,
        kind: TaskKind = TaskKind.CHECK,
    ) -> tuple[Future[Outcome], "list[Report]"]:
        reports: list[Report] = []

        async def note(report: Report) -> None:
            reports.append(report)

        run = self.workers.run(fake_task(text, kind), limits, on_report or note, self.spent.append)
        return self._loop.start(run), reports

    def run(self, text: str, limits: TaskLimits = LIMITS) -> Outcome:
        return self.start(text, limits)[0].result(60)

    def failure(self, text: str, limits: TaskLimits = LIMITS) -> Failure:
        outcome = self.run(text, limits)
        assert isinstance(outcome, Failure), outcome
        return outcome

    def begun(self, text: str, limits: TaskLimits = LIMITS) -> tuple[Future[Outcome], int]:
        """A task under way, and the number of its process."""
        future, reports = self.start(f"pid\n{text}", limits)
        assert eventually(lambda: bool(reports)), future
        return future, int(reports[0].message)


@pytest.fixture(scope="module")
def running() -> Iterator[Running]:
    with BackgroundLoop() as loop, pytest.MonkeyPatch.context() as environment:
        environment.setenv("A_PASSWORD_OF_SOMETHING", "secret")
        workers = LocalWorkers(2, TASK_FUNCTION)
        loop.run(workers.__aenter__())
        yield Running(loop, workers)
        loop.run(workers.__aexit__())
