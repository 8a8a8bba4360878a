"""A whole server, a program of its own, whose disk is full or whose database is gone in the middle of calls and jobs.

What it has accepted is done and kept, once; what it cannot keep it refuses; what needs no database goes on. When the
fault is over, everything does by itself.
"""

import asyncio
import hashlib
import subprocess
from collections import Counter
from collections.abc import AsyncIterator, Iterable, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import grpc
import grpc.aio
import pytest
from grpc_health.v1 import health_pb2, health_pb2_grpc

from robosc_api.v1 import jobs_pb2 as pb
from robosc_api.v1 import jobs_pb2_grpc, synthesis_pb2_grpc
from robosc_server.jobs import JOB_SERVICE_NAME
from robosc_server.synthesis_service import SERVICE_NAME
from robosc_server.tasks.task import TaskKind
from support.job_server import job_server
from support.job_workers import messages_for, task_message
from support.postgresql import Postgresql, postgresql
from support.refusals import reason_of
from support.small_disks import fill, small_disk
from support.waiting import PATIENCE_S, until

_REFUSED_WITHIN_S = 12.0
"""Time limit of a refusal, in seconds: anything that does not answer is given up after 8 seconds."""

_GOES_ON_S = 4.0
_AT_ONCE_S = 1.5
"""A connection that is not answered is given up after 3 seconds."""


@pytest.fixture(scope="module")
def database_server() -> Iterator[Postgresql]:
    with postgresql() as server:
        yield server


class Calls:
    """Calls that a caller may ask a server for."""

    def __init__(self, channel: grpc.aio.Channel, folder: Path) -> None:
        self.folder = folder
        self._jobs: Any = jobs_pb2_grpc.JobServiceStub(channel)  # type: ignore[no-untyped-call]
        self._synthesis: Any = synthesis_pb2_grpc.SynthesisServiceStub(channel)  # type: ignore[no-untyped-call]
        self._health: Any = health_pb2_grpc.HealthStub(channel)

    def gated(self, name: str, more: str = "") -> str:
        """A task that writes down that it has begun, and ends when it is released."""
        return f"log {self.folder / 'begun'}\nuntil {self.folder / name}\n{more}"

    def open_gate(self, name: str) -> None:
        (self.folder / name).touch()

    def begun(self, text: str) -> int:
        """Return the number of times that a task was begun."""
        path = self.folder / "begun"
        lines = Counter(path.read_text().splitlines() if path.exists() else ())
        return lines[hashlib.sha256(text.encode()).hexdigest()]

    async def check(self, text: str) -> str:
        answer = await self._synthesis.Check(task_message(text).check, timeout=PATIENCE_S)
        return str(answer.diagnostics[0].message)

    async def synthesize(self, text: str) -> str:
        request = task_message(text, TaskKind.SYNTHESIZE).synthesize
        *_, last = [response async for response in self._synthesis.Synthesize(request, timeout=PATIENCE_S)]
        return str(last.result.reason)

    async def submit(self, text: str, key: str = "", kind: TaskKind = TaskKind.SYNTHESIZE) -> str:
        request = pb.SubmitJobRequest(task=task_message(text, kind), idempotency_key=key)
        return str((await self._jobs.SubmitJob(request, timeout=PATIENCE_S)).job.id)

    async def job(self, job_id: str) -> Any:
        return (await self._jobs.GetJob(pb.GetJobRequest(id=job_id), timeout=PATIENCE_S)).job

    async def jobs(self) -> list[Any]:
        return list((await self._jobs.ListJobs(pb.ListJobsRequest(page_size=1000), timeout=PATIENCE_S)).jobs)

    async def cancel(self, job_id: str) -> None:
        await self._jobs.CancelJob(pb.CancelJobRequest(id=job_id), timeout=PATIENCE_S)

    async def result(self, job_id: str) -> list[bytes]:
        call = self._jobs.GetJobResult(pb.GetJobResultRequest(id=job_id), timeout=PATIENCE_S)
        return [response.synthesize.SerializeToString() async for response in call]

    async def watch(self, job_id: str) -> Any:
        """A job when it has ended."""
        async with asyncio.timeout(PATIENCE_S):
            async for news in self._jobs.WatchJob(pb.WatchJobRequest(id=job_id)):
                job = news.job
        assert job.HasField("end_time"), job
        return job

    async def is_running(self, job_id: str) -> bool:
        return bool((await self.job(job_id)).state == pb.JOB_STATE_RUNNING)

    async def is_well(self) -> tuple[bool, bool, bool]:
        """Health: of jobs, of synthesis, and of the whole server."""
        found = []
        for service in (JOB_SERVICE_NAME, SERVICE_NAME, ""):
            request = health_pb2.HealthCheckRequest(service=service)
            answer = await self._health.Check(request, timeout=PATIENCE_S)
            found.append(answer.status == health_pb2.HealthCheckResponse.SERVING)
        return found[0], found[1], found[2]

    async def becomes(self, *well: bool) -> None:
        async def is_so() -> bool:
            return await self.is_well() == well

        await until(is_so)


