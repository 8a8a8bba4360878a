"""Conversion between messages of the job service and values."""

import hashlib
import struct
from base64 import urlsafe_b64decode, urlsafe_b64encode
from typing import Any

from google.protobuf import timestamp_pb2
from google.protobuf.message import DecodeError

from robosc_api.v1 import jobs_pb2 as pb
from robosc_api.v1 import jobs_pb2_grpc, synthesis_pb2
from robosc_server.jobs.manager import ServiceLoad
from robosc_server.operations.failures import code_of
from robosc_server.store import JobFilter, JobRecord, JobState
from robosc_server.tasks.fields import nested_of
from robosc_server.tasks.requests import NOT_A_MESSAGE, RequestLimits, require_parsable, require_short
from robosc_server.tasks.task import Reason, RefusedError, TaskKind

JOB_SERVICE_NAME: str = pb.DESCRIPTOR.services_by_name["JobService"].full_name
JOB_METHODS: tuple[str, ...] = tuple(method.name for method in pb.DESCRIPTOR.services_by_name["JobService"].methods)

JobServiceServicer = jobs_pb2_grpc.JobServiceServicer
add_servicer = jobs_pb2_grpc.add_JobServiceServicer_to_server

MAXIMUM_LABEL = 200
MAXIMUM_IDEMPOTENCY_KEY = 128
MAXIMUM_PAGE = 1000
_DEFAULT_PAGE = 100

_STATES: dict[JobState, Any] = {state: pb.JobState.Value(f"JOB_STATE_{state.name}") for state in JobState}
_KINDS: dict[TaskKind, Any] = {kind: pb.TaskKind.Value(f"TASK_KIND_{kind.name}") for kind in TaskKind}
_STATE_OF = {number: state for state, number in _STATES.items()}
_KIND_OF = {number: kind for kind, number in _KINDS.items()}
_FIELD_OF = {kind: pb.GetJobResultResponse.DESCRIPTOR.fields_by_name[kind.value].number for kind in TaskKind}

# Time of creation, id, and eight bytes of a digest of the filter, which detect a token of another list.
_TOKEN = struct.Struct(">Q16s8s")
_TOKEN_CHARACTERS = 44
_LENGTH_DELIMITED = 2

_SUBMISSION = nested_of(pb.SubmitJobRequest)


def malformed(message: str) -> RefusedError:
    """Return the error for a malformed request."""
    return RefusedError(Reason.MALFORMED_REQUEST, message)


def submission(content: bytes, limits: RequestLimits) -> pb.SubmitJobRequest:
    """Return a parsed submission.

    Raises:
        RefusedError: The bytes are no submission, or exceed a limit.
    """
    require_short(content, limits.submission_bytes)
    require_parsable(content, _SUBMISSION, limits)
    try:
        return pb.SubmitJobRequest.FromString(content)
    except DecodeError:
        # The parser's own message may quote the request.
        raise malformed(NOT_A_MESSAGE) from None


def kind_and_request(task: pb.Task) -> tuple[TaskKind, bytes]:
    """Return the kind of a task, and its serialized request.

    Raises:
        RefusedError: There is no task.
    """
    name = task.WhichOneof("request")
    if name is None:
        raise malformed("the request has no task: set one field of Task")
    return TaskKind(name), getattr(task, name).SerializeToString()


def checked_idempotency_key(text: str) -> str:
    """Return an idempotency key unchanged, if it is valid.

    Raises:
        RefusedError: The key is invalid.
    """
    if len(text) > MAXIMUM_IDEMPOTENCY_KEY or not all(" " <= character <= "~" for character in text):
        raise malformed(f"an idempotency key must have 1 to {MAXIMUM_IDEMPOTENCY_KEY} printable ASCII characters")
    return text


def checked_label(text: str) -> str:
    """Return a label unchanged, if it is valid.

    Raises:
        RefusedError: The label is invalid.
    """
    if len(text) > MAXIMUM_LABEL or not text.isprintable():
        raise malformed(f"a label must have at most {MAXIMUM_LABEL} printable characters")
    return text


def retention_s_of(request: pb.SubmitJobRequest) -> float | None:
    """Return the requested retention time of a job in seconds; None: not given.

    Raises:
        RefusedError: The value is no time.
    """
    if not request.HasField("retention"):
        return None
    retention_s = request.retention.seconds + request.retention.nanos / 1e9
    if retention_s < 0 or not 0 <= request.retention.nanos < 1_000_000_000:
        raise malformed("the retention must be a valid duration of 0 s or more")
    return retention_s


