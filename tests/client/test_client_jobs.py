"""Jobs of both clients, and watches across lost connections, against answers that a test has written."""

import threading
from contextlib import ExitStack
from datetime import UTC, datetime
from typing import Any

import grpc
import pytest

from robosc_api.v1 import jobs_pb2
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client import (
    Check,
    DeadlineError,
    JobState,
    RetryPolicy,
    ServerUnavailableError,
    ServiceError,
    Synthesize,
    TaskKind,
)
from support.answers import job, watched
from support.both_clients import AWAY, QUICK, Talk
from support.models import bundle_of
from support.scripted_service import Refusal, held, kept_port, scripted
from support.waiting import PATIENCE_S

BUNDLE = bundle_of("robot R { }")


class TestWatch:
    def states(self, *numbers: int) -> Any:
        """A job's revisions; the last one has ended."""
        *first, last = numbers
        return watched(*(job(number) for number in first), job(last, jobs_pb2.JOB_STATE_SUCCEEDED))

    def test_resumed_after_lost_connections(self, connect: Any) -> None:
        """Check what ends a watch before its job: an error, and a stream that ends; nothing is reported twice."""
        parts = [[AWAY], [*watched(job(1), job(4)), AWAY], watched(job(5)), [AWAY], [AWAY], self.states(7, 9)]
        with (
            scripted(WatchJob=parts) as (address, script),
            connect(address, sleep=lambda seconds: None, retries=RetryPolicy(watch_attempts=4)) as client,
        ):
            assert [item.revision for item in client.watch("job-1")] == [1, 4, 5, 7, 9]
            assert [item.after_revision for item in script.of("WatchJob")] == [0, 0, 4, 5, 5, 5]

    @pytest.mark.parametrize(
        ("code", "message"),
        [
            ("UNKNOWN", "Stream removed (Data frame with END_STREAM flag received)"),
            ("INTERNAL", "Received RST_STREAM with error code 2"),
            ("CANCELLED", "RST_STREAM (8)"),
        ],
    )
    def test_resumed_when_a_proxy_has_lost_the_server(self, connect: Any, code: str, message: str) -> None:
        lost = Refusal(grpc.StatusCode[code], message)
        got = [jobs_pb2.GetJobResponse(job=job())]
        with (
            scripted(WatchJob=[[*watched(job(1)), lost], self.states(2)], GetJob=[[lost], got]) as (address, script),
            connect(address, sleep=lambda seconds: None) as client,
        ):
            assert [item.revision for item in client.watch("job-1")] == [1, 2]
            assert [item.after_revision for item in script.of("WatchJob")] == [0, 1]
            assert client.get_job("job-1").revision == 1

    def test_resumed_with_a_server_that_was_started_anew(self, connect: Any) -> None:
        with kept_port() as port, ExitStack() as first:
            address, _ = first.enter_context(scripted(port=port, WatchJob=[[*watched(job(1)), held]]))
            with connect(address, retries=RetryPolicy(first_s=0.05, watch_attempts=50)) as client:
                items = iter(client.watch("job-1"))
                assert next(items).revision == 1
                first.close()
                with scripted(port=port, WatchJob=[self.states(2)]) as (_, script):
                    assert [item.revision for item in items] == [2]
                    assert script.of("WatchJob")[0].after_revision == 1

    def test_a_stream_that_always_ends_is_not_asked_for_ever(self, connect: Any) -> None:
        with (
            scripted(WatchJob=[[]]) as (address, script),
            connect(address, sleep=lambda seconds: None) as client,
            pytest.raises(ServerUnavailableError),
        ):
            list(client.watch("job-1"))
        assert len(script.of("WatchJob")) == QUICK.watch_attempts

    @pytest.mark.parametrize(
        "jobs", [(job(3), job(3)), (job(3), job(2)), (job(id="job-2"),), (job(0),), (job(state=0),), (job(kind=0),)]
    )
    def test_what_no_server_reports(self, talk: Talk, jobs: Any) -> None:
        with talk(WatchJob=[watched(*jobs)]) as (client, _), pytest.raises(ServiceError, match="malformed"):
            list(client.watch("job-1"))

    def test_deadline(self, talk: Talk) -> None:
        with talk(WatchJob=[[*watched(job(1)), held]]) as (client, _), pytest.raises(DeadlineError):
            client.wait("job-1", deadline_s=0.4)

    def test_wait(self, talk: Talk) -> None:
        with talk(WatchJob=[self.states(1, 2, 3)]) as (client, _):
            found = client.wait("job-1")
            assert (found.state, found.revision) == (JobState.SUCCEEDED, 3)

    def test_an_unread_watch_is_ended(self, talk: Talk) -> None:
        ended = threading.Event()

        def noted(context: Any) -> Any:
            context.add_callback(ended.set)
            return ()

        with talk(WatchJob=[[noted, *watched(job(1)), held]]) as (client, _):
            items = client.watch("job-1")
            next(items)
            items.close()
            assert ended.wait(PATIENCE_S)


