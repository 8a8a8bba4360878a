"""The end of calls when the bridge ends: those that wait for their caller are told so, and nobody waits for them.

gRPC itself would cancel them and write a traceback for each.
"""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import grpc
import grpc.aio

from robosc_api.streams import write_responses

OWN_END_S = 0.2
"""Time for a call to end by itself, with a last word."""


class EndingCalls(grpc.aio.ServerInterceptor):
    """Before `PromptRequests`, after which every method takes a stream of requests."""

    def __init__(self) -> None:
        self._closing = asyncio.Event()

    def close(self) -> None:
        """Let every call end."""
        self._closing.set()

    async def intercept_service(self, continuation: Callable[[Any], Awaitable[Any]], handler_call_details: Any) -> Any:
        """The method's handler, which ends with the bridge."""
        handler = await continuation(handler_call_details)
        if handler is None:
            return handler
        parse, serialize = handler.request_deserializer, handler.response_serializer
        if handler.stream_unary:
            return grpc.stream_unary_rpc_method_handler(self._ending(handler.stream_unary), parse, serialize)

        async def answer(requests: Any, context: Any) -> None:
            await write_responses(handler.stream_stream(requests, context), context)

        return grpc.stream_stream_rpc_method_handler(self._ending(answer), parse, serialize)

    def _ending(self, answer: Callable[[Any, Any], Awaitable[Any]]) -> Callable[[Any, Any], Awaitable[Any]]:
        async def ending(requests: Any, context: Any) -> Any:
            answering = asyncio.ensure_future(answer(requests, context))
            closing = asyncio.ensure_future(self._closing.wait())
            try:
                await asyncio.wait((answering, closing), return_when=asyncio.FIRST_COMPLETED)
                if not answering.done():
                    await asyncio.wait((answering,), timeout=OWN_END_S)
                if answering.done():
                    return answering.result()
            finally:
                closing.cancel()
                answering.cancel()
                await asyncio.gather(answering, closing, return_exceptions=True)
            await context.abort(grpc.StatusCode.UNAVAILABLE, "the bridge ends")
            raise AssertionError("unreachable: the call is aborted")

        return ending
