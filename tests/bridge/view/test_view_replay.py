"""Logs replayed: at any time the state after the last entry before it, and all entries in their order."""

import asyncio
import json
import tempfile
from pathlib import Path
from random import Random
from typing import Any

import hypothesis.strategies as st
import pytest
from hypothesis import given, settings

from robosc.event_logs import LoggedRun, read_log
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.event_log import json_line, plain
from robosc.execution.runtime.progress import Progress
from robosc_view import ViewError
from robosc_view.broadcaster import Viewer
from robosc_view.messages import events_text
from robosc_view.replay import HISTORY, MAXIMUM_STOPS, Player, Recording, Replay
from robosc_view.sources import Pause, Play, Seek
from support.effort import examples
from support.execution import Bench, unsupervised
from support.goal_porter import porter_supervisor
from support.live import LiveRobot, large_model, supervisor_without_synthesis
from support.loaders import MODEL as LOADER
from support.pages_open import opened
from support.rounds import rounds_supervisor
from support.view_servers import served

BEGIN_S, STEP_S = 1.7e9, 0.1
SUPERVISOR = supervisor_without_synthesis(large_model(6))


class Written:
    """A log, with what was so after each of its entries."""

    def __init__(self, folder: Path, count: int, seed: int = 1) -> None:
        robot = LiveRobot(SUPERVISOR, seed)
        subscription = robot.feed.subscribe(lambda: None, count)
        self.states = [self._state(robot)]
        for _ in range(count):
            robot.step()
            self.states.append(self._state(robot))
        entries = [
            {**entry, "time": BEGIN_S + STEP_S * number} for number, entry in enumerate(subscription.take().entries)
        ]
        self.events = [entry["event"] for entry in entries]
        self.path = folder / "run.jsonl"
        self.path.write_text("".join(map(json_line, entries)))

    @staticmethod
    def _state(robot: LiveRobot) -> Any:
        enabled = [robot.snapshot().enabled[place] for place in range(len(robot.snapshot().enabled))]
        state = plain(robot.system.state()), robot.locations(), [f"{name}.request" for name in enabled]
        return json.loads(json.dumps(state))

    def recording(self) -> Recording:
        return Recording(read_log(self.path), SUPERVISOR)


def slowly_last(recording: Recording, number: int) -> dict[str, int]:
    """Return the transition of each component taken last, by going through all entries from the beginning."""
    robot = recording.robot
    initial = {
        component.name: next(state.name for state in component.behaviour.states if state.initial)
        for component in robot.shape.components
        if component.behaviour
    }
    states, last = dict(initial), dict[str, int]()
    for document in recording.documents[:number]:
        if document["kind"] == "restart":
            states, last = dict(initial), {}
        elif document["kind"] == "event":
            for component, numbers in robot.table.get(document["event"], {}).items():
                if states[component] in numbers:
                    last[component] = numbers[states[component]]
            states = {name: part["state"] for name, part in document["state"].items()}
    return last


def shown(message: dict[str, Any]) -> list[Any]:
    return [message["components"], message["communications"], message["enabled"]]


async def test_every_place_shows_the_state_after_the_last_entry_before_it(tmp_path: Path) -> None:
    written = Written(tmp_path, 400)
    dice = Random(1)
    recording = written.recording()
    async with (
        served(lambda: Replay(recording), is_shared=False, robot=recording.robot) as server,
        opened(server.url) as page,
    ):
        definition = await page.receive("definition")
        assert definition["source"] == "log"
        assert definition["can_command"] is False
        assert definition["log"] == {
            "begin_s": BEGIN_S,
            "end_s": pytest.approx(BEGIN_S + STEP_S * 399),
            "count": 400,
        }
        await page.receive("update")
        for _ in range(12):
            number = dice.randrange(1, 400)
            time_s = BEGIN_S + STEP_S * (number - 1) + 0.05
            page.messages.clear()
            await page.send(type="seek", time_s=time_s)
            received = await page.until(_is_update_of(time_s))
            assert shown(received) == written.states[number]
            assert received["last"] == slowly_last(recording, number)
            (position,) = [message for message in page.messages if message["type"] == "position"]
            assert position == {"type": "position", "time_s": time_s, "is_playing": False, "speed": 1.0}
            entries = page.entries()
            assert [entry["number"] for entry in entries] == list(range(max(number - HISTORY, 0) + 1, number + 1))
            assert entries[-1]["event"] == written.events[number - 1]
            lit = [entry for entry in entries if entry["transitions"]]
            assert len(lit) > len(entries) / 3


