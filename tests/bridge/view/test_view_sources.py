"""Sources that are lost and come back, commands over gRPC, and what a page receives where little is known."""

import asyncio
import json
from typing import Any

import pytest

from robosc.execution.interpreter import InterpretedSystem
from robosc_api.v1 import bridge_pb2 as pb
from robosc_bridge.daemon.states import OperatorCommand, State
from robosc_bridge.remote import RemoteSettings, convert, serve
from robosc_view import broadcaster as hub_module
from robosc_view.definition import DefinitionError
from robosc_view.messages import NOT_EXECUTED, NOT_KNOWN, MessageBuilder, PreparedRobot, entry_text
from robosc_view.remote_bridge import robot_from
from robosc_view.reports import EventBatch, Status
from robosc_view.running import RunningBridge
from robosc_view.sources import RefusedError
from support.live import LiveRobot, large_model, supervisor_without_synthesis, viewed_meanwhile
from support.pages_open import opened, token_of
from support.view_servers import remotely_viewed, served
from support.waiting import until


@pytest.fixture
def robot() -> LiveRobot:
    return LiveRobot(supervisor_without_synthesis(large_model(6)))


async def test_a_bridge_that_ends_is_reported_and_found_again(
    robot: LiveRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hub_module, "FIRST_PAUSE_S", 0.1)
    monkeypatch.setattr(hub_module, "LONGEST_PAUSE_S", 0.3)
    endpoint = serve(robot.operations, RemoteSettings("127.0.0.1:0"))
    try:
        async with remotely_viewed(endpoint.address) as server, opened(server.url) as page:
            await page.receive("definition")
            await page.receive("update")
            await asyncio.to_thread(endpoint.stop)
            assert (await page.receive("gone"))["why"]
            await page.send(type="stop")
            assert "bridge" in (await page.receive("refused"))["why"]
            # A page that comes now learns it, too.
            async with opened(server.url) as late:
                assert (await late.next())["type"] == "gone"
            again = serve(robot.operations, RemoteSettings(endpoint.address))
            try:
                await page.receive("definition")
                await page.receive("update")
                robot.step()
                await page.until(lambda message: message["type"] == "events" and message["entries"])
            finally:
                await asyncio.to_thread(again.stop)
    finally:
        endpoint.stop()


async def test_a_robot_that_is_there_again_is_not_reported_as_lost() -> None:
    viewer = hub_module.Viewer()
    # A viewer that has not read for a while receives the present state, and every answer.
    viewer.answer("refused")
    for _ in range(2 * hub_module.MAXIMUM_ANSWERS):
        viewer.source_lost("gone")
    viewer.define("definition")
    viewer.show("update")
    assert await viewer.take() == ["definition", "refused", "update"]
    viewer.define("definition")
    viewer.source_lost("gone")
    assert await viewer.take() == ["definition", "gone"]


def test_a_bridge_elsewhere_is_commanded(robot: LiveRobot) -> None:
    endpoint = serve(robot.operations, RemoteSettings("127.0.0.1:0"))

    async def look() -> None:
        async with remotely_viewed(endpoint.address) as server, opened(server.url) as page:
            await page.receive("definition")
            await page.send(type="stop")
            assert (await page.receive("done"))["what"] == "stop"
            await page.until(lambda message: "OPERATOR_STOP" in json.dumps(message.get("reasons")))
            await page.send(type="command", command="resume", token=token_of(server.url))
            assert (await page.receive("done"))["what"] == "resume"
            robot.refusal = "not now"
            await page.send(type="command", command="start", token=token_of(server.url))
            assert (await page.receive("refused"))["why"] == "not now"
            await page.send(type="play", speed=1)
            assert (await page.receive("refused"))["what"] == "play"

    try:
        asyncio.run(look())
    finally:
        endpoint.stop()
    assert [order.command for order in robot.orders] == [
        OperatorCommand.STOP,
        OperatorCommand.RESUME,
        OperatorCommand.START,
    ]


def test_both_ways_to_a_bridge_define_and_report_the_same(robot: LiveRobot) -> None:
    response = convert.definition(robot.operations)
    near, far = RunningBridge(robot.operations).robot, robot_from(response)
    assert near == far
    # An earlier bridge, which did not send its supervisor.
    response.supervisor = b""
    without = robot_from(response)
    assert (without.shape, without.table, without.communications, without.requests) == (
        near.shape,
        near.table,
        near.communications,
        near.requests,
    )
    assert without.supervisor is None
    # A later bridge, with another format.
    response.supervisor = b'{"format":"robosc-supervisor","version":99}'
    assert robot_from(response).supervisor is None
    response.definition = "[" * 100_000
    with pytest.raises(DefinitionError):
        robot_from(response)
    assert isinstance(response, pb.GetDefinitionResponse)


