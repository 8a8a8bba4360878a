"""A stand-in for the live view's server: it speaks the page's side of the stream, and says what a test wants."""

import asyncio
import json
import threading
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from aiohttp import WSMsgType, web

import robosc_view
from support.waiting import wait_until

PAGE = Path(robosc_view.__file__).parent / "page"
TOKEN = "a-token-of-this-start"
POLICY = "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
EMPTY_TOKEN = '<meta name="robosc-token" content="">'
KINDS = {".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
LIMIT_S = 20.0

Message = Mapping[str, Any]


def _latest_of(messages: Iterable[Message], before: Message | None = None) -> Message | None:
    """The update that counts after these messages; a definition makes the one before it void."""
    for message in messages:
        if message["type"] in ("definition", "update"):
            before = message if message["type"] == "update" else None
    return before


class StandIn:
    """The server, in a thread of its own; a context manager.

    Attributes:
        port: Port that it listens on; the same again after `away`.
        received: Messages that pages have sent, decoded.
        texts: The same as it came.
    """

    def __init__(self, greeting: list[Message]) -> None:
        self.received: list[Any] = []
        self.texts: list[str] = []
        self.port = 0
        self._greeting = greeting
        self._latest = _latest_of(greeting)
        self._sockets: set[web.WebSocketResponse] = set()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="stand-in", daemon=True)
        self._runner: web.AppRunner | None = None
        self._beating: asyncio.Task[None] | None = None
        self.is_beating = True

    @property
    def address(self) -> str:
        """Address of the page, for users without a token."""
        return f"http://127.0.0.1:{self.port}/"

    def __enter__(self) -> "StandIn":
        self._thread.start()
        self._do(self._open())
        return self

    def __exit__(self, *_: object) -> None:
        self.away()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(LIMIT_S)
        self._loop.close()

    def away(self) -> None:
        """Ends all connections and listens no more."""
        if self._runner is not None:
            self._do(self._close())

    def back(self) -> None:
        """Listens again, at the same port."""
        self._do(self._open())

    def greet(self, greeting: list[Message]) -> None:
        """Set the messages that every page that connects from now on receives first."""
        self._greeting = greeting
        self._latest = _latest_of(greeting)

    def send(self, *messages: Message) -> None:
        """Send to all pages, in this order."""
        self._do(self._send(messages))

    def send_text(self, text: str) -> None:
        """The same for what is perhaps no message."""
        self._do(self._send_texts([text]))

    def wait_for_messages(self, count: int) -> list[Any]:
        """All that pages have sent, once it is so many."""
        self._wait(lambda: len(self.received) >= count)
        return list(self.received)

    def wait_for_pages(self, count: int) -> None:
        """Until so many pages are connected."""
        self._wait(lambda: len(self._sockets) == count)

    def _wait(self, is_so: Callable[[], bool]) -> None:
        wait_until(is_so, heard=lambda: f"received: {self.received}")

    def _do(self, work: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(LIMIT_S)

    async def _open(self) -> None:
        application = web.Application()
        application.router.add_get("/", self._index)
        application.router.add_get("/page/{name}", self._asset)
        application.router.add_get("/stream", self._stream)
        self._runner = web.AppRunner(application, shutdown_timeout=1.0)
        await self._runner.setup()
        site = web.TCPSite(self._runner, "127.0.0.1", self.port, reuse_address=True)
        await site.start()
        self.port = self._runner.addresses[0][1]
        self._beating = asyncio.create_task(self._beat())

    async def _close(self) -> None:
        if self._beating is not None:
            self._beating.cancel()
        for socket in list(self._sockets):
            await socket.close()
        if self._runner is not None:
            await self._runner.cleanup()
        self._runner = None

    async def _index(self, request: web.Request) -> web.Response:
        text = (PAGE / "index.html").read_text(encoding="utf-8")
        if request.query.get("token") == TOKEN:
            assert text.count(EMPTY_TOKEN) == 1
            text = text.replace(EMPTY_TOKEN, EMPTY_TOKEN.replace('""', f'"{TOKEN}"'))
        return web.Response(text=text, content_type="text/html", headers={"Content-Security-Policy": POLICY})

    async def _asset(self, request: web.Request) -> web.Response:
        path = PAGE / request.match_info["name"]
        if path.parent != PAGE or not path.is_file():
            raise web.HTTPNotFound
        return web.Response(
            body=path.read_bytes(), content_type=KINDS[path.suffix], headers={"Content-Security-Policy": POLICY}
        )

    async def _stream(self, request: web.Request) -> web.WebSocketResponse:
        socket = web.WebSocketResponse(heartbeat=None)
        await socket.prepare(request)
        for message in self._greeting:
            await socket.send_str(json.dumps(message))
        self._sockets.add(socket)
        try:
            async for heard in socket:
                if heard.type is WSMsgType.TEXT:
                    self.texts.append(heard.data)
                    self.received.append(json.loads(heard.data))
        finally:
            self._sockets.discard(socket)
        return socket

    async def _beat(self) -> None:
        """Says the latest update again, so that a page knows that the server lives."""
        while True:
            await asyncio.sleep(0.5)
            if self.is_beating and self._latest is not None:
                await self._send_texts([json.dumps(self._latest)])

    async def _send(self, messages: tuple[Message, ...]) -> None:
        self._latest = _latest_of(messages, self._latest)
        await self._send_texts([json.dumps(message) for message in messages])

    async def _send_texts(self, texts: list[str]) -> None:
        for socket in list(self._sockets):
            for text in texts:
                await socket.send_str(text)
