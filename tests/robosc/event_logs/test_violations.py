"""Tests of the findings of the log check, case by case, of a small robot."""

from pathlib import Path
from typing import Any

import pytest

from robosc.event_logs import WrongDeploymentError, check_log, checking
from robosc.execution.interpreter import InterpretedSystem
from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from support.execution import Bench, supervisor_of
from support.layers import LayerBench
from support.models import model_of
from support.random_logs import Entry, World, read

GUARD = """
robot Guard {
  interface sight use Sight from our_msgs
  interface ask use Ask from our_msgs
  datatype object Scan { near: double  level: integer(0..9) }
  datatype enum Way from Scan to { value.near > 1.0 -> free default -> shut }
  component Eye {
    outgoing message scan with identifier: "/scan", type: Way links sight
    outgoing message level with identifier: "/scan", type: Scan links sight
    service look with request: none, response: none links ask
    behaviour {
      variable way: Way = shut
      variable level: integer(0..9) = 0
      variable far: double = 0.5
      on response from scan do way := value
      on response from level do level := value.level, far := value.near
      initial marked state closed { transition if way = free goto open }
      marked state open { transition if way = shut goto closed }
    }
  }
  component Wheels {
    incoming message go with identifier: "/go", type: none
    incoming message turn with identifier: "/turn", type: none
    behaviour { initial marked state on_ground { on request to go  on request to turn } }
  }
  requirement go needs Eye.open and Eye.level > 2
  requirement look needs Eye.closed
}
"""


def supervisor(deployment: Deployment = Deployment.CONTROLLER) -> Supervisor:
    return supervisor_of(model_of(GUARD), deployment)


def log() -> list[Entry]:
    """Look, open, level 5, go."""
    bench = Bench(InterpretedSystem(supervisor()), policy="priority", priority=("look", "go"))
    bench.tick()
    bench.receive("/scan", {"near": 2.0, "level": 5})
    bench.executor.on_reply(1, None)
    bench.tick()
    return World.of(bench)


def violations_of(
    folder: Path, entries: list[Entry], deployment: Deployment = Deployment.CONTROLLER
) -> list[tuple[int, str]]:
    found = check_log(read(folder, entries), supervisor(deployment))
    return [(item.line, item.sentence) for item in found.violations]


def names(entries: list[Entry]) -> list[str]:
    return [str(entry.get("event", entry["kind"])) for entry in entries]


def test_the_log_is_right(tmp_path: Path) -> None:
    entries = log()
    assert names(entries) == [
        "look.request", "scan.response", "level.response", "Eye.tau_1", "look.response", "look.reset", "go.request",
    ]  # fmt: skip
    assert violations_of(tmp_path, entries) == []


def wrong(number: int, **changes: Any) -> list[Entry]:
    """The log with one entry changed."""
    entries = log()
    entries[number - 1] |= changes
    return entries


def without(number: int) -> list[Entry]:
    entries = log()
    del entries[number - 1]
    return entries


_NOTHING_NEAR = {"value.level": 5}


@pytest.mark.parametrize(
    ("entries", "line", "sentence"),
    [
        (wrong(1, event="go.request"), 1, "go.request was not allowed: its requirements do not hold"),
        (wrong(1, event="come.request"), 1, "come.request is not an event of the model"),
        (wrong(7, event="look.request"), 7, "look.request was not allowed: its requirements do not hold"),
        (wrong(6, event="look.request"), 6, "look.request happened although look.reset was still to"),
        (wrong(5, event="look.reset", controllable=True), 5, "look.reset was not allowed: the service is waiting"),
        (without(1), 4, "look.response cannot happen here: the service is idle"),
        (without(6), 6, "go.request happened although look.reset was still to be taken before any request"),
        (without(2), 2, "the state after level.response is not the logged one: Eye.way"),
        (wrong(2, controllable=True), 2, "scan.response is logged as controllable"),
        (wrong(2, data={"value": "wide"}), 2, "scan.response carries no value of the declared type"),
        (wrong(2, data={"value": ["free"]}), 2, "scan.response carries no value of the declared type"),
        (wrong(3, data={"value.level": 10, "value.near": 2.0}), 3, "level.response carries no value.level of the decl"),
        (wrong(3, data={"value.level": True, "value.near": 2.0}), 3, "level.response carries no value.level of the"),
        (
            wrong(3, data={"value.level": 4, "value.near": 2.0}),
            3,
            "the state after level.response is not the logged",
        ),
        (
            wrong(3, data={"value.level": 5, "value.near": 2.5}),
            3,
            "the state after level.response is not the logged",
        ),
    ],
)
def test_what_is_wrong_is_reported_once_with_its_line(
    entries: list[Entry], line: int, sentence: str, tmp_path: Path
) -> None:
    found = violations_of(tmp_path, entries)
    assert found[0][0] == line
    assert found[0][1].startswith(sentence)
    assert len(found) <= 2


