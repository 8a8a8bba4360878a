"""Store of jobs, results and servers.

Each method runs one transaction, or several where there may be many jobs; each of them leaves a consistent state.

Every method raises StoreUnavailableError if the database is unavailable, full or too slow.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from itertools import batched

from sqlalchemy import Connection, func, select

from robosc_server.clock import wall_clock_s
from robosc_server.store import job_rows, replica_rows, result_rows
from robosc_server.store.database import Database
from robosc_server.store.records import JobFilter, JobRecord, JobState, OwnerLoad, messages_of
from robosc_server.tasks.task import Failure, Report, Result, TaskKind

_SWEPT_AT_ONCE = 200
_TAKEN_AT_ONCE = 200
_EVICTED_AT_ONCE = 50
_FREE_PAGES = 2000
_SWEEP_LOCK = 0x526F626F5343
"""PostgreSQL advisory lock for eviction, which one server at a time performs."""


def _do_nothing() -> None:
    """Do nothing."""


class Store:
    """Database with jobs and results.

    Args:
        database: Database with its tables.
        on_close: Function that is called when the store is closed.
        wall_clock: Seconds since 1970.
    """

    def __init__(
        self,
        database: Database,
        on_close: Callable[[], None] = _do_nothing,
        wall_clock: Callable[[], float] = wall_clock_s,
    ) -> None:
        self._database = database
        self._on_close = on_close
        self._wall_clock = wall_clock

    @property
    def is_shared(self) -> bool:
        """True if other servers may use it at the same time."""
        return self._database.dialect != "sqlite"

    @property
    def is_available(self) -> bool:
        """True if the last request to the database worked."""
        return self._database.is_available

    @property
    def is_readable(self) -> bool:
        """True if the last read worked; a full disk can be read."""
        return self._database.is_readable

    def now_us(self) -> int:
        """Return the microseconds since 1970."""
        return round(self._wall_clock() * 1e6)

    def close(self) -> None:
        """Close the database; blocks for a moment."""
        self._database.close()
        self._on_close()

    async def accept(
        self, record: JobRecord, request: bytes, result: Result | None, bound: int
    ) -> tuple[JobRecord, bool] | None:
        """Store a new job, as `job_rows.accept`; return the job, and True if it was there before."""
        now_us = self.now_us()
        return await self._database.write(
            lambda connection: job_rows.accept(connection, record, request, result, bound, now_us)
        )

    async def find(self, job_id: str) -> JobRecord | None:
        """Return a stored job."""
        now_us = self.now_us()
        return await self._database.read(lambda connection: job_rows.find(connection, job_id, now_us))

    async def find_by_key(self, owner: str, idempotency_key: str) -> JobRecord | None:
        """Return the job that was accepted from an owner with an idempotency key."""
        now_us = self.now_us()
        return await self._database.read(
            lambda connection: job_rows.find_by_key(connection, owner, idempotency_key, now_us)
        )

    async def find_changed(self, revisions: Mapping[str, int]) -> tuple[list[JobRecord], set[str]]:
        """Return those of some jobs whose revisions are greater than given, and the ids of deleted ones."""
        known = dict(revisions)
        return await self._database.read(lambda connection: job_rows.find_many(connection, known))

    async def list_jobs(self, chosen: JobFilter, after: tuple[int, str] | None, limit: int) -> list[JobRecord]:
        """Return jobs, newest first; see `job_rows.listed`."""
        now_us = self.now_us()
        return await self._database.read(lambda connection: job_rows.listed(connection, chosen, after, limit, now_us))

    async def counts_by_state(self) -> dict[JobState, int]:
        """Return the number of jobs in each state."""
        return await self._database.read(job_rows.counts_by_state)

    async def loads(self, owner: str | None, within_s: float) -> list[OwnerLoad]:
        """Return the load of owners, with the jobs that ended in the last seconds; see `job_rows.loads`."""
        since_us = self.now_us() - round(within_s * 1e6)
        return await self._database.read(lambda connection: job_rows.loads(connection, owner, since_us))

    async def begin(self, job_id: str, replica: str) -> tuple[JobRecord, bytes] | None:
        """Mark a waiting job as running; see `job_rows.begin`."""
        now_us = self.now_us()
        return await self._database.write(lambda connection: job_rows.begin(connection, job_id, replica, now_us))

    async def requeue(
        self, ids: Collection[str], replica: str, next_replica: str | None, *, is_lost: bool = False
    ) -> list[JobRecord]:
        """Queue running jobs again, in small transactions; see `job_rows.requeue`."""
        found: list[JobRecord] = []
        for some in batched(sorted(ids), _TAKEN_AT_ONCE):
            work = partial(job_rows.requeue, ids=some, replica=replica, next_replica=next_replica, is_lost=is_lost)
            found += await self._database.write(work)
        return found

    async def release_queued(self, replica: str) -> None:
        """Release the queued jobs of a server to the other servers."""
        await self._database.write(lambda connection: job_rows.release_queued(connection, replica))

    async def end(self, job_id: str, replica: str, outcome: Result | Failure) -> JobRecord | None:
        """End a job; None: it has ended before, or belongs to another server."""
        now_us = self.now_us()
        if isinstance(outcome, Result):
            return await self._database.write(
                lambda connection: job_rows.succeed(connection, job_id, replica, outcome, now_us)
            )
        return await self._database.write(
            lambda connection: job_rows.fail(connection, job_id, replica, outcome, now_us)
        )

    async def cancel(self, job_id: str) -> JobRecord | None:
        """Cancel a job of any server; None: there is no such job."""
        now_us = self.now_us()
        return await self._database.write(lambda connection: job_rows.cancel(connection, job_id, now_us))

    async def write_progress(self, replica: str, progress: Mapping[str, tuple[int, Report]]) -> None:
        """Store the progress of running jobs; see `job_rows.write_progress`."""
        reports = {
            job_id: (revision, Report(job_rows.clean(report.stage), job_rows.clean(report.message)))
            for job_id, (revision, report) in progress.items()
        }
        await self._database.write(lambda connection: job_rows.write_progress(connection, replica, reports))

    async def active_of(self, replica: str) -> list[JobRecord]:
        """Return the jobs of a server that have not ended, the oldest first."""
        return await self._database.read(lambda connection: job_rows.active_of(connection, replica))

    async def active_ids_of(self, replica: str) -> set[str]:
        """Return the ids of the jobs of a server that have not ended."""
        return await self._database.read(lambda connection: job_rows.active_ids_of(connection, replica))

    async def enter(self, replica: str) -> None:
        """Register a server; if the database is not shared, it takes over all jobs."""

        def work(connection: Connection) -> None:
            replica_rows.enter(connection, replica)
            if not self.is_shared:
                replica_rows.remove_others(connection, replica)

        await self._database.write(work)
        if not self.is_shared:
            await self._take_orphans(replica)

    async def leave(self, replica: str) -> None:
        """Unregister a server, and release its queued jobs to others."""

        def work(connection: Connection) -> None:
            job_rows.release_queued(connection, replica)
            replica_rows.leave(connection, replica)

        await self._database.write(work)

    async def beat(self, replica: str) -> bool:
        """Renew the lease of a server; False: it was taken for dead."""
        return await self._database.write(partial(_beat, replica))

    async def other_servers(self, replica: str) -> tuple[dict[str, int], bool]:
        """Return the heartbeats of the other servers, and whether there are jobs without a server."""
        return await self._database.read(
            lambda connection: (replica_rows.beats_of_others(connection, replica), job_rows.has_orphans(connection))
        )

    async def adopt(self, replica: str, dead: Mapping[str, int]) -> list[JobRecord]:
        """Take over the jobs of servers whose heartbeats are still the given ones, and jobs without a server.

        Returns:
            The jobs that have changed.
        """
        if dead:
            await self._database.write(lambda connection: replica_rows.remove_dead(connection, dead))
        return await self._take_orphans(replica)

    async def keep_results(self, results: Sequence[tuple[str, TaskKind, Result, str]]) -> None:
        """Store results by their keys, with their owners, except for keys that are stored already; all or none."""
        now_us = self.now_us()
        # The same order in each server prevents deadlocks.
        ordered = sorted(results, key=lambda item: item[0])

        def insert(connection: Connection) -> None:
            for key, kind, result, owner in ordered:
                result_rows.insert_result(connection, key, kind, result, owner, now_us)

        await self._database.write(insert)

    async def find_result(self, key: str) -> tuple[TaskKind, Result] | None:
        """Return a whole result, and the kind of its task."""
        found = await self._database.read(lambda connection: result_rows.read_blocks(connection, key))
        if found is None:
            return None
        kind, blocks = found
        return kind, Result(tuple(message for block in blocks for message in messages_of(block)))

    async def count_blocks(self, key: str) -> int | None:
        """Return the number of blocks that a result has; None: there is no such result."""
        return await self._database.read(lambda connection: result_rows.count_blocks(connection, key))

    async def read_block(self, key: str, number: int) -> bytes | None:
        """Return one block of a result; see `records.messages_of`."""
        return await self._database.read(lambda connection: result_rows.read_block(connection, key, number))

    async def touch(self, keys: Collection[str]) -> None:
        """Record that some results were requested now."""
        now_us = self.now_us()
        await self._database.write(lambda connection: result_rows.touch(connection, keys, now_us))

    async def size_of_needed(self) -> int:
        """Return the bytes of the results that jobs refer to; a result of several owners counts for each of them."""
        return sum((await self._database.read(job_rows.results_by_owner)).values())

    async def sweep(self, results_bytes: int) -> int:
        """Delete expired jobs and excess results, in small transactions.

        Excess data is evicted fairly, see `eviction`: results that no job refers to; and if results of jobs reach the
        limit, the jobs that ended first, until a tenth of it is free again.

        Args:
            results_bytes: Maximum size of all results.

        Returns:
            Number of deleted jobs.
        """
        now_us = self.now_us()
        total = 0
        while swept := await self._database.write(partial(job_rows.sweep, now_us=now_us, limit=_SWEPT_AT_ONCE)):
            total += swept
        if await self.size_of_needed() >= results_bytes:
            total += await self._evict_down_to(job_rows.results_by_owner, job_rows.forget, results_bytes * 9 // 10)
        await self._evict_down_to(result_rows.sizes_by_owner, result_rows.trim, results_bytes)
        if not self.is_shared:
            await self._database.write(_vacuum)
        return total

    async def _take_orphans(self, replica: str) -> list[JobRecord]:
        """Take over the jobs without a server, in small transactions, since thousands would exceed the time limit."""
        now_us = self.now_us()
        taken: list[JobRecord] = []
        while some := await self._database.write(
            partial(job_rows.take_orphans, ours=replica, now_us=now_us, limit=_TAKEN_AT_ONCE)
        ):
            taken += some
        return taken

    async def _evict_down_to(
        self,
        sizes: Callable[[Connection], dict[str, int]],
        give: Callable[[Connection, dict[str, int], int, int], tuple[int, dict[str, int]]],
        bound: int,
    ) -> int:
        """Evict data of owners until all together are within a bound; return the number of evicted items."""
        held, total = await self._database.read(sizes), 0
        while sum(held.values()) > bound:
            number, held = await self._database.write(partial(_evict_some, sizes, give, held, bound))
            if not number:
                break
            total += number
        return total


def _evict_some(
    sizes: Callable[[Connection], dict[str, int]],
    give: Callable[[Connection, dict[str, int], int, int], tuple[int, dict[str, int]]],
    held: dict[str, int],
    bound: int,
    connection: Connection,
) -> tuple[int, dict[str, int]]:
    """Evict some excess data; servers that share a database do so one at a time, with current sizes."""
    if connection.dialect.name == "postgresql":
        if not connection.scalar(select(func.pg_try_advisory_xact_lock(_SWEEP_LOCK))):
            return 0, held
        held = sizes(connection)
    excess = sum(held.values()) - bound
    return give(connection, held, excess, _EVICTED_AT_ONCE) if excess > 0 else (0, held)


def _beat(replica: str, connection: Connection) -> bool:
    return replica_rows.beat(connection, replica)


def _vacuum(connection: Connection) -> None:
    cursor = connection.connection.cursor()
    # A page goes back with each row, also where the driver knows of no columns.
    cursor.execute(f"PRAGMA incremental_vacuum({_FREE_PAGES})")
    cursor.fetchall()
    cursor.close()
