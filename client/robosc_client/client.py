"""The service as a typed Python object."""

import time
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import closing
from types import TracebackType
from typing import Any, Self

import grpc

from robosc.errors import Diagnostic
from robosc.source import Bundle, SourceFile
from robosc.targets import GenerateOptions, TargetInfo
from robosc_api.security import Credentials, SecurityError, open_channel
from robosc_client import operations
from robosc_client.connection import CHANNEL_OPTIONS
from robosc_client.convert.failures import Failure, failure_of
from robosc_client.convert.requests import JobStub, SynthesisStub
from robosc_client.errors import CredentialsError
from robosc_client.jobs import Job, JobState, Submission, TaskKind
from robosc_client.operations import Operation
from robosc_client.results import (
    Exploration,
    Formatted,
    Generation,
    Progress,
    ServerInfo,
    Synthesis,
    TaskResult,
    Verification,
)
from robosc_client.retry import DEFAULT_RETRIES, Attempts, RetryPolicy
from robosc_client.tasks import (
    DEFAULT_GENERATION,
    DEFAULT_OPTIONS,
    Check,
    Explore,
    Format,
    Generate,
    SynthesisOptions,
    Synthesize,
    Task,
    Verify,
)

type OnProgress = Callable[[Progress], None]


def ignored(progress: Progress) -> None:
    """Nobody wants to know."""


