"""Results that fill a store, and the slow twin of what is swept out of it."""

from collections import defaultdict
from dataclasses import dataclass

from robosc_server.store import JobRecord, JobState, Store
from robosc_server.tasks.task import Result, TaskKind
from support.job_parts import Times

KIND = TaskKind.SYNTHESIZE


@dataclass(frozen=True)
class Kept:
    """A result, as a test makes it."""

    key: str
    owner: str
    size: int
    used_s: float


@dataclass(frozen=True)
class Done:
    """A job that has succeeded."""

    id: str
    owner: str
    key: str


def twin_of_sweep(results: list[Kept], jobs: list[Done], bound: int) -> tuple[list[Kept], list[Done]]:
    """Return the results and jobs that are left, of jobs in the order of their ends.

    One thing goes at a time, and everything is counted anew.
    """

    def referred(owner: str, among: list[Done]) -> int:
        keys = {job.key for job in among if job.owner == owner}
        return sum(result.size for result in results if result.key in keys)

    results, jobs = list(results), list(jobs)
    owners = sorted({job.owner for job in jobs})
    if sum(referred(owner, jobs) for owner in owners) >= bound:
        while jobs and sum(referred(owner, jobs) for owner in owners) > bound * 9 // 10:
            holders = [owner for owner in owners if any(job.owner == owner for job in jobs)]
            most = min(holders, key=lambda name: (-referred(name, jobs), name))
            jobs.remove(next(job for job in jobs if job.owner == most))
    while sum(result.size for result in results) > bound:
        held: dict[str, int] = defaultdict(int)
        for result in results:
            held[result.owner] += result.size
        free = [result for result in results if all(job.key != result.key for job in jobs)]
        if not free:
            break
        most = min({result.owner for result in free}, key=lambda name: (-held[name], name))
        results.remove(min((one for one in free if one.owner == most), key=lambda one: (one.used_s, one.key)))
    return results, jobs


async def fill(store: Store, times: Times, results: list[Kept], jobs: list[Done]) -> None:
    for result in results:
        times.wall_s = result.used_s
        await store.keep_results([(result.key, KIND, Result((bytes(result.size),)), result.owner)])
    for number, job in enumerate(jobs):
        times.wall_s = 1000.0 + number
        record = JobRecord(
            id=job.id,
            owner=job.owner,
            kind=KIND,
            state=JobState.QUEUED,
            revision=1,
            key=job.key,
            main_file="main",
            label="",
            idempotency_key=None,
            retention_us=10**15,
            created_us=store.now_us(),
        )
        answer = await store.accept(record, b"", None, 10**6)
        assert answer is not None and answer[0].state is JobState.SUCCEEDED


async def check_against_twin(
    store: Store,
    times: Times,
    some_results: list[tuple[str, int, int]],
    some_jobs: list[tuple[str, int]],
    bound: int,
) -> None:
    results = [
        Kept(f"{number:02}", owner, size, float(used_s)) for number, (owner, size, used_s) in enumerate(some_results)
    ]
    jobs = [Done(f"{number:02}", owner, results[at % len(results)].key) for number, (owner, at) in enumerate(some_jobs)]
    await fill(store, times, results, jobs)
    await store.sweep(bound)
    expected_results, expected_jobs = twin_of_sweep(results, jobs, bound)
    left = [result for result in results if await store.find_result(result.key) is not None]
    assert left == expected_results
    assert [job for job in jobs if await store.find(job.id) is not None] == expected_jobs
