"""Whole servers as processes that are killed in the middle of it, and disks that are full."""

import asyncio
import hashlib
import subprocess
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import ExitStack, asynccontextmanager
from pathlib import Path
from typing import Any

import grpc.aio

from robosc_api.v1 import jobs_pb2 as pb
from robosc_api.v1 import jobs_pb2_grpc
from robosc_server.store import JobState
from robosc_server.tasks.task import Reason, RefusedError, TaskKind
from support.job_parts import ME, Choices, ended, in_loop, is_in, parts
from support.job_server import job_server
from support.job_workers import messages_for, task_message, task_of
from support.small_disks import fill, small_disk
from support.waiting import PATIENCE_S, until

_JOBS = 50


@asynccontextmanager
async def stub_for(address: str) -> AsyncIterator[Any]:
    async with grpc.aio.insecure_channel(address) as channel:
        await asyncio.wait_for(channel.channel_ready(), PATIENCE_S)
        yield jobs_pb2_grpc.JobServiceStub(channel)  # type: ignore[no-untyped-call]


async def job_at(stub: Any, job_id: str) -> Any:
    return (await stub.GetJob(pb.GetJobRequest(id=job_id))).job


async def watched(stub: Any, job_id: str, after_revision: int = 0) -> Any:
    """A job when it has ended."""
    async with asyncio.timeout(PATIENCE_S):
        async for news in stub.WatchJob(pb.WatchJobRequest(id=job_id, after_revision=after_revision)):
            job = news.job
    assert job.HasField("end_time")
    return job


async def result_at(stub: Any, job_id: str) -> list[bytes]:
    call = stub.GetJobResult(pb.GetJobResultRequest(id=job_id))
    return [response.SerializeToString() async for response in call]


def text_of(number: int, folder: Path) -> str:
    """Writes down that it has begun, and ends when it is released."""
    return f"log {folder / 'begun'}\nuntil {folder / f'gate{number}'}\nreport 2\nbig 100000"


def begun(folder: Path) -> Counter[str]:
    path = folder / "begun"
    return Counter(path.read_text().splitlines() if path.exists() else ())


async def submit_all(stub: Any, folder: Path) -> list[str]:
    ids = []
    for number in range(_JOBS):
        task = task_message(text_of(number, folder), TaskKind.SYNTHESIZE)
        answer = await stub.SubmitJob(pb.SubmitJobRequest(task=task, idempotency_key=str(number)))
        ids.append(answer.job.id)
    return ids


async def all_ended(stub: Any, ids: list[str]) -> None:
    """Wait for the end of some jobs."""
    for job_id in ids:
        await watched(stub, job_id)


async def test_a_server_is_killed_in_the_middle_of_fifty_jobs_and_nothing_is_lost(tmp_path: Path) -> None:
    state = tmp_path / "state"

    async def before(process: subprocess.Popen[str], address: str) -> tuple[list[str], list[Any], list[list[bytes]]]:
        async with stub_for(address) as stub:
            ids = await submit_all(stub, tmp_path)
            for number in range(12):
                (tmp_path / f"gate{number}").touch()
            await all_ended(stub, ids[:12])

            async def two_run() -> bool:
                states = [(await job_at(stub, job_id)).state for job_id in ids[12:14]]
                return states == [pb.JOB_STATE_RUNNING] * 2

            await until(two_run)
            jobs = [await job_at(stub, job_id) for job_id in ids]
            results = [await result_at(stub, job_id) for job_id in ids[:12]]
            # One more is on its way when the server dies.
            task = task_message("late")
            late = stub.SubmitJob(pb.SubmitJobRequest(task=task, idempotency_key="late"))
            await asyncio.sleep(0)
            process.kill()
            await asyncio.gather(late, return_exceptions=True)
        return ids, jobs, results

    with job_server(state) as (process, address):
        ids, jobs, results = await before(process, address)
    with job_server(state) as (_, address):
        async with stub_for(address) as stub:
            # Ended jobs are as they were, with their results.
            assert [await job_at(stub, job_id) for job_id in ids[:12]] == jobs[:12]
            assert [await result_at(stub, job_id) for job_id in ids[:12]] == results
            # The others are there, and what was begun twice is those that ran.
            for job_id, known in zip(ids[12:], jobs[12:], strict=True):
                job = await job_at(stub, job_id)
                assert job.state in {pb.JOB_STATE_QUEUED, pb.JOB_STATE_RUNNING}
                assert job.revision > known.revision
                assert (job.create_time, job.main_file, job.label) == (known.create_time, known.main_file, known.label)
            for number in range(12, _JOBS):
                (tmp_path / f"gate{number}").touch()
            done = [await watched(stub, job_id, known.revision) for job_id, known in zip(ids, jobs, strict=True)]
            assert {job.state for job in done} == {pb.JOB_STATE_SUCCEEDED}
            assert [job.attempts for job in done] == [1] * 12 + [2] * 2 + [1] * 36
            times = begun(tmp_path)
            texts = [hashlib.sha256(text_of(number, tmp_path).encode()).hexdigest() for number in range(_JOBS)]
            assert [times[text] for text in texts] == [1] * 12 + [2] * 2 + [1] * 36
            # Asking again with the keys finds the same jobs, and the late one once.
            assert await submit_all(stub, tmp_path) == ids
            request = pb.SubmitJobRequest(task=task_message("late"), idempotency_key="late")
            late = [(await stub.SubmitJob(request)).job.id for _ in range(2)]
            assert late[0] == late[1]
            listed = (await stub.ListJobs(pb.ListJobsRequest(page_size=1000))).jobs
            assert sorted(job.id for job in listed) == sorted([*ids, late[0]])
            (expected,) = messages_for(TaskKind.SYNTHESIZE, text_of(_JOBS - 1, tmp_path), 100_000)
            (response,) = [r async for r in stub.GetJobResult(pb.GetJobResultRequest(id=ids[-1]))]
            assert response.synthesize.SerializeToString() == expected


