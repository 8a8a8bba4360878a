"""Requests that are no protobuf message at all: INVALID_ARGUMENT, not a fault of ours with a traceback."""

from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any

import grpc
import grpc.aio
from google.protobuf.message import DecodeError

_MALFORMED = object()


class MalformedError(Exception):
    """What a stream of requests raises for one that is no message; whoever reads them lets it pass."""


_REFUSAL = (grpc.StatusCode.INVALID_ARGUMENT, "the request is no message of this service")


class MalformedRequests(grpc.aio.ServerInterceptor):
    """Answers them for the methods of one service.

    Args:
        service: The service's full name.
    """

    def __init__(self, service: str) -> None:
        self._prefix = f"/{service}/"

    async def intercept_service(self, continuation: Callable[[Any], Awaitable[Any]], handler_call_details: Any) -> Any:
        """The method's handler, behind a check of its requests."""
        handler = await continuation(handler_call_details)
        if handler is None or not handler_call_details.method.startswith(self._prefix):
            return handler
        parse, serialize = _tolerant(handler.request_deserializer), handler.response_serializer
        if handler.unary_unary:
            return grpc.unary_unary_rpc_method_handler(_checked(handler.unary_unary), parse, serialize)
        if handler.unary_stream:
            return grpc.unary_stream_rpc_method_handler(_checked(handler.unary_stream), parse, serialize)
        return grpc.stream_stream_rpc_method_handler(_checked_each(handler.stream_stream), parse, serialize)


def _tolerant(parse: Callable[[bytes], Any]) -> Callable[[bytes], Any]:
    def tolerant(content: bytes) -> Any:
        try:
            return parse(content)
        except DecodeError:
            return _MALFORMED

    return tolerant


def _checked(answer: Callable[[Any, Any], Awaitable[Any]]) -> Callable[[Any, Any], Awaitable[Any]]:
    async def checked(request: Any, context: Any) -> Any:
        if request is _MALFORMED:
            await context.abort(*_REFUSAL)
        return await answer(request, context)

    return checked


def _checked_each(answer: Callable[[Any, Any], Awaitable[Any]]) -> Callable[[Any, Any], Awaitable[Any]]:
    async def requests(given: AsyncIterator[Any]) -> AsyncIterator[Any]:
        async for request in given:
            if request is _MALFORMED:
                raise MalformedError
            yield request

    async def checked(given: AsyncIterator[Any], context: Any) -> Any:
        try:
            return await answer(requests(given), context)
        except MalformedError:
            # Here and not where it is read: that may be another task, which cannot end the call.
            await context.abort(*_REFUSAL)

    return checked
