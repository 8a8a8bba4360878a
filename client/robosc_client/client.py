"""Client for synchronous programs."""

import time
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import closing
from types import TracebackType
from typing import TYPE_CHECKING, Any, Concatenate, Self

import grpc

import robosc
from robosc_api.security import Credentials, close_channel, open_channel
from robosc_client import operations
from robosc_client.calls import WATCH_INTERRUPTED, JobPages, JobWatch, Operation, RetriedCall, channel_of
from robosc_client.convert.failures import failure_of
from robosc_client.convert.requests import JobStub, SynthesisStub
from robosc_client.jobs import Job
from robosc_client.operations import LocalFunction, client_method
from robosc_client.retry import DEFAULT_RETRIES, RetryPolicy


def _unary_method[**P, Result](describe: Callable[P, Operation[Result]]) -> "Callable[Concatenate[Client, P], Result]":
    def method(self: "Client", /, *arguments: P.args, **options: P.kwargs) -> Result:
        return self._answer(describe(*arguments, **options))

    return client_method(method, describe, "Client")


def _watch_method[**P](describe: Callable[P, JobWatch]) -> "Callable[Concatenate[Client, P], Iterator[Job]]":
    def method(self: "Client", /, *arguments: P.args, **options: P.kwargs) -> Iterator[Job]:
        return self._follow(describe(*arguments, **options))

    return client_method(method, describe, "Client", Iterator[Job])


def _wait_method[**P](describe: Callable[P, JobWatch]) -> "Callable[Concatenate[Client, P], Job]":
    def method(self: "Client", /, *arguments: P.args, **options: P.kwargs) -> Job:
        return next(job for job in self._follow(describe(*arguments, **options)) if job.state.has_ended)

    return client_method(method, describe, "Client", Job)


def _list_method[**P](describe: Callable[P, JobPages]) -> "Callable[Concatenate[Client, P], Iterator[Job]]":
    def method(self: "Client", /, *arguments: P.args, **options: P.kwargs) -> Iterator[Job]:
        return self._list(describe(*arguments, **options))

    return client_method(method, describe, "Client", Iterator[Job])


class Client:
    """A connection to one server; use it with `with`, or close it. Threads may share it.

    Every method raises a subclass of `ClientError` if it fails, and takes `deadline_s`, the total time limit in
    seconds; None leaves the time to the server's own limit. The retry policy defines when a call is repeated because no
    server answered or the server was overloaded. `on_progress` receives the progress; an exception of it cancels the
    work.
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
        """Prepare a connection to a server; it is made with the first request.

        Args:
            address: `HOST:PORT`, or `HOST` for the port 50051; or any other name of gRPC, such as `unix:/run/robosc`.
            credentials: Certificates and token; None: neither.
            retries: Policy for repeating calls.
            sleep: Function that waits for so many seconds.
            channel_options: More options of gRPC's channels, such as `grpc.use_local_subchannel_pool`.

        Raises:
            CredentialsError: A file with them cannot be used, or a token would be sent in the clear.
        """
        self._address, self._channel = channel_of(open_channel, address, credentials, channel_options)
        self._retries = retries
        self._is_closed = False
        self._sleep = sleep
        self._tasks = SynthesisStub(self._channel)  # type: ignore[no-untyped-call]  # generated
        self._jobs = JobStub(self._channel)  # type: ignore[no-untyped-call]  # generated

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._is_closed = True
        close_channel(self._channel, error)

    def close(self) -> None:
        """Close the connection; open calls are cancelled."""
        self._is_closed = True
        close_channel(self._channel)

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

    def _answer[Result](self, operation: Operation[Result]) -> Result:
        """Make a call, with retries."""
        call = RetriedCall(operation, self._retries, self._address)
        while True:
            try:
                # Closed at once in any case, so that the work of an abandoned call is cancelled.
                with closing(self._messages(operation, call.begin())) as messages:
                    for message in messages:
                        call.take(message)
                return call.result()
            except grpc.RpcError as error:
                delay_s = call.failed(error, is_closed=self._is_closed)
            self._sleep(delay_s)

    def _follow(self, job_watch: JobWatch) -> Iterator[Job]:
        """Yield a job after each change until it has ended."""
        attempts = job_watch.attempts(self._retries, self._address)
        while not job_watch.is_over:
            failure = WATCH_INTERRUPTED
            try:
                with closing(self._messages(job_watch.operation(), attempts.timeout_s())) as messages:
                    for message in messages:
                        attempts.succeeded()
                        yield job_watch.take(message)
                        if job_watch.is_over:
                            return
            except grpc.RpcError as error:
                failure = failure_of(error)
            self._sleep(attempts.delay_after(failure, has_answered=False, is_closed=self._is_closed))

    def _list(self, pages: JobPages) -> Iterator[Job]:
        """Yield jobs, page by page."""
        while not pages.is_over:
            yield from pages.take(self._answer(pages.operation()))

    def _messages(self, operation: Operation[Any], timeout_s: float | None) -> Generator[Any]:
        """Yield the messages of one attempt; closing the generator cancels the call."""
        method = getattr(self._jobs if operation.is_about_jobs else self._tasks, operation.method)
        if not operation.is_stream:
            yield method(operation.request, timeout=timeout_s)
            return
        call = method(operation.request, timeout=timeout_s)
        try:
            yield from call
        finally:
            call.cancel()
