"""Servers of the live view in the event loop of a test."""

import contextlib
from collections.abc import AsyncIterator, Callable

from robosc_api.security import Credentials
from robosc_bridge.view import ViewSettings
from robosc_bridge.view.definition import Robot
from robosc_bridge.view.remote_bridge import RemoteBridge
from robosc_bridge.view.server import ViewServer
from robosc_bridge.view.sources import Source


@contextlib.asynccontextmanager
async def served(
    make: Callable[[], Source],
    *,
    is_shared: bool = True,
    robot: Robot | None = None,
    settings: ViewSettings | None = None,
) -> AsyncIterator[ViewServer]:
    """A server of a source, on a port of its own choice."""
    server = ViewServer(settings or ViewSettings("127.0.0.1:0"), make, is_shared=is_shared, robot=robot)
    await server.start()
    try:
        yield server
    finally:
        await server.stop()


@contextlib.asynccontextmanager
async def remotely_viewed(address: str) -> AsyncIterator[ViewServer]:
    """The live view of a bridge at an address."""
    async with served(lambda: RemoteBridge(address, Credentials())) as server:
        yield server