async def test_it_plays_to_the_end_and_every_entry_comes_once(tmp_path: Path) -> None:
    written = Written(tmp_path, 300)
    recording = written.recording()
    async with (
        served(lambda: Replay(recording), is_shared=False) as server,
        opened(server.url) as page,
        opened(server.url) as other,
    ):
        await page.receive("update")
        await other.receive("update")
        await page.send(type="play", speed=40)
        await page.until(_stands_at(BEGIN_S + STEP_S * 299))
        await page.until(lambda message: message["type"] == "update" and shown(message) == written.states[-1])
        assert [entry["number"] for entry in page.entries()] == list(range(1, 301))
        assert [entry["event"] for entry in page.entries()] == written.events
        # Each page has a place of its own.
        assert shown(await other.receive("update")) == written.states[1]
        await page.send(type="play", speed=0.5)
        begun = await page.receive("position")
        # It stood at the end, 29.9 s later.
        assert begun["is_playing"] and begun["time_s"] < BEGIN_S + 20.0
        await page.send(type="pause")
        await page.until(lambda message: message["type"] == "position" and not message["is_playing"])
        await page.send(type="stop")
        assert (await page.receive("refused"))["what"] == "stop"


def _is_update_of(time_s: float) -> Any:
    return lambda message: message["type"] == "update" and message["time_s"] == pytest.approx(time_s)


def _stands_at(time_s: float) -> Any:
    return lambda message: (
        message["type"] == "position" and not message["is_playing"] and message["time_s"] == pytest.approx(time_s)
    )


@given(
    st.lists(
        st.one_of(
            st.floats(-10, 60).map(lambda value: Seek(BEGIN_S + value)),
            st.floats(0.01, 100).map(Play),
            st.just(Pause()),
            st.floats(0, 20),
        ),
        max_size=30,
    )
)
@settings(max_examples=examples(60))
def test_a_player_stays_within_the_log(commands: list[Any]) -> None:
    player = Player(RECORDING)
    expected_s = BEGIN_S
    for command in commands:
        before_s, was_playing = player.time_s, player.is_playing
        if isinstance(command, float):
            player.advance(command)
            expected_s = min(before_s + command * player.speed, RECORDING.end_s) if was_playing else before_s
        else:
            player.control_replay(command)
            if isinstance(command, Seek):
                expected_s = min(max(command.time_s, RECORDING.begin_s), RECORDING.end_s)
            elif isinstance(command, Play) and before_s >= RECORDING.end_s:
                expected_s = BEGIN_S
        assert player.time_s == expected_s
        assert not (player.is_playing and isinstance(command, Pause))
        count = RECORDING.count(player.time_s)
        assert RECORDING.times_s[count - 1] <= player.time_s
        assert count == len(RECORDING.times_s) or RECORDING.times_s[count] > player.time_s


def entries(*documents: dict[str, Any]) -> str:
    return "".join(json_line({"time": BEGIN_S + number, **item}) for number, item in enumerate(documents))


def _run(path: Path, *documents: dict[str, Any]) -> LoggedRun:
    path.write_text(entries(*documents))
    return read_log(path)


def _state() -> Any:
    return LiveRobot(SUPERVISOR).system.state()


def test_faults_stops_and_restarts_are_reported(tmp_path: Path) -> None:
    state = {**_state(), "Motor1": {"state": "moving", "variables": {}}}
    run = _run(
        tmp_path / "log.jsonl",
        {"kind": "event", "event": "go1.request", "controllable": True, "data": 1, "state": state},
        {"kind": "stop", "what": "seen0 on /seen0 is stale"},
        {"kind": "fault", "what": "it broke"},
        {"kind": "resume", "what": "seen0 is back"},
        {"kind": "restart", "what": "again"},
        {"kind": "event", "event": "hold2.request", "controllable": True, "data": None, "state": _state()},
    )
    recording = Recording(run, SUPERVISOR)
    frames = [recording.frame(number) for number in range(7)]
    assert [frame.problem for frame in frames] == ["", "", "", "it broke", "it broke", "", ""]
    assert [frame.stops for frame in frames] == [(), (), *[("seen0 on /seen0 is stale",)] * 2, (), (), ()]
    assert [frame.components["Motor1"]["state"] for frame in frames] == ["still", *["moving"] * 4, "still", "still"]
    assert [frame.communications["hold2"] for frame in frames] == [*["idle"] * 6, "waiting"]