def test_a_server_is_killed_again_and_again_at_any_moment_and_each_answer_holds(tmp_path: Path) -> None:
    """Jobs end by themselves while others come in; what a server said before its end is true after it."""
    accepted: dict[str, tuple[str, Any]] = {}

    async def work(process: subprocess.Popen[str], address: str, life: int) -> None:
        async with stub_for(address) as stub:
            for job_id, (_, last) in accepted.items():
                job = await job_at(stub, job_id)
                assert job.revision >= last.revision
                assert job == last or not last.HasField("end_time")

            async def submit(number: int) -> None:
                key = f"{life}.{number}"
                request = pb.SubmitJobRequest(task=task_message(f"report 1\nbig {number}"), idempotency_key=key)
                answer = await stub.SubmitJob(request)
                accepted[answer.job.id] = key, answer.job
                async for news in stub.WatchJob(pb.WatchJobRequest(id=answer.job.id)):
                    accepted[answer.job.id] = key, news.job

            submitting = [asyncio.create_task(submit(number)) for number in range(15)]
            # Each time a little later.
            await until(lambda: _so_many(accepted, life, life * 3))
            process.kill()
            await asyncio.gather(*submitting, return_exceptions=True)

    for life in range(3):
        with job_server(tmp_path / "state") as (process, address):
            asyncio.run(work(process, address, life))

    async def last(address: str) -> None:
        async with stub_for(address) as stub:
            listed = (await stub.ListJobs(pb.ListJobsRequest(page_size=1000))).jobs
            assert {job.id for job in listed} >= set(accepted)
            done = [await watched(stub, job.id) for job in listed]
            assert {job.state for job in done} <= {pb.JOB_STATE_SUCCEEDED, pb.JOB_STATE_FAILED}
            assert {job.failure.reason for job in done} <= {"", "SERVER_DIED"}
            assert all(job.attempts <= 2 for job in done)

    with job_server(tmp_path / "state") as (_, address):
        asyncio.run(last(address))


async def _so_many(accepted: dict[str, tuple[str, Any]], life: int, number: int) -> bool:
    return sum(key.startswith(f"{life}.") for key, _ in accepted.values()) >= number


_REAL_JOBS = 10
_MODEL = (Path(__file__).parents[3] / "examples/line_follower/line_follower.rscd").read_text("utf-8")


