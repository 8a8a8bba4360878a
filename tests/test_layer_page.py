"""The page about supervision layers: its model does what the page says."""

import re
from pathlib import Path

from robosc.certification import make_supervisor
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.settings import OTHER_DEPLOYMENT, Settings
from robosc.model.structure import Deployment
from support.layers import LayerBench
from support.models import bundle_of, checked

PAGE = (Path(__file__).parents[1] / "docs" / "layer.md").read_text(encoding="utf-8")
(MODEL,) = re.findall(r"^```robosc\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)


def test_the_model_is_sound_and_its_messages_are_told_apart() -> None:
    assert checked(MODEL).diagnostics == ()
    made = make_supervisor(bundle_of(MODEL), deployment=Deployment.LAYER)
    assert made.supervisor is not None, made.reason
    b = LayerBench(InterpretedSystem(made.supervisor))
    fast, still = {"linear": {"x": 0.3}}, {"linear": {"x": 0.0}}
    assert b.request("/cmd_vel", fast) == [("publish", "walk", fast)]
    assert b.request("/cmd_vel", still) == [("publish", "halt", still)]
    b.request("/cmd_vel", fast)
    assert b.receive("/bump") == [("default", "/cmd_vel"), ("pass", "/bump", None)]
    assert b.request("/cmd_vel", fast) == [("blocked", "/cmd_vel")]
    # The missing field is unknown, so it is not `walk`.
    assert b.request("/cmd_vel", {})[0][:2] == ("publish", "halt")


def test_every_setting_that_it_names_is_one() -> None:
    for name in ("command_timeout_s", "service_timeout_s", "action_timeout_s", "release_identifiers", "on_unknown"):
        assert name in Settings._fields
        assert f"`{name}`" in PAGE
    assert all(f"`{name}`" in PAGE for name in OTHER_DEPLOYMENT["layer"])