def test_a_difference_says_what_is_what(tmp_path: Path) -> None:
    entries = log()
    entries[2]["state"]["Eye"]["variables"] |= {"level": 7, "far": 3.0}
    entries[2]["state"]["Wheels"]["state"] = "in the air"
    sentence = (
        "the state after level.response is not the logged one: Eye.level is 5, not 7; Eye.far is 2.0, not 3.0; Wheels "
        "is in on_ground, not in in the air"
    )
    assert violations_of(tmp_path, entries)[0] == (3, sentence)


def test_what_the_log_leaves_out_is_taken_from_it(tmp_path: Path) -> None:
    assert violations_of(tmp_path, wrong(3, data=_NOTHING_NEAR)) == []


def test_messages_as_they_came_are_converted(tmp_path: Path) -> None:
    """Check messages as nodes in C++ log them."""
    entries = wrong(2, data={"near": 2.0, "level": 5})
    entries[2]["data"] = {"near": 2.0, "level": 5}
    assert violations_of(tmp_path, entries) == []
    entries[1]["data"] = {"near": 0.5, "level": 5}
    assert violations_of(tmp_path, entries)[0][0] == 2


def test_a_request_while_the_robot_is_to_be_at_rest(tmp_path: Path) -> None:
    entries = log()
    stop = {"time": 1.0, "kind": "stop", "what": "scan on /scan is stale"}
    entries.insert(6, stop)
    sentence = "go.request happened while the robot was to be at rest: scan on /scan is stale"
    assert violations_of(tmp_path, entries) == [(8, sentence)]
    entries.insert(7, {"time": 1.0, "kind": "resume", "what": "level is back"})
    assert len(violations_of(tmp_path, entries)) == 1
    entries.insert(8, {"time": 1.0, "kind": "resume", "what": "scan is back"})
    assert violations_of(tmp_path, entries) == []
    entries[6] = {"time": 1.0, "kind": "fault", "what": "it broke"}
    assert violations_of(tmp_path, entries) == [(10, "go.request happened while the robot was to be at rest: a fault")]


def test_a_stop_of_somebody_else_is_not_ended_by_a_sensor_of_that_name(tmp_path: Path) -> None:
    entries = log()
    entries.insert(6, {"time": 1.0, "kind": "stop", "what": "scan on the operator's desk"})
    entries.insert(7, {"time": 1.0, "kind": "resume", "what": "scan is back"})
    assert [line for line, _ in violations_of(tmp_path, entries)] == [9]


PROVIDING = """
robot Giver {
  datatype object Twist { x: double  inner: Inner }
  datatype object Inner { n: integer }
  interface twist use Twist from our_msgs
  component Wheels {
    outgoing message ready with identifier: "/ready", type: none, max_age: 2.0
    outgoing message often with identifier: "/often", type: none
    incoming message go with identifier: "/go", type: Twist links twist
    behaviour {
      variable n: integer(0..9) = 0
      initial marked state on_ground { on request to go  on response from often do n := 1 }
    }
  }
  provide go with { x: 0.1 + 0.2, inner: { n: Wheels.n } }
}
"""
"""Its sensor is awaited, and its data changes."""


