"""Tests of input that comes while a node waits for its servers: held, and taken in before the first decision."""

import importlib
import signal
import subprocess
import sys
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.runner import Status
from robosc.execution.runtime.settings import Settings
from robosc.model.structure import Deployment
from robosc.targets import generate
from robosc.targets.files import write_files
from robosc.targets.ros.runtime.startup import HeldMessages
from robosc.targets.ros.runtime.startup_controller import StartupBufferingExecutor
from robosc.targets.ros.runtime.startup_layer import StartupBufferingLayer
from support.execution import RecordingMiddleware, system_of, unsupervised
from support.generated import imported
from support.layers import BothSides

MODEL = """
robot Guarded {
    interface trigger use Trigger from std_srvs
    component Drive {
        incoming message go with identifier: "/go", type: none
        outgoing message beat with identifier: "/beat", type: none
        outgoing message stop with identifier: "/stop", type: none
        service ask with identifier: "/ask", request: none, response: none links trigger
        behaviour {
            on response from stop goto stopped
            initial marked state fine { on request to go on request to ask }
            marked state stopped { }
        }
    }
}
"""


def executor_of(clock: ManualClock, **settings: Any) -> tuple[StartupBufferingExecutor, RecordingMiddleware]:
    middleware = RecordingMiddleware()
    return StartupBufferingExecutor(system_of(MODEL), middleware, Settings(**settings), clock), middleware


def test_of_each_topic_the_last_messages_are_held_in_order() -> None:
    held = HeldMessages({"/a": 2, "/b": 1})
    for number, identifier in enumerate(("/a", "/b", "/a", "/b", "/a")):
        held.hold(identifier, f"message {number}", float(number))
    assert held.take() == [("/a", "message 2", 2.0), ("/b", "message 3", 3.0), ("/a", "message 4", 4.0)]
    assert held.take() == []


@pytest.mark.parametrize("every", ["period", "event"])
def test_a_stop_that_came_early_comes_before_every_decision(every: str) -> None:
    clock = ManualClock()
    executor, middleware = executor_of(clock, every=every)
    executor.start_with([("/beat", None, clock.monotonic()), ("/stop", None, clock.monotonic())])
    executor.tick()
    assert executor.status is Status.RUNNING
    assert middleware.sent == []


def test_after_the_start_each_event_brings_a_decision_as_before() -> None:
    clock = ManualClock()
    executor, middleware = executor_of(clock, every="event")
    executor.start_with([("/beat", None, clock.monotonic())])
    assert middleware.sent == []
    executor.receive("/beat", None)
    assert [sent[:2] for sent in middleware.sent] == [("publish", "go")]


def test_the_age_of_what_came_early_counts_from_when_it_came() -> None:
    clock = ManualClock()
    executor, _ = executor_of(clock, max_age_s={"/beat": 1.0})
    came_s = clock.monotonic()
    clock.advance(0.7)
    executor.start_with([("/beat", None, came_s)])
    assert executor.status is Status.RUNNING
    clock.advance(0.4)
    executor.watch()
    assert executor.reasons == ("beat on /beat is stale",)


def test_what_is_too_old_at_the_start_is_stale_until_it_is_back() -> None:
    clock = ManualClock()
    executor, middleware = executor_of(clock, max_age_s={"/beat": 1.0})
    came_s = clock.monotonic()
    clock.advance(3.0)
    executor.start_with([("/beat", None, came_s)])
    assert executor.reasons == ("beat on /beat is stale",)
    executor.tick()
    assert not [sent for sent in middleware.sent if sent[0] == "publish"]
    executor.receive("/beat", None)
    assert executor.status is Status.RUNNING


