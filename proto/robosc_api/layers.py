"""Layers around the handlers of a server, all of whose services are one handler for gRPC.

Each interceptor of grpc.aio adds coroutines to every call; layers do not.
"""

from abc import abstractmethod
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable
from contextlib import aclosing
from itertools import groupby
from typing import Any

import grpc
import grpc.aio

from robosc_api.calls import begin_call
from robosc_api.failures import failure_metadata


class Layer:
    """Wrapper around handlers, which is one of those of `LayeredServices`."""

    def __init__(self) -> None:
        # By method: the inner handler, and the wrapped one, which is made once and not for each call.
        self._made: dict[str, tuple[Any, Any]] = {}

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


class LayeredServices(grpc.GenericRpcHandler):
    """Services inside nested layers, as the one handler that a server of grpc.aio has.

    Services are added here and not to the server, which takes handlers by the name of their method, too: for each of
    these it waits with a future of its own, all of which it looks at for every call.

    Args:
        *layers: The outermost first.
        most_calls: Maximum number of calls that have begun and not ended, those included that a layer refuses; None: no
            limit.
    """

    def __init__(self, *layers: Layer, most_calls: int | None = None) -> None:
        self._services: list[grpc.GenericRpcHandler] = []
        self._most_calls, self._calls = most_calls, 0
        self._inside_out: list[Layer] = []
        for is_same, run in groupby(layers[::-1], _is_same_for_each_call):
            found = list(run)
            self._inside_out += [_Joined(found)] if is_same and len(found) > 1 else found

    def add_generic_rpc_handlers(self, handlers: Iterable[grpc.GenericRpcHandler]) -> None:
        """Add services; generated code calls this for a servicer, as it does for a server."""
        self._services += handlers

    def add_registered_method_handlers(self, service: str, handlers: Any) -> None:
        """Do nothing: generated code adds the same methods by `add_generic_rpc_handlers`."""

    def service(self, handler_call_details: Any) -> Any:
        """Return the handler of a call, wrapped in all layers; None: no service has it."""
        if self._calls == self._most_calls:
            return _TOO_MANY
        self._calls += 1
        begin_call().at_end.append(self._ended)
        handler = None
        for service in self._services:
            handler = service.service(handler_call_details)
            if handler is not None:
                break
        for layer in self._inside_out:
            handler = layer.handler(handler, handler_call_details)
        return handler

    def _ended(self) -> None:
        self._calls -= 1


async def _refuse(requests: Any, context: Any) -> None:
    code, message = grpc.StatusCode.RESOURCE_EXHAUSTED, "the server has too many calls to refuse; try again later"
    await context.abort(code, message, failure_metadata(code, message, "SERVER_BUSY", _RETRY_S))


_RETRY_S = 1.0
_TOO_MANY: Any = grpc.stream_stream_rpc_method_handler(_refuse)


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
