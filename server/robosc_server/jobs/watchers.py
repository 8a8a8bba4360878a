"""Watchers of jobs; an idle watcher takes no time."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager

from robosc_server.store import JobRecord


class Watch:
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


class Watchers:
    """All watchers."""

    def __init__(self) -> None:
        self._by_job: dict[str, set[Watch]] = {}

    @contextmanager
    def watch(self, job_id: str) -> Iterator[Watch]:
        """Watch a job; what changes from now on is not missed."""
        watch = Watch()
        self._by_job.setdefault(job_id, set()).add(watch)
        try:
            yield watch
        finally:
            watches = self._by_job[job_id]
            watches.discard(watch)
            if not watches:
                del self._by_job[job_id]

    def notify(self, record: JobRecord) -> None:
        """Pass the current record of a job to its watchers."""
        for watch in self._by_job.get(record.id, ()):
            watch.notify(record)

    def notify_gone(self, job_id: str) -> None:
        """Notify the watchers of a job that it was deleted."""
        for watch in self._by_job.get(job_id, ()):
            watch.is_gone = True
            watch.wake()

    def wake(self) -> None:
        """Wake all watchers."""
        for watches in self._by_job.values():
            for watch in watches:
                watch.wake()

    def revisions(self) -> dict[str, int]:
        """Return the lowest revision that a watcher knows, for each watched job."""
        return {job_id: min(watch.revision for watch in watches) for job_id, watches in self._by_job.items() if watches}