def test_a_layer_holds_everything_back_before_it_begins_and_then_passes_on_what_came() -> None:
    clock, sides = ManualClock(), BothSides()
    text = """robot Gate { component C {
        outgoing message open with identifier: "/open", type: none
        incoming message go with identifier: "/go", type: none
        behaviour {
            initial marked state shut { on response from open goto wide }
            marked state wide { on request to go }
        } } }"""
    layer = StartupBufferingLayer(
        system_of(text, Deployment.LAYER), sides, sides, Settings(max_age_s={"/open": 1.0}), clock
    )
    layer.on_request("/go", None)
    assert sides.sent == [("blocked", "/go")]
    came_s = clock.monotonic()
    clock.advance(0.7)
    layer.start_with([("/open", None, came_s)])
    layer.on_request("/go", None)
    assert sides.sent[1:] == [("pass", "/open", None), ("publish", "go", None)]
    # Its age counts from when it came.
    clock.advance(0.4)
    layer.on_request("/go", None)
    assert layer.reasons == ("open on /open is stale",)
    assert sides.sent[-1] == ("blocked", "/go")


class Node:
    """A node that makes nothing."""

    def __init__(self) -> None:
        self._values: dict[str, Any] = {}
        self._parameter_overrides: dict[str, Any] = {}

    def __getattr__(self, name: str) -> Any:
        nothing = dict.fromkeys(("publish", "warning", "info"), lambda message: None)
        return lambda *arguments, **named: SimpleNamespace(qos_profile=None, **nothing)

    def has_parameter(self, name: str) -> bool:
        return name in self._values

    def declare_parameter(self, name: str, default: Any, descriptor: Any) -> None:
        self._values[name] = default

    def get_parameter(self, name: str) -> Any:
        return SimpleNamespace(value=self._values[name])

    def get_fully_qualified_name(self) -> str:
        return "/node"


@pytest.mark.ros2
def test_a_node_that_waits_for_its_servers_loses_nothing_and_its_stop_reaches_lost_goals(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
    with warnings.catch_warnings():
        # A parser that rclpy loads uses a module that Python deprecates, as in support.ros2.
        warnings.simplefilter("ignore", DeprecationWarning)
        import rosidl_generator_py  # type: ignore[import-untyped]  # noqa: F401
    missing: list[str] = ["/ask"]
    published: list[str] = []
    cancelled: list[str] = []
    supervisor = unsupervised(MODEL)
    with imported(generate(supervisor, "ros2"), tmp_path, "guarded_controller.node") as generated:
        callbacks: dict[str, Any] = {}

        class Middleware(generated.Middleware):  # type: ignore[misc, name-defined]
            def _connect(self, *arguments: Any) -> None:
                pass

            def missing_servers(self) -> tuple[str, ...]:
                return tuple(missing)

            def subscribe(self, receive: Any) -> None:
                for name in ("/beat", "/stop"):
                    callbacks[name] = receive
                    self.depths[name] = 1

            def cancel_abandoned(self) -> None:
                cancelled.append("lost goals")

            def publish(self, communication: str, message: Any) -> None:
                published.append(communication)

        monkeypatch.setattr(generated, "Middleware", Middleware)
        host = importlib.import_module("guarded_controller.host")
        monkeypatch.setattr(host, "Diagnostics", lambda node: SimpleNamespace(publish=lambda health: None))
        controller = generated.Controller(Node())
        controller.start()
        callbacks["/stop"]("/stop", None)
        controller._tick()
        missing.clear()
        controller._watch()
        controller._tick()
        assert controller._executor.status.value == "running"
        assert published == cancelled == []
        controller.stop("SIGINT")
    assert cancelled == ["lost goals"]


NEVER_IMPORTED = """
import signal
print("importing", flush=True)
while True:
    signal.pause()
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("entry", ["run_node", "run_starter"])
@pytest.mark.parametrize("target", ["ros1", "ros2"])
def test_a_signal_that_comes_during_imports_ends_the_node(
    target: str, entry: str, number: signal.Signals, tmp_path: Path
) -> None:
    write_files(generate(unsupervised(MODEL), target), tmp_path)
    for module in ("actionlib", "diagnostic_msgs", "rclpy", "rosgraph", "rospy"):
        (tmp_path / f"{module}.py").write_text(NEVER_IMPORTED, encoding="utf-8")
    line = f"from guarded_controller.entry import {entry}; {entry}()"
    with subprocess.Popen(
        [sys.executable, "-c", line], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as program:
        assert program.stdout is not None
        assert program.stdout.readline() == "importing\n"
        program.send_signal(number)
        assert program.communicate() == ("", "")
        assert program.returncode == 0
