"""The service as a typed Python object, for programs on asyncio: what `robosc_client.client` is, awaited."""

import asyncio
from collections.abc import AsyncGenerator, AsyncIterator, Awaitable, Callable, Mapping
from contextlib import aclosing
from types import TracebackType
from typing import Any, Self

import grpc
import grpc.aio

from robosc.errors import Diagnostic
from robosc.source import Bundle, SourceFile
from robosc.targets import GenerateOptions, TargetInfo
from robosc_api.security import Credentials, SecurityError, open_async_channel
from robosc_client import operations
from robosc_client.client import OnProgress, ignored
from robosc_client.connection import CHANNEL_OPTIONS
from robosc_client.convert.failures import Failure, failure_of
from robosc_client.convert.requests import JobStub, SynthesisStub
from robosc_client.errors import CredentialsError, malformed
from robosc_client.jobs import Job, JobState, Submission, TaskKind
from robosc_client.operations import Operation
from robosc_client.results import (
    Exploration,
    Formatted,
    Generation,
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


class AsyncClient:
    """A connection to one server; use it with `async with`, or close it. Tasks of one event loop may share it.

    Every method raises a kin of `ClientError` where there is no answer, and takes `deadline_s`, the seconds
    that the caller is willing to wait in all; None leaves it to the server's own limit. Calls that found no server, or
    one with too much to do, are made again as the retry policy says. `on_progress` is told where the work is; what it
    raises ends the work, and so does cancelling the task that waits.
    """

    def __init__(
        self,
        address: str,
        credentials: Credentials | None = None,
        *,
        retries: RetryPolicy = DEFAULT_RETRIES,
        sleep: Callable[[float], Awaitable[None]] = asyncio.sleep,
        channel_options: Mapping[str, Any] | None = None,
    ) -> None:
        """Prepare a connection to `HOST:PORT`, inside of a running event loop; it is made with the first request.

        Args:
            address: `HOST:PORT`.
            credentials: Certificates and token; None: neither.
            retries: How often and when calls are made again.
            sleep: Waits for so many seconds without holding up others.
            channel_options: More options of gRPC's channels, such as `grpc.use_local_subchannel_pool`.

        Raises:
            CredentialsError: A file with them cannot be used, or a token would be sent in the clear.
        """
        self._address = address
        self._retries = retries
        self._sleep = sleep
        options = (*CHANNEL_OPTIONS, *(channel_options or {}).items())
        try:
            self._channel = open_async_channel(address, credentials or Credentials(), options)
        except SecurityError as error:
            raise CredentialsError(str(error)) from error
        self._tasks = SynthesisStub(self._channel)  # type: ignore[no-untyped-call]  # generated
        self._jobs = JobStub(self._channel)  # type: ignore[no-untyped-call]  # generated

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    async def close(self) -> None:
        """End the connection; requests under way are cancelled."""
        await self._channel.close()

    # Tasks that are done at once

    async def check(self, bundle: Bundle, *, deadline_s: float | None = None) -> tuple[Diagnostic, ...]:
        """Every finding about a model or library, sorted by place."""
        return await self._run(operations.check(Check(bundle)), deadline_s)

    async def synthesize(
        self,
        bundle: Bundle,
        options: SynthesisOptions = DEFAULT_OPTIONS,
        *,
        deadline_s: float | None = None,
        on_progress: OnProgress = ignored,
    ) -> Synthesis:
        """Synthesize and certify a supervisor."""
        return await self._run(operations.synthesize(Synthesize(bundle, options)), deadline_s, on_progress)

    async def generate(
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
        return await self._run(operations.generate(task), deadline_s, on_progress)

    async def explore(
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
        return await self._run(operations.explore(task), deadline_s, on_progress)

    async def verify(
        self, task: Verify, *, deadline_s: float | None = None, on_progress: OnProgress = ignored
    ) -> Verification:
        """Check a supervisor against its model, or verify properties of the robot under its supervisor."""
        return await self._run(operations.verify(task), deadline_s, on_progress)

    async def format(self, file: SourceFile, *, deadline_s: float | None = None) -> Formatted:
        """Put a text into its canonical layout."""
        return await self._run(operations.format_(Format(file)), deadline_s)

    # About the server

    async def list_targets(self, *, deadline_s: float | None = None) -> tuple[TargetInfo, ...]:
        """What can be generated, sorted by name."""
        return await self._run(operations.list_targets(), deadline_s)

    async def get_version(self, *, deadline_s: float | None = None) -> ServerInfo:
        """What the server is, and its limits."""
        return await self._run(operations.get_version(), deadline_s)

    # Jobs

    async def submit(
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
        return await self._run(operations.submit(task, idempotency_key, label, retention_s), deadline_s)

    async def get_job(self, job_id: str, *, deadline_s: float | None = None) -> Job:
        """Where a job is."""
        return await self._run(operations.get_job(job_id), deadline_s)

    async def watch(
        self, job_id: str, *, after_revision: int = 0, deadline_s: float | None = None
    ) -> AsyncGenerator[Job]:
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
                async for message in call:
                    attempts.succeeded()
                    yield watching.take(_parsed(message))
                    if watching.is_over:
                        return
            except grpc.RpcError as error:
                failure = failure_of(error)
            finally:
                call.cancel()
            await self._sleep(attempts.delay_after(failure, has_answered=False))

    async def wait(self, job_id: str, *, deadline_s: float | None = None) -> Job:
        """A job, once it has ended."""
        async with aclosing(self.watch(job_id, deadline_s=deadline_s)) as jobs:
            return await anext(job async for job in jobs if job.state.has_ended)

    async def cancel_job(self, job_id: str, *, deadline_s: float | None = None) -> Job:
        """End a job; one that has ended stays as it is."""
        return await self._run(operations.cancel_job(job_id), deadline_s)

    async def list_jobs(
        self,
        *,
        states: tuple[JobState, ...] = (),
        kind: TaskKind | None = None,
        all_owners: bool = False,
        page_size: int = 100,
        deadline_s: float | None = None,
    ) -> AsyncIterator[Job]:
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
            for job in listing.take(await self._run(listing.operation(), deadline_s)):
                yield job

    async def job_result(
        self, job_id: str, *, kind: TaskKind | None = None, deadline_s: float | None = None
    ) -> TaskResult:
        """What a job that has succeeded has found: as the method for its task would have returned it.

        Args:
            job_id: Its id.
            kind: What its task is, as `submit` or `get_job` have told: a result of another kind is refused; None: any.
            deadline_s: See the class.
        """
        return await self._run(operations.job_result(job_id, kind), deadline_s)

    async def _run[Result](
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
                async with aclosing(self._messages(operation, timeout_s)) as messages:
                    async for message in messages:
                        has_answered = True
                        progress = assembly.take(message)
                        if progress is not None:
                            on_progress(progress)
                return assembly.result()
            except grpc.RpcError as error:
                delay_s = attempts.delay_after(failure_of(error), has_answered=has_answered)
            await self._sleep(delay_s)

    async def _messages(self, operation: Operation[Any], timeout_s: float | None) -> AsyncGenerator[Any]:
        """The messages of one attempt; the call ends with their reader."""
        method = getattr(self._jobs if operation.is_about_jobs else self._tasks, operation.method)
        if not operation.is_stream:
            yield _parsed(await method(operation.request, timeout=timeout_s))
            return
        call = method(operation.request, timeout=timeout_s)
        try:
            async for message in call:
                yield _parsed(message)
        finally:
            call.cancel()


def _parsed[Message](message: Message | None) -> Message:
    """A message of an answer.

    Raises:
        ServiceError: Its bytes are none: `grpc.aio` logs that, and gives None.
    """
    if message is None:
        raise malformed("a message cannot be parsed")
    return message
