"""Tests that clients that read slowly, or not at all, hold no connection for long.

Real sockets take as little as they like. The server's time stands still until a test has it pass.
"""

import asyncio
import base64
import contextlib
import json
import os
import socket
import threading
import time
from collections.abc import Callable, Coroutine, Iterator
from types import SimpleNamespace
from typing import Any

import aiohttp
import pytest

from robosc_bridge.daemon import served_endpoint
from robosc_bridge.daemon.states import OperatorCommand
from robosc_view import ViewEndpoint
from robosc_view import server as server_module
from robosc_view.server import BURST
from support.held_time import HeldLoop
from support.live import LiveRobot, large_model, supervisor_without_synthesis, viewed
from support.pages_open import LIMIT_S, opened
from support.waiting import eventually, wait_until

PLACES = 3
BEGIN_S = 1000.0


@pytest.fixture
def robot() -> LiveRobot:
    return LiveRobot(supervisor_without_synthesis(large_model(3)))


@pytest.fixture
def loop() -> HeldLoop:
    return HeldLoop(BEGIN_S)


@pytest.fixture
def endpoint(robot: LiveRobot, loop: HeldLoop, monkeypatch: pytest.MonkeyPatch) -> Iterator[ViewEndpoint]:
    def run(work: Coroutine[Any, Any, None]) -> None:
        with asyncio.Runner(loop_factory=lambda: loop) as runner:
            runner.run(work)

    monkeypatch.setattr(served_endpoint, "asyncio", SimpleNamespace(**{**vars(asyncio), "run": run}))
    monkeypatch.setattr(server_module, "MAXIMUM_CONNECTIONS", PLACES)
    with viewed(robot) as found:
        yield found


@contextlib.contextmanager
def connected(endpoint: ViewEndpoint) -> Iterator[socket.socket]:
    """A connection with next to no room for what is sent to it."""
    host, _, port = endpoint.address.rpartition(":")
    with socket.socket() as reader:
        reader.settimeout(LIMIT_S)
        reader.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        reader.connect((host, int(port)))
        yield reader


@contextlib.contextmanager
def slow(endpoint: ViewEndpoint) -> Iterator[socket.socket]:
    """A page that has taken the head of the answer, and nothing of what followed."""
    with connected(endpoint) as reader:
        key = base64.b64encode(os.urandom(16)).decode()
        lines = (
            "GET /stream HTTP/1.1",
            f"Host: {endpoint.address}",
            f"Origin: http://{endpoint.address}",
            "Upgrade: websocket",
            "Connection: Upgrade",
            "Sec-WebSocket-Version: 13",
            f"Sec-WebSocket-Key: {key}",
        )
        reader.sendall("\r\n".join((*lines, "", "")).encode())
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += reader.recv(1)
        assert head.startswith(b"HTTP/1.1 101")
        yield reader


def frame(**request: str) -> bytes:
    """A request as a browser sends it."""
    data, mask = json.dumps(request).encode(), os.urandom(4)
    return bytes([0x81, 0x80 | len(data)]) + mask + bytes(byte ^ mask[i % 4] for i, byte in enumerate(data))


def fill(endpoint: ViewEndpoint, robot: LiveRobot, pages: int, pass_by: Callable[[float], None]) -> None:
    """Send more than the buffers on the way hold, until the server has an unread message for each page."""
    note = {"time": time.time(), "kind": "device", "what": "x" * 280}
    end_s = time.monotonic() + LIMIT_S
    while sum(item.get_write_buffer_size() > 0 for item in tuple(endpoint._server._sockets.values())) < pages:
        assert time.monotonic() < end_s
        for _ in range(50):
            robot.feed.append(note)
        pass_by(server_module.BATCH_S)


def see_a_place(endpoint: ViewEndpoint, loop: HeldLoop) -> None:
    """A page can be opened again."""

    async def look() -> None:
        async with opened(endpoint.url) as page:
            arrival = asyncio.create_task(page.receive("update"))
            while not arrival.done():
                await asyncio.to_thread(loop.advance, server_module.BATCH_S)
            await arrival

    asyncio.run(look())


def check_full(endpoint: ViewEndpoint) -> None:
    """No page can be opened."""

    async def look() -> None:
        with pytest.raises(aiohttp.ClientError):
            async with opened(endpoint.url):
                pass

    asyncio.run(look())


@contextlib.contextmanager
def trickling(reader: socket.socket) -> Iterator[None]:
    """Takes a byte now and then."""
    end = threading.Event()

    def trickle() -> None:
        with contextlib.suppress(OSError):
            while not end.wait(0.02) and reader.recv(1):
                pass

    thread = threading.Thread(target=trickle)
    thread.start()
    try:
        yield
    finally:
        end.set()
        thread.join()


def check_cut_off(endpoint: ViewEndpoint, loop: HeldLoop) -> None:
    """A page that does not answer keeps its place for one and a half of the time after which it is asked."""
    # It is counted in whole seconds.
    loop.advance(BEGIN_S + 1.5 * server_module.PING_S - 2.0 - loop.time())
    assert len(endpoint._server._sockets) == PLACES
    check_full(endpoint)
    loop.advance(4.0)
    assert not endpoint._server._sockets
    see_a_place(endpoint, loop)


def test_those_who_take_nothing_give_their_places_back(
    endpoint: ViewEndpoint, robot: LiveRobot, loop: HeldLoop
) -> None:
    with contextlib.ExitStack() as stack:
        for _ in range(PLACES):
            stack.enter_context(slow(endpoint))
        fill(endpoint, robot, PLACES, loop.advance)
        check_cut_off(endpoint, loop)


def test_those_who_take_a_byte_now_and_then_do_so_too(endpoint: ViewEndpoint, robot: LiveRobot, loop: HeldLoop) -> None:
    with contextlib.ExitStack() as stack:
        readers = [stack.enter_context(slow(endpoint)) for _ in range(PLACES)]
        fill(endpoint, robot, PLACES, loop.advance)
        for reader in readers:
            stack.enter_context(trickling(reader))
        check_cut_off(endpoint, loop)


def test_those_who_ask_too_much_and_take_nothing_do_so_too(
    endpoint: ViewEndpoint, robot: LiveRobot, loop: HeldLoop
) -> None:
    with contextlib.ExitStack() as stack:
        readers = [stack.enter_context(slow(endpoint)) for _ in range(PLACES)]
        fill(endpoint, robot, PLACES, loop.advance)
        check_full(endpoint)
        begin_s = loop.time()
        for reader in readers:
            reader.sendall(frame(type="pause") * 3 * BURST)
        while endpoint._server._sockets:
            loop.advance(0.01)
        assert loop.time() - begin_s < server_module.PING_S / 2
        see_a_place(endpoint, loop)


def test_those_who_take_nothing_are_heard(endpoint: ViewEndpoint, robot: LiveRobot, loop: HeldLoop) -> None:
    with slow(endpoint) as reader:
        fill(endpoint, robot, 1, loop.advance)
        reader.sendall(frame(type="stop"))
        assert eventually(lambda: bool(robot.orders))
        assert [order.command for order in robot.orders] == [OperatorCommand.STOP]
        loop.advance(3 * server_module.PING_S)


def test_the_server_ends_beside_those_who_take_nothing(robot: LiveRobot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server_module, "_CLOSE_LIMIT_S", 0.1)
    monkeypatch.setattr(server_module, "BATCH_S", 0.001)
    with viewed(robot) as endpoint, slow(endpoint):
        fill(endpoint, robot, 1, time.sleep)
        endpoint.stop()
        # A busy machine may take longer for it than its stop waits.
        wait_until(lambda: not endpoint.is_alive)