def test_goals_are_told_as_far_as_the_log_does(tmp_path: Path) -> None:
    bench = Bench(InterpretedSystem(porter_supervisor()), assumption_timeout_s=2.0)
    bench.receive("/call")
    bench.tick(60)
    late = len(bench.log.entries)
    bench.receive("/door/opened")
    bench.tick(2)
    found = bench.executor.progress
    assert found is not None and found.aims[0].times == 1
    path = tmp_path / "log.jsonl"
    path.write_text("".join(map(json_line, bench.log.entries)))
    recording = Recording(read_log(path), porter_supervisor())

    def told(count: int, time_s: float) -> Progress:
        progress = recording.progress(count, time_s)
        assert progress is not None
        return progress

    first = told(0, recording.begin_s)
    assert (first.approached, first.overdue, [item.times for item in first.aims]) == (None, (), [0, 0])
    owing = told(late, recording.times_s[late - 1] + 3.0)
    assert (owing.approached, owing.overdue) == ("goal 1", ("assumption 1",))
    assert owing.assumptions[0].unmet_s == pytest.approx(5.0, abs=0.11)
    last = told(len(recording.documents), recording.end_s)
    assert (last.approached, last.overdue) == (found.approached, ())
    assert [item.times for item in last.aims] == [item.times for item in found.aims]


def test_visits_that_were_made_are_told_as_far_as_the_log_does(tmp_path: Path) -> None:
    bench = Bench(InterpretedSystem(rounds_supervisor()))
    for identifier in ("/begin", "/call", "/end"):
        bench.receive(identifier)
        bench.tick(3)
    path = tmp_path / "log.jsonl"
    path.write_text("".join(map(json_line, bench.log.entries)))
    recording = Recording(read_log(path), rounds_supervisor())
    found, told = bench.executor.progress, recording.progress(len(recording.documents), recording.end_s)
    assert found is not None and told is not None
    assert [(item.name, item.times, item.mission) for item in told.aims] == [
        (item.name, item.times, item.mission) for item in found.aims
    ]
    assert found.missions[0].rounds == 2 and told.missions == ()


def test_a_log_that_tells_nonsense_of_goals_is_shown_all_the_same(tmp_path: Path) -> None:
    nonsense: tuple[dict[str, Any], ...] = (
        {"kind": "reached", "aim": "goal 9", "count": 1},
        {"kind": "reached", "aim": "goal 1", "count": "many"},
        {"kind": "approach", "aim": ["goal 1"]},
        {"kind": "owed", "assumption": "assumption 1", "owed_s": "long"},
        {"kind": "met", "assumption": {}},
        {"kind": "restart"},
    )
    recording = Recording(_run(tmp_path / "log.jsonl", *nonsense), porter_supervisor())
    assert recording.progress(6, recording.end_s) is None
    told = Recording(
        _run(tmp_path / "b.jsonl", {"kind": "approach", "aim": "goal 2"}, {"kind": "restart"}), porter_supervisor()
    )
    found = [told.progress(count, told.end_s) for count in range(3)]
    assert [item and item.approached for item in found] == [None, "goal 2", None]
    assert Recording(_run(tmp_path / "c.jsonl", {"kind": "restart"}), SUPERVISOR).progress(1, 0.0) is None


def test_what_is_back_ends_its_own_stop_alone(tmp_path: Path) -> None:
    near, far = "scan on /scan is stale", "odom on /odom is stale"
    run = _run(
        tmp_path / "log.jsonl",
        {"kind": "stop", "what": near},
        {"kind": "stop", "what": far},
        {"kind": "stop", "what": near},
        {"kind": "resume", "what": "sca is back"},
        {"kind": "resume", "what": "scan is back"},
        {"kind": "stop", "what": "stopped by hand"},
        {"kind": "resume", "what": "odom is back"},
        {"kind": "restart"},
        *({"kind": "stop", "what": str(number)} for number in range(2 * MAXIMUM_STOPS)),
    )
    recording = Recording(run, SUPERVISOR)
    assert [set(recording.frame(number).stops) for number in range(9)] == [
        set(),
        {near},
        {near, far},
        {near, far},
        {near, far},
        {far},
        {far, "stopped by hand"},
        {"stopped by hand"},
        set(),
    ]
    assert recording.frame(len(recording.documents)).stops == tuple(
        str(number) for number in range(MAXIMUM_STOPS, 2 * MAXIMUM_STOPS)
    )


@given(st.integers(0, 1000), st.lists(st.sampled_from([True, True, True, True, False]), min_size=1, max_size=60))
@settings(max_examples=examples(25))
def test_the_last_transitions_are_those_of_a_run_from_the_beginning(seed: int, happens: list[bool]) -> None:
    robot = LiveRobot(SUPERVISOR, seed)
    subscription = robot.feed.subscribe(lambda: None, len(happens))
    for is_event in happens:
        if is_event:
            robot.step()
        else:
            robot.system.restart()
            robot.feed.append({"time": BEGIN_S, "kind": "restart"})
    documents = [{**entry, "time": BEGIN_S + number} for number, entry in enumerate(subscription.take().entries)]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.jsonl"
        path.write_text("".join(map(json_line, documents)))
        recording = Recording(read_log(path), SUPERVISOR)
    for number in range(len(documents) + 1):
        assert recording.last(number) == slowly_last(recording, number)


