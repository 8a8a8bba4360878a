"""Real models in processes of this machine, for tests of what becomes of them."""

from collections.abc import Iterator
from concurrent.futures import Future

import pytest

from robosc_server.tasks.requests import RequestLimits, accept_request
from robosc_server.tasks.task import Failure, Outcome, Reason, Task, TaskKind, TaskLimits
from robosc_server.workers.local import LocalWorkers
from support.background import BackgroundLoop
from support.requests import MESSAGES, small_request

LIMITS = TaskLimits(seconds=100, cpu_seconds=100, nodes=10**9)


class RealRunning:
    """Workers with the real function, in the background."""

    def __init__(self, loop: BackgroundLoop, workers: LocalWorkers) -> None:
        self.local = workers
        self._loop = loop

    def start(self, task: Task, limits: TaskLimits = LIMITS) -> Future[Outcome]:
        self.stages: list[str] = []
        stages = self.stages

        async def note(report: object) -> None:
            stages.append(str(report))

        return self._loop.start(self.local.run(task, limits, note))

    def run(self, task: Task, limits: TaskLimits = LIMITS) -> Outcome:
        return self.start(task, limits).result(100)


@pytest.fixture(scope="module")
def real() -> Iterator[RealRunning]:
    with BackgroundLoop() as loop:
        workers = LocalWorkers(2)
        loop.run(workers.__aenter__())
        yield RealRunning(loop, workers)
        loop.run(workers.__aexit__())


def task_of(request: object, kind: TaskKind) -> Task:
    assert isinstance(request, MESSAGES[kind])
    return accept_request(kind, request.SerializeToString(), RequestLimits())


def synthesis(text: str) -> Task:
    return task_of(small_request(TaskKind.SYNTHESIZE, text), TaskKind.SYNTHESIZE)


def reason_of(outcome: Outcome) -> Reason:
    assert isinstance(outcome, Failure), outcome
    return outcome.reason
