"""Rows of jobs, and the operations on them within one transaction.

Each change of a job checks its state and its server. Of two concurrent changes of one job, the first succeeds, and the
second finds that there is nothing left to do.
"""

from collections.abc import Collection, Iterator
from dataclasses import replace
from functools import cache
from typing import Any

from sqlalchemy import Connection, Row, and_, bindparam, delete, func, insert, literal, or_, select, tuple_, update

from robosc_server.store.eviction import choose_evicted
from robosc_server.store.records import ACTIVE, STEP, JobFilter, JobRecord, JobState, OwnerLoad
from robosc_server.store.result_rows import insert_result
from robosc_server.store.schema import JOBS, REPLICAS, REQUESTS, RESULTS
from robosc_server.tasks.task import Failure, Reason, Report, Result, TaskKind

_MESSAGE_CHARACTERS = 4096
_SERVER_DIED = "the server crashed more than once while it ran this job"

MAXIMUM_ATTEMPTS = 2
"""Interrupted attempts after which a job has failed."""

# Frequent statements are built once: building one takes longer than executing it.
_IS_KEPT = or_(JOBS.c.expires_us.is_(None), JOBS.c.expires_us > bindparam("now"))
_IS_ACTIVE = or_(*(JOBS.c.state == state for state in sorted(ACTIVE)))
_FIND = select(JOBS).where(JOBS.c.id == bindparam("job"), _IS_KEPT)
_OF_KEY = and_(JOBS.c.owner == bindparam("by"), JOBS.c.idempotency_key == bindparam("with"))
_FIND_BY_KEY = select(JOBS).where(_OF_KEY, _IS_KEPT)
_FREE_KEY = delete(JOBS).where(_OF_KEY, JOBS.c.expires_us <= bindparam("now"))
_SOME_OF_OWNER = select(JOBS.c.id).where(JOBS.c.owner == bindparam("by")).limit(bindparam("bound")).subquery()
_COUNT = select(func.count()).select_from(_SOME_OF_OWNER)
# Skip a job that another server is about to delete.
_ENDED_FIRST = (
    select(JOBS.c.id)
    .where(JOBS.c.owner == bindparam("by"), JOBS.c.ended_us.is_not(None))
    .order_by(JOBS.c.ended_us, JOBS.c.id)
    .limit(1)
    .with_for_update(skip_locked=True)
)
_INSERT = insert(JOBS)
_COLUMNS_OF_NEW = (
    "id owner kind state revision key main_file label idempotency_key retention_us created_us attempts is_from_store"
    " replica"
).split()
_LOCK = select(JOBS).where(JOBS.c.id == bindparam("job")).with_for_update()
_REQUEST = select(REQUESTS.c.content).where(REQUESTS.c.job == bindparam("of"))
_INSERT_REQUEST = insert(REQUESTS)
_DROP_REQUEST = delete(REQUESTS).where(REQUESTS.c.job == bindparam("of"))
# The row is locked, where a database locks rows, so that it is not swept before a job refers to it.
_LOCK_RESULT = select(RESULTS.c.key).where(RESULTS.c.key == bindparam("of"))
_LOCK_RESULT = _LOCK_RESULT.with_for_update(read=True, key_share=True)
_ACTIVE_IDS = select(JOBS.c.id).where(_IS_ACTIVE, JOBS.c.replica == bindparam("by"))


_NO_PROGRESS = {"stage": None, "progress": None}


@cache
def _change_of(names: tuple[str, ...]) -> Any:
    """Return the statement that gives columns of a job new values."""
    values: dict[str, Any] = {name: bindparam(f"new_{name}") for name in names}
    changed = update(JOBS).where(JOBS.c.id == bindparam("job"))
    return changed.values(revision=JOBS.c.revision + STEP, **values).returning(*JOBS.c)


def record_of(row: Row[Any]) -> JobRecord:
    """Return the record of a row."""
    values = row._mapping
    reason = values["reason"]
    return JobRecord(
        id=values["id"],
        owner=values["owner"],
        kind=TaskKind(values["kind"]),
        state=JobState(values["state"]),
        revision=values["revision"],
        key=values["key"],
        main_file=values["main_file"],
        label=values["label"],
        idempotency_key=values["idempotency_key"],
        retention_us=values["retention_us"],
        created_us=values["created_us"],
        started_us=values["started_us"],
        ended_us=values["ended_us"],
        expires_us=values["expires_us"],
        attempts=values["attempts"],
        progress=None if values["stage"] is None else Report(values["stage"], values["progress"] or ""),
        failure=None if reason is None else Failure(Reason(reason), values["message"] or ""),
        is_from_store=values["is_from_store"],
        replica=values["replica"],
        result_key=values["result_key"],
        losses=values["losses"],
    )


