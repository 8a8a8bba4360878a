"""Tests of access, by name, by page and by token; and of the bounds of requests."""

import asyncio
import contextlib
import socket
import ssl
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import aiohttp
import pytest

from robosc_api.security import ServerSecurity
from robosc_bridge.daemon.states import OperatorCommand
from robosc_bridge.daemon.view_settings import ViewSettings
from robosc_view import ViewEndpoint, ViewError
from robosc_view import broadcaster as hub_module
from robosc_view import server as server_module
from robosc_view.access import Access
from robosc_view.page_files import FOLDER, TOKEN_PLACE, read_page
from robosc_view.requests import MAXIMUM_BYTES
from robosc_view.server import BURST, MAXIMUM_VIEWERS, answer_headers
from support.certificates import Authority
from support.live import LiveRobot, large_model, supervisor_without_synthesis, viewed
from support.pages_open import LIMIT_S, opened, token_of
from support.view_servers import remotely_viewed
from support.waiting import until, wait_until


@pytest.fixture
def robot() -> LiveRobot:
    return LiveRobot(supervisor_without_synthesis(large_model(3)))


@pytest.fixture
def endpoint(robot: LiveRobot) -> Iterator[ViewEndpoint]:
    with viewed(robot) as found:
        yield found


def got(url: str, path: str, **headers: str) -> tuple[int, str, dict[str, str]]:
    """Status, text and headers of an answer."""

    async def ask() -> tuple[int, str, dict[str, str]]:
        async with (
            aiohttp.ClientSession() as session,
            session.get(url.partition("/?")[0] + path, headers=headers) as answer,
        ):
            return answer.status, await answer.text(), dict(answer.headers)

    return asyncio.run(ask())


def refused_status(url: str, **headers: str) -> int:
    """Return the HTTP status of a stream that is not opened."""

    async def ask() -> int:
        try:
            async with opened(url, **headers):
                return 101
        except aiohttp.WSServerHandshakeError as error:
            return error.status

    return asyncio.run(ask())


def test_the_token_stands_only_in_the_page_that_was_opened_with_it(endpoint: ViewEndpoint) -> None:
    token = token_of(endpoint.url)
    status, text, headers = got(endpoint.url, f"/?token={token}")
    assert status == 200
    assert TOKEN_PLACE.replace('""', f'"{token}"') in text
    assert {name: headers[name] for name in answer_headers()} == answer_headers()
    assert "no-store" in headers["Cache-Control"]
    status, text, _ = got(endpoint.url, "/")
    assert status == 200
    assert token not in text
    assert TOKEN_PLACE in text
    for wrong in ("x", token[:-1], f"{token}&token={token}", "%00", "x" * 3000):
        status, text, headers = got(endpoint.url, f"/?token={wrong}")
        assert status == 403
        assert token not in text
        assert headers["Referrer-Policy"] == "no-referrer"


def test_each_start_has_another_token(robot: LiveRobot) -> None:
    with viewed(robot) as one, viewed(robot) as other:
        assert token_of(one.url) != token_of(other.url)
        assert len(token_of(one.url)) >= 43


def test_only_the_files_of_the_page_are_served(endpoint: ViewEndpoint) -> None:
    for name, (kind, data) in read_page().assets.items():
        status, text, headers = got(endpoint.url, f"/page/{name}")
        assert (status, text) == (200, data.decode())
        assert headers["Content-Type"].startswith(kind)
        assert headers["X-Content-Type-Options"] == "nosniff"
    paths = ["/page/index.html", "/page/../server.py", "/page/..%2fserver.py", "/page/%2e%2e/server.py", "/page/", "/x"]
    for path in [*paths, "/page/main.js%00", "//etc/passwd", "/stream/"]:
        assert got(endpoint.url, path)[0] == 404, path
    assert FOLDER.is_dir()


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1", "localhost:1", "[::1", "", "1.2.3.4:{port}"]
)
def test_another_name_is_not_answered(endpoint: ViewEndpoint, host: str) -> None:
    port = endpoint.address.rpartition(":")[2]
    status, text, _ = got(endpoint.url, "/", Host=host.format(port=port))
    assert status in (400, 421), host
    assert TOKEN_PLACE not in text
    assert refused_status(endpoint.url, Host=host.format(port=port)) in (400, 421, 403)


