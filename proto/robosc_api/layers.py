"""Layers around the handlers of a server, combined into one interceptor.

Each interceptor of grpc.aio adds a coroutine to every call; layers do not.
"""

import asyncio
from abc import abstractmethod
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import aclosing
from itertools import groupby
from typing import Any

import grpc
import grpc.aio

from robosc_api.peers import begin_call


class Layer(grpc.aio.ServerInterceptor):
    """Wrapper around handlers, which is an interceptor itself or one of `Layers`."""

    def __init__(self) -> None:
        # By method: the inner handler, and the wrapped one, which is made once and not for each call.
        self._made: dict[str, tuple[Any, Any]] = {}

    async def intercept_service(self, continuation: Callable[[Any], Awaitable[Any]], handler_call_details: Any) -> Any:
        """Return the wrapped handler of a call."""
        return self.handler(await continuation(handler_call_details), handler_call_details)

    def handler(self, inner: Any, details: Any) -> Any:
        """Return the wrapped handler of a call.

        Args:
            inner: The handler inside; None: there is none.
            details: The call's method and metadata.
        """
        if inner is None:
            return None
        method: str = details.method
        made = self._made.get(method)
        if made is None or made[0] is not inner:
            made = self._made[method] = inner, self.wrap(inner, method)
        return made[1]

    @abstractmethod
    def wrap(self, inner: Any, method: str) -> Any:
        """Wrap a handler.

        Args:
            inner: The handler inside.
            method: Its method, `/package.Service/Method`.
        """


class Layers(grpc.aio.ServerInterceptor):
    """Nested layers as one interceptor.

    Args:
        *layers: The outermost first.
    """

    def __init__(self, *layers: Layer) -> None:
        self._inside_out: list[Layer] = []
        for is_same, run in groupby(layers[::-1], _is_same_for_each_call):
            found = list(run)
            self._inside_out += [_Joined(found)] if is_same and len(found) > 1 else found

    async def intercept_service(self, continuation: Callable[[Any], Awaitable[Any]], handler_call_details: Any) -> Any:
        """Return the handler of a call, wrapped in all layers."""
        begin_call()
        handler = await continuation(handler_call_details)
        for layer in self._inside_out:
            handler = layer.handler(handler, handler_call_details)
        return handler


def _is_same_for_each_call(layer: Layer) -> bool:
    """Return True if a layer only wraps the handlers of methods, and looks at no call before its handler begins."""
    return type(layer).handler is Layer.handler


class _Joined(Layer):
    """Neighbouring layers whose handlers are looked up together.

    Args:
        inside_out: The innermost first.
    """

    def __init__(self, inside_out: list[Layer]) -> None:
        super().__init__()
        self._layers = inside_out

    def wrap(self, inner: Any, method: str) -> Any:
        """Wrap a handler in all of them."""
        for layer in self._layers:
            inner = layer.wrap(inner, method)
        return inner


def when_call_ends(callback: Callable[[Any], None]) -> None:
    """Call a function when the call whose handler runs has ended for gRPC as well, and its response is on its way.

    gRPC's context offers the same, but then refers to itself: the context, its metadata and its state in gRPC would
    stay until the garbage collector finds them, and each call would take new memory.

    Args:
        callback: Function of the call's task, in which gRPC runs handlers.
    """
    task: Any = asyncio.current_task()
    task.add_done_callback(callback)


async def write_responses(made: Awaitable[Any] | AsyncIterator[Any], context: Any) -> None:
    """Send the responses of a stream handler, which is a generator or a coroutine that writes by itself.

    Args:
        made: Return value of the handler. A generator is closed at once if the call ends before it.
        context: Context of the call.
    """
    if not hasattr(made, "__aiter__"):
        await made
        return
    async with aclosing(made) as responses:  # type: ignore[type-var]  # generators of handlers can be closed
        async for response in responses:
            await context.write(response)


def writing(answer: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Awaitable[None]]:
    """Convert a stream handler of either kind to a coroutine that writes by itself."""

    async def write(request: Any, context: Any) -> None:
        await write_responses(answer(request, context), context)

    return write


def behaviour_of(handler: Any) -> Callable[[Any, Any], Any]:
    """Return the function that a handler of any kind calls with a request, or a stream of them, and a context."""
    behaviour: Callable[[Any, Any], Any] = (
        handler.unary_unary or handler.unary_stream or handler.stream_unary or handler.stream_stream
    )
    return behaviour


def with_behaviour(handler: Any, behaviour: Callable[[Any, Any], Any]) -> Any:
    """Return a handler of the same kind and messages with another behaviour."""
    make = _MAKERS[handler.request_streaming, handler.response_streaming]
    return make(behaviour, handler.request_deserializer, handler.response_serializer)


_MAKERS: dict[tuple[bool, bool], Callable[..., Any]] = {
    (False, False): grpc.unary_unary_rpc_method_handler,
    (False, True): grpc.unary_stream_rpc_method_handler,
    (True, False): grpc.stream_unary_rpc_method_handler,
    (True, True): grpc.stream_stream_rpc_method_handler,
}
