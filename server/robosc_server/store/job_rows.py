"""Rows of jobs: what one transaction does with them.

Whoever changes a job says what it must be for that: in which state, and whose. Of two that want to change the same job
one comes first, and the other finds that there is nothing left to do.
"""

from collections.abc import Collection
from typing import Any

from sqlalchemy import Connection, Row, and_, delete, func, insert, or_, select, tuple_, update

from robosc_server.store.records import ACTIVE, STEP, JobFilter, JobRecord, JobState
from robosc_server.store.result_rows import insert_result
from robosc_server.store.schema import JOBS, REPLICAS, REQUESTS, RESULTS
from robosc_server.tasks.task import Failure, Reason, Report, Result, TaskKind

_MESSAGE_CHARACTERS = 4096
_SERVER_DIED = "the server died while it was at this job, more than once"

MAXIMUM_ATTEMPTS = 2
"""Begun so often and interrupted each time, a job has failed."""


def record_of(row: Row[Any]) -> JobRecord:
    """The value of a row."""
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
    )


def find(connection: Connection, job_id: str, now_us: int) -> JobRecord | None:
    """A job that is still kept."""
    row = connection.execute(select(JOBS).where(JOBS.c.id == job_id, _is_kept(now_us))).one_or_none()
    return None if row is None else record_of(row)


def find_by_key(connection: Connection, owner: str, idempotency_key: str, now_us: int) -> JobRecord | None:
    """The job that was accepted with an idempotency key."""
    chosen = select(JOBS).where(JOBS.c.owner == owner, JOBS.c.idempotency_key == idempotency_key, _is_kept(now_us))
    row = connection.execute(chosen).one_or_none()
    return None if row is None else record_of(row)


def find_many(connection: Connection, revisions: dict[str, int]) -> list[JobRecord]:
    """Those of some jobs that have changed since the revisions given."""
    ids = list(revisions)
    found: list[JobRecord] = []
    for place in range(0, len(ids), 500):
        part = ids[place : place + 500]
        known = select(JOBS.c.id, JOBS.c.revision).where(JOBS.c.id.in_(part))
        changed = [row.id for row in connection.execute(known) if row.revision > revisions[row.id]]
        if changed:
            found += map(record_of, connection.execute(select(JOBS).where(JOBS.c.id.in_(changed))))
    return found


def listed(
    connection: Connection, chosen: JobFilter, after: tuple[int, str] | None, limit: int, now_us: int
) -> list[JobRecord]:
    """Jobs, the youngest first.

    Args:
        connection: In a transaction.
        chosen: Which.
        after: Time of creation and id of the job that they follow; None: from the first one on.
        limit: How many at most.
        now_us: The time.
    """
    query = select(JOBS).where(_is_kept(now_us))
    if chosen.owner is not None:
        query = query.where(JOBS.c.owner == chosen.owner)
    if chosen.states:
        query = query.where(JOBS.c.state.in_(sorted(chosen.states)))
    if chosen.kind is not None:
        query = query.where(JOBS.c.kind == chosen.kind)
    if after is not None:
        query = query.where(tuple_(JOBS.c.created_us, JOBS.c.id) < after)
    query = query.order_by(JOBS.c.created_us.desc(), JOBS.c.id.desc()).limit(limit)
    return [record_of(row) for row in connection.execute(query)]


def count_of(connection: Connection, owner: str, limit: int) -> int:
    """How many jobs of an owner there are, counted up to a limit."""
    some = select(JOBS.c.id).where(JOBS.c.owner == owner).limit(limit).subquery()
    return connection.scalar(select(func.count()).select_from(some)) or 0


def counts_by_state(connection: Connection) -> dict[JobState, int]:
    """How many jobs there are in each state."""
    found = dict.fromkeys(JobState, 0)
    for row in connection.execute(select(JOBS.c.state, func.count().label("number")).group_by(JOBS.c.state)):
        found[JobState(row.state)] = row.number
    return found