def find(connection: Connection, job_id: str, now_us: int) -> JobRecord | None:
    """Return a job, if it is still stored."""
    row = connection.execute(_FIND, {"job": job_id, "now": now_us}).one_or_none()
    return None if row is None else record_of(row)


def find_by_key(connection: Connection, owner: str, idempotency_key: str, now_us: int) -> JobRecord | None:
    """Return the job that was accepted with an idempotency key."""
    row = connection.execute(_FIND_BY_KEY, {"by": owner, "with": idempotency_key, "now": now_us}).one_or_none()
    return None if row is None else record_of(row)


def find_many(connection: Connection, revisions: dict[str, int]) -> tuple[list[JobRecord], set[str]]:
    """Return those of some jobs that have changed since the given revisions, and the ids of deleted ones."""
    ids = list(revisions)
    gone = set(ids)
    found: list[JobRecord] = []
    for place in range(0, len(ids), 500):
        part = ids[place : place + 500]
        known = select(JOBS.c.id, JOBS.c.revision).where(JOBS.c.id.in_(part))
        rows = connection.execute(known).all()
        gone -= {row.id for row in rows}
        changed = [row.id for row in rows if row.revision > revisions[row.id]]
        if changed:
            found += map(record_of, connection.execute(select(JOBS).where(JOBS.c.id.in_(changed))))
    return found, gone


def listed(
    connection: Connection, chosen: JobFilter, after: tuple[int, str] | None, limit: int, now_us: int
) -> list[JobRecord]:
    """Return jobs, newest first.

    Args:
        connection: Connection, in a transaction.
        chosen: Filter of the jobs.
        after: Time of creation and id of the job that they follow; None: from the first one on.
        limit: Largest number of jobs.
        now_us: The time.
    """
    query = select(JOBS).where(_IS_KEPT)
    if chosen.owner is not None:
        query = query.where(JOBS.c.owner == chosen.owner)
    if chosen.states:
        query = query.where(JOBS.c.state.in_(sorted(chosen.states)))
    if chosen.kind is not None:
        query = query.where(JOBS.c.kind == chosen.kind)
    if after is not None:
        query = query.where(tuple_(JOBS.c.created_us, JOBS.c.id) < after)
    query = query.order_by(JOBS.c.created_us.desc(), JOBS.c.id.desc()).limit(limit)
    return [record_of(row) for row in connection.execute(query, {"now": now_us})]


def counts_by_state(connection: Connection) -> dict[JobState, int]:
    """Return the number of jobs in each state."""
    found = dict.fromkeys(JobState, 0)
    for row in connection.execute(select(JOBS.c.state, func.count().label("number")).group_by(JOBS.c.state)):
        found[JobState(row.state)] = row.number
    return found


def loads(connection: Connection, owner: str | None, since_us: int) -> list[OwnerLoad]:
    """Return the load of each owner that has unfinished jobs, or jobs that have ended since a time.

    Args:
        connection: Connection, in a transaction.
        owner: The only owner; None: all.
        since_us: The time.
    """
    counted = func.count().label("number"), func.min(JOBS.c.created_us).label("first")
    active = select(JOBS.c.owner, JOBS.c.state, *counted).where(_IS_ACTIVE).group_by(JOBS.c.owner, JOBS.c.state)
    ended = _ended_by_owner(owner, since_us)
    if owner is not None:
        active = active.where(JOBS.c.owner == owner)
    found = {row.owner: OwnerLoad(row.owner, ended=row.number) for row in connection.execute(ended) if row.number}
    for row in connection.execute(active):
        load = found.get(row.owner, OwnerLoad(row.owner))
        if row.state == JobState.QUEUED:
            found[row.owner] = replace(load, queued=row.number, first_queued_us=row.first)
        else:
            found[row.owner] = replace(load, running=row.number)
    return list(found.values())