async def test_at_rest_there_is_a_sign_of_life_and_nothing_is_executed(
    robot: LiveRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hub_module, "SIGN_OF_LIFE_S", 0.02)
    robot.state = State.STANDBY
    robot.show()
    async with viewed_meanwhile(robot) as endpoint, opened(endpoint.url) as page:
        await page.receive("definition")
        first, second = await page.receive("update"), await page.receive("update")
        assert second["number"] > first["number"]
        assert second["age_s"] > first["age_s"]
        assert (second["state"], second["components"], second["enabled"]) == ("standby", {}, [])
        assert {tuple(item["why"]) for item in second["disabled"]} == {(NOT_EXECUTED,)}


async def test_the_feed_is_asked_only_while_somebody_looks(robot: LiveRobot) -> None:
    async with served(lambda: RunningBridge(robot.operations)) as server:
        assert not robot.feed.is_watched
        async with opened(server.url) as page:
            await page.receive("update")
            assert robot.feed.is_watched
        await until(lambda: not robot.feed.is_watched)
        async with opened(server.url) as page:
            await page.receive("update")


def update(builder: MessageBuilder, status: Status) -> Any:
    return json.loads(builder.update(status, 1, 0.0))


def test_what_is_not_known_is_neither_enabled_nor_not(robot: LiveRobot) -> None:
    defined = RunningBridge(robot.operations).robot
    builder = MessageBuilder(PreparedRobot(defined))
    system = InterpretedSystem(robot.supervisor)
    message = update(builder, Status(1.0, components=system.state()))
    named = {*message["enabled"], *(item["event"] for item in message["disabled"])}
    assert set(defined.requests) - named == {"hold2.request", "hold5.request"}
    wrong = {**system.state(), "Motor1": {"state": "flying", "variables": {}}}
    message = update(builder, Status(1.0, components=wrong))
    assert (message["enabled"], message["disabled"]) == ([], [])
    assert "flying" in message["warnings"][0]["text"]
    message = update(builder, Status(1.0, components=wrong, enabled=["go1"]))
    assert message["enabled"] == ["go1.request"]
    assert {tuple(item["why"]) for item in message["disabled"]} == {(NOT_KNOWN,)}


def test_after_a_gap_only_what_is_sure_is_lit(robot: LiveRobot) -> None:
    builder = MessageBuilder(PreparedRobot(RunningBridge(robot.operations).robot))
    system = InterpretedSystem(robot.supervisor)
    entries: list[dict[str, Any]] = []
    for event in ("seen0.response", "seen0.response", "go1.request", "halt1.request"):
        assert system.step(event, system.read(event, 0)) is not None
        entries.append({"time": 1.0, "kind": "event", "event": event, "controllable": True, "state": system.state()})

    def lit(lost: int, *places: int) -> list[int]:
        found = builder.entries(EventBatch([entries[place] for place in places], lost))
        return [len(json.loads(text)["transitions"]) for text in found]

    # One state alone leads to where each of them ended.
    assert lit(0, 0, 1, 2, 3) == [1, 1, 1, 1]
    # Told twice: the state before is not one that it leads from.
    assert lit(0, 3) == [0]
    assert lit(5, 3) == [1]
    numbers = [json.loads(text)["number"] for text in builder.entries(EventBatch(entries[:1]))]
    assert numbers == [12]


def test_an_entry_says_what_there_is_to_say() -> None:
    assert (
        entry_text({"time": 1, "kind": "event", "event": "x", "data": {"value": "front_free"}}) == "value = front_free"
    )
    assert entry_text({"kind": "blocked", "identifier": "/go", "why": "no"}) == "/go; why: no"
    assert entry_text({"kind": "event", "data": 3.0, "state": {}, "decision_us": 4}) == "3"
    assert len(entry_text({"kind": "event", "data": ["x" * 100] * 100})) <= 300
    assert entry_text({"kind": "stop", "what": "late"}) == "late"


def test_a_live_robot_cannot_be_moved_in_time(robot: LiveRobot) -> None:
    with pytest.raises(RefusedError):
        RunningBridge(robot.operations).control_replay(None)  # type: ignore[arg-type]