def given() -> list[Entry]:
    bench = Bench(InterpretedSystem(supervisor_of(model_of(PROVIDING))), every="event")
    bench.receive("/often", None)
    bench.receive("/ready", None)
    bench.receive("/often", None)
    return World.of(bench)


def violations_of_giver(folder: Path, entries: list[Entry]) -> list[tuple[int, str]]:
    found = check_log(read(folder, entries), supervisor_of(model_of(PROVIDING)))
    return [(item.line, item.sentence) for item in found.violations]


def test_requests_carry_what_the_model_provides(tmp_path: Path) -> None:
    entries = given()
    assert names(entries) == ["often.response", "ready.response", "go.request", "often.response", "go.request"]
    assert entries[4]["data"] == {"x": 0.1 + 0.2, "inner": {"n": 1}}
    assert violations_of_giver(tmp_path, entries) == []
    # The last place of a double is a matter of who computes it.
    entries[4]["data"]["x"] = 0.3
    assert violations_of_giver(tmp_path, entries) == []
    for data in (77, None, {"x": 0.3}, {"x": 0.3, "inner": {"n": 0}}, {"x": 0.31, "inner": {"n": 1}}):
        entries[4]["data"] = data
        ((line, sentence),) = violations_of_giver(tmp_path, entries)
        assert line == 5
        assert sentence.startswith("go.request carries ")
        assert sentence.endswith('where the model provides {"x": 0.30000000000000004, "inner": {"n": 1}}')


def test_nothing_is_requested_before_the_first_message_of_a_sensor_that_may_be_stale(tmp_path: Path) -> None:
    entries = given()
    entries.insert(1, entries.pop(2))
    found = violations_of_giver(tmp_path, entries)
    assert found == [(2, "go.request happened before the first message on /ready")]
    # It may have come with nothing that could be taken.
    entries.insert(1, {"time": 1.0, "kind": "unknown", "event": "ready.response", "unknown": ["value"]})
    assert violations_of_giver(tmp_path, entries) == []


def test_a_log_without_events_has_not_passed(tmp_path: Path) -> None:
    for entries in ([], [{"time": 1.0, "kind": "Event", "event": "go.request"}, {"time": 1.0, "kind": "x"}]):
        found = check_log(read(tmp_path, entries), supervisor())
        assert (found.violation_count, found.has_passed) == (0, False)
        assert found.notes[0] == "the log contains no events; nothing was checked"
    assert found.notes[1] == "2 lines are of an unknown kind and were not checked: 'Event', 'x'"


def test_a_restart_begins_in_the_initial_state(tmp_path: Path) -> None:
    entries = log()
    entries += [{"time": 1.0, "kind": "fault", "what": "x"}, {"time": 1.0, "kind": "restart", "what": ""}, *log()]
    assert violations_of(tmp_path, entries) == []
    del entries[8]
    assert violations_of(tmp_path, entries)[0][0] == 9


def test_what_is_unexpected_must_not_be_possible(tmp_path: Path) -> None:
    unexpected = {"time": 1.0, "kind": "unexpected", "event": "look.response", "data": None}
    assert violations_of(tmp_path, [*log(), unexpected]) == []
    found = violations_of(tmp_path, [log()[0], unexpected])
    assert found == [(2, "look.response is logged as unexpected, but could happen")]


def blocked(identifier: str, why: str) -> Entry:
    return {"time": 1.0, "kind": "blocked", "identifier": identifier, "why": why}


@pytest.mark.parametrize(
    ("entry", "sentence"),
    [
        (blocked("/go", "not allowed now"), ""),
        (blocked("/turn", "not allowed now"), "a request on /turn was held back, but turn.request was allowed"),
        (blocked("/none", "not allowed now"), "a request on /none was held back, but the model has none there"),
        (blocked("/go", "stopped"), "a request on /go was held back as stopped, but nothing stopped it"),
        (
            blocked("look", "its last goal may still be under way"),
            "a request on look was held back, but look.request",
        ),
        (blocked("/turn", "a NaN or an infinity"), ""),
    ],
)
def test_whether_a_layer_was_right_to_hold_a_request_back(entry: Entry, sentence: str, tmp_path: Path) -> None:
    found = violations_of(tmp_path, [entry], Deployment.LAYER)
    assert [text[: len(sentence)] for _, text in found] == [sentence] * bool(sentence)
    assert violations_of(tmp_path, [entry]) == [(1, "a controller holds back nothing, as a layer does")]


