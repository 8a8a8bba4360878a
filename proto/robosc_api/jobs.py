"""Kinds of tasks and states of jobs: the same in servers and clients, whatever messages carry them."""

from enum import StrEnum


class TaskKind(StrEnum):
    """Kind of a task; each has a message of the API for its request, and one for its responses."""

    CHECK = "check"
    SYNTHESIZE = "synthesize"
    GENERATE = "generate"
    EXPLORE = "explore"
    VERIFY = "verify"
    EXPLAIN = "explain"
    FORMAT = "format"

    # That of an enumeration is a function in Python, which every look-up in a dictionary would call.
    __hash__ = str.__hash__


class JobState(StrEnum):
    """State of a job."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    """The job has a result, which may be that a model has errors."""
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def has_ended(self) -> bool:
        """True if the state does not change any more."""
        return self not in (JobState.QUEUED, JobState.RUNNING)