def test_real_workers_die_with_their_server_and_their_jobs_run_again(tmp_path: Path) -> None:
    def request_of(number: int) -> pb.SubmitJobRequest:
        # Another model for each: none is answered from the store.
        task = task_message(f"{_MODEL}\n// {number}\n", TaskKind.SYNTHESIZE)
        return pb.SubmitJobRequest(task=task, idempotency_key=str(number))

    async def before(process: subprocess.Popen[str], address: str) -> list[str]:
        async with stub_for(address) as stub:
            ids = [(await stub.SubmitJob(request_of(number))).job.id for number in range(_REAL_JOBS)]
            await all_ended(stub, ids[:4])
            process.kill()
        return ids

    async def after(address: str, ids: list[str]) -> None:
        async with stub_for(address) as stub:
            done = [await watched(stub, job_id) for job_id in ids]
            assert {job.state for job in done} == {pb.JOB_STATE_SUCCEEDED}
            assert all(job.attempts in {1, 2} for job in done)
            assert sum(job.attempts == 2 for job in done) <= 2
            supervisors = set()
            for job_id in ids:
                (response,) = [r async for r in stub.GetJobResult(pb.GetJobResultRequest(id=job_id))]
                result = response.synthesize.result
                assert hashlib.sha256(result.supervisor).digest() == result.supervisor_digest
                supervisors.add(result.supervisor_digest)
            assert len(supervisors) >= 1
            again = [(await stub.SubmitJob(request_of(number))).job.id for number in range(_REAL_JOBS)]
            assert again == ids

    with job_server(tmp_path / "state", workers="local") as (process, address):
        ids = asyncio.run(before(process, address))
        process.wait(PATIENCE_S)

        async def none_left() -> bool:
            return not children_of_session(process.pid)

        asyncio.run(until(none_left))
    with job_server(tmp_path / "state", workers="local") as (_, address):
        asyncio.run(after(address, ids))


def children_of_session(folder_of: int) -> list[int]:
    """Processes whose command line names the server that has died: its fork servers and workers."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if folder_of in {int(fields[1]), int(fields[2])} and fields[0] != "Z" and int(entry.name) != folder_of:
                found.append(int(entry.name))
    return found


async def test_of_two_servers_one_is_killed_and_the_other_carries_its_jobs_on(
    tmp_path: Path, database_url: str
) -> None:
    with ExitStack() as stack:
        process, dying = stack.enter_context(job_server(tmp_path / "a", database_url))
        _, living = stack.enter_context(job_server(tmp_path / "b", database_url))
        async with stub_for(dying) as first, stub_for(living) as second:
            ids = await submit_all(first, tmp_path)
            for number in range(5):
                (tmp_path / f"gate{number}").touch()
            await all_ended(second, ids[:5])
            before = [await result_at(first, job_id) for job_id in ids[:5]]
            watching = [asyncio.create_task(watched(second, job_id)) for job_id in ids]
            process.kill()
            assert [await result_at(second, job_id) for job_id in ids[:5]] == before
            for number in range(5, _JOBS):
                (tmp_path / f"gate{number}").touch()
            done = await asyncio.gather(*watching)
            assert {job.state for job in done} == {pb.JOB_STATE_SUCCEEDED}
            assert sum(job.attempts - 1 for job in done) <= 2
            assert sum(begun(tmp_path).values()) <= _JOBS + 2
            assert await submit_all(second, tmp_path) == ids


def test_a_full_disk_refuses_jobs_and_the_server_lives_on(tmp_path: Path) -> None:
    async def test(disk: Path) -> None:
        async with parts(disk, Choices(capacity=1)) as made:
            before, _ = await made.manager.submit(task_of("before"), ME)
            await ended(made.manager, before.id)
            gate = tmp_path / "gate"
            running, _ = await made.manager.submit(task_of(f"until {gate}\nbig 3000000", TaskKind.SYNTHESIZE), ME)
            await until(lambda: is_in(made.manager, running.id, JobState.RUNNING))
            watching = asyncio.create_task(ended(made.manager, running.id))
            fill(disk / "filler")
            accepted, refusals = [], 0
            for number in range(40):
                try:
                    job, _ = await made.manager.submit(task_of(f"{number}\n" + "x" * 200_000), ME)
                    accepted.append(job.id)
                except RefusedError as error:
                    assert error.reason is Reason.STORE_UNAVAILABLE
                    refusals += 1
            assert refusals >= 10
            assert not made.store.is_available
            # Stored results are read.
            assert (await made.manager.get(before.id, ME)).state is JobState.SUCCEEDED
            gate.touch()

            async def is_through() -> bool:
                return made.workers.running == 0

            await until(is_through)
            assert not watching.done()
            (disk / "filler").unlink()
            done = await watching
            assert (done.state, done.attempts) == (JobState.SUCCEEDED, 1)
            for job_id in accepted:
                assert (await ended(made.manager, job_id)).state is JobState.SUCCEEDED
            after, _ = await made.manager.submit(task_of("after"), ME)
            assert (await ended(made.manager, after.id)).state is JobState.SUCCEEDED
            assert made.store.is_available
            assert (made.scheduler.running, made.scheduler.waiting) == (0, 0)

    with small_disk(tmp_path / "disk", "16m") as disk:
        in_loop(lambda: test(disk))
