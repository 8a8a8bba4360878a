"""The server of the live view: the page's files over HTTP, and a WebSocket for each page that is open.

It never trusts who connects: sizes, times, connections and requests are bounded, and what moves the robot needs the
token of this start. A stop alone needs none, and waits for nobody: a reader that is slow is sent less, and heard all
the same.
"""

import asyncio
import contextlib
import logging
import os
import ssl
from collections import Counter
from collections.abc import Awaitable, Callable, Sequence
from typing import Any

from aiohttp import WSCloseCode, WSMsgType, web

from robosc_api.security import SecurityError, ServerSecurity, check_files, check_listening, joined
from robosc_api.security.addresses import split_address
from robosc_bridge.daemon.states import OperatorCommand
from robosc_bridge.daemon.view_settings import ViewSettings
from robosc_view.access import Access
from robosc_view.broadcaster import Broadcaster, RobotCache, Viewer
from robosc_view.definition import Robot
from robosc_view.messages import done_text, refused_text
from robosc_view.page_files import PageFiles, read_page
from robosc_view.requests import (
    MAXIMUM_BYTES,
    MAXIMUM_LED_BYTES,
    LoadModel,
    ManualSource,
    RobotCommand,
    RunCommand,
    Stop,
    parse_request,
)
from robosc_view.sources import RefusedError, ReplayCommand, Source, ViewError

_log = logging.getLogger(__name__)

MAXIMUM_VIEWERS = 32
"""Pages that are open at the same time."""

RESERVED_VIEWERS = 8
"""Places among them that only pages with the token get: strangers cannot lock out whoever leads the robot."""

VIEWERS_OF_HOST = 12
"""Pages without the token that one host may have open."""

MAXIMUM_CONNECTIONS = 128
"""At the same time, those of pages among them."""

_FULL = "full: as many pages are open as may be; a page with the token of this start has places of its own\n"

MAXIMUM_WAITING = 4
"""Commands of one page that wait for their answer; stops are not counted."""

REQUESTS_A_S, BURST = 20.0, 60
"""Maximum requests of one page per second, and at once, besides stops; a page that sends more is cut off."""

REQUEST_LIMIT_S = 10.0
"""Time for a request to be sent, and for a WebSocket to be opened."""

SEND_LIMIT_S = 30.0
"""A page that has no room for its next message for so long is cut off."""

PING_S = 10.0
"""A page of which nothing came for so long is sent a ping, and is gone unless it answers within half of that time."""

BATCH_S = 0.02
"""Least time between two batches of messages to a page."""

HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}

_BACKLOG = 16
_SWEEP_S = 1.0
_CLOSE_LIMIT_S = 2.0


def answer_headers(framed_by: Sequence[str] = ()) -> dict[str, str]:
    """Return the headers of every answer.

    Args:
        framed_by: Origins, or schemes with their colon, whose pages may show this one in a frame.
    """
    around = " ".join(framed_by) or "'none'"
    policy = f"default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors {around}; object-src 'none'"
    # Beside some it could not be said who may: the newer header says it then, alone.
    older = {} if framed_by else {"X-Frame-Options": "DENY"}
    return {**HEADERS, "Content-Security-Policy": policy, **older}


_Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class ViewServer:
    """Server of one source; lives in one event loop.

    Args:
        settings: Settings of the server.
        source: Function that returns the source; called for each page if each has a replay of its own, else once.
        is_shared: True if all pages share one source.
        robot: Robot that will be shown, if it is known: its drawings are made now, before anything moves.

    Attributes:
        address: `HOST:PORT` that it listens on; empty: it does not listen yet.
        url: URL to open in a browser, with the token.
    """

    def __init__(
        self, settings: ViewSettings, source: Callable[[], Source], *, is_shared: bool, robot: Robot | None = None
    ) -> None:
        self.address = self.url = ""
        self._settings = settings
        self._headers = answer_headers(settings.framed_by)
        self._source = source
        self._robot_cache = RobotCache(robot)
        self._shared = Broadcaster(source(), self._robot_cache) if is_shared else None
        self._broadcasters: set[Broadcaster] = set()
        self._page: PageFiles | None = None
        self._access: Access | None = None
        self._runner: web.AppRunner | None = None
        self._server: asyncio.Server | None = None
        self._sweep: asyncio.Task[None] | None = None
        self._silent: dict[Any, float] = {}
        self._ending: dict[Any, float] = {}
        self._viewers = 0
        self._strangers: Counter[str] = Counter()
        self._sockets: dict[web.WebSocketResponse, asyncio.Transport] = {}

    async def start(self) -> None:
        """Listen.

        Raises:
            ViewError: The server cannot listen.
        """
        settings = self._settings
        self._page = read_page()
        try:
            check_listening(settings.address, settings.security)
            check_files(settings.security)
            host, port = split_address(settings.address)
        except (SecurityError, ValueError) as error:
            raise ViewError(f"the live view: {error}") from error
        context = tls_context(settings.security)
        app = web.Application(middlewares=[self._guarded], client_max_size=MAXIMUM_BYTES)
        app.router.add_get("/", self._index, allow_head=False)
        app.router.add_get("/page/{name}", self._asset, allow_head=False)
        app.router.add_get("/stream", self._stream, allow_head=False)
        app.router.add_get("/places", self._places, allow_head=False)
        self._runner = web.AppRunner(
            app,
            access_log=None,
            handle_signals=False,
            keepalive_timeout=REQUEST_LIMIT_S,
            shutdown_timeout=_CLOSE_LIMIT_S,
        )
        await self._runner.setup()
        loop = asyncio.get_running_loop()
        try:
            self._server = await loop.create_server(
                self._connected,
                host,
                port,
                ssl=context,
                backlog=_BACKLOG,
                ssl_handshake_timeout=None if context is None else REQUEST_LIMIT_S,
                ssl_shutdown_timeout=None if context is None else _CLOSE_LIMIT_S,
            )
        except OSError as error:
            await self._runner.cleanup()
            raise ViewError(f"the live view cannot listen on {settings.address}: {_os_text(error)}") from error
        bound = self._server.sockets[0].getsockname()[1]
        self._access = Access(host, bound, is_secure=context is not None, names=settings.names)
        self.address = joined(host, bound)
        self.url = self._access.address
        self._sweep = asyncio.create_task(self._sweep_up())

    async def stop(self) -> None:
        """End every connection and close the port."""
        if self._sweep is not None:
            self._sweep.cancel()
        if self._server is not None:
            self._server.close()
        for broadcaster in {*self._broadcasters, *([self._shared] if self._shared else [])}:
            await broadcaster.close()
        closing = [_close(socket, WSCloseCode.GOING_AWAY, b"the server ends") for socket in self._sockets]
        await asyncio.gather(*closing, return_exceptions=True)
        for transport in self._sockets.values():
            transport.abort()
        if self._runner is not None:
            await self._runner.cleanup()

    # Connections

    def _connected(self) -> asyncio.Protocol:
        """A protocol for one more connection, or one that ends it at once."""
        assert self._runner is not None  # noqa: S101  # Connections come only after `start`.
        server = self._runner.server
        # Those that were accepted just now are no connections of the server's yet.
        if server is None:
            return _RefusedConnection()
        if len({*server.connections, *self._silent}) >= MAXIMUM_CONNECTIONS:
            if not self._silent or len(self._ending) >= MAXIMUM_CONNECTIONS:
                return _RefusedConnection()
            # The one that has asked for nothing for the longest gives way: a page asks at once.
            self._cut_off(next(iter(self._silent)))
        handler = server()
        self._silent[handler] = asyncio.get_running_loop().time() + REQUEST_LIMIT_S
        return handler

    async def _sweep_up(self) -> None:
        """End connections without a request."""
        loop = asyncio.get_running_loop()
        while True:
            await asyncio.sleep(_SWEEP_S)
            for handler in [item for item, until_s in self._silent.items() if until_s < loop.time()]:
                self._cut_off(handler)
            for handler, until_s in tuple(self._ending.items()):
                if handler.transport is not None:
                    handler.transport.abort()
                if handler.transport is not None or until_s < loop.time():
                    del self._ending[handler]

    def _cut_off(self, handler: Any) -> None:
        """End a connection without a request."""
        del self._silent[handler]
        handler.force_close()
        if handler.transport is None:
            # Its connection is being made, or TLS agreed upon: a sweep ends it afterwards.
            self._ending[handler] = asyncio.get_running_loop().time() + REQUEST_LIMIT_S
        else:
            handler.transport.abort()

    # Requests

    @web.middleware
    async def _guarded(self, request: web.Request, handler: _Handler) -> web.StreamResponse:
        self._silent.pop(request.protocol, None)
        try:
            if self._access is None or not self._access.is_ours(request.headers.get("Host")):
                raise web.HTTPMisdirectedRequest(text="this server is not reached by that name\n")
            response = await handler(request)
        except web.HTTPException as error:
            response = error
        if not response.prepared:
            response.headers.update(self._headers)
            response.headers["Server"] = "RoboSC"
            # One request a connection: none can be held without asking for something.
            response.force_close()
        if isinstance(response, web.HTTPException):
            raise response
        return response

    async def _index(self, request: web.Request) -> web.StreamResponse:
        assert self._page is not None and self._access is not None  # noqa: S101
        shown = request.query.getall("token", [])
        if shown and not (len(shown) == 1 and self._access.is_token(shown[0])):
            text = "that is not the token of this start: open the address that the server has printed\n"
            raise web.HTTPForbidden(text=text)
        text = self._page.with_token(self._access.token) if shown else self._page.index
        return web.Response(text=text, content_type="text/html")

    async def _asset(self, request: web.Request) -> web.StreamResponse:
        assert self._page is not None  # noqa: S101
        found = self._page.assets.get(request.match_info["name"])
        if found is None:
            raise web.HTTPNotFound(text="there is no such file\n")
        return web.Response(body=found[1], content_type=found[0], charset="utf-8")

    async def _stream(self, request: web.Request) -> web.StreamResponse:
        assert self._access is not None  # noqa: S101
        if not self._access.is_own_page(request.headers.get("Origin"), request.headers.get("Host")):
            raise web.HTTPForbidden(text="only a page of this server may open a stream\n")
        host = str(request.remote)
        is_known = self._access.is_token(request.query.get("token"))
        if not self._has_place(host, is_known=is_known):
            raise web.HTTPServiceUnavailable(text=_FULL)
        self._viewers += 1
        if not is_known:
            self._strangers[host] += 1
        broadcaster = self._shared or Broadcaster(self._source(), self._robot_cache)
        self._broadcasters.add(broadcaster)
        try:
            return await self._serve(request, broadcaster)
        finally:
            self._viewers -= 1
            if not is_known:
                self._strangers[host] -= 1
                self._strangers += Counter()  # Drops those without a page.
            if not broadcaster.is_watched:
                self._broadcasters.discard(broadcaster)

    def _has_place(self, host: str, *, is_known: bool) -> bool:
        """Return True if one more page of a host may open a stream.

        Args:
            host: Address of the page.
            is_known: True if the page has the token.
        """
        if is_known:
            return self._viewers < MAXIMUM_VIEWERS
        places = MAXIMUM_VIEWERS - RESERVED_VIEWERS
        return self._strangers.total() < places and self._strangers[host] < VIEWERS_OF_HOST

    async def _places(self, request: web.Request) -> web.StreamResponse:
        """Answer a page whose stream did not open whether there is a place: it cannot read the answer to the stream."""
        assert self._access is not None  # noqa: S101
        is_known = self._access.is_token(request.query.get("token"))
        if not self._has_place(str(request.remote), is_known=is_known):
            raise web.HTTPServiceUnavailable(text=_FULL)
        return web.Response(status=204)

    async def _serve(self, request: web.Request, broadcaster: Broadcaster) -> web.StreamResponse:
        largest = MAXIMUM_LED_BYTES if isinstance(broadcaster.source, ManualSource) else MAXIMUM_BYTES
        page = web.WebSocketResponse(max_msg_size=largest, compress=False, heartbeat=PING_S, autoping=True)
        page.headers.update(self._headers)
        await page.prepare(request)
        # Kept, since the request forgets it when the connection ends.
        transport = request.transport
        if transport is None:
            return page  # It has ended already.
        self._sockets[page] = transport
        viewer = broadcaster.join()
        session = _Session(page, viewer, broadcaster.source, self._access, str(request.remote))
        writing = asyncio.create_task(_write(page, viewer, transport))
        try:
            await session.read()
        finally:
            del self._sockets[page]
            writing.cancel()
            session.close()
            await asyncio.gather(writing, return_exceptions=True)
            await broadcaster.leave(viewer)
            # One that is only closed stays until everything was sent, which a page that reads nothing never lets be.
            if transport.get_write_buffer_size() > 0:
                transport.abort()
        return page