@asynccontextmanager
async def calls_of(address: str, folder: Path) -> AsyncIterator[Calls]:
    async with grpc.aio.insecure_channel(address) as channel:
        await asyncio.wait_for(channel.channel_ready(), PATIENCE_S)
        yield Calls(channel, folder)


async def refused(call: Any) -> None:
    """A call that ends soon, and says that the database is away and when to come again."""
    begun_s = asyncio.get_running_loop().time()
    with pytest.raises(grpc.aio.AioRpcError) as error:
        await call
    assert error.value.code() is grpc.StatusCode.UNAVAILABLE
    assert reason_of(error.value) == "STORE_UNAVAILABLE"
    assert float(dict(error.value.trailing_metadata())["retry-after"]) > 0
    assert asyncio.get_running_loop().time() - begun_s < _REFUSED_WITHIN_S


async def goes_on(calls: Calls) -> None:
    """Calls that need no database do not wait for it, however long it is away."""
    loop = asyncio.get_running_loop()
    end_s, number = loop.time() + _GOES_ON_S, 0
    while loop.time() < end_s:
        text, begun_s = f"while it is away {number}", loop.time()
        for _ in range(2):
            assert await calls.check(text) == text
        assert loop.time() - begun_s < _AT_ONCE_S
        number += 1


async def all_done(calls: Calls, ids: Iterable[str]) -> None:
    """Each job has been done, at the first time."""
    for job in await asyncio.gather(*map(calls.watch, ids)):
        assert (job.state, job.attempts) == (pb.JOB_STATE_SUCCEEDED, 1), job


def result_of(text: str, size: int = 0) -> list[bytes]:
    return list(messages_for(TaskKind.SYNTHESIZE, text, size))


_LARGE = 3_000_000
_MANY = 40


async def test_what_a_server_accepts_while_its_disk_is_full_is_kept_and_the_rest_refused(tmp_path: Path) -> None:
    def text_of(number: int) -> str:
        return f"job {number}\n" + "x" * 200_000

    async def before(address: str, disk: Path, process: subprocess.Popen[str]) -> dict[str, str]:
        async with calls_of(address, tmp_path) as calls:
            await calls.becomes(True, True, True)
            before = await calls.submit("before")
            await all_done(calls, [before])
            large = calls.gated("gate", f"big {_LARGE}")
            running = await calls.submit(large, "running")
            await until(lambda: calls.is_running(running))
            watching = asyncio.create_task(calls.watch(running))
            synthesis = asyncio.create_task(calls.synthesize(calls.gated("gate", "call")))

            fill(disk / "filler")
            kept: dict[str, str] = {}
            for number in range(_MANY):
                try:
                    kept[str(number)] = await calls.submit(text_of(number), str(number))
                except grpc.aio.AioRpcError as error:
                    assert (error.code(), reason_of(error)) == (grpc.StatusCode.UNAVAILABLE, "STORE_UNAVAILABLE")
            assert len(kept) < _MANY - 10
            await calls.becomes(False, True, False)
            # Stored results are read, and work that needs no disk goes on.
            assert await calls.result(before) == result_of("before")
            assert {job.id for job in await calls.jobs()} >= {before, running, *kept.values()}
            calls.open_gate("gate")
            assert "call" in await synthesis
            assert await calls.check("a call") == "a call"
            assert await calls.check("a call") == "a call"
            # Its end cannot be kept: it is not reported as if it were.
            assert (await calls.job(running)).state == pb.JOB_STATE_RUNNING
            assert not watching.done()

            (disk / "filler").unlink()
            job = await watching
            assert (job.state, job.attempts) == (pb.JOB_STATE_SUCCEEDED, 1)
            assert calls.begun(large) == 1
            await all_done(calls, kept.values())
            again = {str(number): await calls.submit(text_of(number), str(number)) for number in range(_MANY)}
            assert again | kept == again
            await all_done(calls, again.values())
            await calls.becomes(True, True, True)
            assert process.poll() is None
            return {"running": running, "before": before, **again}

    with small_disk(tmp_path / "disk", "32m") as disk:
        with job_server(disk) as (process, address):
            ids = await before(address, disk, process)
        with job_server(disk) as (_, address):
            async with calls_of(address, tmp_path) as calls:
                assert {job.id for job in await calls.jobs()} == set(ids.values())
                large = calls.gated("gate", f"big {_LARGE}")
                assert await calls.result(ids["running"]) == result_of(large, _LARGE)
                for number in range(_MANY):
                    assert await calls.result(ids[str(number)]) == result_of(text_of(number))


