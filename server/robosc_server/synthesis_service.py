"""The SynthesisService: bytes come in and go out; what is refused is raised, and told by what stands around every call.

Requests and responses stay serialized here: a request is looked at once (`tasks.requests`), workers make the responses,
and one that is kept is sent as it is. What the generated bindings would do in between costs more than all of that.
"""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any, Protocol, Self

import grpc
import grpc.aio
from google.protobuf.message import DecodeError

from robosc_api.security import caller_of
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.failures import RefusedError
from robosc_server.result_sender import ResultSender
from robosc_server.tasks.requests import NOT_A_MESSAGE, QUICK_BYTES, RequestCache, RequestLimits, require_short
from robosc_server.tasks.task import Reason, Report, Result, Task, TaskKind

_SERVICE = pb.DESCRIPTOR.services_by_name["SynthesisService"]
SERVICE_NAME = _SERVICE.full_name
METHODS = tuple(method.name for method in _SERVICE.methods)

PROGRESS_PERIOD_S = 0.05
"""Time that work may take before its caller is informed of it, and between two such messages, in seconds."""

type Context = grpc.aio.ServicerContext[Any, Any]
type OnReport = Callable[[Report], Awaitable[None]]

_UNARY = {"Check": TaskKind.CHECK, "Format": TaskKind.FORMAT}
_STREAMS = {
    "Synthesize": TaskKind.SYNTHESIZE,
    "Generate": TaskKind.GENERATE,
    "Explore": TaskKind.EXPLORE,
    "Verify": TaskKind.VERIFY,
}


class ResultProvider(Protocol):
    """ResultProvider that gives an accepted task its result."""

    def cached(self, key: str) -> Result | None:
        """The result of an equal task, if it is in memory."""

    async def result(self, task: Task, caller: str, on_report: OnReport) -> Result:
        """The result: one that is kept, or what a worker makes; cancelling this ends the work.

        Raises:
            RefusedError: There is none.
        """


class SynthesisService:
    """Implementation of the service, which answers its calls.

    Args:
        provider: ResultProvider that has tasks done.
        sender: Sender of results.
        limits: Limits of a request.
        targets: The answer of ListTargets, serialized.
        version: The answer of GetVersion, serialized.
    """

    def __init__(
        self, provider: ResultProvider, sender: ResultSender, limits: RequestLimits, targets: bytes, version: bytes
    ) -> None:
        self._provider = provider
        self._sender = sender
        self._requests = RequestCache(limits)
        self._fixed = {"ListTargets": (pb.ListTargetsRequest, targets), "GetVersion": (pb.GetVersionRequest, version)}

    def handler(self) -> grpc.GenericRpcHandler:
        """Return the handler for a server; messages are bytes on both sides."""
        methods: dict[str, Any] = {}
        for name, kind in _UNARY.items():
            methods[name] = grpc.unary_unary_rpc_method_handler(self._unary(kind))
        for name, kind in _STREAMS.items():
            # On the line a method that answers once is a stream of one message. gRPC sends the answer of such a
            # handler together with the status, at once, and lets it write other messages before.
            methods[name] = grpc.unary_unary_rpc_method_handler(self._stream(kind))
        for name, (message, answer) in self._fixed.items():
            methods[name] = grpc.unary_unary_rpc_method_handler(_fixed_answer(message, answer))
        return grpc.method_handlers_generic_handler(SERVICE_NAME, methods)

    def _unary(self, kind: TaskKind) -> Any:
        async def answer(request: bytes, context: Context) -> bytes:
            task = self._requests.accept(kind, request)
            result = self._provider.cached(task.key)
            if result is None:
                result = await self._provider.result(task, caller_of(context), _drop)
            self._sender.reserve(context, result.messages)
            return result.messages[0]

        return answer

    def _stream(self, kind: TaskKind) -> Any:
        async def answer(request: bytes, context: Context) -> bytes:
            task = self._requests.accept(kind, request)
            result = self._provider.cached(task.key)
            if result is None:
                async with _ProgressWriter(context) as progress:
                    result = await self._provider.result(task, caller_of(context), progress.report)
                    # Now: a caller that does not read its reports has the result wait.
                    self._sender.reserve(context, result.messages)
            else:
                self._sender.reserve(context, result.messages)
            *first, last = result.messages
            for message in first:
                await context.write(message)
            return last

        return answer


def _fixed_answer(request_type: Any, answer: bytes) -> Any:
    async def fixed(request: bytes, context: Context) -> bytes:
        require_short(request, QUICK_BYTES)
        try:
            request_type.FromString(request)
        except DecodeError as error:
            raise RefusedError(Reason.MALFORMED_REQUEST, NOT_A_MESSAGE) from error
        return answer

    return fixed


class _ProgressWriter:
    """Tells a caller where the work is, if it takes a while: what is newest, and not too often.

    Each message costs server and client as much as a small call; who reads slowly misses some, and holds no worker up.
    """

    def __init__(self, context: Context) -> None:
        self._context = context
        self._newest: Report | None = None
        self._may_write = False
        self._writer: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        self._pause = asyncio.get_running_loop().call_later(PROGRESS_PERIOD_S, self._resume)
        return self

    async def __aexit__(self, kind: type[BaseException] | None, *details: object) -> None:
        self._pause.cancel()
        self._may_write = False
        if self._writer is None:
            return
        if kind is not None and issubclass(kind, asyncio.CancelledError):
            self._writer.cancel()  # Nobody is there to read it.
            await asyncio.gather(self._writer, return_exceptions=True)
            return
        # A message that is on its way cannot be taken back: the next one has to wait for it.
        await self._writer
        self._pause.cancel()

    async def report(self, report: Report) -> None:
        """Tell it soon, unless there is something newer by then."""
        self._newest = report
        if self._may_write:
            self._begin()

    def _resume(self) -> None:
        self._may_write = True
        if self._newest is not None:
            self._begin()

    def _begin(self) -> None:
        self._may_write = False
        self._writer = asyncio.create_task(self._write())

    async def _write(self) -> None:
        report, self._newest = self._newest, None
        if report is not None:
            await self._context.write(progress_message(report))
        self._pause = asyncio.get_running_loop().call_later(PROGRESS_PERIOD_S, self._resume)


def progress_message(report: Report) -> bytes:
    """The message that tells where the work is: the same bytes in the response of each streaming method."""
    return pb.SynthesizeResponse(progress=pb.Progress(stage=report.stage, message=report.message)).SerializeToString()


async def _drop(report: Report) -> None:
    """Progress of a call whose response has no place for it."""
