"""Time until the process of a task is gone whose caller has cancelled, or has waited as long as it wanted to.

A real server, a real connection, and the moment of the process's death as the kernel reports it (pidfd_open(2)).
"""

import contextlib
import os
import select
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import grpc
import pytest

from robosc_api.v1 import synthesis_pb2_grpc
from robosc_server.tasks.task import TaskKind
from support.background import children_of, cpu_ticks
from support.hostile_models import products
from support.job_server import job_server
from support.requests import small_request
from support.waiting import eventually

pytestmark = pytest.mark.real_time

GONE_WITHIN_S = 0.2
PATIENCE_S = 60.0
_BUSY_TICKS = 30


@pytest.fixture(params=["stuck in C", "stopped", "decision diagrams"])
def work(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@contextmanager
def begun(work: str, folder: Path, timeout_s: float) -> Iterator[tuple[Any, int, float]]:
    """A call under way, a descriptor of its process, and the latest moment of its deadline."""
    text = {"stuck in C": "pid\nstuck", "stopped": "pid\nstop"}.get(work, products())
    is_real = work == "decision diagrams"
    with (
        job_server(folder, workers="local" if is_real else "fake") as (server, address),
        grpc.insecure_channel(address) as channel,
    ):
        stub: Any = synthesis_pb2_grpc.SynthesisServiceStub(channel)  # type: ignore[no-untyped-call]
        grpc.channel_ready_future(channel).result(PATIENCE_S)
        deadline_s = time.monotonic() + timeout_s
        call = stub.Synthesize(small_request(TaskKind.SYNTHESIZE, text), timeout=timeout_s)
        pid = busy_worker_of(server.pid) if is_real else int(next(call).progress.message)
        descriptor = os.pidfd_open(pid)
        try:
            yield call, descriptor, deadline_s
        finally:
            os.close(descriptor)


def busy_worker_of(server: int) -> int:
    """The process that is at a server's only task, deep in its diagrams."""
    found: list[int] = []

    def is_busy() -> bool:
        workers = [worker for fork_server in children_of(server) for worker in children_of(fork_server)]
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # One that was ready may be gone again.
            found[:] = [worker for worker in workers if cpu_ticks(worker) > _BUSY_TICKS]
        return bool(found)

    assert eventually(is_busy)
    return found[0]


def gone_at(descriptor: int) -> float:
    """Return the time when a process is no more: `poll` says so the moment it is."""
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    assert poll.poll(PATIENCE_S * 1e3)
    return time.monotonic()


def test_a_cancelled_calls_process_is_gone_in_time(
    work: str, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    with begun(work, tmp_path, PATIENCE_S) as (call, descriptor, _):
        cancelled_s = time.monotonic()
        call.cancel()
        taken_s = gone_at(descriptor) - cancelled_s
    record_property(f"from a cancel to the end of its process ({work})", f"{taken_s * 1e3:.0f} ms")
    assert taken_s < GONE_WITHIN_S


def test_the_process_of_a_call_whose_deadline_has_passed_is_gone_in_time(
    work: str, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    with begun(work, tmp_path, 4.0) as (call, descriptor, deadline_s):
        taken_s = gone_at(descriptor) - deadline_s
        with pytest.raises(grpc.RpcError) as ended:
            for _ in call:
                pass
    assert ended.value.code() is grpc.StatusCode.DEADLINE_EXCEEDED
    record_property(f"from a deadline to the end of its process ({work})", f"{taken_s * 1e3:.0f} ms")
    assert taken_s < GONE_WITHIN_S
