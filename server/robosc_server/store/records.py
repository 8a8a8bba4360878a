"""What the database holds, as values."""

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum

from robosc_server.tasks.task import Failure, Report, TaskKind

STEP = 2**20
"""What a change that is kept adds to a job's revision. Between two of them, what a worker reports counts up by one in
the memory of one server, so that no watcher sees a revision fall when that server dies."""

_BLOCK_BYTES = 512 * 1024
_LENGTH = struct.Struct("<I")


class JobState(StrEnum):
    """Where a job is."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def has_ended(self) -> bool:
        """Whether it stays as it is."""
        return self not in ACTIVE


ACTIVE = frozenset({JobState.QUEUED, JobState.RUNNING})


@dataclass(frozen=True, slots=True)
class JobRecord:
    """A job, without its request and result. Times are microseconds since 1970, in UTC.

    Attributes:
        id: Cannot be guessed.
        owner: Name of the caller that it was accepted from.
        kind: What its task is.
        state: Where it is.
        revision: Grows with each change.
        key: Of its task.
        main_file: Name of the main file.
        label: What its owner calls it; may be empty.
        idempotency_key: None: it was given none.
        retention_us: How long it is kept after its end.
        created_us: When it was accepted.
        started_us: When a worker began; None: not yet.
        ended_us: When it ended; None: not yet.
        expires_us: When it is forgotten; None: not before it has ended.
        attempts: How often a worker has begun.
        progress: What a worker has told last; None: nothing.
        failure: Why it has failed; None: it has not.
        is_from_store: Whether its result is that of an earlier task.
        replica: Which server has it to do; None: none.
        result_key: Of its result; None: it has none.
        losses: How often its worker was lost under it in a way that may be its own fault.
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
    """Which jobs are listed.

    Attributes:
        owner: None: of all.
        states: Empty: in any.
        kind: None: of any.
    """

    owner: str | None
    states: frozenset[JobState]
    kind: TaskKind | None


def blocks_of(messages: Sequence[bytes]) -> Iterator[bytes]:
    """Messages in blocks of about half a megabyte, each message with its length before it."""
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
    """The messages of one block."""
    place = 0
    while place < len(block):
        (size,) = _LENGTH.unpack_from(block, place)
        place += _LENGTH.size
        yield block[place : place + size]
        place += size
