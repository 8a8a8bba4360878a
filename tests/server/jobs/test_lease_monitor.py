"""Leases of servers that share a database, poll by poll, on a clock that the test sets."""

import asyncio
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

import pytest

from robosc_server.jobs.lease_monitor import LeaseMonitor
from robosc_server.jobs.retention import JobLimits
from robosc_server.store import JobRecord, JobState, StoreUnavailableError
from robosc_server.tasks.task import TaskKind

LEASE_S = 15.0
RECORD = JobRecord("a", "me", TaskKind.CHECK, JobState.RUNNING, 1, "key", "file", "", None, 0, 0)
OWN = "this server"


@dataclass
class Job:
    record: JobRecord
    is_stored: bool = True
    stored_revision: int = 1


class Site:
    """A database and what this server makes of it: store, runner and watchers in one.

    Attributes:
        done: All that was changed or reported, in order.
        beats: Heartbeats of other servers.
        has_orphans: True if jobs belong to no server.
        is_valid: True if the lease of this server holds.
        active: Jobs that the database has for this server.
        changed: Records that other servers have changed.
        forgotten: Jobs that the database has no more.
    """

    replica = OWN
    has_uncertain_acceptance = False
    is_available = True

    def __init__(self, *, is_shared: bool = True) -> None:
        self.is_shared = is_shared
        self.now_s = 100.0
        self.done: list[object] = []
        self.beats: dict[str, int] = {}
        self.has_orphans = False
        self.is_valid = True
        self.all: list[Job] = []
        self.active: list[JobRecord] = []
        self.changed: list[JobRecord] = []
        self.forgotten: list[str] = []
        self.watched: dict[str, int] = {}
        self.failure: Exception | None = None
        limits = JobLimits(poll_s=0.0, lease_s=LEASE_S)
        self.monitor = LeaseMonitor(self, self, self, limits, lambda: self.now_s)  # type: ignore[arg-type]

    async def poll(self, at_s: float) -> list[object]:
        """Poll at a time; return what was done."""
        self.now_s = 100.0 + at_s
        self.done.clear()
        await self.monitor.poll()
        return list(self.done)

    # The store.

    async def beat(self, replica: str) -> bool:
        self.done.append("beat")
        if self.failure is not None:
            raise self.failure
        return self.is_valid

    async def active_ids_of(self, replica: str) -> set[str]:
        self.done.append("look up")
        return {record.id for record in self.active}

    async def active_of(self, replica: str) -> list[JobRecord]:
        return self.active

    async def find_changed(self, known: Mapping[str, int]) -> tuple[list[JobRecord], list[str]]:
        return [item for item in self.changed if item.id in known], [item for item in self.forgotten if item in known]

    async def other_servers(self, replica: str) -> tuple[dict[str, int], bool]:
        return dict(self.beats), self.has_orphans

    async def adopt(self, replica: str, dead: Mapping[str, int]) -> list[JobRecord]:
        self.done.append(("adopt", dict(dead)))
        return [replace(RECORD, id="orphan")]

    async def write_progress(self, replica: str, reports: Mapping[str, tuple[int, object]]) -> None:
        self.done.append(("progress", {name: revision for name, (revision, _) in reports.items()}))

    # The runner.

    async def stop(self, jobs: Iterable[Job]) -> None:
        self.done.append(("stop", [job.record.id for job in jobs]))

    async def enter(self) -> None:
        self.done.append("enter")

    def take_over(self, records: Iterable[JobRecord]) -> None:
        self.done.append(("take over", [record.id for record in records]))

    def get(self, job_id: str) -> Job | None:
        return next((job for job in self.all if job.record.id == job_id), None)

    # The watchers.

    def revisions(self, runner: object) -> Mapping[str, int]:
        return self.watched

    def notify(self, record: JobRecord) -> None:
        self.done.append(("notify", record.id))

    def notify_gone(self, job_id: str) -> None:
        self.done.append(("gone", job_id))


ADOPTED = [("notify", "orphan"), ("take over", ["orphan"])]


def others(done: Collection[object]) -> list[object]:
    return [item for item in done if item not in ("beat", "look up")]


async def test_a_server_is_dead_once_its_heartbeat_has_not_changed_for_a_lease() -> None:
    site = Site()
    site.beats = {"two": 5, "three": 1}
    assert others(await site.poll(0.0)) == []
    site.beats["three"] = 2
    assert others(await site.poll(LEASE_S - 0.5)) == []
    assert site.monitor.seen == {"two", "three"}
    assert others(await site.poll(LEASE_S)) == [("adopt", {"two": 5}), *ADOPTED]
    del site.beats["two"]
    assert others(await site.poll(2 * LEASE_S - 1.0)) == []
    assert others(await site.poll(2 * LEASE_S - 0.5)) == [("adopt", {"three": 2}), *ADOPTED]