class _RefusedConnection(asyncio.Protocol):
    """Ends a connection for which there is no place."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        transport.abort()  # type: ignore[attr-defined]


async def _write(page: web.WebSocketResponse, viewer: Viewer, transport: asyncio.Transport) -> None:
    """Send what there is, as fast as the page reads."""
    try:
        while not page.closed:
            for text in await viewer.take():
                async with asyncio.timeout(SEND_LIMIT_S):
                    await page.send_str(text)
            await asyncio.sleep(BATCH_S)
    except (ConnectionError, RuntimeError):
        pass  # It has gone.
    except TimeoutError:
        transport.abort()


async def _close(page: web.WebSocketResponse, code: WSCloseCode, why: bytes) -> None:
    """End a stream; a page that does not even take that is not waited for."""
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(_CLOSE_LIMIT_S):
            await page.close(code=code, message=why)


class _Session:
    """Requests of one page."""

    def __init__(
        self, page: web.WebSocketResponse, viewer: Viewer, source: Source, access: Access | None, by: str
    ) -> None:
        self._page = page
        self._viewer = viewer
        self._source = source
        self._access = access
        self._by = f"live view at {by}"
        self._tasks: set[asyncio.Task[None]] = set()
        self._stops: set[asyncio.Task[None]] = set()
        self._left = float(BURST)
        self._last_s = asyncio.get_running_loop().time()

    async def read(self) -> None:
        """Carry out the requests of the page, until it leaves."""
        async for message in self._page:
            if message.type is not WSMsgType.TEXT:
                await _close(self._page, WSCloseCode.UNSUPPORTED_DATA, b"only texts are understood")
                return
            if not self._take(message.data):
                await _close(self._page, WSCloseCode.POLICY_VIOLATION, b"too many requests")
                return

    def close(self) -> None:
        """Revoke the commands of a page that has left and that wait for an answer; a stop is never revoked."""
        for task in (*self._tasks, *self._stops):
            task.cancel()

    def _take(self, text: str) -> bool:
        """Begin what a message requests; False: the page requests too much."""
        try:
            wanted = parse_request(text)
        except RefusedError as error:
            self._viewer.answer(refused_text("request", str(error)))
            return self._is_in_time()
        match wanted:
            case Stop():
                self._stop()
            case RobotCommand(command=command, token=token):
                self._order(command, token)
            case command:
                try:
                    if not isinstance(command, ReplayCommand):
                        self._submit(command)
                    else:
                        self._source.control_replay(command)
                except RefusedError as error:
                    self._viewer.answer(refused_text(type(command).__name__.lower(), str(error)))
        return self._is_in_time()

    def _submit(self, command: RunCommand) -> None:
        if not isinstance(self._source, ManualSource):
            raise RefusedError("nothing here is stepped by hand: only a model alone is")
        if isinstance(command, LoadModel) and (self._access is None or not self._access.is_token(command.token)):
            raise RefusedError(
                "a model of a link needs the token of this start: put what follows # behind the address that the "
                "server has printed, or start robosc view with the link"
            )
        self._source.submit(command)

    def _order(self, command: OperatorCommand, token: object) -> None:
        if self._access is None or not self._access.is_token(token):
            why = "this needs the token of this start: open the page by the address that the server has printed"
        elif len(self._tasks) >= MAXIMUM_WAITING:
            why = "other commands wait for their answer"
        else:
            self._start(command)
            return
        self._viewer.answer(refused_text(str(command), why))

    def _stop(self) -> None:
        # Handed over before anything else is looked at: also of a page that is closed at once.
        task = asyncio.Task(self._do(OperatorCommand.STOP), loop=asyncio.get_running_loop(), eager_start=True)
        if not task.done():
            self._stops.add(task)
            task.add_done_callback(self._stops.discard)

    def _start(self, command: OperatorCommand) -> None:
        task = asyncio.create_task(self._do(command))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _do(self, command: OperatorCommand) -> None:
        try:
            await self._source.order(command, self._by)
        except RefusedError as error:
            self._viewer.answer(refused_text(str(command), str(error)))
        except Exception as error:
            _log.exception("%s wanted: %s", self._by, command)
            self._viewer.answer(refused_text(str(command), f"it has failed: {type(error).__name__}"))
        else:
            self._viewer.answer(done_text(str(command)))

    def _is_in_time(self) -> bool:
        now_s = asyncio.get_running_loop().time()
        self._left = min(self._left + (now_s - self._last_s) * REQUESTS_A_S, BURST) - 1.0
        self._last_s = now_s
        return self._left >= 0.0


def tls_context(security: ServerSecurity) -> ssl.SSLContext | None:
    """Return the TLS context with which the server identifies itself; None: no TLS.

    Raises:
        ViewError: A file cannot be used.
    """
    if security.certificate is None or security.key is None:
        return None
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        context.load_cert_chain(security.certificate, security.key)
    except (OSError, ssl.SSLError) as error:
        raise ViewError(f"{security.certificate} and {security.key} cannot be used: {error}") from error
    return context


def _os_text(error: OSError) -> str:
    """Return what went wrong, without the words that asyncio puts around it."""
    return os.strerror(error.errno) if error.errno else str(error)
