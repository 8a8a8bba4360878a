"""Frames between a worker and the server: a tag byte, a length of 8 bytes and a payload.

Decoding builds only bytes, numbers and texts: a process that has handled an untrusted model may send anything, and must
not be able to run code in the server. A payload is read only if its length is allowed.

    server to worker   T  JSON: the kind and the limits        Q  the request's message
    worker to server   P  JSON: a report                       M  one message of the result
                       R  empty: the result is whole           F  JSON: a failure
"""

import json
import struct
from collections.abc import Callable
from enum import Enum
from typing import Any

from robosc_server.clock import monotonic
from robosc_server.tasks.exceeded import result_too_large
from robosc_server.tasks.task import Failure, Outcome, Reason, Report, Result, Task, TaskKind, TaskLimits

HEADER = struct.Struct(">cQ")
"""Tag and length of a payload."""

MESSAGES_LIMIT = 100_000
"""Maximum number of messages of one result; many small ones would take far more memory than their bytes."""

REPORTS_BURST = 1000
REPORTS_PER_SECOND = 50
"""Progress reports of one task: a burst, and then so many in a second.

Tasks send ten in a second (see `tasks.run.ThrottledReports`) and one for each of their stages.
"""

_REPORT_BYTES = 2**17
_FAILURE_BYTES = 2**20
_TEXT_LIMIT = 4_000
_DETAILS_LIMIT = 60_000

_WORKER_REASONS = frozenset(
    {
        Reason.MALFORMED_REQUEST,
        Reason.REQUEST_TOO_LARGE,
        Reason.CPU_LIMIT,
        Reason.MEMORY_LIMIT,
        Reason.NODE_LIMIT,
        Reason.RESULT_TOO_LARGE,
        Reason.TIME_LIMIT,
        Reason.WORKER_DIED,
        Reason.INTERNAL_FAULT,
    }
)


class Tag(Enum):
    """Content of a frame."""

    TASK = b"T"
    REQUEST = b"Q"
    REPORT = b"P"
    MESSAGE = b"M"
    RESULT = b"R"
    FAILURE = b"F"


class FrameError(Exception):
    """The received data is not a valid answer of a worker."""


def frame(tag: Tag, payload: bytes) -> bytes:
    """Return a frame."""
    return HEADER.pack(tag.value, len(payload)) + payload


def task_frames(task: Task, limits: TaskLimits) -> bytes:
    """Return the frames that give a worker its task."""
    head = {
        "kind": str(task.kind),
        "key": task.key,
        "main_file": task.main_file,
        "limits": {
            "seconds": limits.seconds,
            "cpu_seconds": limits.cpu_seconds,
            "memory_bytes": limits.memory_bytes,
            "nodes": limits.nodes,
            "result_bytes": limits.result_bytes,
        },
    }
    return frame(Tag.TASK, json.dumps(head).encode()) + frame(Tag.REQUEST, task.request)


def task_of(head: bytes, request: bytes) -> tuple[Task, TaskLimits]:
    """Return the task and the limits that the server's frames hold."""
    values = json.loads(head)
    task = Task(TaskKind(values["kind"]), request, values["key"], values["main_file"])
    return task, TaskLimits(**values["limits"])


def report_frame(report: Report) -> bytes:
    """Return the frame of a report, cut to the length that the server reads."""
    return _json_frame(Tag.REPORT, {"stage": report.stage[:_TEXT_LIMIT], "message": report.message[:_TEXT_LIMIT]})


def failure_frame(failure: Failure) -> bytes:
    """Return the frame of a failure, cut to the length that the server reads; details keep the end of a traceback."""
    values = {
        "reason": str(failure.reason),
        "message": failure.message[:_TEXT_LIMIT],
        "details": failure.details[-_DETAILS_LIMIT:],
    }
    return _json_frame(Tag.FAILURE, values)


class AnswerReader:
    """Reader of the frames of one answer, in two steps: it checks a header, then it decodes the payload.

    Args:
        limits: Limits of the task.
        clock: Seconds that never go back.
    """

    def __init__(self, limits: TaskLimits, clock: Callable[[], float] = monotonic) -> None:
        self._limits = limits
        self._clock = clock
        self._begun_s = clock()
        self._reports = 0
        self._messages: list[bytes] = []
        self._bytes = 0

    def read_header(self, header: bytes) -> tuple[Tag, int] | Failure:
        """Return the tag and length of the next payload, or a failure if the answer must not be read further.

        Raises:
            FrameError: The bytes are no frame of a worker.
        """
        mark, length = HEADER.unpack(header)
        try:
            tag = Tag(mark)
        except ValueError:
            raise FrameError(f"a frame with the tag {mark!r}") from None
        match tag:
            case Tag.MESSAGE:
                self._bytes += length
                if self._bytes > self._limits.result_bytes or len(self._messages) >= MESSAGES_LIMIT:
                    return result_too_large(self._limits)
            case Tag.REPORT:
                self._reports += 1
                if self._reports > REPORTS_BURST + REPORTS_PER_SECOND * (self._clock() - self._begun_s):
                    raise FrameError(f"{self._reports} reports, which is more than a task may send")
                if length > _REPORT_BYTES:
                    raise FrameError(f"a report of {length} bytes")
            case Tag.FAILURE:
                if length > _FAILURE_BYTES:
                    raise FrameError(f"a failure of {length} bytes")
            case Tag.RESULT:
                if length:
                    raise FrameError(f"an end of the result with {length} bytes")
            case Tag.TASK | Tag.REQUEST:
                raise FrameError(f"a frame with the tag {mark!r}")
        return tag, length

    def read(self, tag: Tag, payload: bytes) -> Report | Outcome | None:
        """Return the content of a frame; None: more messages of the result follow.

        Raises:
            FrameError: The content is invalid for a worker.
        """
        match tag:
            case Tag.MESSAGE:
                self._messages.append(payload)
                return None
            case Tag.RESULT:
                if not self._messages:
                    raise FrameError("a result without a message")
                return Result(tuple(self._messages))
            case Tag.REPORT:
                values = _values(payload)
                return Report(_text(values, "stage", _TEXT_LIMIT), _text(values, "message", _TEXT_LIMIT))
            case _:
                return _failure(_values(payload))


def _failure(values: dict[str, Any]) -> Failure:
    try:
        reason = Reason(_text(values, "reason", _TEXT_LIMIT))
    except ValueError:
        raise FrameError("a failure of no known reason") from None
    if reason not in _WORKER_REASONS:
        raise FrameError(f"a failure whose reason {reason} workers may not report")
    return Failure(reason, _text(values, "message", _TEXT_LIMIT), _text(values, "details", _DETAILS_LIMIT))


def _json_frame(tag: Tag, values: dict[str, str]) -> bytes:
    return frame(tag, json.dumps(values).encode())


def _values(payload: bytes) -> dict[str, Any]:
    try:
        values = json.loads(payload.decode("ascii"))
    except (ValueError, RecursionError) as error:
        raise FrameError("a payload that is no JSON") from error
    if not isinstance(values, dict):
        raise FrameError("a payload that is not an object")
    return values


def _text(values: dict[str, Any], name: str, limit: int) -> str:
    value = values.get(name)
    if not isinstance(value, str):
        raise FrameError(f"a payload without the text {name}")
    # Lone surrogates cannot be sent in messages.
    return value[:limit].encode("utf-8", "replace").decode("utf-8")
