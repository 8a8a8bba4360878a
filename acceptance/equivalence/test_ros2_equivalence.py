"""The generated ROS 2 node does what the reference executor does, over DDS, step by step."""

from pathlib import Path

import msgspec
import pytest

from robosc.certification import make_supervisor
from robosc.expressions import Binary, DoubleType, EnumType, Expression, Received
from robosc.language import load_bundle
from robosc.model.structure import CommunicationKind, Deployment, Interface, Property
from robosc.supervisor import Supervisor
from support.equivalence.node_target import timed_log
from support.equivalence.python_targets import observe, reference
from support.equivalence.random_scenarios import for_node, node_scenario, node_settings
from support.equivalence.recorded import read_recorded
from support.equivalence.ros2_target import Ros2Surroundings, ros2_target
from support.equivalence.scenario import Action, Scenario
from support.equivalence.targets import compare
from support.generated import example_supervisor
from support.hostile import hostile_supervisor
from support.models import model_of
from support.random_controllers import random_controller
from support.random_supervisors import CERTIFICATE
from support.random_travels import random_travels

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")

pytestmark = pytest.mark.ros2

# The navigation example asks for interfaces that no package index has.
ROBOTS = ["line_follower", "maze_solver", "object_finder", "ball_pusher", "person_follower"]
COURIER = Path(__file__).parents[2] / "tests" / "models" / "courier" / "model.rscd"


LINKS = {
    CommunicationKind.SERVICE: Interface("Empty", "std_srvs"),
    CommunicationKind.ACTION: Interface("Fibonacci", "test_msgs"),
}
POINT = Interface("Point", "geometry_msgs")


def on_ros(supervisor: Supervisor) -> Supervisor:
    """A random robot with types that ROS has: its samples of two integers come as points."""
    names = {"n": "x", "m": "y"}

    def renamed(expression: Expression) -> Expression:
        if isinstance(expression, Received):
            return Received((names[str(expression.path[0])],))
        if isinstance(expression, Binary):
            return msgspec.structs.replace(expression, left=renamed(expression.left), right=renamed(expression.right))
        return expression

    model = supervisor.model
    enums = tuple(
        msgspec.structs.replace(
            item,
            rules=tuple(msgspec.structs.replace(rule, condition=renamed(rule.condition)) for rule in item.rules),
        )
        for item in model.enums
    )
    parts = tuple(Property(name, DoubleType()) for name in names.values())
    communications = tuple(
        msgspec.structs.replace(
            item, interface=POINT if isinstance(item.response, EnumType) else LINKS.get(item.kind, item.interface)
        )
        for item in model.communications
    )
    objects = tuple(msgspec.structs.replace(item, properties=parts) for item in model.objects)
    changed = msgspec.structs.replace(model, enums=enums, objects=objects, communications=communications)
    return msgspec.structs.replace(supervisor, model=changed)


@pytest.mark.parametrize("seed", [4, 21, 33, 36])
def test_a_random_robot(seed: int, tmp_path: Path) -> None:
    made = random_controller(seed)
    assert made is not None
    supervisor = on_ros(made)
    scenario = node_scenario(supervisor, seed, 60)
    compare(ros2_target(supervisor, tmp_path), scenario, observe(supervisor, scenario))


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_recorded_run(robot: str, tmp_path: Path) -> None:
    supervisor = example_supervisor(f"{robot}/{robot}")
    scenario = for_node(supervisor, read_recorded(robot))
    compare(ros2_target(supervisor, tmp_path), scenario, observe(supervisor, scenario))


def test_services_and_actions(tmp_path: Path) -> None:
    supervisor = make_supervisor(load_bundle(COURIER)).supervisor
    assert supervisor is not None
    scenario = node_scenario(supervisor, 1, 200)
    seen = observe(supervisor, scenario)
    asked = {(kind, name) for item in seen for kind, name, _ in item.issued}
    assert asked >= {("call", "power"), ("call", "wind"), ("goal", "count"), ("goal", "reach"), ("cancel", "count")}
    compare(ros2_target(supervisor, tmp_path), scenario, seen)


@pytest.mark.parametrize("seed", [2, 5, 7])
def test_goals_that_end_some_time_after_their_cancel(seed: int, tmp_path: Path) -> None:
    supervisor = random_travels(seed)
    scenario = node_scenario(supervisor, seed, 80, ends_on_cancel=False)
    seen = observe(supervisor, scenario)
    assert any(item.cancelling and item.cancelling[0] for item in seen)
    compare(ros2_target(supervisor, tmp_path), scenario, seen)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_hostile_robot(seed: int, tmp_path: Path) -> None:
    canary = tmp_path / "canary"
    supervisor = hostile_supervisor(seed, canary)
    scenario = node_scenario(supervisor, seed, 60)
    compare(ros2_target(supervisor, tmp_path), scenario, observe(supervisor, scenario))
    assert not canary.exists()


SIDES = """robot Sides {
    interface vector use Vector3 from geometry_msgs
    datatype object Vector { x: double y: double }
    component C {
        outgoing message side with identifier: "/side", type: boolean
        incoming message go with identifier: "/go", type: Vector links vector
        behaviour {
            variable is_left: boolean
            on response from side do is_left := value
            initial marked state ready { on request to go }
        }
    }
    provide go with { x: 1.0 } if C.is_left
    provide go with { y: 2.0 }
}"""


def test_what_a_request_leaves_out_has_its_default(tmp_path: Path) -> None:
    supervisor = Supervisor(model_of(SIDES), Deployment.CONTROLLER, (), CERTIFICATE)
    actions = tuple(Action("message", "/side", is_left) for is_left in (True, False, True, True, False))
    scenario = Scenario(actions, node_settings(supervisor.model))
    compare(ros2_target(supervisor, tmp_path), scenario, observe(supervisor, scenario))


@pytest.mark.parametrize("robot", ["line_follower", "maze_solver"])
def test_a_node_that_decides_by_its_own_timer(robot: str, tmp_path: Path) -> None:
    """Read from its log afterwards when it decided: the reference, deciding then, must have done the same.

    With every request in a list of priorities a decision that issues nothing leaves no trace in the controller.
    """
    supervisor = example_supervisor(f"{robot}/{robot}")
    model = supervisor.model
    requests = tuple(i.name for i in model.communications if i.kind is CommunicationKind.INCOMING_MESSAGE)
    settings = {**node_settings(model), "every": "period", "policy": "priority", "priority": requests, "period_s": 0.02}
    messages = tuple(action for action in read_recorded(robot).actions if action.do == "message")[:40]
    surroundings = Ros2Surroundings(supervisor, tmp_path)
    log = timed_log(surroundings, Scenario(messages, settings), tmp_path / "events", model)
    target = reference(supervisor)
    seen = [*target.start(Scenario((), settings)).log]
    left = list(messages)
    while len(seen) < len(log):
        is_decision = log[len(seen)].get("controllable") is True
        if not is_decision and len(left) < len(messages):
            # The timer ticked after the last message: what was enabled then was issued.
            assert seen[-1].get("controllable") is True or not any(
                event.endswith(".request") for event in target.do(Action("wait")).enabled or ()
            )
        seen += target.do(Action("tick") if is_decision else left.pop(0)).log
    assert seen == log
    assert not left
