"""Jobs as values: stored tasks that continue without their caller."""

from dataclasses import dataclass
from datetime import datetime

from robosc_api.jobs import JobState, TaskKind
from robosc_client.results import Progress

MAXIMUM_LABEL = 200
"""Maximum number of characters of a label."""

MAXIMUM_IDEMPOTENCY_KEY = 128
"""Maximum number of characters of an idempotency key."""


@dataclass(frozen=True, slots=True)
class JobFailure:
    """Reason why a job has failed.

    Attributes:
        reason: Reason of the server, such as `CPU_LIMIT`.
        message: One sentence.
    """

    reason: str
    message: str


@dataclass(frozen=True, slots=True)
class Job:
    """A job, without its request and result.

    Attributes:
        id: Id of the job.
        owner: Owner of the job.
        kind: Kind of its task.
        state: State of the job.
        revision: Number that grows with each change.
        main_file: Name of the main file.
        label: Submitter's name for the job.
        created: Time of its acceptance.
        started: Time at which a worker began, or None.
        ended: Time of its end, or None.
        expires: Time at which the job and its result are deleted, or None.
        attempts: Number of times that a worker has begun.
        progress: Progress of the work, or None.
        failure: Reason why it has failed, or None.
        from_store: True if the result is that of an earlier equal request.
        waiting_before: Number of jobs ahead of it in the queue.
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
    """Outcome of the submission of a task.

    Attributes:
        job: The job.
        existed: True if a job with the idempotency key existed already.
    """

    job: Job
    existed: bool


@dataclass(frozen=True, slots=True)
class CallerLoad:
    """Load of one caller of the service.

    Attributes:
        caller: Name of the caller, as the owner of a job.
        waiting_tasks: Number of its tasks, calls and jobs, that wait at the server that has answered.
        running_tasks: Number of its tasks, calls and jobs, that workers are busy with for that server.
        queued_jobs: Number of its queued jobs, of all servers.
        running_jobs: Number of its running jobs, of all servers.
        ended_jobs: Number of its jobs that have ended within the last minute, of all servers.
        first_queued: Time at which the first of its queued jobs was accepted; None: none is queued.
    """

    caller: str
    waiting_tasks: int
    running_tasks: int
    queued_jobs: int
    running_jobs: int
    ended_jobs: int
    first_queued: datetime | None


@dataclass(frozen=True, slots=True)
class ServiceLoad:
    """Load of the service.

    Attributes:
        time: Time of the answer, by the clock of the server.
        callers: Load of each caller, the largest first.
        workers: Number of tasks that workers can be busy with at once; 0: there is no worker.
        running_tasks: Number of tasks of all callers that workers are busy with for the server that has answered.
        waiting_tasks: Number of tasks of all callers that wait at that server.
        servers: Number of servers that share the jobs.
    """

    time: datetime
    callers: tuple[CallerLoad, ...]
    workers: int
    running_tasks: int
    waiting_tasks: int
    servers: int


__all__ = [
    "MAXIMUM_IDEMPOTENCY_KEY",
    "MAXIMUM_LABEL",
    "CallerLoad",
    "Job",
    "JobFailure",
    "JobState",
    "ServiceLoad",
    "Submission",
    "TaskKind",
]
