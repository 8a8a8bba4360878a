"""What generated nodes publish on `/state`, as they write it, read and shown; the way there is real DDS."""

import asyncio
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any

import pytest

from robosc.supervisor import Supervisor
from robosc.targets import generate
from robosc.targets.c99.layout import PLANT_LOCATIONS
from robosc_bridge.view.definition import DefinitionError
from robosc_bridge.view.ros2_topic import MAXIMUM_CHARACTERS, StateReader, StateTopic
from robosc_bridge.view.telling import Portrait, Teller
from support.generated import example_supervisor, imported
from support.live import large_model, supervisor_without_synthesis
from support.pages_open import LIMIT_S, OpenPage, opened
from support.ros2 import Peer, environment, own_domain
from support.view_servers import served

MAZE = "maze_solver/maze_solver"


class Node:
    """The part of a generated node that makes the texts of the topic."""

    def __init__(self, supervisor: Supervisor, folder: Path) -> None:
        files = generate(supervisor, "ros2")
        (path,) = (path for path in files if path.endswith("/state_topic.py"))
        module = path.removesuffix(".py").replace("/", ".")
        with imported(files, folder, module) as found:
            self.system = found.RecordingSupervisor()
        self._model = supervisor.model
        self._dice = Random(1)

    def step(self) -> str | None:
        """An event, if the state takes it."""
        events = [event for item in self._model.communications for event in item.events]
        event = self._dice.choice(events)
        if event.endswith(".request") and not self.system.enabled(event):
            return None
        return event if self.take(event, self._dice.randint(0, 3)) else None

    def take(self, event: str, data: int = 0) -> bool:
        """Let an event happen; False: the state does not take it."""
        reading = self.system.read(event, data) if event.endswith((".response", ".feedback")) else None
        return self.system.step(event, reading) is not None

    def places(self) -> dict[str, str]:
        """Where services and actions are."""
        called = [item for item in self._model.communications if item.kind in PLANT_LOCATIONS]
        return {item.name: self.system.location(item.name) for item in called}

    def enabled(self) -> list[str]:
        names = [f"{item.name}.request" for item in self._model.communications]
        return [name for name in names if name in self._requests() and self.system.enabled(name)]

    def _requests(self) -> list[str]:
        return [event for item in self._model.communications for event in item.events if event.endswith(".request")]


@pytest.fixture(scope="module")
def large() -> Supervisor:
    return supervisor_without_synthesis(large_model(6))


def test_each_text_tells_state_and_events(large: Supervisor, tmp_path: Path) -> None:
    node, reader = Node(large, tmp_path), StateReader(large)
    mentioned = {event for event, parts in reader.read(node.system.report(), 1.0)[0].table.items() if parts}
    told: list[str] = []
    taken: list[str] = []
    places: set[str] = set()
    states = {name: part["state"] for name, part in node.system.state().items()}
    for _ in range(200):
        event = node.step()
        if event is None or event not in mentioned:
            continue
        before = states
        states = {name: part["state"] for name, part in node.system.state().items()}
        robot, status, entries = reader.read(node.system.report(), 2.0)
        assert {name: part["state"] for name, part in status.components.items()} == states
        assert status.communications == node.places()
        places |= set(status.communications.values())
        # An event that changes nothing anywhere has no transition.
        if any(before[name] in states_of for name, states_of in robot.table[event].items()):
            taken.append(event)
        told += [entry["event"] for entry in entries]
        assert all(entry["controllable"] == entry["event"].endswith(".request") for entry in entries)
    assert told == taken
    assert len(told) > 50
    assert places == {"idle", "waiting", "ready", "failed"}


def test_many_events_in_one_text_are_told_one_by_one(large: Supervisor, tmp_path: Path) -> None:
    node, reader = Node(large, tmp_path), StateReader(large)
    reader.read(node.system.report(), 1.0)
    for event in ("seen0.response", "go1.request", "halt1.request", "seen0.response"):
        assert node.take(event)
    _, _, entries = reader.read(node.system.report(), 1.0)
    assert [entry["event"] for entry in entries] == ["seen0.response", "go1.request", "halt1.request", "seen0.response"]


def test_without_the_model_the_automata_are_shown_all_the_same(large: Supervisor, tmp_path: Path) -> None:
    node = Node(large, tmp_path)
    text = node.system.report()
    known, _, _ = StateReader(large).read(text, 1.0)
    robot, _, _ = StateReader(None).read(text, 1.0)
    assert robot.shape == known.shape
    assert robot.table == known.table
    assert [(item.name, item.component, item.kind) for item in robot.talks] == [
        (item.name, item.component, item.kind) for item in known.talks
    ]


