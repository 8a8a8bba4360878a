"""Content of the database, as values."""

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from robosc_api.jobs import JobState
from robosc_server.tasks.task import Failure, Report, TaskKind

STEP = 2**20
"""Increment of a job's revision for each stored change.

In between, progress reports increment the revision by one in the memory of one server, so that the revision never
decreases for a watcher when that server dies.
"""

_BLOCK_BYTES = 512 * 1024
_LENGTH = struct.Struct("<I")


ACTIVE = frozenset(state for state in JobState if not state.has_ended)


@dataclass(frozen=True, slots=True)
class JobRecord:
    """A job, without its request and result; times are microseconds since 1970, in UTC.

    Attributes:
        id: Id that cannot be guessed.
        owner: Name of the caller that it was accepted from.
        kind: Kind of its task.
        state: State of the job.
        revision: Number that grows with each change.
        key: Key of its task.
        main_file: Name of the main file.
        label: Owner's name for it; may be empty.
        idempotency_key: Idempotency key; None: none was given.
        retention_us: Time that it is kept after its end, in microseconds.
        created_us: Time of its acceptance.
        started_us: Time at which a worker began; None: not yet.
        ended_us: Time of its end; None: not yet.
        expires_us: Time at which it is deleted; None: it has not ended.
        attempts: Number of times that a worker has begun.
        progress: Last report of a worker; None: nothing.
        failure: Failure of the job; None: it has not failed.
        is_from_store: True if its result is that of an earlier task.
        replica: Server to which it belongs; None: none.
        result_key: Key of its result; None: it has none.
        losses: Number of times that its worker was lost while it ran, which the job may have caused.
    """

    id: str
    owner: str
    kind: TaskKind
    state: JobState
    revision: int
    key: str
    main_file: str
    label: str
    idempotency_key: str | None
    retention_us: int
    created_us: int
    started_us: int | None = None
    ended_us: int | None = None
    expires_us: int | None = None
    attempts: int = 0
    progress: Report | None = None
    failure: Failure | None = None
    is_from_store: bool = False
    replica: str | None = None
    result_key: str | None = None
    losses: int = 0


@dataclass(frozen=True, slots=True)
class JobFilter:
    """Filter of the jobs that are listed.

    Attributes:
        owner: Owner of the jobs; None: any.
        states: States of the jobs; empty: any.
        kind: Kind of their tasks; None: any.
    """

    owner: str | None
    states: frozenset[JobState]
    kind: TaskKind | None


@dataclass(frozen=True, slots=True)
class OwnerLoad:
    """Load of one owner's jobs, at all servers.

    Attributes:
        owner: Owner of the jobs.
        queued: Number of its queued jobs.
        running: Number of its running jobs.
        ended: Number of its jobs that have ended lately.
        first_queued_us: Time of acceptance of the first of its queued jobs, in microseconds; None: none is queued.
    """

    owner: str
    queued: int = 0
    running: int = 0
    ended: int = 0
    first_queued_us: int | None = None


def blocks_of(messages: Sequence[bytes]) -> Iterator[bytes]:
    """Return messages in blocks of about half a megabyte, each message with its length before it."""
    block = bytearray()
    for message in messages:
        if block and len(block) + len(message) > _BLOCK_BYTES:
            yield bytes(block)
            block.clear()
        block += _LENGTH.pack(len(message))
        block += message
    if block:
        yield bytes(block)


def messages_of(block: bytes) -> Iterator[bytes]:
    """Return the messages of one block."""
    place = 0
    while place < len(block):
        (size,) = _LENGTH.unpack_from(block, place)
        place += _LENGTH.size
        yield block[place : place + size]
        place += size


__all__ = ["ACTIVE", "STEP", "JobFilter", "JobRecord", "JobState", "OwnerLoad", "blocks_of", "messages_of"]
