"""Client for programs on asyncio, with the same methods as `robosc_client.client`.

The list of methods is written in both: type checkers then know each signature, awaited here and blocking there.
"""

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable, Coroutine, Mapping
from contextlib import aclosing
from types import TracebackType
from typing import TYPE_CHECKING, Any, Concatenate, Self

import grpc
import grpc.aio

import robosc
from robosc_api.security import Credentials, open_async_channel
from robosc_client import operations
from robosc_client.calls import WATCH_INTERRUPTED, JobPages, JobWatch, Operation, RetriedCall, channel_of
from robosc_client.convert.failures import failure_of
from robosc_client.convert.requests import JobStub, SynthesisStub
from robosc_client.errors import malformed
from robosc_client.jobs import Job
from robosc_client.operations import LocalFunction, client_method
from robosc_client.retry import DEFAULT_RETRIES, RetryPolicy


def _unary_method[**P, Result](
    describe: Callable[P, Operation[Result]],
) -> "Callable[Concatenate[AsyncClient, P], Coroutine[Any, Any, Result]]":
    async def method(self: "AsyncClient", /, *arguments: P.args, **options: P.kwargs) -> Result:
        return await self._answer(describe(*arguments, **options))

    return client_method(method, describe, "AsyncClient")


def _watch_method[**P](describe: Callable[P, JobWatch]) -> "Callable[Concatenate[AsyncClient, P], AsyncGenerator[Job]]":
    def method(self: "AsyncClient", /, *arguments: P.args, **options: P.kwargs) -> AsyncGenerator[Job]:
        return self._follow(describe(*arguments, **options))

    return client_method(method, describe, "AsyncClient", AsyncGenerator[Job])


def _wait_method[**P](
    describe: Callable[P, JobWatch],
) -> "Callable[Concatenate[AsyncClient, P], Coroutine[Any, Any, Job]]":
    async def method(self: "AsyncClient", /, *arguments: P.args, **options: P.kwargs) -> Job:
        async with aclosing(self._follow(describe(*arguments, **options))) as jobs:
            return await anext(job async for job in jobs if job.state.has_ended)

    return client_method(method, describe, "AsyncClient", Job)


def _list_method[**P](describe: Callable[P, JobPages]) -> "Callable[Concatenate[AsyncClient, P], AsyncGenerator[Job]]":
    def method(self: "AsyncClient", /, *arguments: P.args, **options: P.kwargs) -> AsyncGenerator[Job]:
        return self._list(describe(*arguments, **options))

    return client_method(method, describe, "AsyncClient", AsyncGenerator[Job])


class AsyncClient:
    """A connection to one server; use it with `async with`, or close it. Tasks of one event loop may share it.

    Every method raises a subclass of `ClientError` if it fails, and takes `deadline_s`, the total time limit in
    seconds; None leaves the time to the server's own limit. The retry policy defines when a call is repeated because no
    server answered or the server was overloaded. `on_progress` receives the progress; an exception of it cancels the
    work, and so does cancelling the waiting task.
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
        """Prepare a connection to a server, inside of a running event loop; it is made with the first request.

        Args:
            address: `HOST:PORT`, or `HOST` for the port 50051; or any other name of gRPC, such as `unix:/run/robosc`.
            credentials: Certificates and token; None: neither.
            retries: Policy for repeating calls.
            sleep: Function that waits for so many seconds without holding up others.
            channel_options: More options of gRPC's channels, such as `grpc.use_local_subchannel_pool`.

        Raises:
            CredentialsError: A file with them cannot be used, or a token would be sent in the clear.
        """
        self._address, self._channel = channel_of(open_async_channel, address, credentials, channel_options)
        self._retries = retries
        self._is_closed = False
        self._sleep = sleep
        self._tasks = SynthesisStub(self._channel)  # type: ignore[no-untyped-call]  # generated
        self._jobs = JobStub(self._channel)  # type: ignore[no-untyped-call]  # generated

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    async def close(self) -> None:
        """Close the connection; open calls are cancelled."""
        self._is_closed = True
        await self._channel.close()

    # The methods are those of `Client`, line by line: other functions make them, and type checkers read them here.
    check = _unary_method(operations.check)
    synthesize = _unary_method(operations.synthesize)
    generate = _unary_method(operations.generate)
    explore = _unary_method(operations.explore)
    verify = _unary_method(operations.verify)
    explain = _unary_method(operations.explain)
    format = _unary_method(operations.format_)

    # The same nouns as in `robosc`: these need no server, and work here, on what one has made.
    if TYPE_CHECKING:
        simulate = staticmethod(robosc.simulate)
    else:
        simulate = LocalFunction("simulate")

    list_targets = _unary_method(operations.list_targets)
    get_version = _unary_method(operations.get_version)

    submit = _unary_method(operations.submit)
    get_job = _unary_method(operations.get_job)
    watch = _watch_method(operations.watch)
    wait = _wait_method(operations.wait)
    cancel_job = _unary_method(operations.cancel_job)
    list_jobs = _list_method(operations.list_jobs)
    get_load = _unary_method(operations.get_load)
    job_result = _unary_method(operations.job_result)

    async def _answer[Result](self, operation: Operation[Result]) -> Result:
        """Make a call, with retries."""
        call = RetriedCall(operation, self._retries, self._address)
        while True:
            try:
                # Closed at once in any case, so that the work of an abandoned call is cancelled.
                async with aclosing(self._messages(operation, call.begin())) as messages:
                    async for message in messages:
                        call.take(message)
                return call.result()
            except grpc.RpcError as error:
                delay_s = call.failed(error, is_closed=self._is_closed)
            await self._sleep(delay_s)

    async def _follow(self, job_watch: JobWatch) -> AsyncGenerator[Job]:
        """Yield a job after each change until it has ended."""
        attempts = job_watch.attempts(self._retries, self._address)
        while not job_watch.is_over:
            failure = WATCH_INTERRUPTED
            try:
                async with aclosing(self._messages(job_watch.operation(), attempts.timeout_s())) as messages:
                    async for message in messages:
                        attempts.succeeded()
                        yield job_watch.take(message)
                        if job_watch.is_over:
                            return
            except grpc.RpcError as error:
                failure = failure_of(error)
            await self._sleep(attempts.delay_after(failure, has_answered=False, is_closed=self._is_closed))

    async def _list(self, pages: JobPages) -> AsyncGenerator[Job]:
        """Yield jobs, page by page."""
        while not pages.is_over:
            for job in pages.take(await self._answer(pages.operation())):
                yield job

    async def _messages(self, operation: Operation[Any], timeout_s: float | None) -> AsyncGenerator[Any]:
        """Yield the messages of one attempt; closing the generator cancels the call."""
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
    """Return a message of an answer.

    Raises:
        ServiceError: The message cannot be parsed: `grpc.aio` logs that and returns None.
    """
    if message is None:
        raise malformed("a message cannot be parsed")
    return message