class Client:
    """A connection to one server; use it with `with`, or close it. Threads may share it.

    Every method raises a kin of `ClientError` where there is no answer, and takes `deadline_s`, the seconds
    that the caller is willing to wait in all; None leaves it to the server's own limit. Calls that found no server, or
    one with too much to do, are made again as the retry policy says. `on_progress` is told where the work is; what it
    raises ends the work.
    """

    def __init__(
        self,
        address: str,
        credentials: Credentials | None = None,
        *,
        retries: RetryPolicy = DEFAULT_RETRIES,
        sleep: Callable[[float], None] = time.sleep,
        channel_options: Mapping[str, Any] | None = None,
    ) -> None:
        """Prepare a connection to `HOST:PORT`; it is made with the first request.

        Args:
            address: `HOST:PORT`.
            credentials: Certificates and token; None: neither.
            retries: How often and when calls are made again.
            sleep: Waits for so many seconds.
            channel_options: More options of gRPC's channels, such as `grpc.use_local_subchannel_pool`.

        Raises:
            CredentialsError: A file with them cannot be used, or a token would be sent in the clear.
        """
        self._address = address
        self._retries = retries
        self._sleep = sleep
        options = (*CHANNEL_OPTIONS, *(channel_options or {}).items())
        try:
            self._channel = open_channel(address, credentials or Credentials(), options)
        except SecurityError as error:
            raise CredentialsError(str(error)) from error
        self._tasks = SynthesisStub(self._channel)  # type: ignore[no-untyped-call]  # generated
        self._jobs = JobStub(self._channel)  # type: ignore[no-untyped-call]  # generated

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the connection; requests under way are cancelled."""
        self._channel.close()

    # Tasks that are done at once

    def check(self, bundle: Bundle, *, deadline_s: float | None = None) -> tuple[Diagnostic, ...]:
        """Every finding about a model or library, sorted by place."""
        return self._run(operations.check(Check(bundle)), deadline_s)

    def synthesize(
        self,
        bundle: Bundle,
        options: SynthesisOptions = DEFAULT_OPTIONS,
        *,
        deadline_s: float | None = None,
        on_progress: OnProgress = ignored,
    ) -> Synthesis:
        """Synthesize and certify a supervisor."""
        return self._run(operations.synthesize(Synthesize(bundle, options)), deadline_s, on_progress)

    def generate(
        self,
        bundle: Bundle,
        target: str,
        generation: GenerateOptions = DEFAULT_GENERATION,
        options: SynthesisOptions = DEFAULT_OPTIONS,
        *,
        deadline_s: float | None = None,
        on_progress: OnProgress = ignored,
    ) -> Generation:
        """Synthesize a supervisor and generate the files of a target around it.

        Args:
            bundle: The model and its libraries.
            target: Name of the target, or `all`.
            generation: What is chosen about the files.
            options: How the supervisor is made.
            deadline_s: See the class.
            on_progress: See the class.
        """
        task = Generate(bundle, target, generation, options)
        return self._run(operations.generate(task), deadline_s, on_progress)

    def explore(
        self,
        bundle: Bundle,
        options: SynthesisOptions = DEFAULT_OPTIONS,
        *,
        maximum_states: int | None = None,
        deadline_s: float | None = None,
        on_progress: OnProgress = ignored,
    ) -> Exploration:
        """Everything that the robot may do under its supervisor; beyond so many states it is given up."""
        task = Explore(bundle, options, maximum_states)
        return self._run(operations.explore(task), deadline_s, on_progress)

    def verify(
        self, task: Verify, *, deadline_s: float | None = None, on_progress: OnProgress = ignored
    ) -> Verification:
        """Check a supervisor against its model, or verify properties of the robot under its supervisor."""
        return self._run(operations.verify(task), deadline_s, on_progress)

    def format(self, file: SourceFile, *, deadline_s: float | None = None) -> Formatted:
        """Put a text into its canonical layout."""
        return self._run(operations.format_(Format(file)), deadline_s)

    # About the server

    def list_targets(self, *, deadline_s: float | None = None) -> tuple[TargetInfo, ...]:
        """What can be generated, sorted by name."""
        return self._run(operations.list_targets(), deadline_s)

    def get_version(self, *, deadline_s: float | None = None) -> ServerInfo:
        """What the server is, and its limits."""
        return self._run(operations.get_version(), deadline_s)

    # Jobs

    def submit(
        self,
        task: Task,
        *,
        label: str = "",
        idempotency_key: str | None = None,
        retention_s: float | None = None,
        deadline_s: float | None = None,
    ) -> Submission:
        """Have a task done without waiting for it; once this returns, the server keeps the job.

        Args:
            task: What is to be done.
            label: What it is called in lists.
            idempotency_key: The same key again gives the same job; None: a new key.
            retention_s: How long the job is kept after its end; None: as long as the server keeps jobs.
            deadline_s: See the class; it is about the submission, not about the task.
        """
        return self._run(operations.submit(task, idempotency_key, label, retention_s), deadline_s)

    def get_job(self, job_id: str, *, deadline_s: float | None = None) -> Job:
        """Where a job is."""
        return self._run(operations.get_job(job_id), deadline_s)

    def watch(self, job_id: str, *, after_revision: int = 0, deadline_s: float | None = None) -> Iterator[Job]:
        """A job as it is now, and whenever it has changed until it has ended; over lost connections, too.

        Args:
            job_id: Its id.
            after_revision: Nothing is given before there is a greater one, or the job has ended.
            deadline_s: See the class.
        """
        watching = operations.Watching(job_id, after_revision)
        attempts = Attempts(self._retries, self._address, deadline_s, is_watch=True)
        while not watching.is_over:
            failure = Failure(grpc.StatusCode.UNAVAILABLE, "it ended before the job")
            call = self._jobs.WatchJob(watching.request(), timeout=attempts.timeout_s())
            try:
                for message in call:
                    attempts.succeeded()
                    yield watching.take(message)
                    if watching.is_over:
                        return
            except grpc.RpcError as error:
                failure = failure_of(error)
            finally:
                call.cancel()
            self._sleep(attempts.delay_after(failure, has_answered=False))

    def wait(self, job_id: str, *, deadline_s: float | None = None) -> Job:
        """A job, once it has ended."""
        return next(job for job in self.watch(job_id, deadline_s=deadline_s) if job.state.has_ended)

    def cancel_job(self, job_id: str, *, deadline_s: float | None = None) -> Job:
        """End a job; one that has ended stays as it is."""
        return self._run(operations.cancel_job(job_id), deadline_s)

    def list_jobs(
        self,
        *,
        states: tuple[JobState, ...] = (),
        kind: TaskKind | None = None,
        all_owners: bool = False,
        page_size: int = 100,
        deadline_s: float | None = None,
    ) -> Iterator[Job]:
        """Jobs, the youngest first, asked for page by page.

        Args:
            states: Only jobs in these; empty: in any.
            kind: Only jobs of this kind; None: of any.
            all_owners: Whether those of other callers are wanted, too; for a token with the scope `admin`.
            page_size: Jobs that are asked for at once.
            deadline_s: See the class; for each page.
        """
        listing = operations.Listing(states, kind, all_owners=all_owners, page_size=page_size)
        while not listing.is_over:
            yield from listing.take(self._run(listing.operation(), deadline_s))

    def job_result(self, job_id: str, *, kind: TaskKind | None = None, deadline_s: float | None = None) -> TaskResult:
        """What a job that has succeeded has found: as the method for its task would have returned it.

        Args:
            job_id: Its id.
            kind: What its task is, as `submit` or `get_job` have told: a result of another kind is refused; None: any.
            deadline_s: See the class.
        """
        return self._run(operations.job_result(job_id, kind), deadline_s)

    def _run[Result](
        self, operation: Operation[Result], deadline_s: float | None, on_progress: OnProgress = ignored
    ) -> Result:
        """Make a call, as often as it is worth it."""
        attempts = Attempts(self._retries, self._address, deadline_s)
        while True:
            timeout_s = attempts.timeout_s()
            has_answered = False
            assembly = operation.assembly()
            try:
                # Closed at once whatever happens, so that a caller who gives up ends the work, too.
                with closing(self._messages(operation, timeout_s)) as messages:
                    for message in messages:
                        has_answered = True
                        progress = assembly.take(message)
                        if progress is not None:
                            on_progress(progress)
                return assembly.result()
            except grpc.RpcError as error:
                delay_s = attempts.delay_after(failure_of(error), has_answered=has_answered)
            self._sleep(delay_s)

    def _messages(self, operation: Operation[Any], timeout_s: float | None) -> Generator[Any]:
        """The messages of one attempt; the call ends with their reader."""
        method = getattr(self._jobs if operation.is_about_jobs else self._tasks, operation.method)
        if not operation.is_stream:
            yield method(operation.request, timeout=timeout_s)
            return
        call = method(operation.request, timeout=timeout_s)
        try:
            yield from call
        finally:
            call.cancel()
