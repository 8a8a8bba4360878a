"""Leases of the servers that share a database: each renews its own, and adopts the jobs of those that stopped.

A server that shares its database increments a number there, its heartbeat. One that finds the heartbeat of another
server unchanged for the length of a lease takes it for dead and adopts its jobs. A server that was taken for dead by
mistake finds out at its next heartbeat, stops its work, and joins again under another name.
"""

import asyncio
import logging
import math
from collections.abc import Callable

from robosc_server.jobs.retention import JobLimits
from robosc_server.jobs.runner import JobRunner
from robosc_server.jobs.watchers import Watchers
from robosc_server.store import Store, StoreUnavailableError

_log = logging.getLogger(__name__)

_UNCERTAIN_LOOKUPS = 40
"""Maximum lookups for a job whose acceptance is uncertain."""

_BEATS_PER_LEASE = 5


class LeaseMonitor:
    """Monitor of the leases of the servers that share a database, and of the jobs of this one.

    Args:
        store: The database.
        runner: Runner of the jobs of this server.
        watchers: Watchers that are notified of what others have changed.
        limits: Limits with the polling period and the length of a lease.
        clock: Seconds of a monotonic clock, for leases.
    """

    def __init__(
        self, store: Store, runner: JobRunner, watchers: Watchers, limits: JobLimits, clock: Callable[[], float]
    ) -> None:
        self._store, self._runner, self._watchers = store, runner, watchers
        self._limits, self._clock = limits, clock
        self._seen: dict[str, tuple[int, float]] = {}
        self._last_beat_s = -math.inf
        self._uncertain_lookups = 0
        self._adopts = True

    @property
    def seen(self) -> frozenset[str]:
        """The other servers that the last poll found."""
        return frozenset(self._seen)

    def stop_adopting(self) -> None:
        """Adopt no more jobs of dead servers."""
        self._adopts = False

    async def poll_forever(self) -> None:
        """Poll the database periodically until cancelled."""
        while True:
            await asyncio.sleep(self._limits.poll_s)
            try:
                await self.poll()
            except StoreUnavailableError:
                # The age of other leases is then unknown.
                self._seen = {}
            except Exception:
                _log.exception("reading jobs and leases from the database failed")

    async def poll(self) -> None:
        """Renew the lease, reconcile jobs with the database, and notify watchers; called periodically."""
        is_shared, now_s = self._store.is_shared, self._clock()
        if self._runner.has_uncertain_acceptance:
            self._runner.has_uncertain_acceptance, self._uncertain_lookups = False, _UNCERTAIN_LOOKUPS
        is_beat_due = is_shared and now_s - self._last_beat_s >= self._limits.lease_s / _BEATS_PER_LEASE
        if is_beat_due or not self._store.is_available:
            if not await self._store.beat(self._runner.replica):
                await self._rejoin()
                return
            self._last_beat_s = now_s
            self._uncertain_lookups = max(1, self._uncertain_lookups)
        if is_shared or self._uncertain_lookups:
            await self._reconcile_own_jobs()
            self._uncertain_lookups = max(0, self._uncertain_lookups - 1)
        if is_shared:
            await self._adopt_jobs_of_dead()
            await self._store_progress()
        await self._notify_watchers()

    async def _rejoin(self) -> None:
        """Stop all jobs and join under a new name, after other servers took this one for dead."""
        _log.warning("the lease of this server has expired: other servers have adopted its jobs")
        await self._runner.stop([job for job in self._runner.all if job.is_stored])
        self._seen = {}
        await self._runner.enter()

    async def _reconcile_own_jobs(self) -> None:
        """Stop jobs that other servers have ended; run jobs that were stored though their acceptance seemed to fail."""
        # Taken before the query: a job that is accepted meanwhile may not be in its result.
        before = {job.record.id: job.is_stored for job in self._runner.all}
        active_ids = await self._store.active_ids_of(self._runner.replica)
        gone = [job for job in self._runner.all if before.get(job.record.id) and job.record.id not in active_ids]
        if gone:
            await self._runner.stop(gone)
            changed, _ = await self._store.find_changed({job.record.id: -1 for job in gone})
            for record in changed:
                self._watchers.notify(record)
        if active_ids - before.keys():
            records = await self._store.active_of(self._runner.replica)
            self._runner.take_over(record for record in records if record.id not in before)

    async def _adopt_jobs_of_dead(self) -> None:
        """Adopt the jobs of servers whose lease has expired."""
        now_s = self._clock()
        beats, has_orphans = await self._store.other_servers(self._runner.replica)
        self._seen = {
            name: self._seen[name] if name in self._seen and self._seen[name][0] == count else (count, now_s)
            for name, count in beats.items()
        }
        dead = {name: count for name, (count, since_s) in self._seen.items() if now_s - since_s >= self._limits.lease_s}
        if not self._adopts or not (dead or has_orphans):
            return
        adopted = await self._store.adopt(self._runner.replica, dead)
        if dead:
            _log.warning(
                "the leases of %d servers have expired; this server has adopted %d of their jobs",
                len(dead),
                len(adopted),
            )
        for record in adopted:
            self._watchers.notify(record)
        self._runner.take_over(adopted)

    async def _store_progress(self) -> None:
        """Write the progress of running jobs to the database, for watchers at other servers."""
        reports = {
            job.record.id: (job.record.revision, job.record.progress)
            for job in self._runner.all
            if job.record.progress is not None and job.record.revision > job.stored_revision
        }
        if reports:
            await self._store.write_progress(self._runner.replica, reports)
            for job_id, (revision, _) in reports.items():
                job = self._runner.get(job_id)
                if job is not None:
                    job.stored_revision = max(revision, job.stored_revision)

    async def _notify_watchers(self) -> None:
        """Notify watchers of jobs that other servers have changed."""
        watched = self._watchers.revisions(self._runner)
        if watched:
            changed, forgotten = await self._store.find_changed(watched)
            for record in changed:
                self._watchers.notify(record)
            for job_id in forgotten:
                # The job ended and was deleted between two polls: its watchers get NO_SUCH_JOB.
                self._watchers.notify_gone(job_id)
