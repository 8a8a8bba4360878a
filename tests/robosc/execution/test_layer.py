"""Semantics 3.7: messages of an existing controller, let through or held back."""

import math
from types import SimpleNamespace
from typing import Any

import pytest

from robosc.execution.runtime.runner import DeploymentError, Status
from robosc.execution.runtime.settings import SettingsError
from robosc.model.structure import Deployment
from support.execution import Bench, Sent, system_of
from support.layers import LayerBench, layer

ROBOT = """
robot Drive {
  interface twist use Twist from geometry_msgs
  datatype object Vector { x: double y: double z: double }
  datatype object Twist { linear: Vector angular: Vector }
  component Sensor {
    outgoing message clear with identifier: "/scan", type: boolean
    outgoing message seen with identifier: "/scan", type: boolean
    outgoing message power with identifier: "/power", type: boolean
    behaviour {
      variable is_clear: boolean = true
      variable was_seen: boolean = false
      variable has_power: boolean = true
      on response from clear do is_clear := value
      on response from seen do was_seen := value
      on response from power do has_power := value
      initial marked state awake { }
    }
  }
  component Wheels {
    incoming message move with identifier: "/cmd_vel", type: Twist links twist
    incoming message beep with identifier: "/beep", type: none
    behaviour {
      initial marked state free { on request to move  on request to beep goto silent }
      state silent { transition if Sensor.has_power goto free }
    }
  }
  requirement move needs Sensor.is_clear
}
"""
ON: Any = {"linear": {"x": 0.5}, "angular": {"z": 1.0}}
OFF: Any = {"linear": {"x": 0.0}}
MOVE: Sent = ("publish", "move", ON)
ZERO: Sent = ("default", "/cmd_vel")
BLOCKED: Sent = ("blocked", "/cmd_vel")


def test_what_is_allowed_goes_through_unchanged() -> None:
    b = layer(ROBOT)
    sent = b.request("/cmd_vel", ON)
    assert sent == [MOVE]
    assert sent[0][2] is ON
    (entry,) = b.entries("event")
    assert (entry["event"], entry["controllable"], entry["data"]) == ("move.request", True, ON)


def test_what_is_not_allowed_is_held_back_reported_and_logged() -> None:
    b = layer(ROBOT)
    b.receive("/scan", False)
    assert b.request("/cmd_vel", ON) == [BLOCKED]
    (entry,) = b.entries("blocked")
    assert (entry["identifier"], entry["why"]) == ("/cmd_vel", "not allowed now")
    assert "move.request" not in b.events


def test_the_supervisor_is_asked_anew_for_every_message() -> None:
    b = layer(ROBOT)
    for is_clear in (True, False, True, True, False):
        b.receive("/scan", is_clear)
        assert (MOVE in b.request("/cmd_vel", ON)) is is_clear


def test_silent_steps_run_to_the_end_after_a_request() -> None:
    b = layer(ROBOT)
    assert b.request("/beep") == [("publish", "beep", None)]
    assert b.events == ["beep.request", "Wheels.tau_1"]
    b.receive("/power", False)
    b.request("/beep")
    assert b.state("Wheels") == "silent"
    # Not where the component writes no transition.
    assert b.request("/beep") == [("blocked", "/beep")]
    assert b.request("/cmd_vel", ON) == [BLOCKED]


class Message:
    """A message as ROS has them."""

    __slots__ = ("_covariance", "_twist")

    def __init__(self, twist: Any, covariance: Any) -> None:
        self._twist = twist
        self._covariance = covariance

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        return {"twist": "geometry_msgs/Twist", "covariance": "double[36]"}

    twist = property(lambda self: self._twist)
    covariance = property(lambda self: self._covariance)


NOT_NUMBERS = [math.nan, math.inf, -math.inf]


