"""A server that answers what a test has written, right or wrong, over real gRPC."""

import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import grpc
from google.protobuf import any_pb2
from google.protobuf.message_factory import GetMessageClass
from google.rpc import error_details_pb2, status_pb2

from robosc_api.v1 import jobs_pb2, synthesis_pb2
from support.waiting import PATIENCE_S

_SERVICES = (
    synthesis_pb2.DESCRIPTOR.services_by_name["SynthesisService"],
    jobs_pb2.DESCRIPTOR.services_by_name["JobService"],
)


@dataclass(frozen=True)
class Refusal:
    """Ends a call without an answer, as a server of RoboSC does it.

    Attributes:
        code: The status.
        message: One sentence.
        reason: The word of ErrorInfo; empty: no details are sent.
        retry_after_s: Seconds of RetryInfo; None: there is none.
        domain: Of ErrorInfo.
    """

    code: grpc.StatusCode
    message: str = "no"
    reason: str = ""
    retry_after_s: float | None = None
    domain: str = "robosc"

    def trailing(self) -> tuple[tuple[str, bytes], ...]:
        """The trailing metadata."""
        details: list[Any] = []
        if self.reason:
            details.append(error_details_pb2.ErrorInfo(reason=self.reason, domain=self.domain))
        if self.retry_after_s is not None:
            retry = error_details_pb2.RetryInfo()
            retry.retry_delay.FromNanoseconds(round(self.retry_after_s * 1e9))
            details.append(retry)
        status = status_pb2.Status(code=self.code.value[0], message=self.message, details=map(_packed, details))
        return (("grpc-status-details-bin", status.SerializeToString()),) if details else ()


def _packed(message: Any) -> any_pb2.Any:
    packed = any_pb2.Any()
    packed.Pack(message)
    return packed


type Step = Any
"""A message of the answer (bytes: as they are), a Refusal, or a function that is called with the call's context."""


def held(context: grpc.ServicerContext) -> Iterator[Any]:
    """A step that ends when its caller is gone."""
    is_over = threading.Event()
    if context.add_callback(is_over.set):
        is_over.wait(PATIENCE_S)
    yield from ()


@dataclass
class Script:
    """Answers of a server.

    Attributes:
        answers: Answers by method: to its first call, its second, and so on; the last is repeated.
        requests: Method and request of each call that came.
    """

    answers: dict[str, Any]
    requests: list[tuple[str, Any]] = field(default_factory=list)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def of(self, method: str) -> list[Any]:
        """The requests to a method."""
        with self._lock:
            return [request for name, request in self.requests if name == method]

    def _next(self, method: str, request: Any) -> Sequence[Step]:
        with self._lock:
            answers = self.answers[method]
            answer: Sequence[Step] = answers[min(sum(name == method for name, _ in self.requests), len(answers) - 1)]
            self.requests.append((method, request))
            return answer

    def stream(self, method: str) -> Callable[[Any, Any], Iterator[Any]]:
        """The behaviour of a method."""

        def answer(request: Any, context: grpc.ServicerContext) -> Iterator[Any]:
            for step in self._next(method, request):
                if isinstance(step, Refusal):
                    context.set_trailing_metadata(step.trailing())
                    context.abort(step.code, step.message)
                elif callable(step):
                    yield from step(context) or ()
                else:
                    yield step

        return answer


@contextmanager
def kept_port() -> Iterator[int]:
    """A port that no other process is given, also while no server listens at it."""
    with socket.socket() as keeper:
        keeper.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        keeper.bind(("127.0.0.1", 0))
        yield keeper.getsockname()[1]


@contextmanager
def scripted(script: Script | None = None, /, *, port: Any = 0, **answers: Any) -> Iterator[Any]:
    """Run a server that answers as written; yield its address and its script.

    Args:
        script: Script of its answers.
        port: Port that it listens on, one of `kept_port`; 0: any.
        answers: The same in short, for a new script.
    """
    chosen = script or Script(answers)
    with ThreadPoolExecutor(8) as threads:
        options = (("grpc.max_send_message_length", -1), ("grpc.so_reuseport", int(port > 0)))
        server = grpc.server(threads, options=options)
        server.add_generic_rpc_handlers([_handler(service, chosen) for service in _SERVICES])
        found = server.add_insecure_port(f"127.0.0.1:{port}")
        server.start()
        try:
            yield f"127.0.0.1:{found}", chosen
        finally:
            server.stop(None).wait(PATIENCE_S)


def _handler(service: Any, script: Script) -> grpc.GenericRpcHandler:
    return grpc.method_handlers_generic_handler(
        service.full_name,
        {
            method.name: _method(method, script.stream(method.name))
            for method in service.methods
            if method.name in script.answers
        },
    )


def _method(method: Any, stream: Callable[[Any, Any], Iterator[Any]]) -> Any:
    parse = GetMessageClass(method.input_type).FromString
    as_bytes = GetMessageClass(method.output_type).SerializeToString

    def serialize(message: Any) -> bytes:
        return message if isinstance(message, bytes) else as_bytes(message)

    if method.server_streaming:
        return grpc.unary_stream_rpc_method_handler(stream, parse, serialize)
    return grpc.unary_unary_rpc_method_handler(
        lambda request, context: next(stream(request, context)), parse, serialize
    )
