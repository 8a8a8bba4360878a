"""Messages that generated nodes publish on `/state`, as they write them, read and shown, over real DDS."""

import asyncio
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from robosc_view.ros2_topic import StateReader, StateTopic
from support.generated import example_supervisor
from support.live import large_model, supervisor_without_synthesis
from support.pages_open import LIMIT_S, OpenPage, opened
from support.ros2 import Peer, environment, own_domain
from support.view_nodes import Node
from support.view_servers import served

MAZE = "maze_solver/maze_solver"


@pytest.fixture
def peer(tmp_path: Path) -> Iterator[Peer]:
    with own_domain() as domain, Peer(domain, environment(domain, tmp_path)) as made:
        yield made


@pytest.mark.smoke
@pytest.mark.ros2
async def test_a_node_is_shown_over_dds(peer: Peer, tmp_path: Path) -> None:
    from std_msgs.msg import String

    supervisor = example_supervisor(MAZE)
    node = Node(supervisor, tmp_path / "package")
    publisher = peer.publisher(String, "/robot1/state")

    async def next_message(page: OpenPage, fits: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
        """Return the message that fits, while the node publishes now and then.

        It never publishes so much that the topic would let go of something.
        """
        waiting = asyncio.create_task(page.until(fits))
        while not waiting.done():
            publisher.publish(String(data=node.system.report()))
            await asyncio.wait([waiting], timeout=0.5)
        return await waiting

    def is_now(message: dict[str, Any]) -> bool:
        return (
            message["type"] == "update"
            and {name: part["state"] for name, part in message["components"].items()}
            == {name: part["state"] for name, part in node.system.state().items()}
            and message["communications"] == node.places()
            and message["enabled"] == node.enabled()
        )

    async with (
        asyncio.timeout(LIMIT_S),
        served(lambda: StateTopic("/robot1", supervisor)) as server,
        opened(server.url) as page,
    ):
        definition = await next_message(page, lambda message: message["type"] == "definition")
        assert (definition["robot"], definition["source"]) == (supervisor.model.name, "ros2")
        assert definition["can_command"] is False
        await next_message(page, is_now)
        reader, wanted = StateReader(supervisor), []
        for _ in range(30):
            while node.step() is None:
                pass
            text = node.system.report()
            wanted += [item["event"] for item in reader.read(text, 1.0)[2]]
            publisher.publish(String(data=text))
            shown = await next_message(page, is_now)
            assert len(shown["enabled"]) + len(shown["disabled"]) == len(definition["requests"])
        assert len(wanted) >= 10
        while len(page.entries()) < len(wanted):
            await page.next()
        assert [entry["event"] for entry in page.entries()] == wanted
        await page.send(type="stop")
        assert (await page.receive("refused"))["what"] == "stop"


@pytest.mark.ros2
async def test_a_node_that_is_not_there_is_reported_and_found_when_it_comes(
    peer: Peer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from std_msgs.msg import String

    monkeypatch.setattr("robosc_view.ros2_topic.SILENCE_S", 1.0)
    node = Node(supervisor_without_synthesis(large_model(3)), tmp_path / "package")
    async with served(StateTopic) as server, opened(server.url) as page:
        assert "/state" in (await page.receive("gone"))["why"]
        publisher, end_s = peer.publisher(String, "/state"), time.monotonic() + 30
        task = asyncio.create_task(page.receive("definition"))
        while not task.done():
            assert time.monotonic() < end_s
            publisher.publish(String(data=node.system.report()))
            await asyncio.sleep(0.02)
        await page.receive("update")
        assert "/state" in (await page.receive("gone"))["why"]
