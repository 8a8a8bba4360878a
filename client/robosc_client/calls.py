"""Calls with their retries, and the opening of channels: the part that both clients share.

Nothing is sent or received here. A client makes the call of an operation, passes on every message or the error, and
waits for the delay that it is given.
"""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import grpc

from robosc.certification.progress import OnProgress, ignored
from robosc_api.security import Credentials, SecurityError
from robosc_api.security.addresses import SYNTHESIS_PORT, with_port
from robosc_api.v1 import jobs_pb2
from robosc_client.convert import jobs
from robosc_client.convert.failures import Failure, failure_of
from robosc_client.convert.requests import list_request
from robosc_client.convert.response_readers import MAXIMUM_BYTES, ResponseReader, UnaryReader
from robosc_client.errors import CredentialsError, malformed
from robosc_client.jobs import Job, JobState, TaskKind
from robosc_client.retry import Attempts, RetryPolicy

_KEEPALIVE_MS = 60_000
"""Keepalive time of an idle connection; servers refuse more frequent pings."""

CHANNEL_OPTIONS: tuple[tuple[str, int | str], ...] = (
    # One name may stand for several servers: distribute calls over the available ones.
    ("grpc.service_config", '{"loadBalancingConfig": [{"round_robin": {}}]}'),
    # One message holds a whole supervisor and little else.
    ("grpc.max_receive_message_length", MAXIMUM_BYTES + 2**20),
    # The server checks its limit and reports it.
    ("grpc.max_send_message_length", -1),
    # A web proxy in the environment must not be used for a service on the local network.
    ("grpc.enable_http_proxy", 0),
    # Retries need a new connection soon, not after the long default backoff of gRPC.
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.max_reconnect_backoff_ms", 5_000),
    # A watch may be idle for hours: keepalive detects a lost connection.
    ("grpc.keepalive_time_ms", _KEEPALIVE_MS),
    ("grpc.keepalive_timeout_ms", 10_000),
    ("grpc.http2.max_pings_without_data", 0),
)

MAXIMUM_PAGE = 1000
"""Maximum number of jobs on one page."""

WATCH_INTERRUPTED = Failure(grpc.StatusCode.UNAVAILABLE, "the watch ended before the job")
"""Failure of a watch that ends without an error before its job does."""

_EMPTY_PAGES = 100


def channel_of[Channel](
    open_channel: Callable[[str, Credentials, tuple[tuple[str, Any], ...]], Channel],
    address: str,
    credentials: Credentials | None,
    channel_options: Mapping[str, Any] | None,
) -> tuple[str, Channel]:
    """Return the address and the channel of a client; the arguments are those of the clients.

    Raises:
        CredentialsError: A file with them cannot be used, or a token would be sent in the clear.
    """
    # The names of gRPC that are no such addresses stay what they are.
    with suppress(ValueError):
        address = with_port(address, SYNTHESIS_PORT)
    options = (*CHANNEL_OPTIONS, *(channel_options or {}).items())
    try:
        return address, open_channel(address, credentials or Credentials(), options)
    except SecurityError as error:
        raise CredentialsError(str(error)) from error


@dataclass(frozen=True, slots=True)
class Operation[Result]:
    """Description of one call with its retries.

    Attributes:
        method: Name of the method.
        request: The request message.
        reader: Function that makes the reader of a response; each attempt needs a new one.
        is_stream: True if the answer is a stream of messages.
        is_about_jobs: True if the method is of the service for jobs.
        deadline_s: Time limit for all attempts together, in seconds; None: no limit.
        on_progress: Callback that receives the progress.
    """

    method: str
    request: Any
    reader: Callable[[], ResponseReader[Result]]
    is_stream: bool = False
    is_about_jobs: bool = False
    deadline_s: float | None = None
    on_progress: OnProgress = ignored