def test_names_of_this_machine_are_answered(endpoint: ViewEndpoint) -> None:
    port = endpoint.address.rpartition(":")[2]
    for name in ("localhost", "127.0.0.1", "LOCALHOST", "[::1]"):
        assert got(endpoint.url, "/", Host=f"{name}:{port}")[0] == 200


def test_a_stream_is_for_pages_of_this_server(endpoint: ViewEndpoint) -> None:
    base = endpoint.url.partition("/?")[0]
    assert refused_status(endpoint.url) == 101
    for origin in ("http://evil.example", "null", base.replace("http", "https"), f"{base}0", f"{base}/", ""):
        assert refused_status(endpoint.url, Origin=origin) == 403, origin


def test_a_server_beyond_this_machine_takes_numbers_and_its_own_names() -> None:
    access = Access("0.0.0.0", 8066, is_secure=True, names=["robot.example"])
    for host in ("192.168.1.7:8066", "robot.example:8066", "[fe80::1]:8066", f"{socket.gethostname()}:8066"):
        assert access.is_ours(host), host
    foreign = ("evil.example:8066", "192.168.1.7", "robot.example:8067", None, "", "a b:8066", "robot.example:8066:1")
    for other in foreign:
        assert not access.is_ours(other), other
    assert access.is_own_page("https://robot.example:8066", "robot.example:8066")
    assert not access.is_own_page("http://robot.example:8066", "robot.example:8066")
    assert access.address.startswith("https://127.0.0.1:8066/?token=")
    assert Access("example.org", 443, is_secure=True).is_ours("example.org")


@pytest.mark.parametrize("token", [None, "", "x", 7, ["x"], "é" * 43, "x" * 10**3])
async def test_a_command_needs_the_token_and_a_stop_none(
    endpoint: ViewEndpoint, robot: LiveRobot, token: object
) -> None:
    async with opened(endpoint.url) as page:
        await page.send(type="command", command="standby", token=token)
        answer = await page.receive("refused")
        assert answer["what"] == "standby"
        assert "token" in answer["why"]
        await page.send(type="stop")
        assert (await page.receive("done"))["what"] == "stop"
    assert [order.command for order in robot.orders] == [OperatorCommand.STOP]


async def test_with_the_token_the_robot_is_commanded(endpoint: ViewEndpoint, robot: LiveRobot) -> None:
    async with opened(endpoint.url) as page:
        for command in ("standby", "start", "resume", "reset"):
            await page.send(type="command", command=command, token=token_of(endpoint.url))
            assert (await page.receive("done"))["what"] == command
        robot.refusal = "the motors are hot"
        await page.send(type="command", command="start", token=token_of(endpoint.url))
        assert (await page.receive("refused"))["why"] == "the motors are hot"
    assert [str(order.command) for order in robot.orders] == ["standby", "start", "resume", "reset", "start"]
    assert all("127.0.0.1" in order.by for order in robot.orders)


async def test_a_command_is_taken_back_when_its_page_leaves(endpoint: ViewEndpoint, robot: LiveRobot) -> None:
    robot.refusal = None  # The command is not answered.
    async with opened(endpoint.url) as page:
        await page.send(type="command", command="resume", token=token_of(endpoint.url))
        await until(lambda: bool(robot.orders))
    await until(lambda: len(robot.orders) == 2)
    assert [order.command for order in robot.orders] == [OperatorCommand.RESUME, OperatorCommand.STOP]


WRONG: list[Any] = [
    "",
    "x",
    "[]",
    "3",
    "[" * 4000,
    '{"type":"seek"}',
    '{"type":"seek","time_s":NaN}',
    '{"type":"play","speed":true}',
    '{"type":"play","speed":0}',
    '{"type":"play","speed":1e400}',
    '{"type":"command","command":"quit","token":"x"}',
    '{"type":"command","command":["stop"]}',
    '{"type":["stop"]}',
    '{"type":"seek","time_s":5}',
    '{"type":"pause"}',
]


