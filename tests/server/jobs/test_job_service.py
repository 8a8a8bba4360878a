"""The RPCs of jobs, over real gRPC."""

import asyncio
import base64
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, cast

import grpc
import pytest
from google.protobuf import duration_pb2
from google.rpc import error_details_pb2
from grpc_status import rpc_status
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc_api.v1 import jobs_pb2 as pb
from robosc_server.jobs import Caller, JobLimits, QueueLimits, caller_of
from robosc_server.jobs.convert import page_position, page_token, result_response
from robosc_server.jobs.manager import JobManager
from robosc_server.jobs.service import Context, JobService
from robosc_server.store import JobFilter, JobRecord, JobState, StoreUnavailableError
from robosc_server.tasks.task import Reason, RefusedError, TaskKind
from support.effort import examples
from support.job_parts import Choices, Parts, in_loop, offered, parts
from support.job_workers import messages_for, task_message
from support.waiting import until

_NEVER = "until /nowhere/never"


@asynccontextmanager
async def service(
    folder: Path, choices: Choices | None = None, identify: Callable[[Context], Caller] | None = None
) -> AsyncIterator[tuple[Parts, Any]]:
    async with parts(folder, choices) as made, offered(made.manager, identify or caller_of) as stub:
        yield made, stub


def submission(text: str, kind: TaskKind = TaskKind.CHECK, **fields: Any) -> pb.SubmitJobRequest:
    return pb.SubmitJobRequest(task=task_message(text, kind), **fields)


async def refusal_of(call: Any) -> tuple[grpc.StatusCode, str]:
    """The status and the reason that a call ends with."""
    try:
        if hasattr(call, "__aiter__"):
            async for _ in call:
                pass
        else:
            await call
    except grpc.aio.AioRpcError as error:
        status = rpc_status.from_call(_Ended(error))
        info = error_details_pb2.ErrorInfo()
        assert status is not None and status.details[0].Unpack(info)
        assert info.domain == "robosc"
        return error.code(), info.reason
    raise AssertionError("it was answered")


class _Ended:
    """An error as `rpc_status` wants calls to be."""

    def __init__(self, error: grpc.aio.AioRpcError) -> None:
        self.code, self.details, self.trailing_metadata = error.code, error.details, error.trailing_metadata


@pytest.mark.parametrize("kind", [TaskKind.CHECK, TaskKind.SYNTHESIZE, TaskKind.GENERATE])
def test_a_job_from_its_submission_to_its_result(tmp_path: Path, kind: TaskKind) -> None:
    async def test() -> None:
        async with service(tmp_path) as (_, stub):
            text = "report 1\nbig 200000"
            answer = await stub.SubmitJob(submission(text, kind, label="mine"))
            job = answer.job
            assert not answer.existed
            assert (job.owner, job.label, job.main_file) == ("127.0.0.1", "mine", "robot.rscd")
            assert pb.TaskKind.Name(job.kind) == f"TASK_KIND_{kind.name}"
            states = [told.job.state async for told in stub.WatchJob(pb.WatchJobRequest(id=job.id))]
            assert states[-1] == pb.JOB_STATE_SUCCEEDED
            got = (await stub.GetJob(pb.GetJobRequest(id=job.id))).job
            assert got.attempts == 1 and not got.from_store
            assert got.create_time.ToMicroseconds() <= got.start_time.ToMicroseconds() <= got.end_time.ToMicroseconds()
            assert got.expire_time.seconds - got.end_time.seconds == 7 * 86400
            assert not got.HasField("failure")
            responses = [message async for message in stub.GetJobResult(pb.GetJobResultRequest(id=job.id))]
            expected = messages_for(kind, text, 200000)
            assert [getattr(response, kind.value).SerializeToString() for response in responses] == list(expected)

    in_loop(test)


@given(st.sampled_from(TaskKind), st.binary(max_size=127))
def test_what_is_put_around_a_message_reads_as_if_it_had_been_parsed(kind: TaskKind, content: bytes) -> None:
    # A field that no message has, of number 2047: so the bytes are a message of each kind.
    inner = b"\xfa\x7f" + bytes([len(content)]) + content
    twin = pb.GetJobResultResponse()
    getattr(twin, kind.value).ParseFromString(inner)
    getattr(twin, kind.value).SetInParent()
    assert result_response(kind, inner) == twin.SerializeToString()


