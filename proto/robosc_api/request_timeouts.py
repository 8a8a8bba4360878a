"""Timeouts for calls whose request does not arrive: such calls would count as open calls for ever."""

import asyncio
import contextvars
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from typing import Any

import grpc
import grpc.aio

from robosc_api.failures import failure_metadata
from robosc_api.layers import Layer, writing

REFLECTION_METHODS = tuple(
    f"/grpc.reflection.{version}.ServerReflection/ServerReflectionInfo" for version in ("v1", "v1alpha")
)
"""The standard methods whose callers may leave their stream of requests open."""

_CODE = grpc.StatusCode.INVALID_ARGUMENT


class _RequestTimeoutError(Exception):
    """The request of a caller did not arrive in time."""


class RequestTimeouts(Layer):
    """Layer that ends calls whose requests do not arrive in time.

    Layers outside see a call as soon as it begins, as a stream of requests; layers inside see it with its request.

    Args:
        limit_s: Time for the request of a call that has one, and for the first one of a stream, in seconds.
        idle_s: By method (`/package.Service/Method`) with a stream of requests, the seconds for each further one; of
            other such methods nothing is asked.
    """

    def __init__(self, limit_s: float, idle_s: Mapping[str, float] | None = None) -> None:
        super().__init__()
        self._first = _Timeout(limit_s)
        self._next = {method: _Timeout(seconds) for method, seconds in (idle_s or {}).items()}

    def wrap(self, inner: Any, method: str) -> Any:
        """Wrap a handler in a wait for its request."""
        if inner.request_streaming and method not in self._next:
            return inner
        return self._with_timeout(inner, method)

    def _with_timeout(self, handler: Any, method: str) -> Any:
        if handler.request_streaming:
            answer = self._streaming(handler.stream_unary or writing(handler.stream_stream), method)
        else:
            answer = self._unary(handler.unary_unary or writing(handler.unary_stream))
        is_stream = handler.response_streaming
        make = grpc.stream_stream_rpc_method_handler if is_stream else grpc.stream_unary_rpc_method_handler
        return make(answer, handler.request_deserializer, handler.response_serializer)

    def _unary(self, answer: Callable[[Any, Any], Awaitable[Any]]) -> Callable[[Any, Any], Awaitable[Any]]:
        waits, end, current_task = self._first, grpc.aio.EOF, asyncio.current_task

        async def answered(requests: Any, context: Any) -> Any:
            # The same as `wait`, whose coroutine would delay every call.
            task: Any = current_task()
            waits.begin(task)
            try:
                request = await context.read()
            except asyncio.CancelledError:
                if not waits.is_late(task):
                    raise
                request = end
            finally:
                waits.end(task)
            if request is end:
                await _abort(context, f"the request did not arrive within {self._first.limit_s:g} seconds")
            return await answer(request, context)

        return answered

    def _streaming(
        self, answer: Callable[[Any, Any], Awaitable[Any]], method: str
    ) -> Callable[[Any, Any], Awaitable[Any]]:
        first, following = self._first, self._next[method]

        async def timed(requests: AsyncIterator[Any]) -> AsyncIterator[Any]:
            timeout = first
            try:
                while True:
                    yield await timeout.wait(anext(requests))
                    timeout = following
            except StopAsyncIteration:
                return

        async def answered(requests: Any, context: Any) -> Any:
            try:
                return await answer(timed(aiter(requests)), context)
            except _RequestTimeoutError:
                # Not where it is read: that may be another asyncio task, which cannot abort the call.
                limits = f"{first.limit_s:g} seconds, and each further one within {following.limit_s:g}"
                await _abort(context, f"the first request must arrive within {limits}")

        return answered


class _Timeout:
    """Timeouts of one duration, with one timer for all of them, since most requests arrive at once.

    A timer for each (`asyncio.timeout`) costs a call ten times as much.

    Attributes:
        limit_s: Length of a wait, in seconds.
    """

    def __init__(self, limit_s: float) -> None:
        self.limit_s = limit_s
        # Start of the wait of each task, the earliest first.
        self._since_s: dict[asyncio.Task[Any], float] = {}
        self._overdue: set[asyncio.Task[Any]] = set()
        self._is_scheduled = False

    async def wait(self, answer: Awaitable[Any]) -> Any:
        """Wait for an answer and return it.

        Raises:
            _RequestTimeoutError: It does not come in time.
        """
        task: Any = asyncio.current_task()
        self.begin(task)
        try:
            return await answer
        except asyncio.CancelledError:
            if self.is_late(task):
                raise _RequestTimeoutError from None
            raise
        finally:
            self.end(task)

    def begin(self, task: asyncio.Task[Any]) -> None:
        """Begin the wait of a task, which is cancelled unless it ends in time."""
        loop = asyncio.get_running_loop()
        self._since_s[task] = loop.time()
        if not self._is_scheduled:
            self._is_scheduled = True
            # In a context of its own: that of this call would be kept until then.
            loop.call_later(self.limit_s, self._cancel_overdue, context=contextvars.Context())

    def is_late(self, task: asyncio.Task[Any]) -> bool:
        """Return True if a task, which is cancelled, is so only because its wait took too long."""
        # Another cancellation may have happened as well.
        return task in self._overdue and task.uncancel() == 0

    def end(self, task: asyncio.Task[Any]) -> None:
        """End the wait of a task, once it is over or cancelled."""
        if self._since_s.pop(task, None) is None:
            self._overdue.discard(task)

    def _cancel_overdue(self) -> None:
        loop = asyncio.get_running_loop()
        late_s = loop.time() - self.limit_s
        while self._since_s:
            task, since_s = next(iter(self._since_s.items()))
            if since_s > late_s:
                loop.call_at(since_s + self.limit_s, self._cancel_overdue)
                return
            del self._since_s[task]
            self._overdue.add(task)
            task.cancel()
        self._is_scheduled = False


async def _abort(context: Any, message: str) -> None:
    await context.abort(_CODE, message, failure_metadata(_CODE, message, "MALFORMED_REQUEST"))
