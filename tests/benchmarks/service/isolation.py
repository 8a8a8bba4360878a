"""Benchmark of the cost of a process of its own for each task: here, in a process that stands ready, in a new one.

Each round does the same task in all ways, one after the other, so that other work on the machine affects them alike.
"""

import asyncio
import statistics
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

from figures import text_table
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.requests import RequestLimits, accept_request
from robosc_server.tasks.run import run_task, warm_up
from robosc_server.tasks.task import Report, Result, Task, TaskKind, TaskLimits
from robosc_server.workers.local import LocalWorkers
from support.fake_tasks import TASK_FUNCTION, fake_task
from support.fake_tasks import run_task as run_fake_task
from support.requests import bundle_at

ROOT = Path(__file__).parents[3]
ROUNDS = 20
COLD_ROUNDS = 3
PAUSE_S = 0.03
AIM_MS = 3.0

HEADER = ("task", "in-process", "ready process", "of it isolation", "least", "aim", "back to back", "from scratch")


async def _ignore(report: Report) -> None:
    """Ignore a report."""


async def _seconds(work: Callable[[], Awaitable[object]]) -> float:
    begin = time.perf_counter()
    assert isinstance(await work(), Result)
    return time.perf_counter() - begin


async def _cold_s(task: Task, task_function: str) -> float:
    """With a fork server that is started for it, ended included."""
    begin = time.perf_counter()
    async with LocalWorkers(1, task_function) as workers:
        assert isinstance(await workers.run(task, TaskLimits(), _ignore), Result)
    return time.perf_counter() - begin


async def _row(name: str, task: Task, task_function: str) -> list[str]:
    function = run_fake_task if task_function == TASK_FUNCTION else run_task

    async def here() -> object:
        return function(task.kind, task.request, TaskLimits(), lambda report: None)

    async with LocalWorkers(2, task_function) as workers:

        async def there() -> object:
            return await workers.run(task, TaskLimits(), _ignore)

        await there()
        in_process, ready = [], []
        for _ in range(ROUNDS):
            in_process.append(await _seconds(here))
            # The fork server forks the next process meanwhile, as it does for a server that is not at its limit.
            await asyncio.sleep(PAUSE_S)
            ready.append(await _seconds(there))
            await asyncio.sleep(PAUSE_S)
        begin = time.perf_counter()
        for _ in range(ROUNDS):
            await there()
        back_to_back = (time.perf_counter() - begin) / ROUNDS
    cold = [await _cold_s(task, task_function) for _ in range(COLD_ROUNDS)]
    medians = statistics.median(in_process), statistics.median(ready)
    least = min(ready) - min(in_process)
    figures = (*medians, medians[1] - medians[0], least)
    return [
        name,
        *(f"{figure * 1e3:.1f}" for figure in figures),
        f"{AIM_MS:.0f}",
        f"{back_to_back * 1e3:.1f}",
        f"{statistics.median(cold) * 1e3:.0f}",
    ]


async def _rows() -> list[list[str]]:
    bundle = bundle_at(ROOT / "examples" / "line_follower" / "line_follower.rscd")
    requests = {
        TaskKind.CHECK: pb.CheckRequest(bundle=bundle),
        TaskKind.SYNTHESIZE: pb.SynthesizeRequest(bundle=bundle),
        TaskKind.GENERATE: pb.GenerateRequest(bundle=bundle, target="ros2"),
    }
    warm_up()
    rows = [await _row("nothing", fake_task("echo"), TASK_FUNCTION)]
    for kind, request in requests.items():
        task = accept_request(kind, request.SerializeToString(), RequestLimits())
        rows.append(await _row(f"{kind} line_follower", task, "robosc_server.tasks.run:run_task"))
    return rows


def table() -> str:
    """Medians in milliseconds; `least`: of the isolation, between the fastest rounds of both."""
    return text_table("Tasks in processes of their own, milliseconds", HEADER, asyncio.run(_rows()))
