"""The end of calls when the bridge ends: those that wait for their caller are ended with a status.

gRPC itself would cancel them and write a traceback for each.
"""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import grpc

from robosc_api.layers import Layer, behaviour_of, with_behaviour, writing

OWN_END_S = 0.2
"""Time for a call to end by itself, with a last word."""


class ShutdownLayer(Layer):
    """Layer in front of `PromptRequests`, behind which every method takes a stream of requests."""

    def __init__(self) -> None:
        super().__init__()
        self._closing = asyncio.Event()

    def close(self) -> None:
        """End every call."""
        self._closing.set()

    def wrap(self, inner: Any, method: str) -> Any:
        """Return a handler whose calls end with the bridge."""
        answer = behaviour_of(inner)
        return with_behaviour(inner, self._ending(writing(answer) if inner.response_streaming else answer))

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
