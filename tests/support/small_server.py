"""A small real server of grpc.aio, whose handlers a test writes, and a log that it can read."""

import asyncio
import io
import json
import logging
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager
from typing import Any

import grpc
import grpc.aio
import structlog
from google.rpc import error_details_pb2, status_pb2

from robosc_api.calls import request_id
from robosc_api.layers import Layer, LayeredServices
from robosc_server.operations.logs import configure_logging
from robosc_server.operations.settings import LogFormat, LogLevel
from robosc_server.tasks.task import Reason, RefusedError
from support.waiting import PATIENCE_S

SERVICE = "test.Service"

MARKER = "a_word_of_the_model"


async def answer(request: bytes, context: Any) -> bytes:
    """A unary handler that ends as the request says; else it returns the id of the request."""
    match request:
        case b"busy":
            raise RefusedError(Reason.SERVER_BUSY, "come again", 1.5)
        case b"fault":
            raise KeyError(MARKER)
        case b"abort":
            await context.abort(grpc.StatusCode.DATA_LOSS, "lost")
        case b"stuck":
            await asyncio.Event().wait()
        case b"code":
            context.set_code(grpc.StatusCode.ABORTED)
    return request_id().encode()


@asynccontextmanager
async def small_server(
    *,
    layers: Sequence[Layer] = (),
    unary: Callable[..., Any] | None = None,
    stream: Callable[..., Any] | None = None,
    setup: Callable[[LayeredServices], Any] = lambda services: None,
    listen: Callable[[grpc.aio.Server], Any] = lambda server: None,
    options: Sequence[tuple[str, int]] = (),
) -> AsyncIterator[tuple[grpc.aio.Channel, grpc.aio.Server]]:
    """A server with the methods `Unary` and `Stream` on bytes, and a channel to it."""
    services = LayeredServices(*layers)
    server = grpc.aio.server(None, (services,), options=list(options))
    handlers: dict[str, Any] = {}
    if unary is not None:
        handlers["Unary"] = grpc.unary_unary_rpc_method_handler(unary)
    if stream is not None:
        handlers["Stream"] = grpc.unary_stream_rpc_method_handler(stream)
    services.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(SERVICE, handlers),))
    setup(services)
    listen(server)
    port = server.add_insecure_port("127.0.0.1:0")
    await server.start()
    try:
        async with grpc.aio.insecure_channel(f"127.0.0.1:{port}") as channel:
            yield channel, server
    finally:
        await server.stop(0)


async def call(channel: Any, request: bytes = b"", metadata: Sequence[tuple[str, str]] = (), **more: Any) -> Any:
    """The call of `Unary` when it is through: `code`, `trailing` and `answer`."""
    made = channel.unary_unary(f"/{SERVICE}/Unary")(
        request, metadata=tuple(metadata), timeout=more.pop("timeout", PATIENCE_S)
    )
    try:
        answer = await made
    except grpc.aio.AioRpcError:
        answer = None
    return Ended(await made.code(), await made.details(), tuple(await made.trailing_metadata() or ()), answer)


class Ended:
    """A call that is through."""

    def __init__(self, code: grpc.StatusCode, message: str, trailing: tuple[Any, ...], answer: bytes | None) -> None:
        self.code, self.message, self.answer = code, message, answer
        self.trailing = dict(trailing)

    @property
    def reason(self) -> str:
        """Reason of google.rpc.ErrorInfo."""
        for detail in status_pb2.Status.FromString(self.trailing["grpc-status-details-bin"]).details:
            info = error_details_pb2.ErrorInfo()
            if detail.Unpack(info):
                assert info.domain == "robosc"
                return str(info.reason)
        return ""

    @property
    def retry_delay_s(self) -> float | None:
        """Retry delay of google.rpc.RetryInfo, in seconds."""
        for detail in status_pb2.Status.FromString(self.trailing["grpc-status-details-bin"]).details:
            info = error_details_pb2.RetryInfo()
            if detail.Unpack(info):
                return float(info.retry_delay.ToNanoseconds() / 1e9)
        return None


class ReadLog:
    """Log that was written."""

    def __init__(self, stream: io.StringIO) -> None:
        self._stream = stream

    @property
    def text(self) -> str:
        """All of it."""
        return self._stream.getvalue()

    def lines(self, event: str | None = None) -> list[dict[str, Any]]:
        """The lines as JSON; those of one event, or all."""
        lines = [json.loads(line) for line in self.text.split("\n") if line]
        return [line for line in lines if event is None or line["event"] == event]


@contextmanager
def logged(level: LogLevel = LogLevel.DEBUG, form: LogFormat = LogFormat.JSON) -> Iterator[ReadLog]:
    """The server's log, set up anew, and afterwards as it was."""
    root = logging.getLogger()
    before, names = root.level, ("asyncio", "distributed", "opentelemetry", "sqlalchemy")
    levels = {name: logging.getLogger(name).level for name in names}
    stream = io.StringIO()
    configure_logging(form, level, stream)
    try:
        yield ReadLog(stream)
    finally:
        for handler in tuple(root.handlers):
            if isinstance(handler.formatter, structlog.stdlib.ProcessorFormatter):
                root.removeHandler(handler)
        root.setLevel(before)
        for name, old in levels.items():
            logging.getLogger(name).setLevel(old)
        structlog.reset_defaults()
