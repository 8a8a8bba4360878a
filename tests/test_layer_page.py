"""The page about supervision layers: its models do what the page says, whatever the caller sends."""

import math
import re
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from robosc.certification import make_supervisor
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.settings import OTHER_DEPLOYMENT, Settings
from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from support.layers import LayerBench
from support.models import bundle_of, checked

PAGE = (Path(__file__).parents[1] / "docs" / "layer.md").read_text(encoding="utf-8")
MODELS = {
    re.findall(r"robot (\w+)", text)[0]: text
    for text in re.findall(r"^```robosc\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)
}
WHEELS = "/cmd_vel"
ZERO = ("default", WHEELS)


@cache
def supervisor(name: str) -> Supervisor:
    made = make_supervisor(bundle_of(MODELS[name]), deployment=Deployment.LAYER)
    assert made.diagnostics == ()
    assert made.supervisor is not None, made.reason
    return made.supervisor


def bench(name: str) -> LayerBench:
    return LayerBench(InterpretedSystem(supervisor(name)))


def twist(x: float = 0.0, y: float = 0.0, turn: float = 0.0) -> dict[str, Any]:
    return {"linear": {"x": x, "y": y, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": turn}}


MOTIONS = {
    "forwards": twist(0.8),
    "backwards": twist(-0.8),
    "sideways": twist(y=0.8),
    "turning": twist(turn=1.5),
    "everything": twist(0.8, -0.8, 1.5),
}
BAD = (twist(math.nan), twist(turn=math.inf), twist(y=-math.inf), {**twist(0.1), "other": [math.nan]})


@pytest.mark.parametrize("name", MODELS)
def test_the_models_are_sound(name: str) -> None:
    assert checked(MODELS[name]).diagnostics == ()
    assert supervisor(name)


def test_there_is_a_model_for_each_pattern() -> None:
    assert list(MODELS) == ["Stop", "OneAxis", "SlowZone", "Walker", "Carrier"]


def ready(name: str) -> LayerBench:
    """A layer that lets its caller drive."""
    b = bench(name)
    for identifier, value in {"/bumper": False, "/front/near": False, "/person/distance": 9.0}.items():
        if identifier in b.executor._batches:
            b.receive(identifier, value)
    return b


@pytest.mark.parametrize("name", ["Stop", "OneAxis", "SlowZone", "Walker"])
def test_no_bad_number_goes_through_and_no_velocity_outlives_its_caller(name: str) -> None:
    b = ready(name)
    for message in BAD:
        assert b.request(WHEELS, message) == [("blocked", WHEELS)]
    assert set(b.middleware.reasons) == {"a NaN or an infinity"}
    assert b.request(WHEELS, twist(0.05))[0][0] == "publish"
    for _ in range(3):
        b.receive(*_refreshing(name))
        assert [item for item in b.wait(0.3) if item[0] != "pass"] == []
    assert ZERO in b.wait(0.3), "a stale command goes on acting"
    b.receive(*_refreshing(name))
    assert b.request(WHEELS, twist())[0][0] == "publish", "the robot can always be stopped"


def _refreshing(name: str) -> tuple[str, Any]:
    """A message of the robot that changes nothing."""
    return {
        "Stop": ("/bumper", False),
        "OneAxis": ("/front/near", False),
        "SlowZone": ("/person/distance", 9.0),
        "Walker": ("/nothing", None),
    }[name]


def test_stop() -> None:
    b = ready("Stop")
    for message in MOTIONS.values():
        assert b.request(WHEELS, message) == [("publish", "drive", message)]
    assert ZERO in b.receive("/bumper", True)
    for message in MOTIONS.values():
        assert b.request(WHEELS, message) == [("blocked", WHEELS)], "nothing that moves passes as a halt"
    assert set(b.middleware.reasons) == {"not allowed now"}
    assert b.request(WHEELS, twist()) == [("publish", "halt", twist())]


def test_one_axis() -> None:
    b = ready("OneAxis")
    sent = {name: b.request(WHEELS, message)[0][2] for name, message in MOTIONS.items()}
    assert sent["sideways"] == twist()
    assert sent["everything"] == twist(0.8, 0.0, 1.5)
    assert sent["forwards"] == MOTIONS["forwards"]
    assert b.request(WHEELS, MOTIONS["forwards"])
    assert ZERO in b.receive("/front/near", True), "what acts is outside its limit now"
    sent = {name: b.request(WHEELS, message)[0][2] for name, message in MOTIONS.items()}
    assert sent["forwards"] == sent["sideways"] == twist()
    assert sent["backwards"] == MOTIONS["backwards"]
    assert sent["turning"] == MOTIONS["turning"]
    assert sent["everything"] == twist(0.0, 0.0, 1.5)
    assert ZERO not in b.receive("/front/near", False)


def test_slow_zone() -> None:
    b = bench("SlowZone")
    assert b.request(WHEELS, twist(0.05)) == [("blocked", WHEELS)], "nobody has seen whether somebody is there"
    b.receive("/person/distance", 9.0)
    assert b.request(WHEELS, MOTIONS["everything"]) == [("publish", "drive", MOTIONS["everything"])]
    assert ZERO in b.receive("/person/distance", 1.0)
    assert b.request(WHEELS, MOTIONS["everything"]) == [("publish", "drive", twist(0.1, -0.1, 0.5))]
    assert b.executor.counters.limited == 3
    assert b.log.entries[-2]["limited"] == ["linear.x: 0.8 -> 0.1", "linear.y: -0.8 -> -0.1", "angular.z: 1.5 -> 0.5"]
    assert b.request(WHEELS, twist(0.05)) == [("publish", "drive", twist(0.05))]
    assert ZERO not in b.receive("/person/distance", 1.2)
    assert ZERO in b.receive("/person/distance", 0.1)
    assert b.request(WHEELS, twist(0.05)) == [("blocked", WHEELS)]
    assert ZERO not in b.receive("/person/distance", math.nan)
    assert b.request(WHEELS, twist(0.05)) == [("blocked", WHEELS)], "an unknown distance is no distance"


def test_messages_of_ones_own() -> None:
    b = bench("Walker")
    assert [b.request(WHEELS, MOTIONS[name])[0][:2] for name in ("forwards", "backwards", "turning")] == [
        ("publish", "walk"),
        ("publish", "walk"),
        ("publish", "turn"),
    ]
    for name in ("sideways", "everything"):
        assert b.request(WHEELS, MOTIONS[name]) == [("blocked", WHEELS)]
    assert set(b.middleware.reasons) == {"no message of the model"}
    b.request(WHEELS, MOTIONS["forwards"])
    assert b.receive("/bump") == [ZERO, ("pass", "/bump", None)]
    assert b.request(WHEELS, MOTIONS["forwards"]) == [("blocked", WHEELS)]
    assert b.request(WHEELS, twist()) == [("publish", "halt", twist())]
    assert b.request(WHEELS, {})[0][0] == "publish", "what is not given is zero"
    assert b.request(WHEELS, MOTIONS["turning"])[0][:2] == ("publish", "turn")


def test_goals_and_calls() -> None:
    b = bench("Carrier")
    assert b.call("up", "a", {"data": True})[0][:2] == ("call", "up")
    b.reply(1, {"success": True})
    assert b.goal("navigate", "g") == [("reject", "navigate", "g"), ("blocked", "/navigate_to_pose")]
    assert b.middleware.reasons == ["not allowed now"] * 2
    # Either name stands for the one service.
    assert b.call("up", "b", {"data": False})[0][:2] == ("call", "down")
    b.reply(2, {"success": True})
    assert b.goal("navigate", "h")[-1] == ("accept", "navigate", "h")
    assert b.call("down", "c", {"data": True}) == [("no answer", "down", "c"), ("blocked", "/arm")]
    assert b.call("up", "d", {"data": math.nan}) == [("no answer", "up", "d"), ("blocked", "/arm")]
    assert b.call("up", "e", {"data": None})[0][:2] == ("call", "down")


def test_every_setting_that_it_names_is_one() -> None:
    for name in ("command_timeout_s", "service_timeout_s", "action_timeout_s", "release_identifiers", "on_unknown"):
        assert name in Settings._fields
        assert f"`{name}`" in PAGE
    assert all(f"`{name}`" in PAGE for name in OTHER_DEPLOYMENT["layer"])
