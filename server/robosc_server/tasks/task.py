"""Tasks, results and failures as values, which server, database and workers exchange."""

import hashlib
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache

from robosc_api.jobs import TaskKind

_OWNER_MARK = "@"
_OWNER_DIGITS = 32


@dataclass(frozen=True, slots=True)
class Task:
    """A checked and accepted request.

    Attributes:
        kind: Kind of the task.
        request: The serialized message of the request.
        key: SHA-256 (64 hexadecimal digits) of everything that determines the result: the kind, every file by name and
            content, the options and the version of RoboSC; in a key by `own_key` also the caller.
        main_file: Name of the main file, for lists.
    """

    kind: TaskKind
    request: bytes
    key: str
    main_file: str


@dataclass(frozen=True, slots=True)
class TaskLimits:
    """Limits of one task.

    Attributes:
        seconds: Maximum wall-clock time at a worker, in seconds.
        cpu_seconds: Maximum CPU time, in seconds.
        memory_bytes: Maximum address space, including that of the worker itself.
        nodes: Maximum number of decision diagram nodes.
        result_bytes: Maximum size of all messages of the result.
    """

    seconds: float = 600.0
    cpu_seconds: float = 600.0
    memory_bytes: int = 2 * 2**30
    nodes: int = 20_000_000
    result_bytes: int = 64 * 2**20


@dataclass(frozen=True, slots=True)
class Report:
    """Progress of the work: a stage, and one short line."""

    stage: str
    message: str


def own_key(key: str, caller: str) -> str:
    """Return the key of a task for one caller, so that callers cannot find out the requests of others."""
    return f"{key}{_OWNER_MARK}{_digest_of(caller)}"


def shared_key(key: str) -> str:
    """Return the key of a task for all callers, from one of either kind."""
    return key.partition(_OWNER_MARK)[0]


@lru_cache(maxsize=4096)
def _digest_of(caller: str) -> str:
    return hashlib.sha256(caller.encode("utf-8", "replace")).hexdigest()[:_OWNER_DIGITS]


class Reason(StrEnum):
    """Reason why something ended without a result: the reason of google.rpc.ErrorInfo."""

    MALFORMED_REQUEST = "MALFORMED_REQUEST"
    REQUEST_TOO_LARGE = "REQUEST_TOO_LARGE"
    SERVER_BUSY = "SERVER_BUSY"
    QUOTA_EXCEEDED = "QUOTA_EXCEEDED"
    CPU_LIMIT = "CPU_LIMIT"
    MEMORY_LIMIT = "MEMORY_LIMIT"
    NODE_LIMIT = "NODE_LIMIT"
    RESULT_TOO_LARGE = "RESULT_TOO_LARGE"
    TIME_LIMIT = "TIME_LIMIT"
    WORKER_DIED = "WORKER_DIED"
    INTERNAL_FAULT = "INTERNAL_FAULT"
    SERVER_DIED = "SERVER_DIED"
    SHUTTING_DOWN = "SHUTTING_DOWN"
    STORE_UNAVAILABLE = "STORE_UNAVAILABLE"
    WORKERS_UNAVAILABLE = "WORKERS_UNAVAILABLE"
    NO_SUCH_JOB = "NO_SUCH_JOB"
    JOB_NOT_ENDED = "JOB_NOT_ENDED"
    JOB_HAS_FAILED = "JOB_HAS_FAILED"
    JOB_CANCELLED = "JOB_CANCELLED"
    IDEMPOTENCY_KEY_REUSED = "IDEMPOTENCY_KEY_REUSED"
    UNAUTHENTICATED = "UNAUTHENTICATED"
    TOKEN_EXPIRED = "TOKEN_EXPIRED"
    PERMISSION_DENIED = "PERMISSION_DENIED"


@dataclass(frozen=True, slots=True)
class Result:
    """The responses that the task's method sends, without progress, each serialized; the same for the same key."""

    messages: tuple[bytes, ...]


@dataclass(frozen=True, slots=True)
class Failure:
    """A task that ended without a result.

    Attributes:
        reason: Reason of the failure.
        message: One sentence for the caller, without parts of the model.
        details: Text only for the log of the server, such as a traceback.
    """

    reason: Reason
    message: str
    details: str = ""


class RefusedError(Exception):
    """A call that ends without an answer.

    Attributes:
        reason: Reason why there is no answer.
        message: One sentence for the caller.
        retry_after_s: Seconds after which it may be worth another try; None: it is not.
    """

    def __init__(self, reason: Reason, message: str, retry_after_s: float | None = None) -> None:
        super().__init__(message)
        self.reason = reason
        self.message = message
        self.retry_after_s = retry_after_s


type Outcome = Result | Failure

__all__ = [
    "Failure",
    "Outcome",
    "Reason",
    "RefusedError",
    "Report",
    "Result",
    "Task",
    "TaskKind",
    "TaskLimits",
    "own_key",
    "shared_key",
]