def test_what_is_wrong_with_requests_is_told(tmp_path: Path) -> None:
    async def test() -> None:
        async with service(tmp_path, Choices(capacity=1, queue=QueueLimits(1, 1))) as (_, stub):
            malformed = (grpc.StatusCode.INVALID_ARGUMENT, "MALFORMED_REQUEST")
            negative = duration_pb2.Duration(seconds=-1)
            odd = duration_pb2.Duration(nanos=2_000_000_000)
            for wrong in (
                pb.SubmitJobRequest(),
                submission("a", idempotency_key="k" * 129),
                submission("a", idempotency_key="é"),
                submission("a", idempotency_key="a\nb"),
                submission("a", label="x" * 201),
                submission("a", label="a\0b"),
                submission("a", retention=negative),
                submission("a", retention=odd),
            ):
                assert await refusal_of(stub.SubmitJob(wrong)) == malformed
            unknown = (grpc.StatusCode.NOT_FOUND, "NO_SUCH_JOB")
            for text in ("", "x", "x" * 65, "../..", "é", "' OR 1=1 --", "0" * 32, "a\0b"):
                assert await refusal_of(stub.GetJob(pb.GetJobRequest(id=text))) == unknown
                assert await refusal_of(stub.WatchJob(pb.WatchJobRequest(id=text))) == unknown
                assert await refusal_of(stub.CancelJob(pb.CancelJobRequest(id=text))) == unknown
                assert await refusal_of(stub.GetJobResult(pb.GetJobResultRequest(id=text))) == unknown
            for list_request in (
                pb.ListJobsRequest(states=[17]),  # type: ignore[list-item]
                pb.ListJobsRequest(states=[pb.JOB_STATE_UNSPECIFIED]),
                pb.ListJobsRequest(kind=99),  # type: ignore[arg-type]
                pb.ListJobsRequest(page_token="x"),
                pb.ListJobsRequest(page_token="A" * 44),
                pb.ListJobsRequest(page_token="é" * 44),
                pb.ListJobsRequest(page_token="A" * 100_000),
            ):
                assert await refusal_of(stub.ListJobs(list_request)) == malformed
            denied = (grpc.StatusCode.PERMISSION_DENIED, "PERMISSION_DENIED")
            assert await refusal_of(stub.ListJobs(pb.ListJobsRequest(all_owners=True))) == denied
            running = await stub.SubmitJob(submission(_NEVER, idempotency_key="k"))
            result = stub.GetJobResult(pb.GetJobResultRequest(id=running.job.id))
            assert await refusal_of(result) == (grpc.StatusCode.FAILED_PRECONDITION, "JOB_NOT_ENDED")
            reused = stub.SubmitJob(submission("b", idempotency_key="k"))
            assert await refusal_of(reused) == (grpc.StatusCode.ALREADY_EXISTS, "IDEMPOTENCY_KEY_REUSED")
            waiting = await stub.SubmitJob(submission("waits"))
            assert waiting.job.state == pb.JOB_STATE_QUEUED
            busy = stub.SubmitJob(submission("too many"))
            assert await refusal_of(busy) == (grpc.StatusCode.RESOURCE_EXHAUSTED, "SERVER_BUSY")
            assert "retry-after" in dict(await busy.trailing_metadata())
            cancelled = await stub.CancelJob(pb.CancelJobRequest(id=running.job.id))
            assert cancelled.job.state == pb.JOB_STATE_CANCELLED

    in_loop(test)


def test_a_failed_job_tells_why(tmp_path: Path) -> None:
    async def test() -> None:
        async with service(tmp_path) as (_, stub):
            job = (await stub.SubmitJob(submission("fail MEMORY_LIMIT"))).job
            *_, last = [told.job async for told in stub.WatchJob(pb.WatchJobRequest(id=job.id))]
            assert last.state == pb.JOB_STATE_FAILED
            assert (last.failure.code, last.failure.reason) == (8, "MEMORY_LIMIT")
            result = stub.GetJobResult(pb.GetJobResultRequest(id=job.id))
            assert await refusal_of(result) == (grpc.StatusCode.FAILED_PRECONDITION, "JOB_HAS_FAILED")

    in_loop(test)


