"""Both clients behind the same methods, so that one test is about both of them."""

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

import grpc

from robosc_client import AsyncClient, Client, RetryPolicy
from support.scripted_service import Refusal

KINDS = ("sync", "async")

QUICK = RetryPolicy(first_s=0.001, longest_s=0.01)
AWAY = Refusal(grpc.StatusCode.UNAVAILABLE, "the server is ending", "SHUTTING_DOWN")

Talk = Callable[..., AbstractContextManager[tuple[Any, Any]]]
"""Opens a client of a server that gives these answers to its methods, with a record of them."""


class Blocking:
    """The asynchronous client, each call run to its end."""

    def __init__(self, runner: asyncio.Runner, client: AsyncClient) -> None:
        self._runner = runner
        self._client = client

    def __getattr__(self, name: str) -> Callable[..., Any]:
        method = getattr(self._client, name)

        def call(*arguments: Any, **options: Any) -> Any:
            found = method(*arguments, **options)
            return self._all(found) if hasattr(found, "__anext__") else self._runner.run(found)

        return call

    def _all(self, items: Any) -> Iterator[Any]:
        try:
            while True:
                try:
                    yield self._runner.run(_next(items))
                except StopAsyncIteration:
                    return
        finally:
            self._runner.run(items.aclose())


async def _next(items: Any) -> Any:
    return await anext(items)


@contextmanager
def client_of(
    kind: str, address: str, *, sleep: Callable[[float], None] | None = None, **options: Any
) -> Iterator[Any]:
    """A client of a kind; its channel shares no connection with others.

    Args:
        kind: `sync` or `async`.
        address: Of the server.
        sleep: Waits, or pretends to.
        options: Of either client.
    """
    options["channel_options"] = {"grpc.use_local_subchannel_pool": 1}
    if kind == "sync":
        if sleep is not None:
            options["sleep"] = sleep
        with Client(address, **options) as client:
            yield client
        return

    async def opened() -> AsyncClient:
        if sleep is not None:
            options["sleep"] = _awaited(sleep)
        return AsyncClient(address, **options)

    with asyncio.Runner() as runner:
        asynchronous = runner.run(opened())
        try:
            yield Blocking(runner, asynchronous)
        finally:
            runner.run(asynchronous.close())


def _awaited(sleep: Callable[[float], None]) -> Callable[[float], Awaitable[None]]:
    async def wait(seconds: float) -> None:
        sleep(seconds)

    return wait