def accept(
    connection: Connection, record: JobRecord, request: bytes, result: Result | None, bound: int, now_us: int
) -> tuple[JobRecord, bool] | None:
    """Keep a new job, and end it at once if there is a result of its task.

    Args:
        connection: In a transaction.
        record: The job, which waits.
        request: What it is asked to do.
        result: One of the same task that is known elsewhere; None: only the database is asked.
        bound: How many jobs of one owner are kept.
        now_us: The time.

    Returns:
        The job, and whether it was there before, by its idempotency key. None: there are too many.
    """
    if record.idempotency_key is not None:
        there = find_by_key(connection, record.owner, record.idempotency_key, now_us)
        if there is not None:
            return there, True
        # One that has expired and is not swept yet.
        connection.execute(
            delete(JOBS).where(
                JOBS.c.owner == record.owner,
                JOBS.c.idempotency_key == record.idempotency_key,
                JOBS.c.expires_us <= now_us,
            )
        )
    if count_of(connection, record.owner, bound) >= bound:
        return None
    connection.execute(
        insert(JOBS).values(
            id=record.id,
            owner=record.owner,
            kind=record.kind,
            state=record.state,
            revision=record.revision,
            key=record.key,
            main_file=record.main_file,
            label=record.label,
            idempotency_key=record.idempotency_key,
            retention_us=record.retention_us,
            created_us=record.created_us,
            attempts=0,
            is_from_store=False,
            replica=record.replica,
        )
    )
    ended = _end_from_store(connection, record, result, now_us)
    if ended is not None:
        return ended, False
    connection.execute(insert(REQUESTS).values(job=record.id, content=request))
    return record, False


def begin(connection: Connection, job_id: str, replica: str, now_us: int) -> tuple[JobRecord, bytes] | None:
    """Have a job run, or end if a result of its task has come up meanwhile (its request is empty then).

    Returns:
        The job and its request; None: it does not wait any more, or is another server's.
    """
    waits = and_(JOBS.c.id == job_id, JOBS.c.replica == replica, JOBS.c.state == JobState.QUEUED)
    row = connection.execute(select(JOBS).where(waits).with_for_update()).one_or_none()
    if row is None:
        return None
    ended = _end_from_store(connection, record_of(row), None, now_us)
    if ended is not None:
        return ended, b""
    record = _changed(
        connection,
        waits,
        state=JobState.RUNNING,
        attempts=JOBS.c.attempts + 1,
        started_us=now_us,
        stage=None,
        progress=None,
    )
    request = connection.scalar(select(REQUESTS.c.content).where(REQUESTS.c.job == job_id))
    return None if record is None else (record, bytes(request or b""))


def put_back(connection: Connection, ids: Collection[str], replica: str, next_replica: str | None) -> list[JobRecord]:
    """Have running jobs wait again that were interrupted through no fault of theirs; the attempt does not count.

    Args:
        connection: In a transaction.
        ids: Which; those that do not run, or are another server's, stay as they are.
        replica: Whose they are.
        next_replica: Whose they will be; None: whoever finds them first.
    """
    found = []
    for job_id in ids:
        record = _changed(
            connection,
            and_(JOBS.c.id == job_id, JOBS.c.replica == replica, JOBS.c.state == JobState.RUNNING),
            state=JobState.QUEUED,
            attempts=JOBS.c.attempts - 1,
            replica=next_replica,
            stage=None,
            progress=None,
        )
        if record is not None:
            found.append(record)
    return found


def give_up_waiting(connection: Connection, replica: str) -> None:
    """Leave the jobs of a server that wait to whoever finds them first."""
    connection.execute(
        update(JOBS).where(JOBS.c.replica == replica, JOBS.c.state == JobState.QUEUED).values(replica=None)
    )


def succeed(connection: Connection, job_id: str, replica: str, result: Result, now_us: int) -> JobRecord | None:
    """Keep the result of a job that runs; None: it does not any more, or is another server's."""
    row = connection.execute(select(JOBS).where(_is_active(job_id, replica)).with_for_update()).one_or_none()
    if row is None:
        return None
    record = record_of(row)
    insert_result(connection, record.key, record.kind, result, now_us)
    return _end(connection, record, JobState.SUCCEEDED, now_us, result_key=record.key)


def fail(connection: Connection, job_id: str, replica: str, failure: Failure, now_us: int) -> JobRecord | None:
    """End a job without a result; None: it has ended before, or is another server's."""
    row = connection.execute(select(JOBS).where(_is_active(job_id, replica)).with_for_update()).one_or_none()
    return None if row is None else _fail(connection, record_of(row), failure, now_us)


def cancel(connection: Connection, job_id: str, now_us: int) -> JobRecord | None:
    """End a job, whoever is at it; None: there is none. One that has ended stays as it is."""
    row = connection.execute(select(JOBS).where(JOBS.c.id == job_id).with_for_update()).one_or_none()
    if row is None:
        return None
    record = record_of(row)
    return record if record.state.has_ended else _end(connection, record, JobState.CANCELLED, now_us)


def note_progress(connection: Connection, replica: str, progress: dict[str, tuple[int, Report]]) -> None:
    """Keep what workers have told, with the revisions that it has brought jobs to."""
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
    """The jobs of a server that have not ended, the oldest first."""
    query = select(JOBS).where(JOBS.c.state.in_(sorted(ACTIVE)), JOBS.c.replica == replica)
    return [record_of(row) for row in connection.execute(query.order_by(JOBS.c.created_us, JOBS.c.id))]


