"""Semantics 3.8 in a supervision layer: wheels stop whatever happens, and nothing goes through."""

from typing import Any

import pytest

from robosc.execution.runtime.runner import Status
from robosc.model.structure import Deployment
from support.execution import Broken, Sent, system_of
from support.layers import LayerBench, layer

ROBOT = """
robot Robot {
  interface twist use Twist from geometry_msgs
  interface trigger use Trigger from std_srvs
  datatype object Vector { x: double }
  datatype object Twist { linear: Vector }
  datatype object Empty { }
  component Sensor {
    outgoing message scan with identifier: "/scan", type: boolean
    outgoing message battery with identifier: "/battery", type: double
    behaviour {
      variable seen: boolean
      on response from scan do seen := value
      initial marked state awake { }
    }
  }
  component Wheels {
    incoming message move with identifier: "/cmd_vel", type: Twist links twist
    incoming message spin with identifier: "/spin", type: Twist links twist
    service ask with identifier: "/ask", request: none, response: Empty links trigger
  }
}
"""
ON: Any = {"linear": {"x": 0.5}}
MOVE: Sent = ("publish", "move", ON)
BLOCKED: Sent = ("blocked", "/cmd_vel")
ZEROS: list[Sent] = [("default", "/cmd_vel"), ("default", "/spin")]


def moving(**settings: Any) -> LayerBench:
    b = layer(ROBOT, **settings)
    assert b.request("/cmd_vel", ON) == [MOVE]
    return b


@pytest.mark.parametrize("is_fault", [False, True])
def test_a_stop_sends_the_default_everywhere_and_lets_nothing_through(is_fault: bool) -> None:
    b = moving()
    assert b.during(b.executor.stop, "broken", is_fault) == ZEROS
    assert b.request("/cmd_vel", ON) == [BLOCKED]
    assert b.request("/cmd_vel", {"linear": {"x": 0.0}}) == [BLOCKED]
    assert b.entries("blocked")[0]["why"] == "stopped"
    assert b.status() is Status.STOPPED
    assert b.executor.is_faulty is is_fault


def test_sensor_data_is_still_handled_and_passed_on() -> None:
    b = moving()
    b.executor.stop("SIGTERM")
    assert b.receive("/scan", True) == [("pass", "/scan", True)]
    assert b.variable("Sensor", "seen") is True


def test_nothing_goes_through_before_the_start() -> None:
    b = LayerBench(system_of(ROBOT, Deployment.LAYER), start=False)
    assert b.request("/cmd_vel", ON) == [BLOCKED]
    assert b.call("ask", 1) == [("no answer", "ask", 1), ("blocked", "/ask")]
    assert b.receive("/scan", True) == []
    assert b.wait(1.0) == []
    assert {entry["why"] for entry in b.entries("blocked")} == {"not started"}


def test_after_a_fault_it_stays_stopped_until_a_restart_in_the_initial_state() -> None:
    b = moving()
    b.receive("/scan", True)
    b.executor.stop("broken", is_fault=True)
    b.wait(1000.0)
    assert b.request("/cmd_vel", ON) == [BLOCKED]
    b.executor.restart()
    assert b.variable("Sensor", "seen") is False
    assert b.request("/cmd_vel", ON) == [MOVE]


def test_a_restart_without_a_stop_brings_the_robot_to_rest_first() -> None:
    b = moving()
    assert b.during(b.executor.restart) == ZEROS
    # Actions of before act no longer.
    assert b.wait(10.0) == []


def test_nothing_goes_through_before_the_first_message_of_a_sensor_with_a_maximum_age() -> None:
    b = layer(ROBOT, max_age_s={"/scan": 1.0})
    assert b.request("/cmd_vel", ON) == [BLOCKED]
    assert b.entries("blocked")[0]["why"] == "waiting for sensors"
    b.receive("/scan", True)
    assert b.request("/cmd_vel", ON) == [MOVE]


