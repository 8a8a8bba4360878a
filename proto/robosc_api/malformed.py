"""Requests that are no protobuf message at all: INVALID_ARGUMENT, not a fault of ours with a traceback."""

from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any

import grpc
import grpc.aio
from google.protobuf.message import DecodeError

from robosc_api.failures import failure_metadata
from robosc_api.streams import write_responses

_MALFORMED = object()


class MalformedError(Exception):
    """What a stream of requests raises for one that is no message; whoever reads them lets it pass."""


_CODE, _MESSAGE = grpc.StatusCode.INVALID_ARGUMENT, "the request is no message of this service"


class MalformedRequests(grpc.aio.ServerInterceptor):
    """Answers them for the methods of some services; methods that take bytes as they come look at them themselves.

    Args:
        services: Their full names.
    """

    def __init__(self, *services: str) -> None:
        self._prefixes = tuple(f"/{service}/" for service in services)
        # By method: the handler that was there, and the one behind a check, made once and not for each call.
        self._made: dict[str, tuple[Any, Any]] = {}

    async def intercept_service(self, continuation: Callable[[Any], Awaitable[Any]], handler_call_details: Any) -> Any:
        """The method's handler, behind a check of its requests."""
        handler = await continuation(handler_call_details)
        method: str = handler_call_details.method
        if handler is None or handler.request_deserializer is None or not method.startswith(self._prefixes):
            return handler
        made = self._made.get(method)
        if made is None or made[0] is not handler:
            made = self._made[method] = handler, self._behind(handler)
        return made[1]

    @staticmethod
    def _behind(handler: Any) -> Any:
        parse, serialize = _tolerant(handler.request_deserializer), handler.response_serializer
        if handler.unary_unary:
            return grpc.unary_unary_rpc_method_handler(_checked(handler.unary_unary), parse, serialize)
        if handler.unary_stream:
            return grpc.unary_stream_rpc_method_handler(_checked_stream(handler.unary_stream), parse, serialize)
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
            await _refuse(context)
        return await answer(request, context)

    return checked


def _checked_stream(answer: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Awaitable[None]]:
    async def checked(request: Any, context: Any) -> None:
        if request is _MALFORMED:
            await _refuse(context)
        await write_responses(answer(request, context), context)

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
            await _refuse(context)

    return checked


async def _refuse(context: Any) -> None:
    await context.abort(_CODE, _MESSAGE, failure_metadata(_CODE, _MESSAGE, "MALFORMED_REQUEST", context=context))