def _ended_by_owner(owner: str | None, since_us: int) -> Any:
    """Return the query for the number of jobs of each owner that have ended since a time.

    It reads the index `jobs_ended` once for each owner and not all jobs: "Loose indexscan", wiki.postgresql.org.
    """
    if owner is not None:
        number = select(func.count()).where(JOBS.c.owner == owner, JOBS.c.ended_us > since_us)
        return select(literal(owner).label("owner"), number.scalar_subquery().label("number"))
    owners = select(func.min(JOBS.c.owner).label("owner")).cte("owners", recursive=True)
    following = select(func.min(JOBS.c.owner)).where(JOBS.c.owner > owners.c.owner).scalar_subquery()
    owners = owners.union_all(select(following).where(owners.c.owner.is_not(None)))
    number = select(func.count()).where(JOBS.c.owner == owners.c.owner, JOBS.c.ended_us > since_us)
    return select(owners.c.owner, number.scalar_subquery().label("number")).where(owners.c.owner.is_not(None))


def accept(
    connection: Connection, record: JobRecord, request: bytes, result: Result | None, bound: int, now_us: int
) -> tuple[JobRecord, bool] | None:
    """Store a new job, and end it at once if there is a result of its task.

    Args:
        connection: Connection, in a transaction.
        record: The job, which waits.
        request: Request of the job.
        result: Result of the same task that is known elsewhere; None: only the database is asked.
        bound: Number of jobs of one owner that are kept; the one that ended first makes room for a new one.
        now_us: The time.

    Returns:
        The job, and True if it was found by its idempotency key. None: `bound` jobs of the owner have not ended.
    """
    if record.idempotency_key is not None:
        there = find_by_key(connection, record.owner, record.idempotency_key, now_us)
        if there is not None:
            return there, True
        # One that has expired and is not swept yet.
        freed = {"by": record.owner, "with": record.idempotency_key, "now": now_us}
        connection.execute(_FREE_KEY, freed)
    if connection.execute(_COUNT, {"by": record.owner, "bound": bound}).scalar_one() >= bound:
        first = connection.scalar(_ENDED_FIRST, {"by": record.owner})
        if first is None:
            return None
        connection.execute(delete(JOBS).where(JOBS.c.id == first))
    new = {name: getattr(record, name) for name in _COLUMNS_OF_NEW}
    connection.execute(_INSERT, new)
    ended = _end_from_store(connection, record, result, now_us)
    if ended is not None:
        return ended, False
    connection.execute(_INSERT_REQUEST, {"job": record.id, "content": request})
    return record, False


def begin(connection: Connection, job_id: str, replica: str, now_us: int) -> tuple[JobRecord, bytes] | None:
    """Mark a job as running, or end it if there is a result of its task by now (its request is empty then).

    Returns:
        The job and its request; None: it no longer waits, or belongs to another server.
    """
    record = _locked(connection, job_id)
    if record is None or record.replica != replica or record.state is not JobState.QUEUED:
        return None
    ended = _end_from_store(connection, record, None, now_us)
    if ended is not None:
        return ended, b""
    attempts = record.attempts + 1
    begun = _update_row(
        connection, job_id, **_NO_PROGRESS, state=JobState.RUNNING, attempts=attempts, started_us=now_us
    )
    return begun, bytes(connection.scalar(_REQUEST, {"of": job_id}) or b"")


def requeue(
    connection: Connection, ids: Collection[str], replica: str, next_replica: str | None, *, is_lost: bool
) -> list[JobRecord]:
    """Queue running jobs again that were interrupted; the attempt does not count.

    Args:
        connection: Connection, in a transaction.
        ids: Ids of the jobs; those that do not run, or belong to another server, do not change.
        replica: Server to which the jobs belong.
        next_replica: Server to which they will belong; None: the one that finds them first.
        is_lost: True if they lost their workers, which the jobs may have caused; such losses are counted.
    """
    found = []
    for job_id in sorted(ids):  # The same order in each server prevents deadlocks.
        record = _locked(connection, job_id)
        if record is not None and record.replica == replica and record.state is JobState.RUNNING:
            values: dict[str, Any] = {"state": JobState.QUEUED, "attempts": record.attempts - 1}
            values["losses"] = record.losses + is_lost
            found.append(_update_row(connection, job_id, **_NO_PROGRESS, **values, replica=next_replica))
    return found


