"""Requests that are no protobuf message at all: INVALID_ARGUMENT, not a fault of ours with a traceback."""

from collections.abc import Awaitable, Callable
from typing import Any

import grpc
import grpc.aio
from google.protobuf.message import DecodeError

_MALFORMED = object()


class MalformedRequests(grpc.aio.ServerInterceptor):
    """Answers them for the methods of one service.

    Args:
        service: The service's full name.
    """

    def __init__(self, service: str) -> None:
        self._prefix = f"/{service}/"

    async def intercept_service(self, continuation: Callable[[Any], Awaitable[Any]], handler_call_details: Any) -> Any:
        """The method's handler, behind a check of its request."""
        handler = await continuation(handler_call_details)
        if handler is None or not handler_call_details.method.startswith(self._prefix):
            return handler
        if handler.unary_unary:
            return grpc.unary_unary_rpc_method_handler(
                _checked(handler.unary_unary), _tolerant(handler.request_deserializer), handler.response_serializer
            )
        return grpc.unary_stream_rpc_method_handler(
            _checked(handler.unary_stream), _tolerant(handler.request_deserializer), handler.response_serializer
        )


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
            await context.abort(grpc.StatusCode.INVALID_ARGUMENT, "the request is no message of this service")
        return await answer(request, context)

    return checked
