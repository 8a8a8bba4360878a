"""Real models in processes of their own: small ones, and those that would take all the time or memory that there is."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import CancelledError, Future
from pathlib import Path

import pytest

from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.requests import RequestLimits, accepted
from robosc_server.tasks.run import run_task
from robosc_server.tasks.task import Failure, Outcome, Reason, Result, Task, TaskKind, TaskLimits
from robosc_server.workers.local import LocalWorkers
from support.background import BackgroundLoop, cpu_ticks, is_running
from support.hostile_models import buttons, products
from support.requests import MESSAGES, bundle_at, small_request
from support.waiting import eventually

ROOT = Path(__file__).parents[3]
LIMITS = TaskLimits(seconds=100, cpu_seconds=100, nodes=10**9)
KILLED_WITHIN_S = 0.2


class Running:
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
def running() -> Iterator[Running]:
    with BackgroundLoop() as loop:
        workers = LocalWorkers(2)
        loop.run(workers.__aenter__())
        yield Running(loop, workers)
        loop.run(workers.__aexit__())


def task_of(request: object, kind: TaskKind) -> Task:
    assert isinstance(request, MESSAGES[kind])
    return accepted(kind, request.SerializeToString(), RequestLimits())


def synthesis(text: str) -> Task:
    return task_of(small_request(TaskKind.SYNTHESIZE, text), TaskKind.SYNTHESIZE)


def reason_of(outcome: Outcome) -> Reason:
    assert isinstance(outcome, Failure), outcome
    return outcome.reason


@pytest.mark.parametrize("kind", [TaskKind.CHECK, TaskKind.SYNTHESIZE, TaskKind.EXPLORE])
def test_the_outcome_is_that_of_the_function(running: Running, kind: TaskKind) -> None:
    bundle = bundle_at(ROOT / "examples" / "line_follower" / "line_follower.rscd")
    task = task_of(MESSAGES[kind](bundle=bundle), kind)
    outcome = running.run(task)
    assert isinstance(outcome, Result)
    assert outcome == run_task(kind, task.request, LIMITS, lambda report: None)


def test_processes_find_everything_loaded() -> None:
    program = (
        "import sys\n"
        "from robosc_server.tasks.task import TaskKind, TaskLimits\n"
        "from robosc_server.workers.template import _load\n"
        "from support.hostile_models import buttons\n"
        "from support.requests import small_request\n"
        "function = _load('robosc_server.tasks.run:run_task')\n"
        "for kind in TaskKind:\n"
        "    loaded = set(sys.modules)\n"
        "    request = small_request(kind, buttons(2)).SerializeToString()\n"
        "    print(function(kind, request, TaskLimits(), lambda report: None).__class__.__name__, end=' ')\n"
        "    print(*sorted(set(sys.modules) - loaded))\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    told = subprocess.run([sys.executable, "-c", program], env=environment, check=True, capture_output=True, text=True)
    assert [line.strip() for line in told.stdout.splitlines()] == ["Result"] * len(TaskKind)


def test_an_endless_model_reaches_its_limits_and_harms_no_other(running: Running) -> None:
    endless = synthesis(products())
    by_clock = running.start(endless, TaskLimits(seconds=1.0, nodes=10**9))
    by_processor = running.start(endless, TaskLimits(cpu_seconds=1, nodes=10**9))
    check = task_of(small_request(TaskKind.CHECK, products()), TaskKind.CHECK)
    for _ in range(3):
        outcome = running.run(check)
        assert isinstance(outcome, Result)
        found = pb.CheckResponse.FromString(outcome.messages[0]).diagnostics
        assert [finding.code for finding in found] == ["may-leave-range"] * 2
    assert reason_of(by_clock.result(60)) is Reason.TIME_LIMIT
    assert reason_of(by_processor.result(60)) is Reason.CPU_LIMIT


def test_a_model_with_too_large_diagrams_reaches_the_limit_of_nodes(running: Running) -> None:
    assert reason_of(running.run(synthesis(products()), TaskLimits(nodes=20_000))) is Reason.NODE_LIMIT


def test_a_model_with_too_many_states_reaches_the_limit_of_memory(running: Running) -> None:
    request = small_request(TaskKind.EXPLORE, buttons(20))
    request.maximum_states = 10**9
    # The least that a task can be given.
    failure = running.run(task_of(request, TaskKind.EXPLORE), TaskLimits(memory_bytes=1))
    assert reason_of(failure) is Reason.MEMORY_LIMIT


@pytest.mark.real_time
def test_an_endless_model_is_gone_in_time_when_it_is_cancelled(running: Running) -> None:
    future = running.start(synthesis(products()))
    busy: list[int] = []

    def is_busy() -> bool:
        busy[:] = [pid for pid in running.local.pids if cpu_ticks(pid) > 30]
        return len(busy) == 1

    assert eventually(is_busy)
    begin = time.monotonic()
    future.cancel()
    assert eventually(lambda: not is_running(busy[0]))
    assert time.monotonic() - begin < KILLED_WITHIN_S
    with pytest.raises(CancelledError):
        future.result(60)
