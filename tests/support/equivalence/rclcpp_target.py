"""Generated ROS 2 nodes in C++ on the stand-in for rclcpp, as processes that read what happens line by line."""

import json
import os
import signal
import subprocess
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

import pytest

from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc.targets.ros.runtime.supervised import callers_name
from robosc.targets.ros.topics import servers, topics
from support.equivalence.node_target import IN_CPP, LIMIT_S, NodeTarget, given, node_parameters, set_parts
from support.equivalence.observation import Issued
from support.equivalence.portable import Callers
from support.equivalence.scenario import PERIOD_S, Action, Scenario

yaml: Any = pytest.importorskip("yaml", reason="PyYAML, which reads what the stand-in prints, is not installed")

RUNNING = ('"running', '"waiting for the first message')
"""Beginnings of what a node that has begun reports on `/diagnostics`."""
_SPIN_S = 0.002
_KINDS = ("publish", "call", "goal", "cancel")
# action_msgs/GoalStatus.
_ENDS = {"succeeded": 4, "cancelled": 5, "aborted": 6}


class StandInSurroundings:
    """A node and the test, which is everything around it.

    Args:
        supervisor: Supervisor that the node was generated from.
        program: Program of the node.
        folder: Folder for its output.
        parameters: Parameters of the node beside those of a scenario.
    """

    def __init__(
        self, supervisor: Supervisor, program: Path, folder: Path, parameters: Mapping[str, Any] | None = None
    ) -> None:
        self._deployment = supervisor.deployment
        self._topics = {_on_ros(topic.identifier): topic for topic in topics(supervisor.model)}
        self._servers = {item.identifier: item for item in servers(supervisor.model)}
        self._identifiers = {item.name: item.identifier for item in servers(supervisor.model)}
        self._program = program
        self._output = folder / "output.txt"
        self._errors = folder / "errors.txt"
        self._read = 0
        self._parameters = parameters or {}

    def start(self, scenario: Scenario, folder: Path) -> None:
        """Start the node; every server is there."""
        parameters = {
            name: value for name, value in node_parameters(scenario, folder, self._deployment).items() if value != [""]
        } | dict(self._parameters)
        words = [word for name, value in parameters.items() for word in ("-p", f"{name}:={_parameter(value)}")]
        with self._output.open("wb") as output, self._errors.open("wb") as errors:
            self._process = subprocess.Popen(
                [self._program, "--ros-args", *words],
                stdin=subprocess.PIPE,
                stdout=output,
                stderr=errors,
                text=True,
                env={"PATH": os.environ["PATH"]},
            )
        for name in self._servers:
            self._order("server", name, "1")

    def _order(self, *words: str) -> None:
        self._input.write(" ".join(words) + "\n")
        self._input.flush()

    @property
    def _input(self) -> IO[str]:
        assert self._process.stdin is not None
        return self._process.stdin

    def send(self, topic: str, data: Any) -> None:
        """Publish."""
        self._order("message", topic, _line(data))

    def answer(self, action: Action) -> None:
        """Let a server do it."""
        name = self._identifiers[action.subject]
        match action.do:
            case "reply":
                self._order("answer", name, _line(action.data))
            case "accept":
                self._order("accept", name)
            case "feedback":
                self._order("feedback", name, _line(action.data))
            case "end":
                if action.how == "cancelled":
                    self._order("refuse", name, "0")  # The cancel is accepted.
                self._order("result", name, str(_ENDS[action.how]), _line(action.data))
            case _:
                raise ValueError(action.do)

    def ask(self, action: Action) -> None:
        """Let the existing controller before a layer do it."""
        raise ValueError(action.do)

    def take_issued(self) -> list[Issued]:
        """Return everything that the node issued since the last call."""
        return [found for line in self._new_lines() if (found := self._issued(line))]

    def _new_lines(self) -> list[str]:
        text = self._output.read_text(encoding="utf-8")
        end = text.rfind("\n") + 1
        lines = text[self._read : end].split("\n")[:-1]
        self._read = end
        return lines

    def _issued(self, line: str) -> Issued | None:
        kind, name, text = line.split(" ", 2)
        assert kind in _KINDS, line
        if kind == "publish":
            topic = self._topics.get(name)
            # A message without a field is printed as nothing.
            return (kind, topic.identifier, given(topic.interface, yaml.safe_load(text) or {})) if topic else None
        return kind, self._servers[name].name, set_parts(yaml.safe_load(text)) if text else {}

    def settle(self) -> None:
        """Do nothing: what comes next waits in line."""

    def spin(self) -> None:
        """For a moment."""
        time.sleep(_SPIN_S)
        assert self._process.poll() is None, self._errors.read_text(errors="replace")

    def stop(self) -> None:
        """Stop by a signal; the node does not wait long for the ends of goals."""
        self._order("signal", str(int(signal.SIGTERM)))
        assert self._process.wait(LIMIT_S) == 0, self._errors.read_text(errors="replace")

    def close(self) -> None:
        """End it all."""
        self._process.kill()
        self._process.wait()
        self._input.close()


class RunningSurroundings(StandInSurroundings):
    """A node that runs when the test begins: what is sent before is held, and decides nothing; a layer refuses it."""

    def start(self, scenario: Scenario, folder: Path) -> None:
        """Start the node, and wait until it runs."""
        super().start(scenario, folder)
        began = time.monotonic()
        while not any(f": {word}" in self._output.read_text("utf-8") for word in RUNNING):
            assert time.monotonic() < began + LIMIT_S, self._errors.read_text(errors="replace")
            self.spin()

    def stop(self) -> None:
        """Stop by a signal; a goal whose server says nothing more makes the node end with 1."""
        self._order("signal", str(int(signal.SIGTERM)))
        errors = self._errors.read_text(errors="replace")
        assert self._process.wait(LIMIT_S) == 0 or "may be running" in self._errors.read_text(errors="replace"), errors


