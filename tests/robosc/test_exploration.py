"""The controlled system's graph: JSON values, table and drawing."""

import json

import pytest

from robosc.automata import to_automata
from robosc.errors import RoboscError, SynthesisCancelled, UnsupportedModelError
from robosc.exploration import Graph, explore, graph_dot, graph_json, graph_text
from robosc.expressions import EnumType, IntegerType, Received, StateTest, StringType
from robosc.model.structure import Deployment
from support.models_by_hand import action, component, incoming, model, needs, outgoing, transition, variable

LINE = EnumType("Line", ("seen", "lost"))

ROBOT = model(
    outgoing("scan", LINE, "Sensor"),
    component(
        "Sensor",
        "sensing*",
        [transition("sensing: scan.response", line=Received(()), note=Received(()))],
        [
            variable("line", LINE, "lost"),
            variable("armed"),
            variable("note", StringType(), "", is_synthesis=False),
            variable("left", IntegerType(-1, 1), -1),
        ],
    ),
    incoming("halt", "Base"),
    component("Base", "waiting* driving", ["*: halt.request -> waiting"]),
)


def _graph(limit: int = 100) -> Graph:
    return explore(to_automata(ROBOT, Deployment.CONTROLLER), {}, ROBOT, limit=limit)


def test_the_json_structure() -> None:
    def state(line: str) -> dict[str, object]:
        return {
            "components": {"Sensor": "sensing", "Base": "waiting"},
            "variables": {"Sensor.line": line, "Sensor.armed": False, "Sensor.left": -1},
            "communications": {},
            "enabled": ["halt.request", "scan.response"],
        }

    made = graph_json(_graph())
    assert made == {
        "initial": 0,
        "states": [state("lost"), state("seen")],
        "transitions": [
            [0, "halt.request", 0],
            [0, "scan.response", 0],
            [0, "scan.response", 1],
            [1, "halt.request", 1],
            [1, "scan.response", 0],
            [1, "scan.response", 1],
        ],
    }
    assert json.loads(json.dumps(made)) == made


def test_services_and_actions_and_silent_components() -> None:
    made = model(action("go"), incoming("move"), component("Base", "on*"), needs("go", StateTest("Base", "on")))
    graph = explore(to_automata(made, Deployment.CONTROLLER), {"move.request": lambda at: False}, made)
    first = graph.states[0]
    assert first.components == {"Base": "on"}
    assert first.communications == {"go": "idle"}
    assert first.enabled == ("go.request",)
    assert graph.transitions[0] == (0, "go.request", 1)
    # The requirement always holds, so nothing may be cancelled.
    assert graph.states[1].enabled == ("go.error", "go.feedback", "go.response")


def test_states_are_numbered_breadth_first() -> None:
    made = model(
        incoming("a"),
        incoming("b"),
        component(
            "C", "s* t* u* v*", ["s: b.request -> t", "s: a.request -> u", "u: a.request -> v", "t: a.request -> v"]
        ),
    )
    graph = explore(to_automata(made, Deployment.CONTROLLER), {}, made)
    assert [item.components["C"] for item in graph.states] == ["s", "u", "t", "v"]
    assert graph.transitions == ((0, "a.request", 1), (0, "b.request", 2), (1, "a.request", 3), (2, "a.request", 3))


def test_beyond_the_limit_there_is_one_clear_error() -> None:
    assert len(_graph(limit=2).states) == 2
    with pytest.raises(UnsupportedModelError, match="the controlled system of Robot has more than 1 states") as caught:
        _graph(limit=1)
    assert isinstance(caught.value, RoboscError)


def test_it_stops_on_request() -> None:
    with pytest.raises(SynthesisCancelled):
        explore(to_automata(ROBOT, Deployment.CONTROLLER), {}, ROBOT, should_stop=lambda: True)


def test_the_table() -> None:
    assert graph_text(_graph()) == (
        "Robot: 2 states, 6 transitions; it starts in state 0\n"
        "\n"
        "   Sensor   Base     Sensor.line  Sensor.armed  Sensor.left\n"
        "0  sensing  waiting  lost         false         -1\n"
        "   halt.request -> 0\n"
        "   scan.response -> 0, 1\n"
        "1  sensing  waiting  seen         false         -1\n"
        "   halt.request -> 1\n"
        "   scan.response -> 0, 1\n"
    )


def test_the_drawing() -> None:
    def box(line: str) -> str:
        return rf"Sensor = sensing\nBase = waiting\nSensor.line = {line}\nSensor.armed = false\nSensor.left = -1"

    assert graph_dot(_graph()).splitlines() == [
        'digraph "Robot" {',
        "  node [shape=box];",
        '  start [shape=point, label=""];',
        "  start -> 0;",
        rf'  0 [label="0\n{box("lost")}", peripheries=2];',
        rf'  1 [label="1\n{box("seen")}", peripheries=2];',
        r'  0 -> 0 [label="halt.request\nscan.response"];',
        '  0 -> 1 [label="scan.response"];',
        r'  1 -> 1 [label="halt.request\nscan.response"];',
        '  1 -> 0 [label="scan.response"];',
        "}",
    ]
