"""Retention of jobs and results: limits on their number, size and age."""

import asyncio
import contextlib
import logging
from collections.abc import Mapping
from dataclasses import dataclass

from robosc_server.store import JobState, Store, StoreUnavailableError
from robosc_server.tasks.task import Reason, RefusedError, Result

_log = logging.getLogger(__name__)

_SHORTEST_PAUSE_S = 1.0
"""Minimum time between two sweeps, even if one is requested, in seconds."""


@dataclass(frozen=True, slots=True)
class JobLimits:
    """Limits of jobs, and the periods of their manager.

    Attributes:
        retention_s: Longest time that a job is kept after its end.
        results_bytes: Maximum size of all stored results. Beyond it, results that no job refers to are deleted. If the
            results of jobs alone reach it, jobs that have ended are deleted early, and new jobs are refused until then.
            Each time, data of the caller with the most data is chosen.
        jobs_per_owner: Maximum number of stored jobs of one caller; beyond it, those that ended first are deleted.
        poll_s: Period, in seconds, at which a server that shares its database reads the changes of other servers; a
            server with its own database needs it only after the database was unavailable.
        lease_s: Duration of a lease, in seconds, after which the other servers take a server for dead.
        sweep_s: Period, in seconds, of the search for expired jobs and excess results.
    """

    retention_s: float = 7 * 86400.0
    results_bytes: int = 2 * 2**30
    jobs_per_owner: int = 10_000
    poll_s: float = 0.5
    lease_s: float = 15.0
    sweep_s: float = 30.0


class Retention:
    """Retention policy, which deletes expired jobs and excess results.

    Args:
        store: The database.
        limits: Limits of jobs.

    Attributes:
        counts: Number of jobs that the database has in each state, as of the last sweep.
    """

    def __init__(self, store: Store, limits: JobLimits) -> None:
        self._store, self._limits = store, limits
        self._needed_bytes = 0
        self._is_wanted = asyncio.Event()
        self.counts: Mapping[JobState, int] = dict.fromkeys(JobState, 0)

    def retention_us_of(self, asked_s: float | None) -> int:
        """Return the time that a job is kept after its end, in microseconds.

        Args:
            asked_s: Requested time in seconds, bounded by the maximum; None: the maximum.
        """
        longest_s = self._limits.retention_s
        return round((longest_s if asked_s is None else min(asked_s, longest_s)) * 1e6)

    def admit(self) -> None:
        """Do nothing if there is room for the result of one more job.

        Raises:
            RefusedError: There is no room.
        """
        if self._needed_bytes >= self._limits.results_bytes:
            # Sweep at once, so that a caller who fills the storage blocks others only for a moment.
            self._is_wanted.set()
            message = "the storage for job results is full; try again after the server has deleted old results"
            raise RefusedError(Reason.SERVER_BUSY, message, retry_after_s=2 * _SHORTEST_PAUSE_S)

    def too_many(self) -> RefusedError:
        """Return the error for a caller whose jobs have reached the limit and have not ended."""
        count = self._limits.jobs_per_owner
        message = f"the caller has {count} unfinished jobs, which is the limit; try again after some have ended"
        return RefusedError(Reason.QUOTA_EXCEEDED, message, retry_after_s=self._limits.sweep_s)

    def note(self, result: Result) -> None:
        """Count the result of another job."""
        self._needed_bytes += sum(map(len, result.messages))

    async def sweep_forever(self) -> None:
        """Sweep periodically, and on request when there is no room."""
        while True:
            self._is_wanted.clear()
            try:
                await self.sweep()
            except StoreUnavailableError:
                pass  # Retried at the next sweep.
            except Exception:
                _log.exception("deleting expired jobs and results failed")
            await asyncio.sleep(min(_SHORTEST_PAUSE_S, self._limits.sweep_s))
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._is_wanted.wait(), max(0.0, self._limits.sweep_s - _SHORTEST_PAUSE_S))

    async def sweep(self) -> None:
        """Delete expired jobs and excess results once."""
        await self._store.sweep(self._limits.results_bytes)
        self._needed_bytes = await self._store.size_of_needed()
        self.counts = await self._store.counts_by_state()
