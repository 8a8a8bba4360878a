"""Watchers of jobs; an idle watcher takes no time.

A new state is passed on at once. Progress is passed on at a limited rate, since a worker reports it ten times a second:
a thousand watchers of one job would take a third of a processor for lines that people cannot read so fast.
"""

import asyncio
from collections.abc import Container, Iterator
from contextlib import contextmanager

from robosc_server.clock import monotonic
from robosc_server.store import JobRecord, JobState

PROGRESS_PER_SECOND = 200
"""Number of messages of progress a second to all watchers of one job, if it has more than a few."""

_FEW = 20
"""Number of watchers that get every report."""


class JobWatch:
    """One watcher of one job, which holds only the newest record.

    Attributes:
        revision: Last seen revision, which the user of the watcher sets.
        is_gone: True if the job was deleted.
    """

    __slots__ = ("_has_news", "_record", "is_gone", "revision")

    def __init__(self) -> None:
        self.revision = 0
        self.is_gone = False
        self._record: JobRecord | None = None
        self._has_news = asyncio.Event()

    def notify(self, record: JobRecord) -> None:
        """Pass on the current record of the job."""
        if self._record is None or record.revision > self._record.revision:
            self._record = record
            self._has_news.set()

    def wake(self) -> None:
        """Wake the watcher without a new record."""
        self._has_news.set()

    async def next_record(self) -> JobRecord | None:
        """Return the newest record received since the last call, once there is one; None: it was woken."""
        await self._has_news.wait()
        self._has_news.clear()
        record, self._record = self._record, None
        return record


class _Audience:
    """Watchers of one job, with at most one timer for all of them.

    Attributes:
        watches: The watchers.
    """

    __slots__ = ("_held", "_next_s", "_state", "_timer", "watches")

    def __init__(self) -> None:
        self.watches: set[JobWatch] = set()
        self._state: JobState | None = None
        self._next_s = 0.0
        self._held: JobRecord | None = None
        self._timer: asyncio.TimerHandle | None = None

    def notify(self, record: JobRecord) -> None:
        """Pass a record on, or hold it until the next one may be passed on; a newer one replaces it."""
        if self._held is not None and record.revision < self._held.revision:
            return
        wait_s = self._next_s - monotonic()
        if record.state is self._state and wait_s > 0:
            self._held = record
            if self._timer is None:
                self._timer = asyncio.get_running_loop().call_later(wait_s, self._pass_held)
            return
        self._pass(record)

    def close(self) -> None:
        """Stop the timer."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _pass_held(self) -> None:
        self._timer = None
        if self._held is not None:
            self._pass(self._held)

    def _pass(self, record: JobRecord) -> None:
        self.close()
        self._held = None
        self._state = record.state
        count = len(self.watches)
        self._next_s = monotonic() + (count / PROGRESS_PER_SECOND if count > _FEW else 0.0)
        for watch in self.watches:
            watch.notify(record)


class Watchers:
    """All watchers."""

    def __init__(self) -> None:
        self._by_job: dict[str, _Audience] = {}

    @contextmanager
    def watch(self, job_id: str) -> Iterator[JobWatch]:
        """Watch a job; what changes from now on is not missed."""
        watch = JobWatch()
        audience = self._by_job.get(job_id)
        if audience is None:
            audience = self._by_job[job_id] = _Audience()
        audience.watches.add(watch)
        try:
            yield watch
        finally:
            audience.watches.discard(watch)
            if not audience.watches:
                audience.close()
                del self._by_job[job_id]

    def notify(self, record: JobRecord) -> None:
        """Pass the current record of a job to its watchers: a new state at once, progress at a limited rate."""
        audience = self._by_job.get(record.id)
        if audience is not None:
            audience.notify(record)

    def notify_gone(self, job_id: str) -> None:
        """Notify the watchers of a job that it was deleted."""
        audience = self._by_job.get(job_id)
        if audience is not None:
            for watch in audience.watches:
                watch.is_gone = True
                watch.wake()

    def wake(self) -> None:
        """Wake all watchers."""
        for audience in self._by_job.values():
            for watch in audience.watches:
                watch.wake()

    def revisions(self, known: Container[str] = ()) -> dict[str, int]:
        """Return the lowest revision that a watcher knows, for each watched job.

        Args:
            known: Ids of jobs that are left out.
        """
        return {
            job_id: min(watch.revision for watch in audience.watches)
            for job_id, audience in self._by_job.items()
            if audience.watches and job_id not in known
        }
