"""The parts of a server that have to do with jobs, put together in this process, with scripted workers."""

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import grpc.aio
import pytest

from robosc_api.layers import LayeredServices
from robosc_api.v1 import jobs_pb2_grpc
from robosc_server.jobs import (
    Caller,
    JobLimits,
    JobManager,
    JobService,
    QueueLimits,
    ResultCache,
    Scheduler,
    add_job_service,
    caller_of,
)
from robosc_server.jobs.retention import Retention
from robosc_server.jobs.scheduler import Accounts
from robosc_server.jobs.service import Context
from robosc_server.operations.interceptor import CallInterceptor
from robosc_server.operations.metrics import Metrics
from robosc_server.store import JobRecord, JobState, Store, open_store
from robosc_server.tasks.task import TaskLimits
from support.job_workers import ScriptedWorkers, accepted
from support.waiting import PATIENCE_S

ME = Caller("me")


@dataclass
class Times:
    """The time, as a test wants it."""

    wall_s: float = 1_700_000_000.0
    monotonic_s: float = 0.0

    def wall(self) -> float:
        return self.wall_s

    def monotonic(self) -> float:
        return self.monotonic_s


@dataclass
class Parts:
    """Parts that belong together."""

    store: Store
    workers: ScriptedWorkers
    scheduler: Scheduler
    results: ResultCache
    manager: JobManager


@dataclass
class Choices:
    """Choices for making the parts."""

    url: str = ""
    limits: JobLimits = field(default_factory=lambda: JobLimits(poll_s=0.02, sweep_s=3600.0))
    queue: QueueLimits = field(default_factory=QueueLimits)
    capacity: int = 2
    memory_bytes: int = 2**20
    times: Times = field(default_factory=Times)
    accounts: Accounts | None = None


@asynccontextmanager
async def parts(folder: Path, choices: Choices | None = None) -> AsyncIterator[Parts]:
    """All parts, working."""
    chosen = choices or Choices()
    store = await asyncio.to_thread(open_store, folder, chosen.url, chosen.times.wall)
    try:
        workers = ScriptedWorkers(chosen.capacity)
        scheduler = Scheduler(workers, chosen.queue, accounts=chosen.accounts)
        async with ResultCache(store, chosen.memory_bytes) as results:
            manager = JobManager(store, scheduler, results, TaskLimits(), chosen.limits, chosen.times.monotonic)
            async with manager:
                yield Parts(store, workers, scheduler, results, manager)
    finally:
        await asyncio.to_thread(store.close)


def sweep_by_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have a test say when it is swept: else it may be in the middle of it."""

    async def never(retention: Retention) -> None:
        """Sweep no job unless the test says so."""
        await asyncio.Event().wait()

    monkeypatch.setattr(Retention, "sweep_forever", never)


@asynccontextmanager
async def offered(manager: JobManager, identify: Callable[[Context], Caller] = caller_of) -> AsyncIterator[Any]:
    """The jobs' service over gRPC; yields a stub."""
    services = LayeredServices(CallInterceptor(Metrics("of a test")))
    add_job_service(JobService(manager, accepted, identify), services)
    server = grpc.aio.server(None, (services,))
    port = server.add_insecure_port("127.0.0.1:0")
    await server.start()
    try:
        async with grpc.aio.insecure_channel(f"127.0.0.1:{port}") as channel:
            yield jobs_pb2_grpc.JobServiceStub(channel)  # type: ignore[no-untyped-call]
    finally:
        await server.stop(None)


def in_loop(test: Callable[[], Coroutine[Any, Any, None]]) -> None:
    """Run a test in an event loop."""
    asyncio.run(test())


async def ended(manager: JobManager, job_id: str, caller: Caller = ME) -> JobRecord:
    """A job when it has ended."""
    async with asyncio.timeout(PATIENCE_S):
        async for record in manager.watch(job_id, caller, 0):
            if record.state.has_ended:
                return record
    raise AssertionError("it never ended")


async def has_begun(made: Parts, job_id: str, tasks: int = 1) -> bool:
    """Return True if a job is at work and so many tasks have begun.

    It is marked as running before its worker begins.
    """
    return len(made.workers.begun) == tasks and await is_in(made.manager, job_id, JobState.RUNNING)


async def is_in(manager: JobManager, job_id: str, state: JobState) -> bool:
    """Return True if a job is in a state."""
    return (await manager.get(job_id, ME)).state is state


async def messages_of_job(manager: JobManager, job_id: str) -> tuple[bytes, ...]:
    """The result of a job."""
    _, messages = await manager.result(job_id, ME)
    return tuple([message async for message in messages])
