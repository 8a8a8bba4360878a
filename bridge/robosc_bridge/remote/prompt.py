"""Calls that begin and then say nothing: they would hold their connection without ever showing a token."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any

import grpc
import grpc.aio

REQUEST_LIMIT_S = 5.0
"""Time for the request of a call that has one."""


class PromptRequests(grpc.aio.ServerInterceptor):
    """Ends them. The outermost interceptor: whatever looks at a call sees it with its request."""

    async def intercept_service(self, continuation: Callable[[Any], Awaitable[Any]], handler_call_details: Any) -> Any:
        """The method's handler, behind a wait for its one request."""
        handler = await continuation(handler_call_details)
        if handler is None or handler.request_streaming:
            return handler
        parse, serialize = handler.request_deserializer, handler.response_serializer
        if handler.unary_unary:
            return grpc.stream_unary_rpc_method_handler(_behind(handler.unary_unary), parse, serialize)
        return grpc.stream_stream_rpc_method_handler(_behind(handler.unary_stream), parse, serialize)


def _behind(answer: Callable[[Any, Any], Awaitable[Any]]) -> Callable[[Any, Any], Awaitable[Any]]:
    async def prompt(requests: AsyncIterator[Any], context: Any) -> Any:
        try:
            async with asyncio.timeout(REQUEST_LIMIT_S):
                request = await anext(aiter(requests))
        except (TimeoutError, StopAsyncIteration):
            why = f"the request comes within {REQUEST_LIMIT_S:g} seconds"
            await context.abort(grpc.StatusCode.INVALID_ARGUMENT, why)
        return await answer(request, context)

    return prompt
