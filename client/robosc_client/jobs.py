"""Jobs, as values: tasks that go on without their caller."""

from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum

from robosc_client.results import Progress

MAXIMUM_LABEL = 200
"""Characters of what a job is called."""

MAXIMUM_IDEMPOTENCY_KEY = 128
"""Characters of an idempotency key."""


class TaskKind(StrEnum):
    """What a task is."""

    CHECK = "check"
    SYNTHESIZE = "synthesize"
    GENERATE = "generate"
    EXPLORE = "explore"
    VERIFY = "verify"
    FORMAT = "format"


class JobState(StrEnum):
    """Where a job is."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    """It has a result, also one that says that a model has errors."""
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def has_ended(self) -> bool:
        """Whether it stays so."""
        return self not in (JobState.QUEUED, JobState.RUNNING)


@dataclass(frozen=True, slots=True)
class JobFailure:
    """Why a job has failed.

    Attributes:
        reason: The word for it, such as `CPU_LIMIT`.
        message: One sentence.
    """

    reason: str
    message: str


@dataclass(frozen=True, slots=True)
class Job:
    """A job, without its request and result.

    Attributes:
        id: Its id.
        owner: Whose it is.
        kind: What its task is.
        state: Where it is.
        revision: Grows with each change.
        main_file: Name of the main file.
        label: What its submitter calls it.
        created: When it was accepted.
        started: When a worker began, or None.
        ended: When it ended, or None.
        expires: When it and its result are forgotten, or None.
        attempts: How often a worker has begun.
        progress: Where the work is, or None.
        failure: Why it has failed, or None.
        from_store: Whether the result is an earlier one of the same request.
        waiting_before: Jobs that wait before it.
    """

    id: str
    owner: str
    kind: TaskKind
    state: JobState
    revision: int
    main_file: str
    label: str
    created: datetime
    started: datetime | None = None
    ended: datetime | None = None
    expires: datetime | None = None
    attempts: int = 0
    progress: Progress | None = None
    failure: JobFailure | None = None
    from_store: bool = False
    waiting_before: int = 0


@dataclass(frozen=True, slots=True)
class Submission:
    """What became of a task that was submitted.

    Attributes:
        job: The job.
        existed: Whether it was there before, by its idempotency key.
    """

    job: Job
    existed: bool
