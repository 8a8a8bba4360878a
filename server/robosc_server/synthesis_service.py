"""SynthesisService with serialized messages; its handlers raise RefusedError, which the call interceptor reports.

Requests and responses stay serialized: `tasks.requests` checks a request, workers make the responses, and a cached
response is sent as it is. Parsing and serializing with the generated bindings would take longer than all of this.
"""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any, Protocol, Self

import grpc
import grpc.aio
from google.protobuf.message import DecodeError

from robosc_api.security import caller_of
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.result_sender import ResultSender
from robosc_server.tasks.requests import NOT_A_MESSAGE, QUICK_BYTES, RequestCache, RequestLimits, require_short
from robosc_server.tasks.task import Reason, RefusedError, Report, Result, Task, TaskKind, own_key

_SERVICE = pb.DESCRIPTOR.services_by_name["SynthesisService"]
SERVICE_NAME = _SERVICE.full_name
METHODS = tuple(method.name for method in _SERVICE.methods)

PROGRESS_PERIOD_S = 0.05
"""Time before the first progress message, and between two of them, in seconds."""

type Context = grpc.aio.ServicerContext[Any, Any]
type OnReport = Callable[[Report], Awaitable[None]]

_UNARY = {"Check": TaskKind.CHECK, "Format": TaskKind.FORMAT}
_STREAMS = {
    "Synthesize": TaskKind.SYNTHESIZE,
    "Generate": TaskKind.GENERATE,
    "Explore": TaskKind.EXPLORE,
    "Verify": TaskKind.VERIFY,
    "Explain": TaskKind.EXPLAIN,
}


class ResultProvider(Protocol):
    """Provider of the results of accepted tasks."""

    def cached(self, key: str, caller: str) -> Result | None:
        """Return the result of an equal task, if it is in memory.

        Raises:
            RefusedError: The quota of the caller is used up.
        """

    async def result(self, task: Task, caller: str, on_report: OnReport) -> Result:
        """Return the result: a stored one, or that of a worker; cancelling this ends the work.

        Raises:
            RefusedError: There is no result.
        """


class SynthesisService:
    """Implementation of the service, which answers its calls.

    Args:
        provider: Provider of the results of tasks.
        sender: Sender of results.
        limits: Limits of a request.
        targets: The answer of ListTargets, serialized.
        version: The answer of GetVersion, serialized.
        keys: Function that returns the key of a caller's task, from the key of the task and the caller.
        identify: Function that returns the caller behind the call of a context.
    """

    def __init__(
        self,
        provider: ResultProvider,
        sender: ResultSender,
        limits: RequestLimits,
        targets: bytes,
        version: bytes,
        keys: Callable[[str, str], str] = own_key,
        identify: Callable[[Any], str] = caller_of,
    ) -> None:
        self._provider, self._identify = provider, identify
        self._sender = sender
        self._requests = RequestCache(limits, keys)
        self._fixed = {"ListTargets": (pb.ListTargetsRequest, targets), "GetVersion": (pb.GetVersionRequest, version)}

    def handler(self) -> grpc.GenericRpcHandler:
        """Return the handler for a server; messages are bytes on both sides."""
        methods: dict[str, Any] = {}
        for name, kind in _UNARY.items():
            methods[name] = grpc.unary_unary_rpc_method_handler(self._unary(kind))
        for name, kind in _STREAMS.items():
            # A unary response is a stream of one message on the wire. gRPC sends the response of such a handler
            # together with the status, and lets the handler write other messages before.
            methods[name] = grpc.unary_unary_rpc_method_handler(self._stream(kind))
        for name, (message, answer) in self._fixed.items():
            methods[name] = grpc.unary_unary_rpc_method_handler(_fixed_answer(message, answer))
        return grpc.method_handlers_generic_handler(SERVICE_NAME, methods)

    def _accepted(self, kind: TaskKind, request: bytes, context: Context) -> tuple[Task, str]:
        """Return the task of a request, under the key of its caller, and that caller.

        Raises:
            RefusedError: There is none.
        """
        caller = self._identify(context)
        return self._requests.accept(kind, caller, request), caller

    def _unary(self, kind: TaskKind) -> Any:
        async def answer(request: bytes, context: Context) -> bytes:
            task, caller = self._accepted(kind, request, context)
            result = self._provider.cached(task.key, caller)
            if result is None:
                result = await self._provider.result(task, caller, _drop)
            self._sender.reserve(context, result.messages)
            return result.messages[0]

        return answer

    def _stream(self, kind: TaskKind) -> Any:
        async def answer(request: bytes, context: Context) -> bytes:
            task, caller = self._accepted(kind, request, context)
            result = self._provider.cached(task.key, caller)
            if result is None:
                async with _ProgressWriter(context) as progress:
                    result = await self._provider.result(task, caller, progress.report)
                    # Reserved now, since a caller that does not read its progress delays the result.
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
    """Writer of progress messages, which sends the newest report at a limited rate.

    A message takes as long as a small call. A slow reader misses reports and does not delay its worker.
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
            self._writer.cancel()  # The caller has gone.
            await asyncio.gather(self._writer, return_exceptions=True)
            return
        # A message that is being written cannot be cancelled: the result has to wait for it.
        await self._writer
        self._pause.cancel()

    async def report(self, report: Report) -> None:
        """Send a report soon, unless a newer one replaces it."""
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
    """Return a serialized progress message, which is the same for each streaming method."""
    return pb.SynthesizeResponse(progress=pb.Progress(stage=report.stage, message=report.message)).SerializeToString()


async def _drop(report: Report) -> None:
    """Ignore the progress of a unary call."""