async def test_jobs_without_a_server_are_adopted_at_once() -> None:
    site = Site()
    site.has_orphans = True
    assert others(await site.poll(0.0)) == [("adopt", {}), *ADOPTED]


async def test_a_server_that_ends_adopts_nothing() -> None:
    site = Site()
    site.beats, site.has_orphans = {"two": 5}, True
    site.monitor.stop_adopting()
    assert others([*await site.poll(0.0), *await site.poll(LEASE_S)]) == []


async def test_after_the_database_was_away_the_age_of_leases_is_unknown() -> None:
    site = Site()
    site.beats = {"two": 5}
    await site.poll(0.0)
    site.failure = StoreUnavailableError()
    site.now_s += LEASE_S
    polling = asyncio.create_task(site.monitor.poll_forever())
    while site.done.count("beat") < 3:
        await asyncio.sleep(0)
    polling.cancel()
    await asyncio.gather(polling, return_exceptions=True)
    site.failure = None
    assert others(await site.poll(LEASE_S)) == []
    assert others(await site.poll(2 * LEASE_S)) == [("adopt", {"two": 5}), *ADOPTED]


async def test_a_server_taken_for_dead_stops_its_stored_jobs_and_joins_anew() -> None:
    site = Site()
    site.beats = {"two": 5}
    await site.poll(0.0)
    site.all = [Job(RECORD), Job(replace(RECORD, id="new"), is_stored=False)]
    site.is_valid = False
    assert await site.poll(LEASE_S) == ["beat", ("stop", ["a"]), "enter"]
    # Meanwhile others may have lived.
    assert site.monitor.seen == set()


async def test_the_lease_is_renewed_five_times_in_its_length() -> None:
    site = Site()
    beats = [("beat" in await site.poll(at_s)) for at_s in (0.0, 2.9, 3.0, 5.9, 6.0)]
    assert beats == [True, False, True, False, True]
    alone = Site(is_shared=False)
    assert await alone.poll(0.0) == []


async def test_jobs_that_other_servers_have_ended_are_stopped_and_those_on_their_way_are_not() -> None:
    site = Site()
    site.all = [Job(RECORD), Job(replace(RECORD, id="b")), Job(replace(RECORD, id="new"), is_stored=False)]
    site.active = [replace(RECORD, id="b")]
    site.changed = [replace(RECORD, state=JobState.CANCELLED)]
    assert others(await site.poll(0.0)) == [("stop", ["a"]), ("notify", "a")]


async def test_a_job_whose_acceptance_seemed_to_fail_is_looked_for_and_run() -> None:
    site = Site(is_shared=False)
    site.has_uncertain_acceptance = True
    assert [await site.poll(number) for number in range(2)] == [["look up"]] * 2
    site.active = [RECORD]
    assert await site.poll(3.0) == ["look up", ("take over", ["a"])]
    site.all = [Job(RECORD)]
    assert [await site.poll(4.0 + number) for number in range(40)] == [["look up"]] * 37 + [[]] * 3


async def test_a_server_of_its_own_looks_once_after_its_database_was_away() -> None:
    site = Site(is_shared=False)
    site.is_available = False
    assert await site.poll(0.0) == ["beat", "look up"]
    site.is_available = True
    assert await site.poll(1.0) == []


async def test_progress_is_written_once() -> None:
    site = Site()
    site.all = [Job(replace(RECORD, revision=3, progress="half")), Job(replace(RECORD, id="b"))]  # type: ignore[arg-type]
    site.active = [RECORD, replace(RECORD, id="b")]
    assert others(await site.poll(0.0)) == [("progress", {"a": 3})]
    assert others(await site.poll(0.1)) == []


async def test_watchers_hear_of_changes_and_of_jobs_that_are_gone() -> None:
    site = Site()
    site.watched = {"a": 1, "b": 1, "c": 1}
    site.changed, site.forgotten = [RECORD], ["b"]
    assert others(await site.poll(0.0)) == [("notify", "a"), ("gone", "b")]


async def test_an_unexpected_error_does_not_end_the_polling(caplog: pytest.LogCaptureFixture) -> None:
    site = Site()
    site.failure = RuntimeError("a mistake")
    polling = asyncio.create_task(site.monitor.poll_forever())
    while site.done.count("beat") < 3:
        await asyncio.sleep(0)
    polling.cancel()
    await asyncio.gather(polling, return_exceptions=True)
    assert "reading jobs and leases from the database failed" in caplog.text