@pytest.mark.parametrize("number", NOT_NUMBERS)
@pytest.mark.parametrize(
    "make",
    [
        lambda n: {"linear": {"x": n}},
        lambda n: {"linear": {"x": 0.5}, "unknown_to_the_model": [0.0, (1, n)]},
        lambda n: SimpleNamespace(linear=SimpleNamespace(x=0.5, y=n)),
        lambda n: Message(ON, [0.0] * 35 + [n]),
        lambda n: Message(SimpleNamespace(linear={"z": n}), [0.0]),
        lambda n: n,
    ],
)
def test_a_message_with_a_nan_or_an_infinity_anywhere_is_held_back(make: Any, number: float) -> None:
    b = layer(ROBOT)
    assert b.request("/cmd_vel", make(number)) == [BLOCKED]
    assert b.request("/cmd_vel", make(0.25))[0][0] == "publish"


def test_a_message_for_nobody_is_unexpected() -> None:
    b = layer(ROBOT)
    assert b.request("/cmd", ON) == []
    assert b.request("/scan", True) == []
    assert b.executor.counters.unexpected == 2
    assert b.status() is Status.RUNNING


def test_sensor_data_is_passed_on_after_the_supervisor_has_seen_it() -> None:
    b = layer(ROBOT)
    states: list[Any] = []
    b.middleware.on_sent = lambda sent: states.append((sent, b.variable("Sensor", "was_seen"), b.state("Wheels")))
    b.receive("/power", False)
    b.request("/beep")
    states.clear()
    b.receive("/scan", True)
    assert states == [(("pass", "/scan", True), True, "silent")]
    b.receive("/power", True)
    # The silent steps have run, too.
    assert states[-1] == (("pass", "/power", True), True, "free")


def test_what_sensor_data_makes_due_is_released_before_it_is_passed_on() -> None:
    b = layer(ROBOT)
    b.request("/cmd_vel", ON)
    assert b.receive("/scan", False) == [ZERO, ("pass", "/scan", False)]


def test_sensor_data_that_the_model_does_not_know_is_not_passed_on() -> None:
    b = layer(ROBOT)
    assert b.receive("/camera", 1) == []
    assert b.executor.counters.unexpected == 1


def test_sensor_data_is_passed_on_whatever_it_does_to_the_supervisor() -> None:
    text = """
    robot Loud {
      datatype enum Level from double to { value > 1.0 -> high default -> low }
      component Sensor {
        outgoing message level with type: Level
        behaviour { variable seen: Level = low on response from level do seen := value initial marked state awake { } }
      }
    }
    """
    for setting in ("default", "keep", "fault"):
        b = layer(text, on_unknown=setting)
        assert b.receive("level", "no number") == [("pass", "level", "no number")]
        assert b.executor.is_faulty is (setting == "fault")


def test_a_layer_decides_nothing_by_itself() -> None:
    b = layer(ROBOT)
    assert [b.wait(0.1) for _ in range(50)] == [[]] * 50
    assert b.events == []


# Releases.


def test_a_due_release_is_carried_out_at_once() -> None:
    b = layer(ROBOT)
    b.request("/cmd_vel", ON)
    assert ZERO in b.receive("/scan", False)
    assert [entry["identifier"] for entry in b.entries("release")] == ["/cmd_vel"]
    assert ZERO not in b.receive("/scan", False)


def test_nothing_is_released_after_the_default_message_or_one_that_was_held_back() -> None:
    b = layer(ROBOT)
    b.request("/cmd_vel", OFF)
    assert ZERO not in b.receive("/scan", False)
    b.request("/cmd_vel", ON)
    assert ZERO not in b.receive("/scan", True) + b.receive("/scan", False)


TWO = ROBOT.replace(
    "type: Twist links twist",
    "type: Twist, when: value.linear.x != 0.0 links twist\n"
    '    incoming message halt with identifier: "/cmd_vel", type: Twist links twist',
    1,
).replace("on request to move ", "on request to move  on request to halt ")