def filter_of(request: pb.ListJobsRequest, caller: str) -> JobFilter:
    """Return the filter of a request for a list of jobs.

    Raises:
        RefusedError: There are no such states or kinds.
    """
    if any(number not in _STATE_OF for number in request.states):
        raise malformed("the filter names an unknown job state")
    if request.kind and request.kind not in _KIND_OF:
        raise malformed("the filter names an unknown task kind")
    states = frozenset(_STATE_OF[number] for number in request.states)
    return JobFilter(None if request.all_owners else caller, states, _KIND_OF.get(request.kind))


def page_size_of(request: pb.ListJobsRequest) -> int:
    """Return the requested number of jobs."""
    return min(request.page_size or _DEFAULT_PAGE, MAXIMUM_PAGE)


def page_token(last: JobRecord, chosen: JobFilter) -> str:
    """Return the token of the page of jobs that follow a given one."""
    return urlsafe_b64encode(_TOKEN.pack(last.created_us, bytes.fromhex(last.id), _digest(chosen))).decode()


def page_position(token: str, chosen: JobFilter) -> tuple[int, str] | None:
    """Return the creation time and id of the last job of the previous page; None: first page.

    Raises:
        RefusedError: The token is invalid, or belongs to another filter.
    """
    if not token:
        return None
    try:
        if len(token) != _TOKEN_CHARACTERS:
            raise ValueError
        created_us, job_id, digest = _TOKEN.unpack(urlsafe_b64decode(token.encode("ascii")))
    except (ValueError, struct.error) as error:
        raise malformed("the page token is invalid: use next_page_token of the previous response") from error
    if digest != _digest(chosen) or created_us >= 2**63:
        raise malformed("the page token belongs to another list: repeat the other fields of the previous request")
    return created_us, job_id.hex()


def _digest(chosen: JobFilter) -> bytes:
    text = repr((chosen.owner, sorted(chosen.states), chosen.kind))
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).digest()[:8]


def job_of(record: JobRecord, waiting_before: int) -> pb.Job:
    """Return a job as a message."""
    job = pb.Job(
        id=record.id,
        owner=record.owner,
        kind=_KINDS[record.kind],
        state=_STATES[record.state],
        revision=record.revision,
        main_file=record.main_file,
        label=record.label,
        create_time=_timestamp(record.created_us),
        start_time=_timestamp(record.started_us),
        end_time=_timestamp(record.ended_us),
        expire_time=_timestamp(record.expires_us),
        attempts=record.attempts,
        from_store=record.is_from_store,
        waiting_before=waiting_before,
    )
    if record.progress is not None:
        job.progress.CopyFrom(synthesis_pb2.Progress(stage=record.progress.stage, message=record.progress.message))
    if record.failure is not None:
        code: int = code_of(record.failure.reason).value[0]
        job.failure.CopyFrom(pb.Failure(code=code, reason=record.failure.reason, message=record.failure.message))
    return job


def load_response(load: ServiceLoad) -> pb.GetLoadResponse:
    """Return the load of the service as a message."""
    answer = pb.GetLoadResponse(
        time=_timestamp(load.now_us),
        workers=load.workers,
        running_tasks=load.running,
        waiting_tasks=load.waiting,
        servers=load.servers,
    )
    for caller in load.callers:
        answer.callers.add(
            caller=caller.jobs.owner,
            waiting_tasks=caller.waiting,
            running_tasks=caller.running,
            queued_jobs=caller.jobs.queued,
            running_jobs=caller.jobs.running,
            ended_jobs=caller.jobs.ended,
            first_queued_time=_timestamp(caller.jobs.first_queued_us),
        )
    return answer


def _timestamp(time_us: int | None) -> timestamp_pb2.Timestamp | None:
    if time_us is None:
        return None
    stamp = timestamp_pb2.Timestamp()
    stamp.FromMicroseconds(time_us)
    return stamp


def result_response(kind: TaskKind, message: bytes) -> bytes:
    """Return a serialized GetJobResultResponse around a serialized message, which is not parsed.

    Its field is written as the encoding of Protocol Buffers has it: a tag of number and wire type, the length, the
    bytes (protobuf.dev: Encoding, "Length-Delimited Records").
    """
    return _varint(_FIELD_OF[kind] << 3 | _LENGTH_DELIMITED) + _varint(len(message)) + message


def _varint(number: int) -> bytes:
    found = bytearray()
    while number > 0x7F:
        found.append(number & 0x7F | 0x80)
        number >>= 7
    found.append(number)
    return bytes(found)


def serialized(message: Any) -> bytes:
    """Return the bytes of a message, or bytes unchanged."""
    return message if isinstance(message, bytes) else message.SerializeToString()
