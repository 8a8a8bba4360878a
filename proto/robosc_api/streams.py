"""Handlers of streams of grpc.aio, of either kind, behind something."""

from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import aclosing
from typing import Any


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
