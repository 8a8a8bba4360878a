"""Goals with headers: no action in a package index has one, so the action is made of other real messages."""

import importlib
import sys
import types
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from robosc.targets import generate
from support.execution import unsupervised
from support.generated import imported

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")

pytestmark = pytest.mark.ros2

MODEL = """
robot Planner {
    interface plan use Plan from plan_msgs
    datatype object Point { x: double }
    datatype object Pose { position: Point }
    datatype object Stamped { pose: Pose }
    datatype object Goal { goal: Stamped tolerance: double }
    component C {
        action go with
            identifier: "go", request: Goal, response: none, feedback: none, stamped: "map" links plan
    }
    provide go with { goal: { pose: { position: { x: 2.5 } } }, tolerance: 0.5 }
}
"""


class Client:
    """Keeps what it is asked to send."""

    def __init__(self, node: Any, type_: Any, name: str) -> None:
        self.name = name
        self.sent: list[Any] = []
        node.clients.append(self)

    def server_is_ready(self) -> bool:
        return True

    def send_goal_async(self, goal: Any, feedback_callback: Any, goal_uuid: Any) -> Any:
        self.sent.append(goal)
        return SimpleNamespace(add_done_callback=lambda callback: None)


def test_every_stamped_field_of_a_goal_gets_time_and_frame(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with warnings.catch_warnings():
        # A parser that rclpy loads uses a module that Python deprecates, as in support.ros2.
        warnings.simplefilter("ignore", DeprecationWarning)
        import rosidl_generator_py  # type: ignore[import-untyped]  # noqa: F401
    from builtin_interfaces.msg import Time
    from nav_msgs.srv import GetPlan
    from std_msgs.msg import Empty
    from test_msgs.action import Fibonacci

    module: Any = types.ModuleType("plan_msgs.action")
    # The part that asks after a goal is the same for all actions.
    module.Plan = SimpleNamespace(Goal=GetPlan.Request, Result=GetPlan.Response, Feedback=Empty, Impl=Fibonacci.Impl)
    monkeypatch.setitem(sys.modules, "plan_msgs", types.ModuleType("plan_msgs"))
    monkeypatch.setitem(sys.modules, "plan_msgs.action", module)
    supervisor = unsupervised(MODEL)
    now = SimpleNamespace(to_msg=lambda: Time(sec=7))
    node: Any = SimpleNamespace(
        clients=[],
        get_clock=lambda: SimpleNamespace(now=lambda: now),
        get_publishers_info_by_topic=lambda name: [],
        create_client=lambda type_, name: SimpleNamespace(
            srv_type=type_, service_name=name, get_pending_request=lambda number: None
        ),
    )
    settings = SimpleNamespace(service_timeout_s=None)
    parameters = SimpleNamespace(topic_prefix="/r", resample_scans=False, settings=settings)
    with imported(generate(supervisor, "ros2"), tmp_path, "planner_controller.middleware") as generated:
        monkeypatch.setattr(importlib.import_module("planner_controller.connections"), "ActionClient", Client)
        middleware = generated.Middleware(node, parameters, lambda: 0.0)
        data = {"goal": {"pose": {"position": {"x": 2.5}}}, "tolerance": 0.5}
        middleware.send_goal("go", 1, middleware.prepare("go", data))
    (client,) = node.clients
    assert client.name == "/r/go"
    (goal,) = client.sent
    assert (goal.goal.pose.position.x, goal.tolerance) == (2.5, 0.5)
    for header in (goal.start.header, goal.goal.header):
        assert (header.stamp, header.frame_id) == (Time(sec=7), "map")
