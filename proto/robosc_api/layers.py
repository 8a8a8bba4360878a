"""Layers around the handlers of a server, one around the other, for the price of one interceptor.

An interceptor of grpc.aio costs every call a coroutine of its own, whatever it does.
"""

from abc import abstractmethod
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import aclosing
from typing import Any

import grpc
import grpc.aio


class Layer(grpc.aio.ServerInterceptor):
    """One thing around handlers: an interceptor on its own, or one of `Layers`."""

    def __init__(self) -> None:
        # By method: the handler that was there, and the one with this around it, made once and not for each call.
        self._made: dict[str, tuple[Any, Any]] = {}

    async def intercept_service(self, continuation: Callable[[Any], Awaitable[Any]], handler_call_details: Any) -> Any:
        """The handler of a call, with this around it."""
        return self.handler(await continuation(handler_call_details), handler_call_details)

    def handler(self, inner: Any, details: Any) -> Any:
        """The handler of a call, with this around it.

        Args:
            inner: The handler inside; None: there is none.
            details: The call's method and metadata.
        """
        if inner is None:
            return None
        method: str = details.method
        made = self._made.get(method)
        if made is None or made[0] is not inner:
            made = self._made[method] = inner, self.around(inner, method)
        return made[1]

    @abstractmethod
    def around(self, inner: Any, method: str) -> Any:
        """A handler with this around it.

        Args:
            inner: The handler inside.
            method: Its method, `/package.Service/Method`.
        """


class Layers(grpc.aio.ServerInterceptor):
    """Layers around each other, as one interceptor.

    Args:
        *layers: The outermost first.
    """

    def __init__(self, *layers: Layer) -> None:
        self._inside_out = layers[::-1]

    async def intercept_service(self, continuation: Callable[[Any], Awaitable[Any]], handler_call_details: Any) -> Any:
        """The handler of a call, with all of them around it."""
        handler = await continuation(handler_call_details)
        for layer in self._inside_out:
            handler = layer.handler(handler, handler_call_details)
        return handler


async def write_responses(made: Awaitable[Any] | AsyncIterator[Any], context: Any) -> None:
    """Send what a handler makes: handlers of streams are generators, or coroutines that write by themselves.

    Args:
        made: Value that the handler gave when it was called. A generator is closed at once when the call ends before
            it.
        context: Context of the call.
    """
    if not hasattr(made, "__aiter__"):
        await made
        return
    async with aclosing(made) as responses:  # type: ignore[type-var]  # generators of handlers can be closed
        async for response in responses:
            await context.write(response)


def writing(answer: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Awaitable[None]]:
    """A handler of a stream, of either kind, as a coroutine that writes by itself."""

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
    """A handler of the same kind, for the same messages, that does something else."""
    make = _MAKERS[handler.request_streaming, handler.response_streaming]
    return make(behaviour, handler.request_deserializer, handler.response_serializer)


_MAKERS: dict[tuple[bool, bool], Callable[..., Any]] = {
    (False, False): grpc.unary_unary_rpc_method_handler,
    (False, True): grpc.unary_stream_rpc_method_handler,
    (True, False): grpc.stream_unary_rpc_method_handler,
    (True, True): grpc.stream_stream_rpc_method_handler,
}