def test_pages_hold_all_jobs_once_and_tokens_hold_for_one_list(tmp_path: Path) -> None:
    async def test() -> None:
        callers = iter([Caller("me")] * 5 + [Caller("you")] * 2)
        current = [Caller("me")]
        choices = Choices()
        async with service(tmp_path, choices, lambda _: current[0]) as (_, stub):
            ids = []
            for number, caller in enumerate(callers):
                current[0] = caller
                choices.times.wall_s += 1.0
                ids.append((await stub.SubmitJob(submission(str(number)))).job.id)
            current[0] = Caller("me")
            found, token, sizes = [], "", []
            while True:
                page = await stub.ListJobs(pb.ListJobsRequest(page_size=2, page_token=token))
                found += [job.id for job in page.jobs]
                sizes.append(len(page.jobs))
                if not page.next_page_token:
                    break
                token = page.next_page_token
            assert (sizes, found) == ([2, 2, 1], ids[4::-1])
            other = stub.ListJobs(pb.ListJobsRequest(page_token=token, kind=pb.TASK_KIND_CHECK))
            assert (await refusal_of(other))[0] == grpc.StatusCode.INVALID_ARGUMENT
            current[0] = Caller("boss", is_admin=True)
            everything = await stub.ListJobs(pb.ListJobsRequest(all_owners=True))
            assert [job.id for job in everything.jobs] == ids[::-1]
            assert len((await stub.ListJobs(pb.ListJobsRequest())).jobs) == 0

    in_loop(test)


def test_the_load_of_callers_is_for_themselves_and_an_admin(tmp_path: Path) -> None:
    async def test() -> None:
        current = [Caller("me")]
        choices = Choices(capacity=1)
        async with service(tmp_path, choices, lambda _: current[0]) as (_, stub):

            async def loads(*, all_callers: bool = False) -> dict[str, pb.CallerLoad]:
                answer = await stub.GetLoad(pb.GetLoadRequest(all_callers=all_callers))
                assert (answer.workers, answer.running_tasks, answer.waiting_tasks, answer.servers) == (1, 1, 2, 1)
                assert answer.time.ToSeconds() == choices.times.wall_s
                return {load.caller: load for load in answer.callers}

            done = (await stub.SubmitJob(submission("done"))).job.id
            async for _ in stub.WatchJob(pb.WatchJobRequest(id=done)):
                pass
            running = (await stub.SubmitJob(submission(_NEVER))).job.id
            choices.times.wall_s += 59.0
            first = (await stub.SubmitJob(submission("first"))).job
            current[0] = Caller("you")
            choices.times.wall_s += 2.0
            await stub.SubmitJob(submission("second"))
            await until(lambda: _is_running(stub, running, current))

            current[0] = Caller("me")
            mine = pb.CallerLoad(
                caller="me", waiting_tasks=1, running_tasks=1, queued_jobs=1, running_jobs=1, ended_jobs=0
            )
            mine.first_queued_time.CopyFrom(first.create_time)
            # Tasks that ended a minute ago count no more.
            assert await loads() == {"me": mine}
            choices.times.wall_s -= 2.0
            assert (await loads())["me"].ended_jobs == 1
            choices.times.wall_s += 2.0
            denied = (grpc.StatusCode.PERMISSION_DENIED, "PERMISSION_DENIED")
            assert await refusal_of(stub.GetLoad(pb.GetLoadRequest(all_callers=True))) == denied
            current[0] = Caller("boss", is_admin=True)
            assert await loads() == {}
            everything = await loads(all_callers=True)
            assert list(everything) == ["me", "you"] and everything["me"] == mine
            assert (everything["you"].queued_jobs, everything["you"].waiting_tasks) == (1, 1)

    in_loop(test)


async def _is_running(stub: Any, job_id: str, current: list[Caller]) -> bool:
    asking, current[0] = current[0], Caller("me")
    state = (await stub.GetJob(pb.GetJobRequest(id=job_id))).job.state
    current[0] = asking
    return bool(state == pb.JOB_STATE_RUNNING)


_ALL = JobFilter("me", frozenset({JobState.FAILED}), None)


class Kept:
    """Stands for a manager that has many jobs."""

    async def list_jobs(self, chosen: JobFilter, after: tuple[int, str] | None, limit: int) -> list[JobRecord]:
        return [
            JobRecord(f"{number:032x}", "me", TaskKind.CHECK, JobState.FAILED, 1, "k", "f", "", None, 0, number)
            for number in range(limit)
        ]

    def waiting_before(self, record: JobRecord) -> int:
        return 0

    def require_room(self, caller: Caller) -> None:
        """Accept: the server has room."""


@pytest.mark.parametrize("size", [1, 20, 21, 1000])
def test_others_have_their_turn_while_a_long_list_is_made(size: int) -> None:
    def nothing(*_: Any) -> Any:
        raise AssertionError("not asked for")

    async def test() -> None:
        service = JobService(cast(JobManager, Kept()), nothing, lambda _: Caller("me"))
        turns = 0

        async def other() -> None:
            nonlocal turns
            while True:
                turns += 1
                await asyncio.sleep(0)

        task = asyncio.create_task(other())
        answer = await service.ListJobs(pb.ListJobsRequest(page_size=size), cast(Any, None))
        assert [int(job.id, 16) for job in answer.jobs] == list(range(size))
        assert answer.next_page_token
        assert turns >= size // 20
        task.cancel()

    asyncio.run(test())