def test_a_layer_as_it_is(tmp_path: Path) -> None:
    bench = LayerBench(InterpretedSystem(supervisor(Deployment.LAYER)))
    bench.request("/go")
    bench.request("/turn", {"x": float("nan")})
    bench.receive("/scan", {"near": 2.0, "level": 5})
    bench.request("/go")
    bench.executor.stop("by hand")
    bench.request("/go")
    found = check_log(read(tmp_path, World.of(bench)), supervisor(Deployment.LAYER))
    assert (found.violations, found.blocked, found.unjudged, found.requests) == ((), 3, 1, 1)


def test_a_supervisor_of_another_deployment_is_refused(tmp_path: Path) -> None:
    action = "action a with request: none, response: none, feedback: none links ask"
    text = f"robot R {{ interface ask use Ask from our_msgs component A {{ {action} }} }}"
    made = supervisor_of(model_of(text))
    with pytest.raises(WrongDeploymentError, match="made for the deployment controller, not layer"):
        check_log(read(tmp_path, []), made, Deployment.LAYER)


def test_violations_beyond_the_limit_are_only_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checking, "MAXIMUM_VIOLATIONS", 2)
    found = check_log(read(tmp_path, wrong(1, event="come.request")[:1] * 5), supervisor())
    assert (len(found.violations), found.violation_count, found.has_passed) == (2, 5, False)


LIMITED = """
robot Limited {
  interface sample use Sample from our_msgs
  datatype object Sample { x: double }
  component Wheels {
    incoming message go with identifier: "/go", type: Sample links sample
    outgoing message near with identifier: "/near", type: boolean
    behaviour {
      variable close: boolean
      on response from near do close := value
      initial marked state on_ground { on request to go }
    }
  }
  provide go with { x: 2.0 }
  limit go to { x: -1.0..1.0 }
  limit go to { x: 0.0..0.25 } if Wheels.close
}
"""


def test_a_controller_provides_numbers_within_their_limits(tmp_path: Path) -> None:
    made = supervisor_of(model_of(LIMITED))
    bench = Bench(InterpretedSystem(made))
    bench.tick()
    bench.receive("/near", True)
    bench.tick()
    entries = World.of(bench)
    assert [entry["limited"] for entry in entries if entry["kind"] == "limited"] == [
        ["x: 2.0 -> 1.0"],
        ["x: 2.0 -> 0.25"],
    ]
    assert check_log(read(tmp_path, entries), made).violations == ()
    for entry in entries:
        if entry.get("event") == "go.request":
            entry["data"] = {"x": 2.0}
    found = check_log(read(tmp_path, entries), made)
    assert len(found.violations) == 2
    assert "carries {'x': 2.0}, where the model provides {'x': 1.0}" in found.violations[0].sentence.replace('"', "'")


def test_a_layer_lets_no_number_through_that_is_outside_a_limit(tmp_path: Path) -> None:
    made = supervisor_of(model_of(LIMITED), Deployment.LAYER)
    bench = LayerBench(InterpretedSystem(made))
    bench.request("/go", {"x": -5.0})
    bench.receive("/near", True)
    bench.request("/go", {"x": -5.0})
    entries = World.of(bench)
    assert check_log(read(tmp_path, entries), made).violations == ()
    for entry in entries:
        if entry.get("event") == "go.request":
            entry["data"] = {"x": 0.5}
    (found,) = check_log(read(tmp_path, entries), made).violations
    assert "go.request went through with x = 0.5, which a limit keeps within 0.0..0.25" in found.sentence
