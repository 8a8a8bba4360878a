"""The typed state of generated ROS 2 nodes, with messages that take what stands in their definitions."""

import importlib
import sys
import types
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from robosc.interfaces.definitions import parse_definition
from robosc.supervisor import Supervisor
from robosc.targets import GeneratedFiles, GenerateOptions, StateMessage, generate
from support.equivalence.python_targets import generated_python
from support.equivalence.scenario import Scenario
from support.generated import imported

TYPES = ("SupervisorState", "ComponentState", "VariableValue")

_PACKAGE = "node_in_python"


class Node:
    """Makes publishers that keep what is published."""

    def __init__(self) -> None:
        self.published: dict[str, list[Any]] = {}

    def create_publisher(self, type_: Any, topic: str, quality: Any) -> Any:
        """A publisher."""
        return SimpleNamespace(publish=self.published.setdefault(topic, []).append)

    def get_clock(self) -> Any:
        """A clock that shows one time."""
        return SimpleNamespace(now=lambda: SimpleNamespace(to_msg=lambda: "now"))


def _strict(names: list[str]) -> type:
    """A class of messages that takes what is in their definition, as those of ROS do."""

    def make(self: Any, **given: Any) -> None:
        assert set(given) <= set(names)
        vars(self).update(header=SimpleNamespace(stamp=None), **given)

    return type("Message", (), {"__init__": make})


def install_messages(files: GeneratedFiles, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the messages of a package found where a built one would be."""
    module: Any = types.ModuleType("robosc_msgs.msg")
    for name in TYPES:
        (part,) = parse_definition(files[f"msg/{name}.msg"], "robosc_msgs")
        setattr(module, name, _strict(list(part.fields)))
    monkeypatch.setitem(sys.modules, "robosc_msgs", types.ModuleType("robosc_msgs"))
    monkeypatch.setitem(sys.modules, "robosc_msgs.msg", module)


def states_in_python(
    supervisor: Supervisor, scenario: Scenario, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> list[Any]:
    """Return the typed states that the node in Python publishes in a run, one for each period, without headers."""
    install_messages(generate(supervisor, "ros2-msgs"), monkeypatch)
    options = GenerateOptions(package=_PACKAGE, state_message=StateMessage.TYPED)
    node = Node()
    with imported(generate(supervisor, "ros2", options), folder, f"{_PACKAGE}.state_publisher") as generated:
        topic = importlib.import_module(f"{_PACKAGE}.state_topic")
        system = topic.RecordingSupervisor()
        target = generated_python(supervisor, importlib.import_module(f"{_PACKAGE}.supervisor"), system)
        publisher = generated.StatePublisher(node, "", "typed")
        target.start(scenario)
        for action in scenario.actions:
            target.do(action)
            if action.do == "tick":
                publisher.publish(target.executor, system.look(), topic.text_of)
    return [_plain(message) for message in node.published["~/state"]]


def _plain(value: Any) -> Any:
    """A message as dicts, lists and basic values, without its header."""
    if isinstance(value, list):
        return [_plain(item) for item in value]
    if not hasattr(value, "__dict__"):
        return value
    return {name: _plain(part) for name, part in vars(value).items() if name != "header"}