@settings(max_examples=examples(40))
@given(st.one_of(st.text(max_size=60), st.binary(max_size=40).map(lambda raw: base64.urlsafe_b64encode(raw).decode())))
def test_no_page_token_is_taken_that_was_not_given(token: str) -> None:
    if token:
        with pytest.raises(RefusedError) as refused:
            page_position(token, _ALL)
        assert refused.value.reason is Reason.MALFORMED_REQUEST


def test_a_submission_beyond_the_quota_is_not_looked_at() -> None:
    """One that asks again with its key is, since it may ask for nothing new."""
    looked: list[bytes] = []

    def accept(kind: TaskKind, request: bytes) -> Any:
        looked.append(request)
        raise RefusedError(Reason.MALFORMED_REQUEST, "looked at")

    def admit(caller: str) -> None:
        raise RefusedError(Reason.QUOTA_EXCEEDED, "too much", 1.0)

    async def test() -> None:
        service = JobService(cast(JobManager, Kept()), accept, lambda _: Caller("me"), admit)
        for key, reason in (("", Reason.QUOTA_EXCEEDED), ("key", Reason.MALFORMED_REQUEST)):
            with pytest.raises(RefusedError) as refused:
                await service.SubmitJob(submission("a", idempotency_key=key).SerializeToString(), cast(Any, None))
            assert refused.value.reason is reason
        assert len(looked) == 1

    asyncio.run(test())


def test_a_page_token_leads_back_to_its_place() -> None:
    record = JobRecord(
        "0123456789abcdef" * 2, "me", TaskKind.CHECK, JobState.FAILED, 1, "k", "f", "", None, 0, created_us=12345
    )
    assert page_position(page_token(record, _ALL), _ALL) == (12345, record.id)


def test_a_server_that_ends_tells_watchers_to_ask_again(tmp_path: Path) -> None:
    async def test() -> None:
        async with service(tmp_path) as (made, stub):
            job = (await stub.SubmitJob(submission(_NEVER))).job
            watching = stub.WatchJob(pb.WatchJobRequest(id=job.id))
            await anext(aiter(watching))
            await made.manager.drain(0.0)
            assert await refusal_of(watching) == (grpc.StatusCode.UNAVAILABLE, "SHUTTING_DOWN")

    in_loop(test)


def test_a_database_that_is_away_is_told_as_such(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def test() -> None:
        async with service(tmp_path) as (made, stub):

            async def away(*_: object, **__: object) -> None:
                raise StoreUnavailableError

            monkeypatch.setattr(made.store._database, "_run", away)
            expected = (grpc.StatusCode.UNAVAILABLE, "STORE_UNAVAILABLE")
            assert await refusal_of(stub.SubmitJob(submission("a"))) == expected
            assert await refusal_of(stub.GetJob(pb.GetJobRequest(id="a"))) == expected
            assert await refusal_of(stub.ListJobs(pb.ListJobsRequest())) == expected
            assert made.scheduler.running == 0
            monkeypatch.undo()
            assert (await stub.SubmitJob(submission("a"))).job.id

    in_loop(test)


def test_a_fault_of_ours_is_told_without_its_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def test() -> None:
        async with service(tmp_path) as (made, stub):

            async def broken(*_: object) -> None:
                raise ZeroDivisionError("secret")

            monkeypatch.setattr(made.manager, "get", broken)
            call = stub.GetJob(pb.GetJobRequest(id="a"))
            assert await refusal_of(call) == (grpc.StatusCode.INTERNAL, "INTERNAL_FAULT")
            assert "secret" not in await call.details()

    in_loop(test)


def test_watchers_that_go_away_leave_nothing_behind(tmp_path: Path) -> None:
    async def test() -> None:
        limits = JobLimits(poll_s=0.02, sweep_s=3600.0)
        async with service(tmp_path, Choices(limits=limits)) as (made, stub):
            job = (await stub.SubmitJob(submission(_NEVER))).job
            watching = [stub.WatchJob(pb.WatchJobRequest(id=job.id)) for _ in range(20)]
            for watch in watching:
                await anext(aiter(watch))
                watch.cancel()
            await until(lambda: not made.manager._watchers.revisions())

    in_loop(test)