class TestJobs:
    def test_values(self, talk: Talk) -> None:
        message = job(
            5,
            jobs_pb2.JOB_STATE_FAILED,
            label="mine\x1b",
            attempts=2,
            from_store=True,
            waiting_before=3,
            progress=pb.Progress(stage="check", message="m"),
        )
        message.start_time.seconds = 1_700_000_001
        message.end_time.seconds = 1_700_000_002
        message.expire_time.seconds = 1_700_000_003
        with talk(GetJob=[[jobs_pb2.GetJobResponse(job=message)]]) as (client, _):
            found = client.get_job("job-1")
        assert (found.id, found.owner, found.kind, found.state) == (
            "job-1", "tester", TaskKind.SYNTHESIZE, JobState.FAILED
        )  # fmt: skip
        assert found.created == datetime.fromtimestamp(1_700_000_000, UTC)
        assert [item.timestamp() % 10 for item in (found.started, found.ended, found.expires)] == [1, 2, 3]
        assert (found.attempts, found.from_store, found.waiting_before, found.main_file) == (2, True, 3, "robot.rscd")
        assert (found.failure.reason, found.failure.message) == ("CPU_LIMIT", "too long")
        assert found.label == "mine\\x1b"

    @pytest.mark.parametrize(
        "message",
        [
            job(id="../x"),
            job(id=""),
            job(id="x" * 200),
            job(id="other"),
            job(failure=jobs_pb2.Failure(reason="x")),
            job(create_time={"seconds": 2**60}),
        ],
    )
    def test_what_no_server_reports(self, talk: Talk, message: Any) -> None:
        with (
            talk(GetJob=[[jobs_pb2.GetJobResponse(job=message)]]) as (client, _),
            pytest.raises(ServiceError, match="malformed"),
        ):
            client.get_job("job-1")

    def test_submission(self, talk: Talk) -> None:
        answer = jobs_pb2.SubmitJobResponse(job=job(), existed=True)
        with talk(SubmitJob=[[answer]]) as (client, script):
            assert client.submit(Check(BUNDLE)).existed
            client.submit(Check(BUNDLE))
            client.submit(Synthesize(BUNDLE), idempotency_key="mine", label="a label", retention_s=1.5)
            first, second, third = script.of("SubmitJob")
        assert len(first.idempotency_key) == 32
        assert first.idempotency_key != second.idempotency_key
        assert first.task.WhichOneof("request") == "check"
        assert not first.HasField("retention")
        assert (third.idempotency_key, third.label, third.retention.ToMilliseconds()) == ("mine", "a label", 1500)

    def test_pages(self, talk: Talk) -> None:
        def page(token: str, *numbers: int) -> list[Any]:
            return [jobs_pb2.ListJobsResponse(jobs=[job(id=f"job-{n}") for n in numbers], next_page_token=token)]

        pages = [page("a", 1, 2), page("b"), page("", 3)]
        with talk(ListJobs=pages) as (client, script):
            chosen = {"states": (JobState.QUEUED,), "kind": TaskKind.CHECK, "all_owners": True, "page_size": 2}
            assert [item.id for item in client.list_jobs(**chosen)] == ["job-1", "job-2", "job-3"]
            assert [item.page_token for item in script.of("ListJobs")] == ["", "a", "b"]
            asked = script.of("ListJobs")[2]
        assert (list(asked.states), asked.kind, asked.all_owners, asked.page_size) == ([1], 1, True, 2)

    def test_pages_without_an_end(self, talk: Talk) -> None:
        same = [jobs_pb2.ListJobsResponse(next_page_token="a")]
        many = [jobs_pb2.ListJobsResponse(jobs=[job() for _ in range(3)])]
        changing = [[jobs_pb2.ListJobsResponse(next_page_token=str(number))] for number in range(200)]
        for pages in ([same], [many], changing):
            with (
                talk(ListJobs=pages) as (client, _),
                pytest.raises(ServiceError, match=r"does not end|more than 2 jobs"),
            ):
                list(client.list_jobs(page_size=2))
