"""Limits in the executors: numbers of any kind of message are moved, in copies."""

from types import SimpleNamespace
from typing import Any

import pytest

from robosc.execution.runtime.limits import is_within, limited
from support.execution import Bench, system_of
from support.layers import layer

X = (("linear", "x"), -0.5, 0.5)


@pytest.mark.parametrize(
    ("message", "bounds", "result"),
    [
        ({"linear": {"x": 2.0, "y": 3.0}}, [X], {"linear": {"x": 0.5, "y": 3.0}}),
        ({"linear": {"x": -2}}, [X], {"linear": {"x": -0.5}}),
        ({"linear": {"x": 0.25}}, [X], {"linear": {"x": 0.25}}),
        ({}, [X], {}),
        (None, [(("x",), 1.0, 2.0)], {"x": 1.0}),
        (None, [((), 1, 2)], 1),
        (7, [((), 0, 3)], 3),
        ({"linear": {"x": 2.0}}, [X, (("linear", "x"), 0.0, 0.25)], {"linear": {"x": 0.25}}),
        ({"linear": {"x": -2.0}}, [(("linear", "x"), 0.0, 0.25), X], {"linear": {"x": 0.0}}),
        ({"linear": {"x": 0.0}}, [X, (("linear", "x"), 0.75, 1.0)], None),
        ({"linear": {"x": "fast"}}, [X], None),
        ({"linear": {"x": True}}, [X], None),
        ({"linear": {"x": float("nan")}}, [X], None),
    ],
)
def test_each_number_goes_to_the_nearest_one_that_all_allow(message: Any, bounds: Any, result: Any) -> None:
    found = limited(message, bounds)
    assert (None if found is None else found.message) == result
    assert is_within(message, bounds) == (found is not None and found.message == message)


def test_an_object_is_changed_in_a_copy() -> None:
    inner = SimpleNamespace(x=2.0, y=1.0)
    message = SimpleNamespace(linear=inner, angular=3)
    found = limited(message, [X])
    assert found is not None
    assert found.message.linear.x == 0.5
    assert (found.message.linear.y, found.message.angular) == (1.0, 3)
    assert (message.linear, inner.x) == (inner, 2.0)
    assert found.moved == ("linear.x: 2.0 -> 0.5",)


def test_a_float_of_a_message_stays_a_float() -> None:
    found = limited(SimpleNamespace(x=7.5), [(("x",), 0, 3)])
    assert found is not None
    assert isinstance(found.message.x, float)


ROBOT = """robot R {
    interface sample use Twist from geometry_msgs
    interface ask use Ask from our_msgs
    datatype object Vector { x: double }
    datatype object Twist { linear: Vector }
    datatype object Order { level: integer }
    component Base {
        incoming message go with identifier: "/go", type: Twist links sample
        service low with identifier: "/order", request: Order, response: none, when: value.level < 5 links ask
        service high with identifier: "/order", request: Order, response: none links ask
        outgoing message near with identifier: "/near", type: integer(0..2)
        behaviour {
            variable at: integer(0..2)
            on response from near do at := value
            initial marked state still { on request to go on request to low on request to high }
        }
    }
    provide go with { linear: { x: 2.0 } }
    limit go to { linear: { x: -1.0..1.0 } } if Base.at > 0
    limit go to { linear: { x: 0.0..3.0 } } if 1 / (Base.at - 1) > 0
    limit high to { level: 0..10 }
}"""


def test_a_controller_issues_what_is_within_its_limits_and_counts() -> None:
    b = Bench(system_of(ROBOT), policy="priority", priority=("go",))
    b.tick()
    b.receive("/near", 2)
    b.tick()
    b.tick()
    sent = [item[2]["linear"]["x"] for item in b.middleware.sent if item[0] == "publish"]
    assert sent == [2.0, 1.0, 1.0]
    assert b.executor.counters.limited == 2


def test_a_limit_that_returns_releases_what_was_sent_without_it() -> None:
    b = Bench(system_of(ROBOT), policy="priority", priority=("go",))
    for near in (2, 0):
        b.receive("/near", near)
        b.tick()
    assert [item[2]["linear"]["x"] for item in b.middleware.sent] == [1.0, 2.0]
    assert b.receive("/near", 2) == [("default", "/go")]


def test_an_unknown_condition_applies_and_what_violates_a_limit_is_released() -> None:
    b = layer(ROBOT)
    fast, back = ({"linear": {"x": x}} for x in (2.0, -0.5))
    assert b.request("/go", fast) == [("publish", "go", fast)]
    assert ("default", "/go") in b.receive("/near", 2)
    assert b.request("/go", back) == [("publish", "go", {"linear": {"x": 0.0}})]
    assert ("default", "/go") not in b.receive("/near", 2)
    # With 1 the second condition divides by zero.
    b.receive("/near", 1)
    assert b.request("/go", back) == [("publish", "go", {"linear": {"x": 0.0}})]


def test_calls_on_one_name_are_told_apart_before_they_are_limited() -> None:
    b = layer(ROBOT)
    assert b.call("low", "a", {"level": 4}) == [("call", "low", 1, {"level": 4})]
    assert b.call("low", "b", {"level": 40}) == [("call", "high", 2, {"level": 10})]
    assert b.reply(2, None)[0][:3] == ("answer", "high", "b")
    assert [entry["limited"] for entry in b.log.entries if entry["kind"] == "limited"] == [["level: 40 -> 10"]]