class RetriedCall[Result]:
    """One operation, called until it succeeds or its attempts are used up."""

    def __init__(self, operation: Operation[Result], policy: RetryPolicy, address: str) -> None:
        """Prepare the operation.

        Args:
            operation: Operation that is called.
            policy: Policy for retries.
            address: Address of the server that is called, for messages.
        """
        self._operation = operation
        self._attempts = Attempts(policy, address, operation.deadline_s)
        self._has_answered = False
        self._reader = operation.reader()

    def begin(self) -> float | None:
        """Begin an attempt, and return its time limit in seconds; None: none.

        Raises:
            DeadlineError: The deadline has passed.
        """
        self._has_answered = False
        self._reader = self._operation.reader()
        return self._attempts.timeout_s()

    def take(self, message: Any) -> None:
        """Take the next message of the attempt; raises ServiceError if it is invalid."""
        self._has_answered = True
        progress = self._reader.take(message)
        if progress is not None:
            self._operation.on_progress(progress)

    def result(self) -> Result:
        """Return the operation's result, once the attempt's messages have ended.

        Raises ServiceError if it is incomplete.
        """
        return self._reader.result()

    def failed(self, error: grpc.RpcError, *, is_closed: bool) -> float:
        """Return the delay before the next attempt after a failed one, in seconds.

        Args:
            error: Error of the attempt.
            is_closed: True if the client was closed.

        Raises:
            ClientError: There is no next attempt.
        """
        return self._attempts.delay_after(failure_of(error), has_answered=self._has_answered, is_closed=is_closed)


def job_reader(job_id: str) -> Callable[[Any], Job]:
    """Return a function that reads a job from a message; it raises ServiceError for another job."""

    def convert(message: Any) -> Job:
        job = jobs.job_in(message)
        if job.id != job_id:
            raise malformed("it is about another job")
        return job

    return convert


class JobPages:
    """Pages of jobs, each requested on first use."""

    def __init__(
        self,
        states: tuple[JobState, ...],
        kind: TaskKind | None,
        *,
        all_owners: bool,
        page_size: int,
        deadline_s: float | None = None,
    ) -> None:
        """Begin with the first page.

        Raises:
            ValueError: The size of a page is none.
        """
        if not 0 < page_size <= MAXIMUM_PAGE:
            raise ValueError(f"page_size must be from 1 to {MAXIMUM_PAGE}")
        self._chosen = (states, kind)
        self._all_owners = all_owners
        self._page_size = page_size
        self._deadline_s = deadline_s
        self._token = ""
        self._empty = 0
        self.is_over = False

    def operation(self) -> Operation[tuple[tuple[Job, ...], str]]:
        """Return the call for the next page."""
        states, kind = self._chosen
        request = list_request(
            states, kind, all_owners=self._all_owners, page_size=self._page_size, page_token=self._token
        )

        def convert(message: jobs_pb2.ListJobsResponse) -> tuple[tuple[Job, ...], str]:
            return jobs.page_of(message, self._page_size)

        return Operation(
            "ListJobs", request, lambda: UnaryReader(convert), is_about_jobs=True, deadline_s=self._deadline_s
        )

    def take(self, page: tuple[tuple[Job, ...], str]) -> tuple[Job, ...]:
        """Return the jobs of a page.

        Raises:
            ServiceError: The list does not end.
        """
        found, token = page
        self._empty = 0 if found else self._empty + 1
        if (token and token == self._token) or self._empty > _EMPTY_PAGES:
            raise malformed("the list of jobs does not end")
        self._token = token
        self.is_over = not token
        return found


class JobWatch:
    """Watch of one job, across lost connections.

    Attributes:
        is_over: True if the job has ended.
    """

    def __init__(self, job_id: str, after_revision: int = 0, deadline_s: float | None = None) -> None:
        self._job_id = job_id
        self._revision = after_revision
        self._deadline_s = deadline_s
        self.is_over = False

    def attempts(self, policy: RetryPolicy, address: str) -> Attempts:
        """Return the retry state of the watch."""
        return Attempts(policy, address, self._deadline_s, is_watch=True)

    def operation(self) -> Operation[Job]:
        """Return the call for the changes after the last seen revision; its messages go to `take`."""
        request = jobs_pb2.WatchJobRequest(id=self._job_id, after_revision=self._revision)
        return Operation("WatchJob", request, lambda: UnaryReader(self.take), is_stream=True, is_about_jobs=True)

    def take(self, message: jobs_pb2.WatchJobResponse) -> Job:
        """Return the present state of the job.

        Raises:
            ServiceError: The message is about another job, or about no change.
        """
        job = job_reader(self._job_id)(message)
        # The server sends a job that has ended even if nothing has changed.
        if job.revision < self._revision or (job.revision == self._revision and not job.state.has_ended):
            raise malformed("the changes of the job are not in order")
        self._revision = job.revision
        self.is_over = job.state.has_ended
        return job