def active_ids_of(connection: Connection, replica: str) -> set[str]:
    """The ids of the jobs of a server that have not ended."""
    return set(connection.scalars(select(JOBS.c.id).where(JOBS.c.state.in_(sorted(ACTIVE)), JOBS.c.replica == replica)))


def has_orphans(connection: Connection) -> bool:
    """Whether there are jobs that have not ended, and are no server's."""
    return connection.scalar(select(JOBS.c.id).where(_is_orphan()).limit(1)) is not None


def take_orphans(connection: Connection, ours: str, now_us: int) -> list[JobRecord]:
    """Take over the jobs that have not ended, and are no server's; those that ran wait again, or have failed.

    Args:
        connection: In a transaction.
        ours: The server that takes them.
        now_us: The time.

    Returns:
        The jobs that have changed.
    """
    # Whoever else takes jobs at this moment takes others.
    query = select(JOBS).where(_is_orphan()).order_by(JOBS.c.created_us, JOBS.c.id)
    found = [record_of(row) for row in connection.execute(query.with_for_update(skip_locked=True, of=JOBS))]
    taken = []
    for record in found:
        if record.state is JobState.RUNNING and record.attempts >= MAXIMUM_ATTEMPTS:
            taken.append(_fail(connection, record, Failure(Reason.SERVER_DIED, _SERVER_DIED), now_us))
            continue
        changed = _changed(
            connection, JOBS.c.id == record.id, state=JobState.QUEUED, replica=ours, stage=None, progress=None
        )
        if changed is not None:
            taken.append(changed)
    return taken


def sweep(connection: Connection, now_us: int, limit: int) -> int:
    """Delete jobs whose time has passed, at most so many; how many there were."""
    expired = select(JOBS.c.id).where(JOBS.c.expires_us <= now_us).limit(limit)
    ids = list(connection.scalars(expired))
    if ids:
        connection.execute(delete(JOBS).where(JOBS.c.id.in_(ids)))
    return len(ids)


def _is_kept(now_us: int) -> Any:
    return or_(JOBS.c.expires_us.is_(None), JOBS.c.expires_us > now_us)


def _is_orphan() -> Any:
    is_somebodys = select(REPLICAS.c.id).where(REPLICAS.c.id == JOBS.c.replica).exists()
    return and_(JOBS.c.state.in_(sorted(ACTIVE)), ~is_somebodys)


def _is_active(job_id: str, replica: str) -> Any:
    return and_(JOBS.c.id == job_id, JOBS.c.replica == replica, JOBS.c.state.in_(sorted(ACTIVE)))


def _changed(connection: Connection, which: Any, **values: Any) -> JobRecord | None:
    """Change a job that is in some condition, and how it is then; None: it is not."""
    changed = update(JOBS).where(which).values(revision=JOBS.c.revision + STEP, **values).returning(*JOBS.c)
    row = connection.execute(changed).one_or_none()
    return None if row is None else record_of(row)


def _end_from_store(connection: Connection, record: JobRecord, result: Result | None, now_us: int) -> JobRecord | None:
    """End a job with the result of an earlier task; None: there is none."""
    # Locked against being swept, where rows are: until the job refers to it.
    there = select(RESULTS.c.key).where(RESULTS.c.key == record.key).with_for_update(read=True, key_share=True)
    if connection.scalar(there) is None:
        if result is None:
            return None
        insert_result(connection, record.key, record.kind, result, now_us)
    return _end(connection, record, JobState.SUCCEEDED, now_us, result_key=record.key, is_from_store=True)


def _fail(connection: Connection, record: JobRecord, failure: Failure, now_us: int) -> JobRecord:
    message = clean(failure.message)
    return _end(connection, record, JobState.FAILED, now_us, reason=failure.reason, message=message)


def _end(connection: Connection, record: JobRecord, state: JobState, now_us: int, **values: Any) -> JobRecord:
    connection.execute(delete(REQUESTS).where(REQUESTS.c.job == record.id))
    ended = _changed(
        connection,
        JOBS.c.id == record.id,
        state=state,
        ended_us=now_us,
        expires_us=now_us + record.retention_us,
        replica=None,
        **values,
    )
    assert ended is not None  # noqa: S101  # its row is locked
    return ended


def clean(text: str) -> str:
    """A text that every database takes: without NUL and lone surrogates, not too long."""
    return text[:_MESSAGE_CHARACTERS].encode("utf-8", "replace").decode().replace("\0", "\N{REPLACEMENT CHARACTER}")
