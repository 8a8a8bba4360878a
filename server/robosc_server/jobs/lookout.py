"""Findings of one server in the database: what others have done there, and which of them are dead.

A server that shares its database counts up a number there, its beats. One that finds the beats of another one
unchanged for as long as a lease takes it for dead, and adopts its jobs; a server that was taken for dead by mistake
finds out at its next beat, stops its work, and takes part again under another name.
"""

import asyncio
import logging
import math
from collections.abc import Callable

from robosc_server.jobs.carrying import Carrying
from robosc_server.jobs.limits import JobLimits
from robosc_server.jobs.watching import Watchers
from robosc_server.store import Store, StoreUnavailableError

_log = logging.getLogger(__name__)

_DOUBTFUL_LOOKS = 40
"""Number of looks for a job whose acceptance failed in a way that leaves open whether it is kept."""

_BEATS_PER_LEASE = 5


class Lookout:
    """Lookout of one server, which looks into the database.

    Args:
        store: The database.
        carrying: The jobs of this server.
        watchers: Watchers that are notified of what others have changed.
        limits: Limits with the period of its looks, and the length of a lease.
        clock: Seconds of a monotonic clock, for leases.
    """

    def __init__(
        self, store: Store, carrying: Carrying, watchers: Watchers, limits: JobLimits, clock: Callable[[], float]
    ) -> None:
        self._store, self._carrying, self._watchers = store, carrying, watchers
        self._limits, self._clock = limits, clock
        self._seen: dict[str, tuple[int, float]] = {}
        self._beaten_s = -math.inf
        self._doubtful_looks = 0
        self._adopts = True

    @property
    def seen(self) -> frozenset[str]:
        """The other servers that were found at the last look."""
        return frozenset(self._seen)

    def stop_adopting(self) -> None:
        """From now on, leave the jobs of dead servers to others."""
        self._adopts = False

    async def look_often(self) -> None:
        """Look now and then, for ever."""
        while True:
            await asyncio.sleep(self._limits.look_s)
            try:
                await self.look()
            except StoreUnavailableError:
                # How long others have been silent is not known then.
                self._seen = {}
            except Exception:
                _log.exception("the jobs in the database cannot be looked after")

    async def look(self) -> None:
        """Look what others have done in the database, and whether it is there again; called often."""
        is_shared, now_s = self._store.is_shared, self._clock()
        if self._carrying.has_doubts:
            self._carrying.has_doubts, self._doubtful_looks = False, _DOUBTFUL_LOOKS
        is_beat_due = is_shared and now_s - self._beaten_s >= self._limits.lease_s / _BEATS_PER_LEASE
        if is_beat_due or not self._store.is_available:
            if not await self._store.beat(self._carrying.replica):
                await self._start_again()
                return
            self._beaten_s = now_s
            self._doubtful_looks = max(1, self._doubtful_looks)
        if is_shared or self._doubtful_looks:
            await self._look_after_ours()
            self._doubtful_looks = max(0, self._doubtful_looks - 1)
        if is_shared:
            await self._look_for_dead()
            await self._tell_progress()
        await self._tell_watchers()

    async def _start_again(self) -> None:
        """We were taken for dead: our jobs are another's now."""
        _log.warning("other servers took this one for dead; its jobs are theirs")
        await self._carrying.stop([carried for carried in self._carrying.all if carried.is_kept])
        self._seen = {}
        await self._carrying.enter()

    async def _look_after_ours(self) -> None:
        """Stop what others have ended, and carry what was kept though its acceptance seemed to fail."""
        # As of before the question: what is accepted meanwhile may not be in the answer.
        before = {carried.record.id: carried.is_kept for carried in self._carrying.all}
        active = await self._store.active_ids_of(self._carrying.replica)
        gone = [
            carried
            for carried in self._carrying.all
            if before.get(carried.record.id) and carried.record.id not in active
        ]
        if gone:
            await self._carrying.stop(gone)
            changed, _ = await self._store.find_changed({carried.record.id: -1 for carried in gone})
            for record in changed:
                self._watchers.tell(record)
        if active - before.keys():
            records = await self._store.active_of(self._carrying.replica)
            self._carrying.take_up(record for record in records if record.id not in before)

    async def _look_for_dead(self) -> None:
        """Adopt the jobs of servers that have been silent for the length of a lease."""
        now_s = self._clock()
        beats, has_orphans = await self._store.others(self._carrying.replica)
        self._seen = {
            name: self._seen[name] if name in self._seen and self._seen[name][0] == count else (count, now_s)
            for name, count in beats.items()
        }
        dead = {name: count for name, (count, since_s) in self._seen.items() if now_s - since_s >= self._limits.lease_s}
        if not self._adopts or not (dead or has_orphans):
            return
        adopted = await self._store.adopt(self._carrying.replica, dead)
        if dead:
            _log.warning("%d servers were silent for too long; %d jobs are adopted", len(dead), len(adopted))
        for record in adopted:
            self._watchers.tell(record)
        self._carrying.take_up(adopted)

    async def _tell_progress(self) -> None:
        """Let other servers know how far our jobs are."""
        told = {
            carried.record.id: (carried.record.revision, carried.record.progress)
            for carried in self._carrying.all
            if carried.record.progress is not None and carried.record.revision > carried.noted
        }
        if told:
            await self._store.note_progress(self._carrying.replica, told)
            for job_id, (revision, _) in told.items():
                carried = self._carrying.get(job_id)
                if carried is not None:
                    carried.noted = max(revision, carried.noted)

    async def _tell_watchers(self) -> None:
        """Tell those who watch jobs of other servers what has become of them."""
        watched = {
            job_id: revision for job_id, revision in self._watchers.revisions().items() if job_id not in self._carrying
        }
        if watched:
            changed, forgotten = await self._store.find_changed(watched)
            for record in changed:
                self._watchers.tell(record)
            for job_id in forgotten:
                # It has ended and was forgotten between two looks: who watches is told that there is none.
                self._watchers.tell_gone(job_id)
