"""Stops towards a bridge that answers late or not at all: few are under way, and none is lost."""

import asyncio
import contextlib
import threading
from collections.abc import AsyncIterator, Iterator

import pytest

from robosc_bridge.daemon.states import OperatorCommand
from robosc_bridge.remote import RemoteSettings, serve
from robosc_bridge.terminal import client
from robosc_view import remote_bridge
from support.live import LiveRobot, large_model, supervisor_without_synthesis
from support.pages_open import LIMIT_S, OpenPage, opened
from support.view_servers import remotely_viewed
from support.waiting import until, wait_until

MOST_THREADS = 12


class Gate:
    """A way to an address on which nothing gets through while it is shut.

    Args:
        address: `HOST:PORT`.

    Attributes:
        address: Address to connect to instead.
        connections: Number of connections that were made.
        is_open: Event that is set while anything gets through.
    """

    def __init__(self, address: str) -> None:
        self._to = address
        self.address = ""
        self.connections = 0
        self.is_open = asyncio.Event()
        self._passing: set[asyncio.Task[None]] = set()
        self._server: asyncio.Server | None = None

    @contextlib.asynccontextmanager
    async def standing(self) -> AsyncIterator["Gate"]:
        """While it stands."""
        server = await asyncio.start_server(self._pass, "127.0.0.1", 0)
        host, port = server.sockets[0].getsockname()
        self.address = f"{host}:{port}"
        self._server = server
        try:
            yield self
        finally:
            self.fall()
            await asyncio.gather(*self._passing, return_exceptions=True)

    def fall(self) -> None:
        """End every connection, and let no other one come."""
        if self._server is not None:
            self._server.close()
        for task in self._passing:
            task.cancel()

    def _pass(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.connections += 1
        self._passing.add(asyncio.create_task(self._copy(reader, writer)))

    async def _copy(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.closing(writer):
            await self.is_open.wait()
            host, _, port = self._to.partition(":")
            there, back = await asyncio.open_connection(host, int(port))
            with contextlib.closing(back):
                await asyncio.gather(_copied(reader, back), _copied(there, writer), return_exceptions=True)


async def _copied(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    try:
        while data := await reader.read(2**16):
            writer.write(data)
            await writer.drain()
    finally:
        writer.close()


@pytest.fixture
def robot() -> LiveRobot:
    # Those of an earlier test end when their connections have.
    wait_until(lambda: not asking())
    return LiveRobot(supervisor_without_synthesis(large_model(3)))


@pytest.fixture
def address(robot: LiveRobot) -> Iterator[str]:
    endpoint = serve(robot.operations, RemoteSettings("127.0.0.1:0"))
    try:
        yield endpoint.address
    finally:
        endpoint.stop()


def asking() -> int:
    """Threads in which the view asks a bridge."""
    return sum(thread.name == "live view asks" for thread in threading.enumerate())


async def until_stopped(robot: LiveRobot, count: int) -> None:
    await until(lambda: len(robot.orders) >= count)


async def until_connected(gate: Gate, count: int) -> None:
    await until(lambda: gate.connections >= count)


async def press(page: OpenPage, count: int) -> None:
    for _ in range(count):
        await page.send(type="stop")
    # An answer of the view itself, after which it has taken all of them.
    await page.send(type="nothing")
    await page.until(lambda message: message["type"] == "refused" and message["what"] == "request")


async def test_who_comes_and_goes_and_hammers_on_the_button_starts_few_threads(robot: LiveRobot, address: str) -> None:
    async with Gate(address).standing() as gate, remotely_viewed(gate.address) as server:
        for _ in range(12):
            async with opened(server.url) as page:
                await press(page, 40)
            assert asking() <= MOST_THREADS
        assert robot.orders == []
        # One stop of the pages that have left is heard, at least, and a page that stays has an answer.
        async with opened(server.url) as page:
            await press(page, 3)
            gate.is_open.set()
            await until_stopped(robot, 1)
            assert (await page.receive("done"))["what"] == "stop"
        assert {order.command for order in robot.orders} == {OperatorCommand.STOP}


async def test_a_stop_that_is_wanted_while_one_is_under_way_follows_it(
    robot: LiveRobot, address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(remote_bridge, "FOLLOW_S", LIMIT_S)
    async with Gate(address).standing() as gate, remotely_viewed(gate.address) as server:
        async with opened(server.url) as page:
            await press(page, 1)
            async with opened(server.url) as other:
                await press(other, 1)
            await press(page, 30)
            gate.is_open.set()
            await until_stopped(robot, 2)
            for _ in range(31):
                assert (await page.receive("done"))["what"] == "stop"
        # One for the first, and one for all who came after it, also for who has left.
        assert [order.command for order in robot.orders] == [OperatorCommand.STOP] * 2
        async with opened(server.url) as page:
            await page.send(type="stop")
            await until_stopped(robot, 3)


async def test_a_stop_that_hangs_holds_up_the_next_one_only_shortly(
    robot: LiveRobot, address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert remote_bridge.FOLLOW_S <= 0.5
    monkeypatch.setattr(remote_bridge, "FOLLOW_S", 0.01)
    # The time limit ends neither of them.
    monkeypatch.setattr(client, "STOP_LIMIT_S", 10 * LIMIT_S)
    async with Gate(address).standing() as gate, remotely_viewed(gate.address) as server, opened(server.url) as page:
        # The definition and a stop come first; then one after the other, each on a way of its own.
        for count in range(2, 5):
            await press(page, 1)
            await until_connected(gate, count)
        await press(page, 1)
        assert not any(message.get("what") == "stop" for message in page.messages)
        assert robot.orders == []
        # The page that wanted it learns in the end that the robot has not heard it.
        gate.fall()
        assert (await page.receive("refused"))["what"] == "stop"


async def test_who_comes_and_goes_asks_a_bridge_once_what_it_is(robot: LiveRobot, address: str) -> None:
    async with Gate(address).standing() as gate, remotely_viewed(gate.address) as server:
        for _ in range(30):
            async with opened(server.url):
                pass
        assert asking() <= 1
        async with opened(server.url) as page:
            gate.is_open.set()
            await page.receive("definition")