def release_queued(connection: Connection, replica: str) -> None:
    """Release the queued jobs of a server to the other servers."""
    connection.execute(
        update(JOBS).where(JOBS.c.replica == replica, JOBS.c.state == JobState.QUEUED).values(replica=None)
    )


def succeed(connection: Connection, job_id: str, replica: str, result: Result, now_us: int) -> JobRecord | None:
    """Store the result of a running job; None: it no longer runs, or belongs to another server."""
    record = _locked(connection, job_id)
    if record is None or record.replica != replica or record.state.has_ended:
        return None
    insert_result(connection, record.key, record.kind, result, record.owner, now_us)
    return _end(connection, record, JobState.SUCCEEDED, now_us, result_key=record.key)


def fail(connection: Connection, job_id: str, replica: str, failure: Failure, now_us: int) -> JobRecord | None:
    """End a job without a result; None: it has ended before, or belongs to another server."""
    record = _locked(connection, job_id)
    if record is None or record.replica != replica or record.state.has_ended:
        return None
    return _fail(connection, record, failure, now_us)


def cancel(connection: Connection, job_id: str, now_us: int) -> JobRecord | None:
    """Cancel a job of any server; None: there is no such job. A job that has ended does not change."""
    record = _locked(connection, job_id)
    if record is None or record.state.has_ended:
        return record
    return _end(connection, record, JobState.CANCELLED, now_us)


def write_progress(connection: Connection, replica: str, progress: dict[str, tuple[int, Report]]) -> None:
    """Store the progress of running jobs with their revisions."""
    for job_id, (revision, report) in progress.items():
        connection.execute(
            update(JOBS)
            .where(
                JOBS.c.id == job_id,
                JOBS.c.replica == replica,
                JOBS.c.state == JobState.RUNNING,
                JOBS.c.revision < revision,
            )
            .values(revision=revision, stage=report.stage, progress=report.message)
        )


def active_of(connection: Connection, replica: str) -> list[JobRecord]:
    """Return the jobs of a server that have not ended, the oldest first."""
    query = select(JOBS).where(_IS_ACTIVE, JOBS.c.replica == replica)
    return [record_of(row) for row in connection.execute(query.order_by(JOBS.c.created_us, JOBS.c.id))]


def active_ids_of(connection: Connection, replica: str) -> set[str]:
    """Return the ids of the jobs of a server that have not ended."""
    return set(connection.scalars(_ACTIVE_IDS, {"by": replica}))


def has_orphans(connection: Connection) -> bool:
    """Return True if there are jobs that have not ended and belong to no server."""
    return connection.scalar(select(JOBS.c.id).where(_is_orphan()).limit(1)) is not None


def take_orphans(connection: Connection, ours: str, now_us: int, limit: int) -> list[JobRecord]:
    """Take over jobs that have not ended and belong to no server; those that ran are queued again, or have failed.

    Args:
        connection: Connection, in a transaction.
        ours: The server that takes them.
        now_us: The time.
        limit: Largest number of jobs, the oldest first.

    Returns:
        The jobs that have changed.
    """
    # Concurrent servers take different jobs. Our own jobs are not taken again, even if another server takes us for
    # dead meanwhile.
    query = select(JOBS).where(_is_orphan(), JOBS.c.replica.is_distinct_from(ours))
    query = query.order_by(JOBS.c.created_us, JOBS.c.id).limit(limit)
    found = [record_of(row) for row in connection.execute(query.with_for_update(skip_locked=True, of=JOBS))]
    taken = []
    for record in found:
        if record.state is JobState.RUNNING and record.attempts >= MAXIMUM_ATTEMPTS:
            taken.append(_fail(connection, record, Failure(Reason.SERVER_DIED, _SERVER_DIED), now_us))
            continue
        taken.append(_update_row(connection, record.id, **_NO_PROGRESS, state=JobState.QUEUED, replica=ours))
    return taken


def sweep(connection: Connection, now_us: int, limit: int) -> int:
    """Delete expired jobs, at most a given number; return the number of deleted jobs."""
    expired = select(JOBS.c.id).where(JOBS.c.expires_us <= now_us).limit(limit)
    ids = list(connection.scalars(expired))
    if ids:
        connection.execute(delete(JOBS).where(JOBS.c.id.in_(ids)))
    return len(ids)


