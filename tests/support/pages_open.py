"""Pages of the live view as a browser would open them, in the hands of a test: a WebSocket, and what came over it."""

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Callable
from typing import Any

import aiohttp

LIMIT_S = 30.0


class OpenPage:
    """A page that is open.

    Args:
        socket: Its WebSocket.

    Attributes:
        socket: The same.
        messages: All that came, in its order.
    """

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self.socket = socket
        self.messages: list[dict[str, Any]] = []

    async def next(self) -> dict[str, Any]:
        """The next message."""
        message = await asyncio.wait_for(self.socket.receive(), LIMIT_S)
        assert message.type is aiohttp.WSMsgType.TEXT, message
        content: dict[str, Any] = json.loads(message.data, parse_constant=_refuse)
        self.messages.append(content)
        return content

    async def until(self, fits: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
        """The next message that fits."""
        while True:
            message = await self.next()
            if fits(message):
                return message

    async def receive(self, kind: str) -> dict[str, Any]:
        """The next message of a kind."""
        return await self.until(lambda message: message["type"] == kind)

    async def send(self, **request: Any) -> None:
        """Ask for something."""
        await self.socket.send_str(json.dumps(request))

    def entries(self) -> list[dict[str, Any]]:
        """All entries that came."""
        return [entry for message in self.messages if message["type"] == "events" for entry in message["entries"]]

    def lost(self) -> int:
        """Return the number of entries that were reported lost."""
        return sum(message["lost"] for message in self.messages if message["type"] == "events")


def _refuse(text: str) -> float:
    raise AssertionError(f"{text} is no JSON")


@contextlib.asynccontextmanager
async def opened(url: str, **headers: str) -> AsyncIterator[OpenPage]:
    """A page of the server with an address such as `http://127.0.0.1:8066/?token=...`."""
    base = url.partition("/?")[0]
    async with aiohttp.ClientSession() as session:
        sent = {"Origin": base, **headers}
        async with session.ws_connect(f"{base}/stream", headers=sent, max_msg_size=2**26) as socket:
            yield OpenPage(socket)


def token_of(url: str) -> str:
    """The token of an address."""
    return url.partition("?token=")[2]
