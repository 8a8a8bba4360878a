"""Refusal of requests that cannot be parsed with INVALID_ARGUMENT, instead of an internal error."""

from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any

import grpc
from google.protobuf.message import DecodeError

from robosc_api.failures import failure_metadata
from robosc_api.layers import Layer, write_responses

PLAIN_REQUESTS = ("grpc.compression_enabled_algorithms_bitset", 1 << grpc.Compression.NoCompression)
"""Option of a server that refuses compressed requests: a few hundred bytes would become megabytes before any limit."""

_MALFORMED = object()


class MalformedError(Exception):
    """Error of a stream of requests for one that cannot be parsed; handlers let it pass."""


_CODE, _MESSAGE = grpc.StatusCode.INVALID_ARGUMENT, "the request is not a valid message of this service"


class MalformedRequests(Layer):
    """Layer that refuses malformed requests of some services; methods that take bytes check them themselves.

    Args:
        services: Full names of the services.
        limit: Maximum bytes of a request; longer ones are not parsed. None: no limit.
    """

    def __init__(self, *services: str, limit: int | None = None) -> None:
        super().__init__()
        self._limit = limit
        self._prefixes = tuple(f"/{service}/" for service in services)

    def wrap(self, inner: Any, method: str) -> Any:
        """Wrap a handler in a check of its requests."""
        if inner.request_deserializer is None or not method.startswith(self._prefixes):
            return inner
        return self._with_check(inner)

    def _with_check(self, handler: Any) -> Any:
        parse, serialize = _tolerant(handler.request_deserializer, self._limit), handler.response_serializer
        if handler.unary_unary:
            return grpc.unary_unary_rpc_method_handler(_checked(handler.unary_unary), parse, serialize)
        if handler.unary_stream:
            return grpc.unary_stream_rpc_method_handler(_checked_stream(handler.unary_stream), parse, serialize)
        return grpc.stream_stream_rpc_method_handler(_checked_each(handler.stream_stream), parse, serialize)


def _tolerant(parse: Callable[[bytes], Any], limit: int | None) -> Callable[[bytes], Any]:
    def tolerant(content: bytes) -> Any:
        if limit is not None and len(content) > limit:
            return _MALFORMED
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


def _checked_each(answer: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Awaitable[None]]:
    async def requests(given: AsyncIterator[Any]) -> AsyncIterator[Any]:
        async for request in given:
            if request is _MALFORMED:
                raise MalformedError
            yield request

    async def checked(given: AsyncIterator[Any], context: Any) -> None:
        try:
            await write_responses(answer(requests(given), context), context)
        except MalformedError:
            # Not where it is read: that may be another asyncio task, which cannot abort the call.
            await _refuse(context)

    return checked


async def _refuse(context: Any) -> None:
    await context.abort(_CODE, _MESSAGE, failure_metadata(_CODE, _MESSAGE, "MALFORMED_REQUEST"))
