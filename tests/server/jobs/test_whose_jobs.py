"""Tests of a server's permissions on a job in the database: none, unless the job is its own and as it must be."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from robosc_server.store import JobRecord, JobState, Store, open_store, replica_rows
from robosc_server.store.records import STEP
from robosc_server.tasks.task import Failure, Reason, Report, Result, TaskKind
from support.job_parts import Times

_KIND = TaskKind.CHECK
_RESULT = Result((b"result",))
_FAILURE = Failure(Reason.CPU_LIMIT, "too long")


def job(job_id: str, replica: str | None = "ours", *, key: str = "", idempotency_key: str | None = None) -> JobRecord:
    return JobRecord(
        id=job_id,
        owner="me",
        kind=_KIND,
        state=JobState.QUEUED,
        revision=1,
        key=key or f"key of {job_id}",
        main_file="main",
        label="",
        idempotency_key=idempotency_key,
        retention_us=10_000_000,
        created_us=0,
        replica=replica,
    )


@pytest.fixture
def times() -> Times:
    return Times()


@pytest.fixture
def store(tmp_path: Path, times: Times) -> Iterator[Store]:
    with closing(open_store(tmp_path, wall_clock=times.wall)) as store:
        yield store


async def take_part(store: Store, *names: str) -> None:
    for name in names:
        await store._database.write(lambda connection, name=name: replica_rows.enter(connection, name))  # type: ignore[misc]


async def found(store: Store, job_id: str) -> JobRecord:
    record = await store.find(job_id)
    assert record is not None
    return record


async def accepted(store: Store, record: JobRecord) -> JobRecord:
    answer = await store.accept(record, b"request", None, 1000)
    assert answer is not None
    return answer[0]


async def test_a_job_begins_once_and_at_its_own_server_alone(store: Store) -> None:
    await accepted(store, job("a"))
    assert await store.begin("a", "theirs") is None
    assert await store.begin("b", "ours") is None
    begun = await store.begin("a", "ours")
    assert begun is not None
    record, request = begun
    assert (record.state, record.attempts, request) == (JobState.RUNNING, 1, b"request")
    assert record.started_us == store.now_us()
    assert await store.begin("a", "ours") is None
    assert await found(store, "a") == record


@pytest.mark.parametrize("outcome", [_RESULT, _FAILURE])
async def test_a_job_is_ended_by_its_own_server_alone_and_once(
    outcome: Result | Failure, store: Store, times: Times
) -> None:
    await accepted(store, job("a"))
    await store.begin("a", "ours")
    assert await store.end("a", "theirs", outcome) is None
    assert (await found(store, "a")).state is JobState.RUNNING
    assert await store.find_result("key of a") is None
    times.wall_s += 5.0
    ended = await store.end("a", "ours", outcome)
    assert ended is not None
    assert ended.state is (JobState.SUCCEEDED if outcome is _RESULT else JobState.FAILED)
    assert ended.ended_us == store.now_us()
    assert ended.expires_us == store.now_us() + 10_000_000
    assert ended.replica is None
    # A result that comes too late changes nothing.
    for late in (_RESULT, _FAILURE):
        assert await store.end("a", "ours", late) is None
    assert await store.cancel("a") == ended
    assert await found(store, "a") == ended


async def test_a_cancelled_job_is_not_ended_again(store: Store) -> None:
    await accepted(store, job("a"))
    await store.begin("a", "ours")
    cancelled = await store.cancel("a")
    assert cancelled is not None
    assert cancelled.state is JobState.CANCELLED
    for late in (_RESULT, _FAILURE):
        assert await store.end("a", "ours", late) is None
    assert await store.begin("a", "ours") is None
    assert await store.requeue(["a"], "ours", "ours") == []
    assert await found(store, "a") == cancelled


async def test_only_running_jobs_of_ones_own_are_put_back(store: Store) -> None:
    for job_id in "ab":
        await accepted(store, job(job_id))
    await store.begin("a", "ours")
    assert await store.requeue(["a", "b"], "theirs", "theirs") == []
    (record,) = await store.requeue(["a", "b", "c"], "ours", "others")
    assert (record.id, record.state, record.attempts, record.losses) == ("a", JobState.QUEUED, 0, 0)
    assert (record.replica, record.progress) == ("others", None)
    assert (await found(store, "b")).revision == 1
    await store.begin("a", "others")
    (record,) = await store.requeue(["a"], "others", None, is_lost=True)
    assert (record.attempts, record.losses, record.replica) == (0, 1, None)


async def test_progress_is_noted_of_ones_own_running_jobs_and_never_backwards(store: Store) -> None:
    for job_id in "ab":
        await accepted(store, job(job_id))
    begun = await store.begin("a", "ours")
    assert begun is not None
    revision = begun[0].revision
    progress = {job_id: (revision + 2, Report("stage", "two\0")) for job_id in "ab"}
    await store.write_progress("theirs", progress)
    assert (await found(store, "a")).progress is None
    await store.write_progress("ours", progress)
    record = await found(store, "a")
    assert (record.revision, record.progress) == (revision + 2, Report("stage", "two\N{REPLACEMENT CHARACTER}"))
    assert (await found(store, "b")).progress is None
    for earlier in (revision + 2, revision + 1):
        await store.write_progress("ours", {"a": (earlier, Report("stage", "one"))})
    assert await found(store, "a") == record
    ended = await store.end("a", "ours", _FAILURE)
    assert ended is not None
    assert ended.revision >= record.revision + STEP


async def test_a_server_that_has_counted_on_is_not_taken_for_dead(store: Store) -> None:
    await take_part(store, "ours", "living", "dead")
    for job_id, replica in (("a", "living"), ("b", "dead"), ("c", "dead"), ("d", "ours"), ("e", None)):
        await accepted(store, job(job_id, replica))
    for job_id, replica in (("a", "living"), ("b", "dead"), ("d", "ours")):
        await store.begin(job_id, replica)
    assert await store.beat("living")
    # Both were found with no beat, long ago.
    adopted = await store.adopt("ours", {"living": 0, "dead": 0})
    assert [(record.id, record.state, record.attempts) for record in adopted] == [
        ("b", JobState.QUEUED, 1),
        ("c", JobState.QUEUED, 0),
        ("e", JobState.QUEUED, 0),
    ]
    assert {record.replica for record in adopted} == {"ours"}
    assert (await found(store, "a")).state is JobState.RUNNING
    assert (await found(store, "d")).state is JobState.RUNNING
    assert await store.beat("living")
    assert not await store.beat("dead")
    assert await store.other_servers("ours") == ({"living": 2}, False)
    # The second server that found the same has nothing left to adopt.
    assert await store.adopt("living", {"dead": 0}) == []


async def test_a_job_that_two_servers_died_on_is_not_adopted_again(store: Store) -> None:
    await accepted(store, job("a", "first"))
    await accepted(store, job("b", "first"))
    for name in ("first", "second"):
        await take_part(store, name)
        await store.adopt(name, {"first": 0})
        await store.begin("a", name)
    (failed, waits) = await store.adopt("third", {"second": 0})
    assert failed.failure is not None
    assert (failed.state, failed.failure.reason, failed.attempts) == (JobState.FAILED, Reason.SERVER_DIED, 2)
    assert (waits.id, waits.state, waits.attempts, waits.replica) == ("b", JobState.QUEUED, 0, "third")


async def test_a_key_is_its_owners_until_its_job_has_expired(store: Store, times: Times) -> None:
    await accepted(store, job("a", idempotency_key="k"))
    again = await store.accept(job("b", idempotency_key="k"), b"", None, 100)
    assert again is not None
    assert (again[0].id, again[1]) == ("a", True)
    assert await store.find("b") is None
    assert await store.find_by_key("you", "k") is None
    times.wall_s += 1e9
    # One that has not ended never expires.
    assert await store.find_by_key("me", "k") is not None
    await store.cancel("a")
    times.wall_s += 9.999
    assert await store.find_by_key("me", "k") is not None
    times.wall_s += 0.001
    assert await store.find_by_key("me", "k") is None
    assert (await accepted(store, job("b", idempotency_key="k"))).id == "b"
    # And it was forgotten for that, before any sweep.
    assert await store.find_changed({"a": 0, "b": 0}) == ([await found(store, "b")], {"a"})


async def test_what_has_expired_is_swept_and_nothing_else(
    monkeypatch: pytest.MonkeyPatch, store: Store, times: Times
) -> None:
    monkeypatch.setattr("robosc_server.store.store._SWEPT_AT_ONCE", 3)
    for number in range(12):
        await accepted(store, job(str(number)))
        if number % 3:
            await store.cancel(str(number))
    times.wall_s += 9.999
    assert await store.sweep(10**9) == 0
    times.wall_s += 0.001
    assert await store.sweep(10**9) == 8
    assert (await store.counts_by_state()) == dict.fromkeys(JobState, 0) | {JobState.QUEUED: 4}