def test_a_release_does_not_wait_in_a_layer() -> None:
    b = layer(TWO)
    b.request("/cmd_vel", ON)
    # A controller would wait for `halt`, which is enabled.
    assert ZERO in b.receive("/scan", False)
    assert b.system.enabled("halt.request")


def test_what_a_request_makes_due_goes_out_before_it() -> None:
    b = layer(
        ROBOT.replace("requirement move needs Sensor.is_clear", "requirement move needs Wheels.free"),
    )
    b.receive("/power", False)
    b.request("/cmd_vel", ON)
    assert b.request("/beep") == [ZERO, ("publish", "beep", None)]


def test_what_a_request_makes_false_does_not_release_its_own_earlier_message() -> None:
    text = ROBOT.replace("free { on request to move ", "free { on request to move goto silent ")
    b = layer(text.replace("needs Sensor.is_clear", "needs Wheels.free"))
    assert b.request("/cmd_vel", ON) == [MOVE]
    # It went back by itself: `move` is enabled again, and the same message once more releases nothing.
    b.receive("/power", False)
    assert b.request("/cmd_vel", ON) == [MOVE]


@pytest.mark.parametrize("timeout_s", [1.0, 0.25])
def test_a_silent_caller_is_released(timeout_s: float) -> None:
    b = layer(ROBOT) if timeout_s == 1.0 else layer(ROBOT, command_timeout_s=timeout_s)
    b.request("/cmd_vel", ON)
    assert b.wait(timeout_s * 0.75) == []
    assert b.request("/cmd_vel", ON) == [MOVE]
    assert b.wait(timeout_s * 0.75) == []
    assert b.wait(timeout_s * 0.25) == [ZERO]
    assert len(b.entries("release")) == 1
    assert b.wait(timeout_s) == []
    assert b.request("/cmd_vel", ON) == [MOVE]


def test_zero_means_that_a_caller_may_be_silent_for_ever() -> None:
    b = layer(ROBOT, command_timeout_s=0)
    b.request("/cmd_vel", ON)
    assert b.wait(1e9) == []


def test_a_caller_that_stopped_may_be_silent() -> None:
    b = layer(ROBOT)
    b.request("/cmd_vel", ON)
    b.request("/cmd_vel", OFF)
    assert b.wait(100.0) == []


def test_whatever_arrives_shows_that_the_caller_is_there() -> None:
    b = layer(ROBOT)
    b.request("/cmd_vel", ON)
    for _ in range(10):
        b.wait(0.75)
        assert b.request("/cmd_vel", {"linear": {"x": math.nan}}) == [BLOCKED]
    b.wait(0.75)
    # Somewhere else is not there.
    assert b.request("/beep")[0][0] == "publish"
    assert b.wait(0.25) == [ZERO]


def test_silence_is_over_before_what_comes_at_the_same_moment() -> None:
    b = layer(ROBOT)
    b.request("/cmd_vel", ON)
    b.clock.advance(1.0)
    assert b.request("/cmd_vel", ON) == [ZERO, MOVE]


@pytest.mark.parametrize("value", [-1, math.inf, math.nan, "1", True, None])
def test_the_command_timeout_is_a_number_of_seconds(value: Any) -> None:
    with pytest.raises(SettingsError, match="command_timeout_s"):
        layer(ROBOT, command_timeout_s=value)


@pytest.mark.parametrize("setting", [{"policy": "random"}, {"priority": ("move",)}, {"seed": 3}, {"every": "event"}])
def test_settings_of_decisions_mean_nothing_in_a_layer(setting: Any) -> None:
    with pytest.raises(SettingsError, match="means nothing in the deployment 'layer'"):
        layer(ROBOT, **setting)


def test_the_command_timeout_means_nothing_in_a_controller() -> None:
    with pytest.raises(SettingsError, match="means nothing in the deployment 'controller'"):
        Bench(system_of(ROBOT), command_timeout_s=2.0)


# Several messages on one identifier.

