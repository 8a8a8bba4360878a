"""The service as a typed Python object."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Self

import grpc

from robosc.errors import Diagnostic
from robosc.model.structure import Deployment
from robosc.source import Bundle
from robosc.targets import GenerateOptions
from robosc_api.security import Credentials, SecurityError, open_channel
from robosc_client import convert
from robosc_client.errors import (
    ClientError,
    CredentialsError,
    DeadlineError,
    RequestRefusedError,
    ServerUnavailableError,
    ServiceError,
)
from robosc_client.results import Generation, Progress, Synthesis

_MAXIMUM_RESPONSE_BYTES = 64 * 2**20

_OPTIONS = (
    ("grpc.max_receive_message_length", _MAXIMUM_RESPONSE_BYTES),
    # A proxy for web pages, set in the environment, is none for a service in the next room.
    ("grpc.enable_http_proxy", 0),
)

# gRPC measures a deadline with a clock of its own.
_CLOCK_TOLERANCE_S = 0.05

_REFUSALS = frozenset(
    {
        grpc.StatusCode.INVALID_ARGUMENT,
        grpc.StatusCode.PERMISSION_DENIED,
        grpc.StatusCode.RESOURCE_EXHAUSTED,
        grpc.StatusCode.UNAUTHENTICATED,
    }
)


class Client:
    """A connection to one server; use it with `with`, or close it. Threads may share it.

    Every method raises a kin of `ClientError` where there is no answer, and takes `deadline_s`, the seconds
    that the caller is willing to wait; None leaves it to the server's own limit.
    """

    def __init__(self, address: str, credentials: Credentials | None = None) -> None:
        """Prepare a connection to `HOST:PORT`; it is made with the first request.

        Args:
            address: `HOST:PORT`.
            credentials: Certificates and token; None: neither.

        Raises:
            CredentialsError: A file with them cannot be used, or a token would be sent in the clear.
        """
        self._address = address
        try:
            self._channel = open_channel(address, credentials or Credentials(), _OPTIONS)
        except SecurityError as error:
            raise CredentialsError(str(error)) from error
        self._stub = convert.Stub(self._channel)  # type: ignore[no-untyped-call]  # generated

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the connection; requests under way are cancelled."""
        self._channel.close()

    def check(self, bundle: Bundle, *, deadline_s: float | None = None) -> tuple[Diagnostic, ...]:
        """Every finding about a model or library, sorted by place."""
        request = convert.check_request(bundle)
        with self._translated(deadline_s):
            return convert.check_diagnostics(self._stub.Check(request, timeout=deadline_s))

    def synthesize(
        self,
        bundle: Bundle,
        *,
        deployment: Deployment = Deployment.CONTROLLER,
        engine: str = "auto",
        allow_livelock: bool = False,
        deadline_s: float | None = None,
        on_progress: Callable[[Progress], None] = lambda progress: None,
    ) -> Synthesis:
        """Synthesize and certify a supervisor.

        Args:
            bundle: The model and its libraries.
            deployment: Where the supervisor will stand.
            engine: Name of the server's engine for decision diagrams, or `auto`.
            allow_livelock: Whether a supervisor is made even if silent steps of its controller never end.
            deadline_s: See the class.
            on_progress: Told where the work is; what it raises ends the work.
        """
        request = convert.synthesize_request(bundle, deployment, engine, allow_livelock=allow_livelock)
        with self._translated(deadline_s):
            call = self._stub.Synthesize(request, timeout=deadline_s)
            try:
                for response in call:
                    message = convert.progress_or_synthesis(response)
                    if isinstance(message, Synthesis):
                        return message
                    on_progress(message)
            finally:
                call.cancel()
        raise ServiceError("the server ended the synthesis without a result")

    def generate(
        self,
        bundle: Bundle,
        *,
        target: str,
        options: GenerateOptions | None = None,
        deployment: Deployment = Deployment.CONTROLLER,
        engine: str = "auto",
        allow_livelock: bool = False,
        deadline_s: float | None = None,
    ) -> Generation:
        """Synthesize a supervisor and generate the files of a target around it; other arguments as in `synthesize`.

        Args:
            bundle: The model and its libraries.
            target: Name of the target.
            options: What is chosen about the files; the defaults if None.
            deployment: Where the supervisor will stand.
            engine: Engine for decision diagrams.
            allow_livelock: Whether silent steps may never end.
            deadline_s: Give up after so many seconds.
        """
        request = convert.generate_request(
            bundle, deployment, engine, target, options or GenerateOptions(), allow_livelock=allow_livelock
        )
        with self._translated(deadline_s):
            return convert.generation(self._stub.Generate(request, timeout=deadline_s))

    @contextmanager
    def _translated(self, deadline_s: float | None) -> Iterator[None]:
        """Turn gRPC's errors into ours."""
        started = time.monotonic()
        try:
            yield
        except grpc.RpcError as error:
            # Every error of a call is also a grpc.Call; the stubs do not say so.
            is_over = deadline_s is not None and time.monotonic() - started >= deadline_s - _CLOCK_TOLERANCE_S
            raise self._error(error.code(), error.details() or "", deadline_s if is_over else None) from error

    def _error(self, code: grpc.StatusCode, details: str, passed_s: float | None) -> ClientError:
        """Our error for a status; `passed_s` is the caller's deadline if it has passed."""
        if code is grpc.StatusCode.UNAVAILABLE:
            return ServerUnavailableError(f"no server answers at {self._address}")
        if code is grpc.StatusCode.DEADLINE_EXCEEDED:
            if passed_s is not None:
                return DeadlineError(f"no result from {self._address} within {passed_s:g} seconds")
            return DeadlineError(f"no result from {self._address}: {details}")
        if code in _REFUSALS:
            return RequestRefusedError(f"the server at {self._address} refuses: {details}")
        if code is grpc.StatusCode.UNIMPLEMENTED:
            return ServiceError(f"what answers at {self._address} is no RoboSC server of this version")
        return ServiceError(f"the server at {self._address} failed ({code.name.lower()}): {details}")