class LayerSurroundings(RunningSurroundings):
    """A layer and the test, which is the robot and the existing controller."""

    def __init__(self, supervisor: Supervisor, program: Path, folder: Path) -> None:
        super().__init__(supervisor, program, folder)
        self._callers = Callers()
        self._supervised = {_on_ros(callers_name("", topic.identifier)): topic for topic in self._topics.values()}
        self._offered = {callers_name("", item.identifier): item.name for item in self._servers.values()}

    def ask(self, action: Action) -> None:
        """Let the existing controller do it."""
        name, data = action.subject, action.data
        if action.do == "ask":
            topic = next(item for item in self._topics.values() if item.identifier == name)
            is_twist = topic.interface.type == "Twist"
            self._order("message", _on_ros(callers_name("", name)), _twist(data) if is_twist else _line(data))
            return
        offered = callers_name("", self._identifiers[name])
        if action.do == "ask_cancel":
            self._order("ask_cancel", offered, str(self._callers.last(name)))
        else:
            self._order(action.do, offered, str(self._callers.next(name)), _line(data) or "0")

    def _issued(self, line: str) -> Issued | None:
        kind, name, text = line.split(" ", 2)
        if kind == "publish":
            if name == "/blocked":
                return "blocked", json.loads(yaml.safe_load(text)["data"])["identifier"], {}
            topic = self._supervised.get(name)
            if topic is not None:
                parts = given(topic.interface, yaml.safe_load(text) or {})
                # The stand-in itself fills in what makes a scan one of a whole circle.
                kept = {path: part for path, part in parts.items() if path not in ("range_max", "angle_increment")}
                return "pass", topic.identifier, kept
            topic = self._topics.get(name)
            return (kind, topic.identifier, given(topic.interface, yaml.safe_load(text) or {})) if topic else None
        if name not in self._offered:
            return super()._issued(line)
        number, _, rest = text.partition(" ")
        found: dict[str, Any] = {"caller": int(number)}
        if kind == "ended":
            found["how"], _, rest = rest.partition(" ")
        parts = set_parts(yaml.safe_load(rest) or {}) if rest else {}
        # A default response says only why there is no other.
        parts = {} if list(parts) == ["message"] else parts
        return kind, self._offered[name], {**found, **parts}


class SteppedSurroundings(StandInSurroundings):
    """A node on simulated time, which publishes its state as a typed message each period.

    Args:
        supervisor: Supervisor that the node was generated from.
        program: Program of the node, generated with the typed message.
        folder: Folder for its output.
        package: Name of the node.
    """

    def __init__(self, supervisor: Supervisor, program: Path, folder: Path, package: str) -> None:
        parameters = {"use_sim_time": "true", "publish_state": "true", "state_message": "typed"}
        super().__init__(supervisor, program, folder, parameters)
        self._beginning = f"publish /{package}/state "
        self._periods = 0
        self._states: list[dict[str, Any]] = []
        self._count = 0

    def wait_for_issued(self, count: int) -> None:
        """Wait until the node has issued so much since its start: answers are to what it has asked for."""
        self._wait(lambda: self._count >= count, f"the node does not issue {count} requests")

    def next_state(self) -> dict[str, Any]:
        """Let a period pass, and return the state that the node publishes then."""
        self._periods += 1
        self._order("clock", str(1.0 + self._periods * PERIOD_S))
        self._wait(lambda: bool(self._states), "the node publishes no state")
        return self._states.pop()

    def _wait(self, is_done: Callable[[], bool], problem: str) -> None:
        began = time.monotonic()
        while True:
            for line in self._new_lines():
                if line.startswith(self._beginning):
                    self._states.append(dict(yaml.safe_load(line.removeprefix(self._beginning))))
                elif self._issued(line) is not None:
                    self._count += 1
            if is_done():
                break
            assert time.monotonic() < began + LIMIT_S, problem
            self.spin()

    def first_state(self) -> dict[str, Any]:
        """Let periods pass until the node has begun, and return the first state after that."""
        self._order("clock", "1.0")
        while (state := self.next_state())["status"] == "new":
            pass
        return state


def _on_ros(identifier: str) -> str:
    """The name of a topic where there is no namespace."""
    return "/" + identifier.lstrip("/")


def _twist(data: Any) -> str:
    """The parts of both vectors of a twist."""
    parts = ((data or {}).get(vector, {}).get(axis, 0.0) for vector in ("linear", "angular") for axis in "xyz")
    return " ".join(map(str, parts))


def _parameter(value: Any) -> str:
    return f"[{','.join(value)}]" if isinstance(value, list) else str(value)


def _line(data: Any) -> str:
    """Data as the stand-in reads it: the values, one after the other, texts without ends of lines."""
    if isinstance(data, dict):
        return " ".join(map(_line, data.values()))
    if isinstance(data, list):
        return " ".join(map(_line, data))
    if isinstance(data, str):
        return " ".join(data.splitlines())
    return "" if data is None else str(int(data) if isinstance(data, bool) else data)


def rclcpp_target(supervisor: Supervisor, program: Path, folder: Path) -> NodeTarget:
    """The target `ros2-cpp`, compiled with the stand-in."""
    is_layer = supervisor.deployment is Deployment.LAYER
    surroundings = (LayerSurroundings if is_layer else RunningSurroundings)(supervisor, program, folder)
    sight = replace(IN_CPP, has_requests=not is_layer)
    return NodeTarget("ros2-cpp", supervisor.model, surroundings, folder / "events", sight)