async def test_what_makes_no_sense_is_refused_and_nothing_more(
    endpoint: ViewEndpoint, robot: LiveRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hub_module, "SIGN_OF_LIFE_S", 0.02)
    async with opened(endpoint.url) as page:
        for text in WRONG:
            await page.socket.send_str(text)
            answer = await page.receive("refused")
            assert answer["why"].isprintable()
        await page.receive("update")
    assert robot.orders == []


def test_large_binary_and_too_many_requests_end_the_stream(
    endpoint: ViewEndpoint, robot: LiveRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    # However slowly they come: what is allowed after a burst is none of this test.
    monkeypatch.setattr(server_module, "REQUESTS_A_S", 0.0)
    # It is not cut off while it has still to read why.
    monkeypatch.setattr(server_module, "_CLOSE_LIMIT_S", LIMIT_S)

    async def code(*sent: Any) -> int | None:
        async with opened(endpoint.url) as page:
            for item in sent:
                await (page.socket.send_bytes(item) if isinstance(item, bytes) else page.socket.send_str(item))
            while True:
                message = await asyncio.wait_for(page.socket.receive(), 20)
                if message.type is not aiohttp.WSMsgType.TEXT:
                    return page.socket.close_code

    assert asyncio.run(code("x" * (MAXIMUM_BYTES + 1))) == aiohttp.WSCloseCode.MESSAGE_TOO_BIG
    assert asyncio.run(code(b"x")) == aiohttp.WSCloseCode.UNSUPPORTED_DATA
    assert asyncio.run(code(*['{"type":"pause"}'] * (3 * BURST))) == aiohttp.WSCloseCode.POLICY_VIOLATION
    # Each stop of one who hammers on the button counts, as long as the stream is open.
    assert asyncio.run(code(*['{"type":"stop"}'] * (3 * BURST))) == aiohttp.WSCloseCode.POLICY_VIOLATION
    assert len(robot.orders) >= BURST
    assert {order.command for order in robot.orders} == {OperatorCommand.STOP}


async def test_a_stop_of_a_page_that_closes_at_once_counts(endpoint: ViewEndpoint, robot: LiveRobot) -> None:
    async with opened(endpoint.url) as page:
        await page.send(type="stop")
    await until(lambda: bool(robot.orders))


def test_there_is_a_limit_of_pages_and_of_connections(
    endpoint: ViewEndpoint, robot: LiveRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def pages() -> None:
        monkeypatch.setattr(server_module, "MAXIMUM_VIEWERS", 3)
        monkeypatch.setattr(server_module, "RESERVED_VIEWERS", 0)
        async with opened(endpoint.url), opened(endpoint.url), opened(endpoint.url):
            with pytest.raises(aiohttp.WSServerHandshakeError) as error:
                async with opened(endpoint.url):
                    pass
            assert error.value.status == 503
        # A place is free again once the server has seen that a page has left, which is a moment later.
        async with asyncio.timeout(LIMIT_S), contextlib.AsyncExitStack() as stack:
            page = None
            while page is None:
                try:
                    page = await stack.enter_async_context(opened(endpoint.url))
                except aiohttp.WSServerHandshakeError as error:
                    assert error.status == 503
                    await asyncio.sleep(0.005)
            await page.receive("update")

    asyncio.run(pages())
    assert MAXIMUM_VIEWERS > 3
    runner = endpoint._server._runner
    assert runner is not None
    # Connections of pages that still end would take the places of the next two.
    wait_until(lambda: runner.server is not None and not runner.server.connections)
    monkeypatch.setattr(server_module, "MAXIMUM_CONNECTIONS", 2)
    host, _, port = endpoint.address.rpartition(":")
    # A connection that asks for nothing gives way to one that asks.
    with socket.create_connection((host, int(port))) as first, socket.create_connection((host, int(port))):
        assert got(endpoint.url, "/")[0] == 200
        first.settimeout(LIMIT_S)
        with contextlib.suppress(ConnectionResetError):
            assert first.recv(1) == b""


async def test_connections_that_come_at_once_give_way_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server_module, "MAXIMUM_CONNECTIONS", 1)
    monkeypatch.setattr(server_module, "_SWEEP_S", 0.01)
    async with remotely_viewed("127.0.0.1:1") as server:
        host, _, port = server.address.rpartition(":")
        # The loop accepts both together, and knows the second before it has made the connection of the first.
        with socket.create_connection((host, int(port))) as first, socket.create_connection((host, int(port))):
            first.setblocking(False)
            async with asyncio.timeout(LIMIT_S):
                with contextlib.suppress(ConnectionResetError):
                    assert await asyncio.get_running_loop().sock_recv(first, 1) == b""


async def test_strangers_cannot_lock_out_who_has_the_token(
    endpoint: ViewEndpoint, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server_module, "MAXIMUM_VIEWERS", 4)
    monkeypatch.setattr(server_module, "RESERVED_VIEWERS", 1)
    monkeypatch.setattr(server_module, "VIEWERS_OF_HOST", 2)
    base, _, token = endpoint.url.partition("/?token=")
    async with opened(endpoint.url), opened(endpoint.url), aiohttp.ClientSession() as session:
        with pytest.raises(aiohttp.WSServerHandshakeError) as error:
            async with opened(endpoint.url):
                pass
        assert error.value.status == 503
        async with session.get(f"{base}/places") as answer:
            assert answer.status == 503
            assert (await answer.text()).startswith("full")
        async with session.get(f"{base}/places?token={token}") as answer:
            assert answer.status == 204
        stream = f"{base}/stream?token={token}"
        async with session.ws_connect(stream, headers={"Origin": base}) as known:
            assert not known.closed
    assert not endpoint._server._strangers or endpoint._server._strangers.total() <= 2


def test_who_asks_for_nothing_is_cut_off(robot: LiveRobot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server_module, "REQUEST_LIMIT_S", 0.3)
    with viewed(robot) as endpoint:
        host, _, port = endpoint.address.rpartition(":")
        for sent in (b"", b"GET / HTTP/1.1\r\nHost: 127.0"):
            with socket.create_connection((host, int(port))) as silent:
                silent.settimeout(20)
                silent.sendall(sent)
                with contextlib.suppress(ConnectionResetError):
                    assert silent.recv(1) == b""


def test_with_tls(robot: LiveRobot, tmp_path: Path) -> None:
    authority = Authority(tmp_path)
    certificate, key = authority.sign("localhost")
    settings = ViewSettings("127.0.0.1:0", ServerSecurity(certificate=certificate, key=key))
    endpoint = ViewEndpoint(robot.operations, settings)
    endpoint.start()
    try:
        assert endpoint.url.startswith("https://")
        port = int(endpoint.address.rpartition(":")[2])
        context = ssl.create_default_context(cafile=str(authority.file))
        with (
            socket.create_connection(("127.0.0.1", port)) as plain,
            context.wrap_socket(plain, server_hostname="localhost") as secure,
        ):
            secure.sendall(f"GET / HTTP/1.1\r\nHost: localhost:{port}\r\n\r\n".encode())
            assert secure.recv(20).startswith(b"HTTP/1.1 200")
    finally:
        endpoint.stop()


def test_where_it_must_not_or_cannot_listen(robot: LiveRobot, tmp_path: Path) -> None:
    def why(settings: ViewSettings) -> str:
        endpoint = ViewEndpoint(robot.operations, settings)
        with pytest.raises(ViewError) as error:
            endpoint.start()
        assert not endpoint.is_alive
        endpoint.stop()
        return str(error.value)

    assert "is reachable from other machines" in why(ViewSettings("0.0.0.0:0"))
    assert "HOST:PORT" in why(ViewSettings("nonsense"))
    missing = ServerSecurity(certificate=tmp_path / "none.pem", key=tmp_path / "none.key")
    assert "none.pem" in why(ViewSettings("127.0.0.1:0", missing))
    with viewed(robot) as endpoint:
        assert "in use" in why(ViewSettings(endpoint.address))
    insecure = ServerSecurity(insecure_beyond_loopback=True)
    endpoint = ViewEndpoint(robot.operations, ViewSettings("0.0.0.0:0", insecure))
    endpoint.start()
    endpoint.stop()
    endpoint.stop()
    assert not endpoint.is_alive
