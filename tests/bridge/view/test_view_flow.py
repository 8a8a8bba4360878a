"""Events of a robot of sixty components, through a real server: none is missed, and none comes twice."""

import asyncio
import contextlib
import json
import socket
import time
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager
from typing import Any

import pytest

from robosc.execution.runtime.event_log import plain
from robosc_bridge.remote import RemoteSettings, serve
from robosc_view import server as server_module
from robosc_view.broadcaster import MAXIMUM_EVENTS
from support.live import LiveRobot, large_model, supervisor_without_synthesis, viewed_meanwhile
from support.pages_open import LIMIT_S, OpenPage, opened
from support.view_servers import remotely_viewed

EVENTS = 150
# So many are under way at most: what comes is many batches, and no buffer on the way is full.
AHEAD = 10


def large_robot() -> LiveRobot:
    return LiveRobot(supervisor_without_synthesis(large_model(60)))


async def lived(page: OpenPage, robot: LiveRobot, count: int) -> list[str]:
    """Execute `count` events in a thread like that of the control loop, and return their names.

    Also receive everything that a page receives of them.
    """
    taken: list[str] = []
    while len(page.entries()) + page.lost() < count:
        if len(taken) < count and len(taken) - len(page.entries()) < AHEAD:
            taken.append(await asyncio.to_thread(robot.step))
        else:
            await page.next()
    return taken


async def seen(page: OpenPage, count: int) -> None:
    """All entries that were not lost."""
    while len(page.entries()) + page.lost() < count:
        await page.next()


def is_final(robot: LiveRobot) -> Callable[[dict[str, Any]], bool]:
    def fits(message: dict[str, Any]) -> bool:
        if message["type"] != "update":
            return False
        state = message["components"], message["communications"]
        return bool(
            json.loads(json.dumps(state)) == json.loads(json.dumps([plain(robot.system.state()), robot.locations()]))
        )

    return fits


def check_whole(page: OpenPage, robot: LiveRobot, taken: list[str]) -> None:
    entries = page.entries()
    assert [entry["event"] for entry in entries] == taken
    assert [entry["number"] for entry in entries] == list(range(1, len(taken) + 1))
    assert page.lost() == 0
    shown = page.messages[-1]
    names = [
        item.name for item in robot.supervisor.model.communications if f"{item.name}.request" in shown_requests(page)
    ]
    enabled = [f"{names[number]}.request" for number in robot.system.enabled_requests()]
    assert shown["enabled"] == enabled
    assert {item["event"] for item in shown["disabled"]} == set(shown_requests(page)) - set(enabled)
    assert all(item["why"] for item in shown["disabled"])


def shown_requests(page: OpenPage) -> list[str]:
    requests: list[str] = page.messages[0]["requests"]
    return requests


@contextlib.asynccontextmanager
async def viewed_over_grpc(robot: LiveRobot) -> AsyncIterator[str]:
    """Address of a view that is connected to a robot's bridge."""
    endpoint = serve(robot.operations, RemoteSettings("127.0.0.1:0"))
    try:
        async with remotely_viewed(endpoint.address) as server:
            yield server.url
    finally:
        endpoint.stop()


@contextlib.asynccontextmanager
async def viewed_here(robot: LiveRobot) -> AsyncIterator[str]:
    """Address of a bridge's own view."""
    async with viewed_meanwhile(robot) as endpoint:
        yield endpoint.url


@pytest.mark.parametrize("way", [viewed_here, viewed_over_grpc])
async def test_every_event_comes_once_and_in_its_order(
    way: Callable[[LiveRobot], AbstractAsyncContextManager[str]],
) -> None:
    robot = large_robot()
    async with way(robot) as url, opened(url) as page:
        assert (await page.next())["type"] == "definition"
        await page.receive("update")
        taken = await lived(page, robot, EVENTS)
        await page.until(is_final(robot))
        check_whole(page, robot, taken)


async def test_the_lit_transitions_lead_from_state_to_state() -> None:
    robot = large_robot()
    async with viewed_meanwhile(robot) as endpoint, opened(endpoint.url) as page:
        definition = await page.next()
        await page.receive("update")
        edges = {
            (component["name"], edge["id"]): edge
            for component in definition["components"]
            for edge in component["graph"]["edges"]
        }
        states = {name: part["state"] for name, part in robot.system.state().items()}
        await lived(page, robot, 60)
        lit = 0
        for entry in page.entries():
            for transition in entry["transitions"]:
                edge = edges[transition["component"], transition["id"]]
                # Events before the first one of a component cannot be known.
                assert edge["from"] == states[transition["component"]]
                states[transition["component"]] = edge["to"]
                lit += 1
        assert lit >= 40
        assert states == {name: part["state"] for name, part in robot.system.state().items()}


async def test_who_does_not_read_loses_entries_learns_how_many_and_is_heard_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # It is never silent for so long that it would be cut off.
    monkeypatch.setattr(server_module, "PING_S", 10 * LIMIT_S)
    monkeypatch.setattr(server_module, "SEND_LIMIT_S", 10 * LIMIT_S)
    robot = LiveRobot(supervisor_without_synthesis(large_model(3)))
    # So large that the buffers on the way hold few of them.
    note = {"time": time.time(), "kind": "device", "what": "x" * 250}
    count = 12 * MAXIMUM_EVENTS
    async with viewed_meanwhile(robot) as endpoint, opened(endpoint.url) as page:
        await page.receive("update")
        # No byte is taken off the connection from now on.
        connection = page.socket._response.connection
        assert connection is not None and connection.transport is not None
        connection.transport.pause_reading()
        for number in range(count):
            robot.feed.append(note)
            if number % 200 == 0:
                await asyncio.sleep(0.001)
        await page.send(type="stop")
        begin_s = time.monotonic()
        while not robot.orders:
            assert time.monotonic() - begin_s < LIMIT_S
            await asyncio.sleep(0.001)
        connection.transport.resume_reading()
        await seen(page, count)
        numbers = [entry["number"] for entry in page.entries()]
        assert page.lost() > 0
        assert numbers == sorted(set(numbers))
        assert len(numbers) + page.lost() == count
        assert numbers[-1] == count
        # The latest state is never lost.
        await page.until(lambda message: "OPERATOR_STOP" in json.dumps(message.get("reasons")))


async def test_a_reader_that_is_gone_without_a_word_holds_up_nobody() -> None:
    robot = large_robot()
    async with viewed_meanwhile(robot) as endpoint:
        host, _, rest = endpoint.url.removeprefix("http://").partition(":")
        port = int(rest.partition("/")[0])
        with socket.create_connection((host, port)) as silent:
            silent.sendall(b"GET /stream HTTP/1.1\r\nHost: ")
            async with opened(endpoint.url) as page:
                await page.receive("update")
                await lived(page, robot, 20)