WHEN = """
robot Several {
  interface order use Order from shop_msgs
  datatype object Order { kind: integer level: integer(0..9) }
  component Robot {
    incoming message first with identifier: "/order", type: Order, when: value.kind = 1 or 6 / value.kind > 3.0
      links order
    incoming message second with identifier: "/order", type: Order, when: value.kind >= 1 and value.level > 2
      links order
    incoming message third with identifier: "/order", type: Order, when: value.kind < 0
      links order
    incoming message only with identifier: "/only", type: integer, when: value > 0
    outgoing message poke with type: none
    behaviour {
      initial marked state one {
        on request to first  on request to second  on request to third  on request to only
        on response from poke goto two
      }
      marked state two { on request to second  on request to only }
    }
  }
}
"""


@pytest.mark.parametrize(
    ("kind", "level", "expected"),
    [
        (1, 5, "first"),
        (2, 5, "second"),
        (3, 1, None),
        (-1, 0, "third"),
        # 6 / 0 is unknown, so `first` is none; nor is any other true.
        (0, 5, None),
        ("no number", 5, None),
        (None, None, None),
    ],
)
def test_a_message_is_the_first_whose_condition_is_true_else_it_is_held_back(
    kind: Any, level: Any, expected: str | None
) -> None:
    b = layer(WHEN)
    message = {"kind": kind, "level": level}
    blocked = [("blocked", "/order")]
    assert b.request("/order", message) == (blocked if expected is None else [("publish", expected, message)])


def test_it_is_that_message_even_if_only_another_were_allowed() -> None:
    b = layer(WHEN)
    b.receive("poke")
    # It is `first`, though the condition of `second` is true as well.
    assert b.request("/order", {"kind": 1, "level": 5}) == [("blocked", "/order")]
    assert b.request("/order", {"kind": 2, "level": 5})[0][:2] == ("publish", "second")


def test_a_condition_counts_for_a_message_that_shares_its_identifier_with_none() -> None:
    b = layer(WHEN)
    assert b.request("/only", 1) == [("publish", "only", 1)]
    assert b.request("/only", 0) == [("blocked", "/only")]


def test_a_number_outside_its_declared_range_is_judged_at_the_bound_counted_logged_and_sent_as_it_came() -> None:
    b = layer(WHEN)
    message = {"kind": 2, "level": 100}
    assert b.request("/order", message) == [("publish", "second", message)]
    assert b.executor.counters.unknown == 1
    assert b.entries("unknown")[0]["event"] == "second.request"


ENUM = """
robot Moody {
  datatype enum Mood from double to { 1.0 / value > 2.0 -> happy default -> sad }
  component Robot {
    incoming message smile with identifier: "/face", type: Mood, when: value = happy
    incoming message cry with identifier: "/face", type: Mood
  }
}
"""


def test_an_unknown_enum_decides_as_the_setting_says() -> None:
    b = layer(ENUM)
    assert b.request("/face", 0.25) == [("publish", "smile", 0.25)]
    assert b.request("/face", 0.0) == [("publish", "cry", 0.0)]
    assert b.executor.counters.unknown == 1
    b = layer(ENUM, on_unknown="keep")
    assert b.request("/face", 0.0) == [("blocked", "/face")]
    b = layer(ENUM, on_unknown="fault")
    assert b.request("/face", 0.0) == [("blocked", "/face")]
    assert b.executor.is_faulty


def test_a_model_that_cannot_tell_its_messages_apart_is_refused() -> None:
    text = ENUM.replace(", when: value = happy", "")
    with pytest.raises(DeploymentError, match=r"'smile' or 'cry'.*'when: CONDITION'"):
        LayerBench(system_of(text))
    # A controller sends them itself.
    Bench(system_of(text))


def test_a_model_without_actions_takes_a_supervisor_of_either_deployment() -> None:
    for deployment in Deployment:
        b = LayerBench(system_of(ROBOT, deployment))
        assert b.request("/cmd_vel", ON) == [MOVE]
