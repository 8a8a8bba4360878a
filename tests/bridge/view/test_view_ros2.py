"""Tests of the messages that generated nodes publish on `/state`, as written, read and shown, over real DDS."""

import json
from pathlib import Path

import pytest

from robosc.execution.interpreter import InterpretedSystem
from robosc.supervisor import Supervisor
from robosc_view.definition import DefinitionError
from robosc_view.messages import MessageBuilder, PreparedRobot
from robosc_view.ros2_topic import MAXIMUM_CHARACTERS, StateReader
from support.execution import Bench
from support.generated import example_supervisor
from support.goal_porter import porter_supervisor
from support.live import large_model, supervisor_without_synthesis
from support.rounds import rounds_supervisor
from support.view_nodes import Node


@pytest.fixture(scope="module")
def large() -> Supervisor:
    return supervisor_without_synthesis(large_model(6))


def test_each_text_reports_state_and_events(large: Supervisor, tmp_path: Path) -> None:
    node, reader = Node(large, tmp_path), StateReader(large)
    mentioned = {event for event, parts in reader.read(node.system.report(), 1.0)[0].table.items() if parts}
    events: list[str] = []
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
        events += [entry["event"] for entry in entries]
        assert all(entry["controllable"] == entry["event"].endswith(".request") for entry in entries)
    assert events == taken
    assert len(events) > 50
    assert places == {"idle", "waiting", "ready", "failed"}


def test_many_events_in_one_text_are_reported_one_by_one(large: Supervisor, tmp_path: Path) -> None:
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
    assert [(item.name, item.component, item.kind) for item in robot.communications] == [
        (item.name, item.component, item.kind) for item in known.communications
    ]


def test_a_node_of_before_does_not_report_where_services_are(large: Supervisor, tmp_path: Path) -> None:
    text = Node(large, tmp_path).system.report()
    state = json.loads(text)
    # The words are the same in C++: the test of those nodes has this list, too.
    assert list(state) == ["current", "communications", "transitions", "cancelling", "definition"]
    assert state.pop("communications") == {"hold2": "idle", "hold5": "idle"}
    reader = StateReader(large)
    robot, status, _ = reader.read(json.dumps(state), 1.0)
    assert status.communications == {}
    shown = json.loads(MessageBuilder(PreparedRobot(robot)).update(status, 1, 0.0))
    named = {*shown["enabled"], *(item["event"] for item in shown["disabled"])}
    assert set(robot.requests) - named == {"hold2.request", "hold5.request"}
    # One that sends them leaves nothing open.
    shown = json.loads(MessageBuilder(PreparedRobot(robot)).update(reader.read(text, 1.0)[1], 1, 0.0))
    assert shown["communications"] == {"hold2": "idle", "hold5": "idle"}
    assert {*shown["enabled"], *(item["event"] for item in shown["disabled"])} == set(robot.requests)


def test_what_makes_no_sense_is_reported_in_a_sentence(large: Supervisor, tmp_path: Path) -> None:
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
        json.dumps({**good, "cancelling": "navigate"}),
        json.dumps({**good, "cancelling": ["hold2"]}),
        json.dumps({**good, "cancelling": [["navigate"]]}),
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


def test_goals_that_are_being_cancelled_are_shown(tmp_path: Path) -> None:
    supervisor = example_supervisor("navigation/navigation")
    node, reader = Node(supervisor, tmp_path), StateReader(supervisor)
    robot, status, _ = reader.read(node.system.report(cancelling=("navigate",)), 1.0)
    assert status.cancelling == ("navigate",)
    assert json.loads(MessageBuilder(PreparedRobot(robot)).update(status, 1, 0.0))["cancelling"] == ["navigate"]
    # A node of an earlier version does not report them.
    state = json.loads(node.system.report())
    assert state.pop("cancelling") == []
    assert reader.read(json.dumps(state), 1.0)[1].cancelling == ()


def test_the_progress_of_a_strategy_is_read_as_the_node_writes_it(tmp_path: Path) -> None:
    node, reader = Node(porter_supervisor(), tmp_path), StateReader(porter_supervisor())
    assert reader.read(node.system.report(), 1.0)[1].progress is None
    bench = Bench(InterpretedSystem(porter_supervisor()), assumption_timeout_s=2.0)
    bench.receive("/call")
    bench.tick(40)
    progress = bench.executor.progress
    assert progress is not None and progress.overdue == ("assumption 1",)
    text = node.system.report(progress)
    rounded = tuple(item._replace(unmet_s=item.unmet_s and round(item.unmet_s, 3)) for item in progress.assumptions)
    found = reader.read(text, 1.0)[1].progress
    assert found is not None
    assert (found.assumptions, found.approached, found.overdue) == (rounded, "goal 1", ("assumption 1",))
    document = json.loads(text)
    changes: tuple[dict[str, object], ...] = ({"aims": [{}]}, {"chosen": 7}, {"aims": None})
    for wrong in ([], *({**document["progress"], **change} for change in changes)):
        with pytest.raises(DefinitionError, match="the progress on /state makes no sense"):
            reader.read(json.dumps({**document, "progress": wrong}), 1.0)


def test_the_progress_of_missions_is_read_as_the_node_writes_it(tmp_path: Path) -> None:
    node, reader = Node(rounds_supervisor(), tmp_path), StateReader(rounds_supervisor())
    bench = Bench(InterpretedSystem(rounds_supervisor()))
    for identifier in ("/begin", "/call"):
        bench.receive(identifier)
    progress = bench.executor.progress
    assert progress is not None and [item.detours for item in progress.missions] == [(1,)]
    text = node.system.report(progress)
    assert reader.read(text, 1.0)[1].progress == progress
    document = json.loads(text)
    # A node of an earlier version says nothing of missions.
    aims = [{key: value for key, value in item.items() if key != "mission"} for item in document["progress"]["aims"]]
    told = {key: value for key, value in document["progress"].items() if key != "missions"}
    found = reader.read(json.dumps({**document, "progress": {**told, "aims": aims}}), 1.0)[1].progress
    assert found is not None and found.missions == () and found.aims[0].mission is None
    wrong = {**document["progress"], "missions": [{"name": "rounds", "visit": -1}]}
    with pytest.raises(DefinitionError, match="the progress on /state makes no sense"):
        reader.read(json.dumps({**document, "progress": wrong}), 1.0)