def test_a_node_of_before_does_not_tell_where_services_are(large: Supervisor, tmp_path: Path) -> None:
    text = Node(large, tmp_path).system.report()
    told = json.loads(text)
    # In C++ it is told in the same words: the test of those nodes has this list, too.
    assert list(told) == ["current", "communications", "transitions", "definition"]
    assert told.pop("communications") == {"hold2": "idle", "hold5": "idle"}
    reader = StateReader(large)
    robot, status, _ = reader.read(json.dumps(told), 1.0)
    assert status.communications == {}
    shown = json.loads(Teller(Portrait(robot)).update(status, 1, 0.0))
    named = {*shown["enabled"], *(item["event"] for item in shown["disabled"])}
    assert set(robot.requests) - named == {"hold2.request", "hold5.request"}
    # One that tells leaves nothing open.
    shown = json.loads(Teller(Portrait(robot)).update(reader.read(text, 1.0)[1], 1, 0.0))
    assert shown["communications"] == {"hold2": "idle", "hold5": "idle"}
    assert {*shown["enabled"], *(item["event"] for item in shown["disabled"])} == set(robot.requests)


def test_what_makes_no_sense_is_told_in_a_sentence(large: Supervisor, tmp_path: Path) -> None:
    good = json.loads(Node(large, tmp_path).system.report())
    wrong = [
        "",
        "[" * 100_000,
        "[]",
        "x" * (MAXIMUM_CHARACTERS + 1),
        json.dumps({**good, "definition": None}),
        json.dumps({**good, "definition": {"name": "x", "components": [{}]}}),
        json.dumps({**good, "current": None}),
        json.dumps({**good, "current": {"Sensor0": {"state": 3, "variables": {}}}}),
        json.dumps({**good, "current": {"Sensor0": {"state": "clear"}}}),
        json.dumps({**good, "transitions": "x"}),
        json.dumps({**good, "communications": []}),
        json.dumps({**good, "communications": {"hold2": "executing"}}),
        json.dumps({**good, "communications": {"hold2": ["idle"]}}),
        json.dumps({**good, "communications": {"seen0": "idle"}}),
        json.dumps({**good, "communications": {"nothing": "idle"}}),
    ]
    for text in wrong:
        with pytest.raises(DefinitionError) as error:
            StateReader(large).read(text, 1.0)
        assert len(str(error.value)) < 600
    # Numbers of nothing are left out.
    odd = json.dumps({**good, "transitions": [10**9, "x", None, -1]})
    assert StateReader(large).read(odd, 1.0)[2] == []
    other = supervisor_without_synthesis(large_model(3))
    with pytest.raises(DefinitionError, match="another model"):
        StateReader(other).read(json.dumps(good), 1.0)


@pytest.fixture
def peer(tmp_path: Path) -> Iterator[Peer]:
    with own_domain() as domain, Peer(domain, environment(domain, tmp_path)) as made:
        yield made


@pytest.mark.ros2
def test_a_node_is_shown_over_dds(peer: Peer, tmp_path: Path) -> None:
    from std_msgs.msg import String

    supervisor = example_supervisor(MAZE)
    node = Node(supervisor, tmp_path / "package")
    publisher = peer.publisher(String, "/robot1/state")

    async def told(page: OpenPage, fits: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
        """What fits, while the node publishes now and then: never so much that the topic would let go of something."""
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

    async def look() -> None:
        async with (
            asyncio.timeout(LIMIT_S),
            served(lambda: StateTopic("/robot1", supervisor)) as server,
            opened(server.url) as page,
        ):
            definition = await told(page, lambda message: message["type"] == "definition")
            assert (definition["robot"], definition["source"]) == (supervisor.model.name, "ros2")
            assert definition["can_command"] is False
            await told(page, is_now)
            reader, wanted = StateReader(supervisor), []
            for _ in range(30):
                while node.step() is None:
                    pass
                text = node.system.report()
                wanted += [item["event"] for item in reader.read(text, 1.0)[2]]
                publisher.publish(String(data=text))
                shown = await told(page, is_now)
                assert len(shown["enabled"]) + len(shown["disabled"]) == len(definition["requests"])
            assert len(wanted) >= 10
            while len(page.entries()) < len(wanted):
                await page.next()
            assert [entry["event"] for entry in page.entries()] == wanted
            await page.send(type="stop")
            assert (await page.told("refused"))["what"] == "stop"

    asyncio.run(look())


@pytest.mark.ros2
def test_a_node_that_is_not_there_is_told_and_found_when_it_comes(
    peer: Peer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from std_msgs.msg import String

    monkeypatch.setattr("robosc_bridge.view.ros2_topic.SILENCE_S", 1.0)
    node = Node(supervisor_without_synthesis(large_model(3)), tmp_path / "package")

    async def look() -> None:
        async with served(StateTopic) as server, opened(server.url) as page:
            assert "/state" in (await page.told("gone"))["why"]
            publisher, end_s = peer.publisher(String, "/state"), time.monotonic() + 30
            task = asyncio.create_task(page.told("definition"))
            while not task.done():
                assert time.monotonic() < end_s
                publisher.publish(String(data=node.system.report()))
                await asyncio.sleep(0.02)
            await page.told("update")
            assert "/state" in (await page.told("gone"))["why"]

    asyncio.run(look())