def results_by_owner(connection: Connection) -> dict[str, int]:
    """Return the bytes of the results that each owner's jobs refer to; a shared result counts for each owner."""
    referred = select(JOBS.c.owner, JOBS.c.result_key).where(JOBS.c.result_key.is_not(None)).distinct().subquery()
    query = select(referred.c.owner, func.sum(RESULTS.c.size).label("total")).group_by(referred.c.owner)
    query = query.join_from(referred, RESULTS, RESULTS.c.key == referred.c.result_key)
    return {row.owner: int(row.total) for row in connection.execute(query)}


def forget(connection: Connection, held: dict[str, int], excess: int, limit: int) -> tuple[int, dict[str, int]]:
    """Delete jobs with results early: each time the job that ended first of the owner whose results are largest.

    Args:
        connection: Connection, in a transaction.
        held: Bytes of the results that each owner's jobs refer to.
        excess: Number of bytes to free.
        limit: Largest number of jobs.

    Returns:
        Number of deleted jobs, and the bytes of the results that each owner's jobs refer to then.
    """

    def oldest(owner: str) -> Iterator[tuple[str, int]]:
        later = JOBS.alias()
        is_referred_to = (
            select(later.c.id)
            .where(later.c.result_key == JOBS.c.result_key, later.c.owner == owner)
            .where(tuple_(later.c.ended_us, later.c.id) > tuple_(JOBS.c.ended_us, JOBS.c.id))
            .exists()
        )
        query = select(JOBS.c.id, RESULTS.c.size, is_referred_to.label("is_referred_to"))
        query = query.join_from(JOBS, RESULTS, RESULTS.c.key == JOBS.c.result_key).where(JOBS.c.owner == owner)
        for row in connection.execute(query.order_by(JOBS.c.ended_us, JOBS.c.id).limit(limit)):
            yield row.id, 0 if row.is_referred_to else row.size

    chosen, left = choose_evicted(held, oldest, excess, limit)
    if chosen:
        connection.execute(delete(JOBS).where(JOBS.c.id.in_(chosen)))
    return len(chosen), left


def _is_orphan() -> Any:
    is_somebodys = select(REPLICAS.c.id).where(REPLICAS.c.id == JOBS.c.replica).exists()
    return and_(_IS_ACTIVE, ~is_somebodys)


def _locked(connection: Connection, job_id: str) -> JobRecord | None:
    """Lock a job against changes until the end of the transaction, and return it."""
    row = connection.execute(_LOCK, {"job": job_id}).one_or_none()
    return None if row is None else record_of(row)


def _update_row(connection: Connection, job_id: str, **values: Any) -> JobRecord:
    """Change a locked job and return its new record."""
    new = {f"new_{name}": value for name, value in values.items()}
    return record_of(connection.execute(_change_of(tuple(values)), {"job": job_id, **new}).one())


def _end_from_store(connection: Connection, record: JobRecord, result: Result | None, now_us: int) -> JobRecord | None:
    """End a job with the result of an earlier task; None: there is none."""
    if connection.scalar(_LOCK_RESULT, {"of": record.key}) is None:
        if result is None:
            return None
        insert_result(connection, record.key, record.kind, result, record.owner, now_us)
    return _end(connection, record, JobState.SUCCEEDED, now_us, result_key=record.key, is_from_store=True)


def _fail(connection: Connection, record: JobRecord, failure: Failure, now_us: int) -> JobRecord:
    message = clean(failure.message)
    return _end(connection, record, JobState.FAILED, now_us, reason=failure.reason, message=message)


def _end(connection: Connection, record: JobRecord, state: JobState, now_us: int, **values: Any) -> JobRecord:
    connection.execute(_DROP_REQUEST, {"of": record.id})
    times: dict[str, Any] = {"ended_us": now_us, "expires_us": now_us + record.retention_us}
    return _update_row(connection, record.id, **values, **times, state=state, replica=None)


def clean(text: str) -> str:
    """Return a text that every database accepts: without NUL and lone surrogates, not too long."""
    return text[:_MESSAGE_CHARACTERS].encode("utf-8", "replace").decode().replace("\0", "\N{REPLACEMENT CHARACTER}")
