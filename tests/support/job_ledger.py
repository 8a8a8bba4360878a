"""Ledger of many jobs: what was accepted, what came of it, and what is wrong with that.

Three witnesses are compared: what callers were answered, what the database has at the end, and each end of a job that a
trigger in the database has noted while it happened.
"""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

import psycopg
from psycopg.rows import class_row

from robosc_api.jobs import JobState

GIVEN_UP = frozenset({"WORKER_DIED", "SERVER_DIED"})
"""Reasons for which a job fails that has lost its worker or its server too often: it may be the cause."""

_NOTES = """
CREATE TABLE noted_ends (job text NOT NULL, state text NOT NULL, at timestamptz NOT NULL DEFAULT clock_timestamp());
CREATE FUNCTION note_end() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    IF TG_OP = 'UPDATE' AND OLD.ended_us IS NOT NULL THEN
        IF (NEW.ended_us, NEW.state, NEW.result_key, NEW.reason)
                IS DISTINCT FROM (OLD.ended_us, OLD.state, OLD.result_key, OLD.reason) THEN
            INSERT INTO noted_ends (job, state) VALUES (NEW.id, NEW.state);
        END IF;
    ELSIF NEW.ended_us IS NOT NULL THEN
        INSERT INTO noted_ends (job, state) VALUES (NEW.id, NEW.state);
    END IF;
    RETURN NEW;
END $$;
CREATE TRIGGER note_end AFTER INSERT OR UPDATE ON jobs FOR EACH ROW EXECUTE FUNCTION note_end();
"""

_STORED = """
SELECT id, idempotency_key AS key, state, coalesce(reason, '') AS reason, attempts,
       (SELECT count(*) FROM noted_ends WHERE job = id)::int AS ends
FROM jobs
"""


@dataclass(frozen=True)
class StoredJob:
    """A job as the database has it at the end.

    Attributes:
        id: Its id.
        key: Its idempotency key.
        state: Its state.
        reason: Reason why it has failed; empty if it has not.
        attempts: Number of times that a worker has begun.
        ends: Number of times that it has ended.
    """

    id: str
    key: str
    state: str
    reason: str
    attempts: int
    ends: int


@dataclass
class Ledger:
    """Fate of jobs, as three witnesses report it.

    Attributes:
        accepted: Ids of accepted jobs by their idempotency keys, as callers were answered.
        results: Digests of the results by id, as callers were answered.
        failures: Reasons of failed jobs by id, as callers were answered.
        expected: Digests of the right results by id.
        problems: Everything that is wrong, one sentence each.
    """

    accepted: dict[str, str] = field(default_factory=dict)
    results: dict[str, str] = field(default_factory=dict)
    failures: dict[str, str] = field(default_factory=dict)
    expected: dict[str, str] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)

    def accept(self, key: str, job_id: str) -> None:
        """Note an accepted job; the same key must always name the same job."""
        if self.accepted.setdefault(key, job_id) != job_id:
            self.problems.append(f"the key {key} was answered with two jobs: {self.accepted[key]} and {job_id}")

    def counted(self, stored: Iterable[StoredJob]) -> dict[str, int | dict[str, int]]:
        """Compare the witnesses and count; what is wrong is in `problems`, too."""
        by_id = {job.id: job for job in stored}
        ids = set(self.accepted.values())
        answered = self.results.keys() | self.failures.keys()
        wrong = sorted(one for one, digest in self.results.items() if self.expected.get(one) != digest)
        lost = sorted(one for one in ids if one not in by_id or not JobState(by_id[one].state).has_ended)
        lost_answers = sorted((ids & answered) - by_id.keys())
        silent = sorted(ids - answered - set(lost))
        twice = sorted(job.id for job in by_id.values() if job.ends > 1)
        unnoted = sorted(job.id for job in by_id.values() if JobState(job.state).has_ended and not job.ends)
        strange = sorted(by_id.keys() - ids)
        contradicted = sorted(one for one in answered & by_id.keys() if self._contradicts(by_id[one]))
        failed = Counter(self.failures.values())
        for words, found in (
            ("has a wrong result", wrong),
            ("was accepted and is lost", lost),
            ("was answered and is not stored", lost_answers),
            ("has ended and its caller was never answered", silent),
            ("has ended more than once", twice),
            ("has ended and no end was noted", unnoted),
            ("is stored and was never answered for", strange),
            ("is stored with another end than its caller was answered", contradicted),
        ):
            self.problems += [f"job {one} {words}" for one in found]
        unexpected = {reason: number for reason, number in failed.items() if reason not in GIVEN_UP}
        self.problems += [f"{number} jobs failed with {reason}" for reason, number in sorted(unexpected.items())]
        return {
            "accepted": len(ids),
            "answered": len(answered & ids),
            "right": len(self.results) - len(wrong),
            "wrong": len(wrong),
            "lost": len(lost),
            "ended_twice": len(twice),
            "never_told": len(silent),
            "contradicted": len(contradicted) + len(lost_answers) + len(unnoted),
            "not_asked_for": len(strange),
            "given_up": dict(sorted((failed - Counter(unexpected)).items())),
            "failed": dict(sorted(unexpected.items())),
            "attempts": {
                str(attempts): number
                for attempts, number in sorted(Counter(job.attempts for job in by_id.values()).items())
            },
        }

    def _contradicts(self, job: StoredJob) -> bool:
        if job.id in self.results:
            return job.state != JobState.SUCCEEDED
        return job.state != JobState.FAILED or job.reason != self.failures[job.id]


def note_ends(url: str) -> None:
    """Have a database note each end of a job, from now on."""
    with psycopg.connect(url) as connection:
        connection.execute(_NOTES)


def stored_jobs(url: str) -> list[StoredJob]:
    """The jobs of a database with what was noted."""
    with psycopg.connect(url) as connection, connection.cursor(row_factory=class_row(StoredJob)) as cursor:
        return cursor.execute(_STORED).fetchall()
