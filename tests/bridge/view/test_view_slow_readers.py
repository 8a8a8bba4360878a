"""Who reads slowly, or not at all, holds no connection for long: real sockets that take as little as they like."""

import asyncio
import base64
import contextlib
import json
import os
import socket
import threading
import time
from collections.abc import Iterator

import aiohttp
import pytest

from robosc_bridge.daemon.states import Command
from robosc_bridge.view import ViewFace
from robosc_bridge.view import server as server_module
from robosc_bridge.view.server import BURST
from support.live import LiveRobot, large_model, supervisor_without_synthesis, viewed
from support.pages_open import LIMIT_S, opened

PLACES = 3


@pytest.fixture
def robot() -> LiveRobot:
    return LiveRobot(supervisor_without_synthesis(large_model(3)))


@pytest.fixture
def face(robot: LiveRobot, monkeypatch: pytest.MonkeyPatch) -> Iterator[ViewFace]:
    monkeypatch.setattr(server_module, "PING_S", 1.0)
    monkeypatch.setattr(server_module, "_CLOSE_LIMIT_S", 0.3)
    monkeypatch.setattr(server_module, "MAXIMUM_CONNECTIONS", PLACES)
    with viewed(robot) as found:
        yield found


@contextlib.contextmanager
def connected(face: ViewFace) -> Iterator[socket.socket]:
    """A connection with next to no room for what is sent to it."""
    host, _, port = face.address.rpartition(":")
    with socket.socket() as reader:
        reader.settimeout(LIMIT_S)
        reader.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        reader.connect((host, int(port)))
        yield reader


@contextlib.contextmanager
def slow(face: ViewFace) -> Iterator[socket.socket]:
    """A page that has taken the head of the answer, and nothing of what followed."""
    with connected(face) as reader:
        key = base64.b64encode(os.urandom(16)).decode()
        lines = (
            "GET /stream HTTP/1.1",
            f"Host: {face.address}",
            f"Origin: http://{face.address}",
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


@contextlib.contextmanager
def telling(robot: LiveRobot) -> Iterator[None]:
    """More than the buffers on the way hold."""
    end = threading.Event()
    note = {"time": time.time(), "kind": "device", "what": "x" * 280}

    def tell() -> None:
        while not end.wait(0.005):
            for _ in range(50):
                robot.feed.tell(note)

    thread = threading.Thread(target=tell)
    thread.start()
    try:
        yield
    finally:
        end.set()
        thread.join()


def wait_for_a_place(face: ViewFace) -> None:
    """Until a page can be opened again."""

    async def look() -> None:
        async with asyncio.timeout(LIMIT_S):
            while True:
                with contextlib.suppress(aiohttp.ClientError):
                    async with opened(face.url) as page:
                        await page.told("update")
                        return
                await asyncio.sleep(0.02)

    asyncio.run(look())


def wait_for_unsent(face: ViewFace) -> None:
    """Until the server has something that nobody takes; on a slow machine it may have cut them off before that."""
    end_s = time.monotonic() + LIMIT_S
    while (transports := list(face._server._sockets.values())) and not any(
        item.get_write_buffer_size() for item in transports
    ):
        assert time.monotonic() < end_s
        time.sleep(0.01)


def check_full(face: ViewFace) -> None:
    """No page can be opened."""

    async def look() -> None:
        with pytest.raises(aiohttp.ClientError):
            async with opened(face.url):
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


def test_those_who_take_nothing_give_their_places_back(face: ViewFace, robot: LiveRobot) -> None:
    with contextlib.ExitStack() as stack:
        stack.enter_context(telling(robot))
        readers = [stack.enter_context(slow(face)) for _ in range(PLACES)]
        check_full(face)
        readers[0].sendall(frame(type="stop"))
        wait_for_a_place(face)
        assert [order.command for order in robot.orders] == [Command.STOP]


def test_those_who_take_a_byte_now_and_then_do_so_too(face: ViewFace, robot: LiveRobot) -> None:
    with contextlib.ExitStack() as stack:
        stack.enter_context(telling(robot))
        readers = [stack.enter_context(slow(face)) for _ in range(PLACES)]
        for reader in readers:
            stack.enter_context(trickling(reader))
        check_full(face)
        wait_for_a_place(face)


def test_those_who_ask_too_much_and_take_nothing_do_so_too(face: ViewFace, robot: LiveRobot) -> None:
    with contextlib.ExitStack() as stack:
        stack.enter_context(telling(robot))
        readers = [stack.enter_context(slow(face)) for _ in range(PLACES)]
        check_full(face)
        wait_for_unsent(face)
        for reader in readers:
            with contextlib.suppress(OSError):
                reader.sendall(frame(type="pause") * 3 * BURST)
        wait_for_a_place(face)


def test_the_server_ends_soon_beside_those_who_take_nothing(robot: LiveRobot) -> None:
    with contextlib.ExitStack() as stack:
        stack.enter_context(telling(robot))
        face = stack.enter_context(viewed(robot))
        stack.enter_context(slow(face))
        wait_for_unsent(face)
        face.stop()
        assert not face.is_alive
