"""Conversion of messages about jobs to checked values."""

import re
from datetime import UTC, datetime

from google.protobuf.timestamp_pb2 import Timestamp

from robosc.source import visible
from robosc_api.v1 import jobs_pb2 as pb
from robosc_client.convert.response_fields import MAXIMUM_SHOWN, progress_of, require_at_most
from robosc_client.errors import malformed
from robosc_client.jobs import CallerLoad, Job, JobFailure, JobState, ServiceLoad, Submission, TaskKind

_ID = re.compile(r"[A-Za-z0-9-]{1,100}\Z")

_MAXIMUM_CALLERS = 1000

_KINDS = {
    pb.TASK_KIND_CHECK: TaskKind.CHECK,
    pb.TASK_KIND_SYNTHESIZE: TaskKind.SYNTHESIZE,
    pb.TASK_KIND_GENERATE: TaskKind.GENERATE,
    pb.TASK_KIND_EXPLORE: TaskKind.EXPLORE,
    pb.TASK_KIND_VERIFY: TaskKind.VERIFY,
    pb.TASK_KIND_EXPLAIN: TaskKind.EXPLAIN,
    pb.TASK_KIND_FORMAT: TaskKind.FORMAT,
}
_STATES = {
    pb.JOB_STATE_QUEUED: JobState.QUEUED,
    pb.JOB_STATE_RUNNING: JobState.RUNNING,
    pb.JOB_STATE_SUCCEEDED: JobState.SUCCEEDED,
    pb.JOB_STATE_FAILED: JobState.FAILED,
    pb.JOB_STATE_CANCELLED: JobState.CANCELLED,
}


def job_of(message: pb.Job) -> Job:
    """Return a job; its texts are harmless on a terminal.

    Raises:
        ServiceError: The message is no valid job.
    """
    if not _ID.match(message.id):
        raise malformed("the id of a job is invalid")
    if message.kind not in _KINDS or message.state not in _STATES:
        raise malformed(f"unknown kind {message.kind} or state {message.state} of a job")
    state = _STATES[message.state]
    if (state is JobState.FAILED) != message.HasField("failure"):
        raise malformed("the state of a job contradicts its failure")
    return Job(
        id=message.id,
        owner=_printable(message.owner),
        kind=_KINDS[message.kind],
        state=state,
        revision=message.revision,
        main_file=_printable(message.main_file),
        label=_printable(message.label),
        created=_time(message.create_time),
        started=_time(message.start_time) if message.HasField("start_time") else None,
        ended=_time(message.end_time) if message.HasField("end_time") else None,
        expires=_time(message.expire_time) if message.HasField("expire_time") else None,
        attempts=message.attempts,
        progress=progress_of(message.progress) if message.HasField("progress") else None,
        failure=JobFailure(_printable(message.failure.reason), _printable(message.failure.message))
        if message.HasField("failure")
        else None,
        from_store=message.from_store,
        waiting_before=message.waiting_before,
    )


def submission_of(message: pb.SubmitJobResponse) -> Submission:
    """Return the outcome of a submission; raises as `job_of`."""
    return Submission(job_of(message.job), message.existed)


def job_in(message: pb.GetJobResponse | pb.CancelJobResponse | pb.WatchJobResponse) -> Job:
    """Return the job in an answer; raises as `job_of`."""
    return job_of(message.job)


def page_of(message: pb.ListJobsResponse, most: int) -> tuple[tuple[Job, ...], str]:
    """Return jobs, at most a given number, and the token of the next page; raises as `job_of`."""
    require_at_most(most, len(message.jobs), "jobs")
    return tuple(map(job_of, message.jobs)), message.next_page_token


def load_of(message: pb.GetLoadResponse) -> ServiceLoad:
    """Return the load of the service; its texts are harmless on a terminal.

    Raises:
        ServiceError: The message is no valid load.
    """
    if not message.HasField("time") or not message.servers:
        raise malformed("the load of the service has no time or no server")
    require_at_most(_MAXIMUM_CALLERS, len(message.callers), "callers")
    return ServiceLoad(
        time=_time(message.time),
        callers=tuple(map(_caller_load, message.callers)),
        workers=message.workers,
        running_tasks=message.running_tasks,
        waiting_tasks=message.waiting_tasks,
        servers=message.servers,
    )


def _caller_load(message: pb.CallerLoad) -> CallerLoad:
    return CallerLoad(
        caller=_printable(message.caller),
        waiting_tasks=message.waiting_tasks,
        running_tasks=message.running_tasks,
        queued_jobs=message.queued_jobs,
        running_jobs=message.running_jobs,
        ended_jobs=message.ended_jobs,
        first_queued=_time(message.first_queued_time) if message.HasField("first_queued_time") else None,
    )


def _printable(text: str) -> str:
    return visible(text[:MAXIMUM_SHOWN])


def _time(message: Timestamp) -> datetime:
    try:
        return message.ToDatetime(UTC)
    except (ValueError, OverflowError) as error:
        raise malformed("a time is invalid") from error