def test_what_waits_of_another_place_is_not_sent_after_a_jump() -> None:
    async def look() -> list[str]:
        viewer = Viewer()
        viewer.append_events(["of before"], 3)
        viewer.show("update of before")
        viewer.show_scan("scan of before")
        viewer.jump()
        viewer.show_position("position")
        viewer.append_events(["{}"], 0)
        viewer.show("update")
        return await viewer.take()

    assert asyncio.run(look()) == ["position", events_text(["{}"], 0), "update"]


DEEP = 900


@pytest.mark.parametrize("deep", [f"{'[' * DEEP}7{']' * DEEP}", f"{'{"a":' * DEEP}7{'}' * DEEP}"])
@pytest.mark.parametrize("place", ["data", "state", "what", "transitions", "more"])
async def test_what_is_nested_deeply_in_a_log_ends_nothing(tmp_path: Path, deep: str, place: str) -> None:
    state = json.dumps(_state())
    if place == "state":
        state = state.replace('"level": 0', f'"level": {deep}', 1)
        assert deep in state
    more = "" if place == "state" else f',"{place}":{deep}'
    path = tmp_path / "log.jsonl"
    begin = f'{{"time":{BEGIN_S},"kind":"event","event":"seen0.response","controllable":false,"state":{state}'
    path.write_text(f"{begin}{more}}}\n" + entries({"kind": "stop", "what": "x"}))
    recording = Recording(read_log(path), SUPERVISOR)
    async with (
        served(lambda: Replay(recording), is_shared=False, robot=recording.robot) as server,
        opened(server.url) as page,
    ):
        assert (await page.next())["type"] == "definition"
        received = await page.until(lambda message: message["type"] in ("gone", "update"))
        assert received["type"] == "update"
        assert [entry["kind"] for entry in page.entries()] == ["event", "stop"]


def test_a_clock_that_was_set_back_hides_nothing(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    note = {"kind": "stop", "what": "x"}
    path.write_text("".join(json_line({"time": time_s, **note}) for time_s in (10.0, 20.0, 15.0, 30.0)))
    recording = Recording(read_log(path), SUPERVISOR)
    assert recording.times_s == [10.0, 20.0, 20.0, 30.0]
    assert [recording.count(time_s) for time_s in (9.0, 10.0, 16.0, 20.0, 29.0, 31.0)] == [0, 1, 1, 3, 3, 4]


def test_a_log_of_another_model_or_without_entries_is_refused(tmp_path: Path) -> None:
    other = {"kind": "event", "event": "dance.request", "controllable": True, "data": 1, "state": _state()}
    with pytest.raises(ViewError, match="line 1: the model has no such event"):
        Recording(_run(tmp_path / "a.jsonl", other), SUPERVISOR)
    part = {**other, "event": "go1.request", "state": {"Motor1": {"state": "moving", "variables": {}}}}
    with pytest.raises(ViewError, match="line 1"):
        Recording(_run(tmp_path / "b.jsonl", part), SUPERVISOR)
    with pytest.raises(ViewError, match="no entries"):
        Recording(LoggedRun(()), SUPERVISOR)


def _recording() -> Recording:
    state = _state()
    event = {"kind": "event", "event": "seen0.response", "controllable": False, "data": 1, "state": state}
    with tempfile.TemporaryDirectory() as folder:
        return Recording(_run(Path(folder) / "log.jsonl", *[event] * 50), SUPERVISOR)


RECORDING = _recording()


def test_goals_that_are_being_cancelled_are_shown_until_they_have_ended(tmp_path: Path) -> None:
    supervisor = unsupervised(LOADER.read_text(encoding="utf-8"))
    bench = Bench(InterpretedSystem(supervisor), cancel_timeout_s=1.0)
    bench.tick()
    bench.executor.on_goal_accepted(1)
    bench.receive("/stop", True)
    bench.tick(20)
    bench.executor.on_goal_ended(1, "cancelled")
    path = tmp_path / "run.jsonl"
    path.write_text("".join(map(json_line, bench.log.entries)))
    recording = Recording(read_log(path), supervisor)
    kinds = [document.get("event", document["kind"]) for document in recording.documents]
    assert kinds[:5] == ["travel.request", "stop.response", "cancelling", "cancel_overdue", "travel.cancel"]
    shown = [recording.frame(number).cancelling for number in range(6)]
    assert shown == [(), (), (), ("travel",), ("travel",), ()]