def test_a_stale_sensor_stops_the_robot_and_its_return_ends_that() -> None:
    b = layer(ROBOT, max_age_s={"/scan": 0.5})
    b.receive("/scan", True)
    b.request("/cmd_vel", ON)
    b.clock.advance(0.5)
    # Noticed by the request itself, if nothing came before.
    assert b.request("/cmd_vel", ON) == [*ZEROS, BLOCKED]
    assert "stale" in b.executor.reasons[0]
    assert b.receive("/battery", 1.0) == [("pass", "/battery", 1.0)]
    assert b.request("/cmd_vel", ON) == [BLOCKED]
    assert b.receive("/scan", True) == [("pass", "/scan", True)]
    assert b.request("/cmd_vel", ON) == [MOVE]
    assert not b.executor.is_faulty


@pytest.mark.parametrize("method", ["publish", "is_default", "pass_on", "blocked", "answer_default", "answer"])
def test_an_exception_of_either_side_stops_the_robot(method: str) -> None:
    b = layer(ROBOT)
    b.call("ask", 1)
    b.middleware.failing.add(method)
    b.executor.on_call("ask", 2, None)
    b.executor.on_reply(1, {})
    b.executor.on_request("/cmd_vel", ON)
    b.executor.receive("/scan", True)
    assert b.executor.is_faulty
    assert all(item in b.middleware.sent for item in ZEROS)
    sent = b.request("/cmd_vel", ON)
    assert sent == (ZEROS if method == "blocked" else [BLOCKED])
    b.middleware.failing.clear()
    b.executor.restart()
    assert b.request("/cmd_vel", ON) == [MOVE]


@pytest.mark.parametrize("method", ["enabled", "matches", "step", "enabled_silent", "conjuncts", "read"])
def test_an_exception_of_the_system_stops_the_robot_and_holds_back_what_came(method: str) -> None:
    system = Broken(system_of(ROBOT, Deployment.LAYER), method)
    b = LayerBench(system)
    b.request("/cmd_vel", ON)
    system.is_broken = True
    assert ("pass", "/scan", True) in b.receive("/scan", True)
    sent = b.request("/cmd_vel", ON)
    assert BLOCKED in sent
    assert MOVE not in sent
    assert b.executor.is_faulty
    assert b.middleware.sent.count(ZEROS[0]) == 1


def test_a_robot_that_cannot_be_brought_to_rest_is_tried_again() -> None:
    b = moving()
    b.middleware.failing.add("publish_default")
    b.executor.stop("SIGINT")
    assert b.wait(0.1) == []
    b.middleware.failing.clear()
    assert b.wait(0.1) == ZEROS
    assert b.wait(0.1) == []


def test_a_broken_clock_lets_nothing_through(monkeypatch: pytest.MonkeyPatch) -> None:
    b = moving()
    monkeypatch.setattr(b.clock, "now_s", None)
    monkeypatch.setattr(type(b.clock), "monotonic", lambda clock: clock.now_s + 1.0)
    assert b.request("/cmd_vel", ON) == [BLOCKED, *ZEROS]
    assert b.call("ask", 1) == [("no answer", "ask", 1), ("blocked", "/ask"), *ZEROS]


LAST_MOMENT = """
robot Robot {
  interface dock use Dock from irobot_msgs
  interface trigger use Trigger from std_srvs
  component Wheels {
    incoming message move with identifier: "/cmd_vel", type: double
    action park with identifier: "/park", request: none, response: none, feedback: none links dock
    service ask with identifier: "/ask", request: none, response: none links trigger
  }
}
"""


def broken_at_the_deadline() -> LayerBench:
    """A goal and a call are under way, and the release that is due next cannot be sent."""
    b = layer(LAST_MOMENT, release_identifiers=("/cmd_vel",), command_timeout_s=1.0)
    b.request("/cmd_vel", 0.5)
    b.goal("park", "g")
    b.executor.on_goal_accepted(1)
    b.call("ask", "c")
    b.clock.advance(1.5)
    b.middleware.failing = {"publish_default"}
    return b


def test_what_comes_at_the_moment_of_a_fault_is_still_handled() -> None:
    b = broken_at_the_deadline()
    assert ("end", "park", "g", "succeeded", 7) in b.end(1, "succeeded", 7)
    assert b.executor.is_faulty
    assert ("answer", "ask", "c", 3) in b.reply(1, 3)
    b.middleware.failing = set()
    b.wait(1.0)
    b.during(b.executor.restart)
    # The action is not dead.
    assert any(sent[0] == "goal" for sent in b.goal("park", "h"))
