"""Models that would take all memory or time that there is, through a whole server, which answers others meanwhile."""

import os
import signal
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import grpc
import pytest

from robosc_api.security import Scope, make_token
from robosc_api.v1 import jobs_pb2, jobs_pb2_grpc, synthesis_pb2_grpc
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.task import TaskKind
from support.background import children_of, cpu_ticks
from support.hostile_models import all_different, products
from support.refusals import reason_of
from support.requests import small_request
from support.service import server_process
from support.waiting import PATIENCE_S, eventually

_NODES = ("--task-nodes", "1000000000")
_SMALL = "robot Small {{ component C{} {{ incoming message a with type: none }} }}"


class Server:
    """A server as a program, with a stranger who does harm, and another caller."""

    def __init__(self, pid: int, channel: grpc.Channel, stranger: str, other: str) -> None:
        self._pid = pid
        self.synthesis: Any = synthesis_pb2_grpc.SynthesisServiceStub(channel)  # type: ignore[no-untyped-call]
        self.jobs: Any = jobs_pb2_grpc.JobServiceStub(channel)  # type: ignore[no-untyped-call]
        self.stranger, self.other = (
            {"metadata": (("authorization", f"Bearer {token}"),)} for token in (stranger, other)
        )
        self._answered = 0

    def refusal(self, text: str) -> tuple[str, str]:
        """Return the end of a synthesis for the stranger: the name of its code, and the reason."""
        request = small_request(TaskKind.SYNTHESIZE, text)
        with pytest.raises(grpc.RpcError) as refused:
            for _ in self.synthesis.Synthesize(request, timeout=PATIENCE_S, **self.stranger):
                pass
        return refused.value.code().name, reason_of(refused.value)

    def answers_another(self) -> None:
        """Have a new task of the other caller done."""
        self._answered += 1
        request = small_request(TaskKind.SYNTHESIZE, _SMALL.format(self._answered))
        *_, last = self.synthesis.Synthesize(request, timeout=PATIENCE_S, **self.other)
        assert last.result.status == pb.SYNTHESIS_STATUS_SUPERVISOR

    def busy_workers(self) -> list[int]:
        """Processes of tasks that have worked for a third of a second."""
        fork_servers = children_of(self._pid)
        workers = [worker for fork_server in fork_servers for worker in children_of(fork_server)]
        return [worker for worker in workers if _ticks(worker) > 30]


def _ticks(pid: int) -> int:
    try:
        return cpu_ticks(pid)
    except (FileNotFoundError, ProcessLookupError):
        return 0


@contextmanager
def server(folder: Path, *arguments: str) -> Iterator[Server]:
    made = [make_token(name, (Scope.SYNTHESIZE,)) for name in ("stranger", "other")]
    tokens = folder / "tokens"
    tokens.write_text("".join(line + "\n" for _, line in made))
    tokens.chmod(0o600)
    words = ("--worker-processes", "2", "--tokens", str(tokens), *_NODES, *arguments)
    with server_process(*words) as (process, address), grpc.insecure_channel(address) as channel:
        yield Server(process.pid, channel, *(token for token, _ in made))
        assert process.poll() is None


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server that gives no task more than a second of a processor's time."""
    with server(tmp_path_factory.mktemp("quick"), "--task-cpu-seconds", "1") as served:
        yield served


def is_refused_while_others_are_answered(served: Server, text: str, ending: tuple[str, str]) -> None:
    with ThreadPoolExecutor(1) as threads:
        refusal = threads.submit(served.refusal, text)
        assert eventually(lambda: bool(served.busy_workers()) or refusal.done())
        meanwhile = 0
        while not refusal.done():
            served.answers_another()
            meanwhile += not refusal.done()
        assert refusal.result() == ending
        assert meanwhile
        served.answers_another()
        # Memory of a process is given back before the process is gone.
        assert eventually(lambda: served.busy_workers() == [])


def test_a_model_that_takes_all_memory(tmp_path: Path) -> None:
    """Its engine is refused memory, deep in a library in C."""
    with server(tmp_path, "--task-memory-bytes", "256MiB") as served:
        is_refused_while_others_are_answered(served, all_different(), ("RESOURCE_EXHAUSTED", "MEMORY_LIMIT"))


def test_a_model_without_end(quick: Server) -> None:
    is_refused_while_others_are_answered(quick, products(), ("RESOURCE_EXHAUSTED", "CPU_LIMIT"))


def test_a_model_without_end_by_the_clock(tmp_path: Path) -> None:
    with server(tmp_path, "--task-seconds", "2") as served:
        is_refused_while_others_are_answered(served, products(), ("DEADLINE_EXCEEDED", "TIME_LIMIT"))


def test_who_takes_all_workers_keeps_nobody_waiting(tmp_path: Path) -> None:
    with server(tmp_path) as served:
        requests = [small_request(TaskKind.SYNTHESIZE, f"{products()}\n// {number}") for number in range(2)]
        endless = [served.synthesis.Synthesize(request, timeout=PATIENCE_S, **served.stranger) for request in requests]
        assert eventually(lambda: len(served.busy_workers()) == len(endless))
        for _ in range(3):
            served.answers_another()
        # They are at it still: no other was answered in their place.
        assert len(served.busy_workers()) == len(endless)
        for call in endless:
            call.cancel()
        assert eventually(lambda: not served.busy_workers())


def test_a_job_without_end_fails_by_its_limit_and_one_whose_worker_is_killed_by_that(quick: Server) -> None:
    served = quick
    task = jobs_pb2.Task(synthesize=small_request(TaskKind.SYNTHESIZE, products()))
    request = jobs_pb2.SubmitJobRequest(task=task)

    def job(job_id: str) -> Any:
        return served.jobs.GetJob(jobs_pb2.GetJobRequest(id=job_id), timeout=PATIENCE_S, **served.stranger).job

    ids = [served.jobs.SubmitJob(request, timeout=PATIENCE_S, **served.stranger).job.id for _ in range(2)]
    busy: list[int] = []

    def is_one_busy() -> bool:
        busy[:] = served.busy_workers()
        return bool(busy)

    assert eventually(is_one_busy)
    os.kill(busy[0], signal.SIGKILL)
    served.answers_another()
    end_s = time.monotonic() + PATIENCE_S
    while not all(job(job_id).HasField("end_time") for job_id in ids):
        served.answers_another()
        assert time.monotonic() < end_s
    ended = [job(job_id) for job_id in ids]
    assert {found.state for found in ended} == {jobs_pb2.JOB_STATE_FAILED}
    assert sorted(found.failure.reason for found in ended) == ["CPU_LIMIT", "WORKER_DIED"]
    assert [found.attempts for found in ended] == [1, 1]