async def test_a_server_that_is_killed_while_its_disk_is_full_has_lost_nothing_that_it_accepted(tmp_path: Path) -> None:
    async def before(address: str, disk: Path, process: subprocess.Popen[str]) -> list[str]:
        async with calls_of(address, tmp_path) as calls:
            ids = [await calls.submit(calls.gated("gate", str(number))) for number in range(5)]
            fill(disk / "filler")
            is_refused = False
            while not is_refused:
                try:
                    ids.append(await calls.submit(calls.gated("gate", "x" * 5000 + str(len(ids)))))
                except grpc.aio.AioRpcError:
                    is_refused = True
            process.kill()
            return ids

    with small_disk(tmp_path / "disk", "16m") as disk:
        with job_server(disk) as (process, address):
            ids = await before(address, disk, process)
        (disk / "filler").unlink()
        with job_server(disk) as (_, address):
            async with calls_of(address, tmp_path) as calls:
                calls.open_gate("gate")
                found = {job.id for job in await calls.jobs()}
                # One more may be kept whose caller learned that this is open.
                assert set(ids) <= found
                assert len(found) <= len(ids) + 1
                for job in await asyncio.gather(*map(calls.watch, ids)):
                    assert job.state == pb.JOB_STATE_SUCCEEDED


@pytest.mark.parametrize("way", ["stop", "freeze"])
async def test_a_database_that_is_gone_for_a_while(database_server: Postgresql, tmp_path: Path, way: str) -> None:
    with job_server(tmp_path / "state", database_server.new_database()) as (process, address):
        async with calls_of(address, tmp_path) as calls:
            succeeded, failed = await calls.submit("done"), await calls.submit("fail CPU_LIMIT")
            await asyncio.gather(*map(calls.watch, (succeeded, failed)))
            running_text = calls.gated("gate", "big 200000")
            waiting_texts = [calls.gated("later", str(number)) for number in range(4)]
            running = await calls.submit(running_text)
            await until(lambda: calls.is_running(running))
            second = await calls.submit(calls.gated("later", "second"))
            await until(lambda: calls.is_running(second))
            waiting = [await calls.submit(text) for text in waiting_texts]
            cancelled = await calls.submit(calls.gated("never"))
            await calls.cancel(cancelled)
            ended = [await calls.job(job_id) for job_id in (succeeded, failed, cancelled)]
            states = [pb.JOB_STATE_SUCCEEDED, pb.JOB_STATE_FAILED, pb.JOB_STATE_CANCELLED]
            assert [job.state for job in ended] == states
            watching = [asyncio.create_task(calls.watch(job_id)) for job_id in (running, second, *waiting)]
            await calls.becomes(True, True, True)

            await asyncio.to_thread(database_server.stop if way == "stop" else database_server.freeze)
            try:
                await asyncio.gather(
                    refused(calls.submit("refused", "key")),
                    refused(calls.job(succeeded)),
                    refused(calls.jobs()),
                    refused(calls.cancel(running)),
                    refused(calls.result(succeeded)),
                )
                await calls.becomes(False, True, False)
                # Its work goes on, and so does what needs no database, once there is a worker for it.
                calls.open_gate("gate")
                await goes_on(calls)
                assert not any(watch.done() for watch in watching)
            finally:
                await asyncio.to_thread(database_server.start if way == "stop" else database_server.thaw)

            await calls.becomes(True, True, True)
            calls.open_gate("later")
            for job in await asyncio.gather(*watching):
                assert (job.state, job.attempts) == (pb.JOB_STATE_SUCCEEDED, 1), job
            for text in (running_text, *waiting_texts):
                assert calls.begun(text) == 1
            assert await calls.result(running) == result_of(running_text, 200_000)
            assert [await calls.job(job.id) for job in ended] == ended
            assert await calls.result(succeeded) == result_of("done")
            again = [await calls.submit("refused", "key") for _ in range(2)]
            assert again[0] == again[1]
            await all_done(calls, again[:1])
            expected = {succeeded, failed, cancelled, running, second, *waiting, again[0]}
            assert {job.id for job in await calls.jobs()} == expected
            assert process.poll() is None
