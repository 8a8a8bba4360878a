"""What each method of the client calls, and how its answer is put together: the same for both clients.

No input or output is done here. A client makes the call of an operation, as often as `robosc_client.retry` says, and
gives every message that it receives to the assembly.
"""

import secrets
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from robosc.errors import Diagnostic
from robosc.targets import TargetInfo
from robosc_api.v1 import jobs_pb2
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client.convert import answers, jobs
from robosc_client.convert.assembly import (
    Assembly,
    ExplorationAssembly,
    GenerationAssembly,
    JobResultAssembly,
    SynthesisAssembly,
    VerificationAssembly,
    Whole,
    check_assembly,
    format_assembly,
)
from robosc_client.convert.requests import list_request, request_of, submit_request
from robosc_client.errors import malformed
from robosc_client.jobs import Job, JobState, Submission, TaskKind
from robosc_client.results import (
    Exploration,
    Formatted,
    Generation,
    ServerInfo,
    Synthesis,
    TaskResult,
    Verification,
)
from robosc_client.tasks import Check, Explore, Format, Generate, Synthesize, Task, Verify

MAXIMUM_PAGE = 1000
"""Jobs that one answer lists."""

_EMPTY_PAGES = 100


@dataclass(frozen=True, slots=True)
class Operation[Result]:
    """One call.

    Attributes:
        method: Name of the method.
        request: The request message.
        assembly: Makes what puts an answer together; each attempt needs another.
        is_stream: Whether the answer is a stream of messages.
        is_about_jobs: Whether the method is of the service for jobs.
    """

    method: str
    request: Any
    assembly: Callable[[], Assembly[Result]]
    is_stream: bool = False
    is_about_jobs: bool = False


def check(task: Check) -> Operation[tuple[Diagnostic, ...]]:
    """Every finding about a model or library."""
    return Operation("Check", request_of(task), check_assembly)


def synthesize(task: Synthesize) -> Operation[Synthesis]:
    """A supervisor."""
    return Operation("Synthesize", request_of(task), SynthesisAssembly, is_stream=True)


def generate(task: Generate) -> Operation[Generation]:
    """Generated files."""
    return Operation("Generate", request_of(task), GenerationAssembly, is_stream=True)


def explore(task: Explore) -> Operation[Exploration]:
    """The graph of a robot under its supervisor."""
    return Operation("Explore", request_of(task), ExplorationAssembly, is_stream=True)


def verify(task: Verify) -> Operation[Verification]:
    """Whether a supervisor is right, or properties hold."""
    return Operation("Verify", request_of(task), VerificationAssembly, is_stream=True)


def format_(task: Format) -> Operation[Formatted]:
    """A text in its canonical layout."""
    return Operation("Format", request_of(task), lambda: format_assembly(task.file.text))


def list_targets() -> Operation[tuple[TargetInfo, ...]]:
    """What can be generated."""
    return Operation("ListTargets", pb.ListTargetsRequest(), lambda: Whole(answers.targets_of))


def get_version() -> Operation[ServerInfo]:
    """What the server is."""
    return Operation("GetVersion", pb.GetVersionRequest(), lambda: Whole(answers.server_info_of))


def submit(task: Task, idempotency_key: str | None, label: str, retention_s: float | None) -> Operation[Submission]:
    """A job; without a key of the caller's, one is made, so that the call may be made again."""
    key = secrets.token_hex(16) if idempotency_key is None else idempotency_key
    request = submit_request(task, key, label, retention_s)
    return _about_jobs("SubmitJob", request, jobs.submission_of)


def get_job(job_id: str) -> Operation[Job]:
    """Where a job is."""
    return _about_jobs("GetJob", jobs_pb2.GetJobRequest(id=job_id), _same(job_id))


def cancel_job(job_id: str) -> Operation[Job]:
    """The end of a job."""
    return _about_jobs("CancelJob", jobs_pb2.CancelJobRequest(id=job_id), _same(job_id))


def job_result(job_id: str, kind: TaskKind | None) -> Operation[TaskResult]:
    """What a job has found; of this kind, if it is known."""
    request = jobs_pb2.GetJobResultRequest(id=job_id)
    return Operation("GetJobResult", request, lambda: JobResultAssembly(kind), is_stream=True, is_about_jobs=True)


def _about_jobs[Message, Result](method: str, request: Any, convert: Callable[[Message], Result]) -> Operation[Result]:
    return Operation(method, request, lambda: Whole(convert), is_about_jobs=True)


def _same(job_id: str) -> Callable[[Any], Job]:
    def convert(message: Any) -> Job:
        job = jobs.job_in(message)
        if job.id != job_id:
            raise malformed("it tells of another job")
        return job

    return convert


class Listing:
    """Pages of jobs, as they are asked for."""

    def __init__(
        self, states: tuple[JobState, ...], kind: TaskKind | None, *, all_owners: bool, page_size: int
    ) -> None:
        """Begin with the first page.

        Raises:
            ValueError: The size of a page is none.
        """
        if not 0 < page_size <= MAXIMUM_PAGE:
            raise ValueError(f"a page has from 1 to {MAXIMUM_PAGE} jobs")
        self._chosen = (states, kind)
        self._all_owners = all_owners
        self._page_size = page_size
        self._token = ""
        self._empty = 0
        self.is_over = False

    def operation(self) -> Operation[tuple[tuple[Job, ...], str]]:
        """Asks for the next page."""
        states, kind = self._chosen
        request = list_request(
            states, kind, all_owners=self._all_owners, page_size=self._page_size, page_token=self._token
        )

        def convert(message: jobs_pb2.ListJobsResponse) -> tuple[tuple[Job, ...], str]:
            return jobs.page_of(message, self._page_size)

        return _about_jobs("ListJobs", request, convert)

    def take(self, page: tuple[tuple[Job, ...], str]) -> tuple[Job, ...]:
        """The jobs of a page.

        Raises:
            ServiceError: Pages do not get on.
        """
        found, token = page
        self._empty = 0 if found else self._empty + 1
        if (token and token == self._token) or self._empty > _EMPTY_PAGES:
            raise malformed("a list of jobs has no end")
        self._token = token
        self.is_over = not token
        return found


class Watching:
    """One job's changes, over as many connections as it takes."""

    def __init__(self, job_id: str, after_revision: int = 0) -> None:
        self._job_id = job_id
        self._revision = after_revision
        self.is_over = False

    def request(self) -> jobs_pb2.WatchJobRequest:
        """Asks for what comes after all that was seen."""
        return jobs_pb2.WatchJobRequest(id=self._job_id, after_revision=self._revision)

    def take(self, message: jobs_pb2.WatchJobResponse) -> Job:
        """The job as it is now.

        Raises:
            ServiceError: It is another job, or nothing has changed.
        """
        job = _same(self._job_id)(message)
        # A job that has ended is told of even if nothing has changed.
        if job.revision < self._revision or (job.revision == self._revision and not job.state.has_ended):
            raise malformed("a job's changes are not in their order")
        self._revision = job.revision
        self.is_over = job.state.has_ended
        return job
