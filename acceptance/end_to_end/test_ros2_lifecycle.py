"""A generated node that others manage, over DDS: configure, activate, deactivate, cleanup, shutdown, and faults."""

import itertools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from robosc.targets import generate, write_files
from support.execution import supervisor_of
from support.models import model_of
from support.other_rclpy import DISTRIBUTIONS, distribution_command
from support.ros2 import Peer, RosProcess, environment, own_domain

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")

pytestmark = pytest.mark.ros2

LIMIT_S = 15.0
PACKAGE = "walker_controller"
ACTIVE, INACTIVE, UNCONFIGURED = "active", "inactive", "unconfigured"

# It walks, once it has power, until it is asked to halt. An unknown level is a fault, if the parameters say so.
MODEL = """
robot Walker {
    interface twist use Twist from geometry_msgs
    interface power use SetBool from std_srvs
    interface lift use Fibonacci from test_msgs
    datatype enum Level from double to { value > 0.5 -> high  default -> low }
    datatype object Vector { x: double }
    datatype object Twist { linear: Vector }
    datatype object Request { data: boolean }
    datatype object Response { success: boolean }
    component Base {
        incoming message walk with identifier: "/cmd_vel", type: Twist links twist
        outgoing message halt with identifier: "/halt", type: none
        outgoing message level with identifier: "/level", type: Level
        behaviour {
            initial marked state free { on response from halt goto halted }
            marked state halted { }
        }
    }
    component Motors {
        service power with identifier: "/power", request: Request, response: Response links power
        behaviour {
            initial marked state off { on response from power goto powered }
            marked state powered { }
        }
    }
    component Lift {
        action lift with identifier: "/lift", request: none, response: none, feedback: none links lift
    }
    requirement lift needs Base.halted
    requirement walk needs Base.free and Motors.powered
    requirement power needs Motors.off
    provide walk with { linear: { x: 0.5 } }
    provide power with { data: true }
}
"""


class Power:
    """The robot's service.

    Attributes:
        calls: Number of the calls that have come.
        answers: Future after which calls are answered.
    """

    def __init__(self, peer: Peer) -> None:
        from rclpy.callback_groups import ReentrantCallbackGroup
        from rclpy.task import Future
        from std_srvs.srv import SetBool

        self.calls = 0
        self.answers = Future()
        # A call that waits keeps nothing else waiting.
        peer.node.create_service(SetBool, "/power", self._grant, callback_group=ReentrantCallbackGroup())

    async def _grant(self, request: Any, response: Any) -> Any:
        self.calls += 1
        await self.answers
        response.success = request.data
        return response


class Stage:
    """A managed node, a manager, and the robot around it."""

    def __init__(self, peer: Peer, node: RosProcess, power: Power) -> None:
        from geometry_msgs.msg import Twist
        from lifecycle_msgs.srv import ChangeState, GetState

        self.peer = peer
        self.node = node
        self.power = power
        self.commands = peer.receive(Twist, "/cmd_vel")
        self._change = peer.node.create_client(ChangeState, f"/{PACKAGE}/change_state")
        self._get = peer.node.create_client(GetState, f"/{PACKAGE}/get_state")
        self.until(lambda: self._change.service_is_ready() and self._get.service_is_ready(), "the node's services")
        # Discovery of the last service ends after that of the other: a change is never requested twice.
        peer.ask(self._get, GetState.Request(), LIMIT_S, node)

    def until(self, condition: Callable[[], bool], what: str, repeat: Callable[[], object] = lambda: None) -> None:
        self.peer.spin_until(condition, LIMIT_S, what, self.node, repeat)

    def call(self, client: Any, request: Any) -> Any:
        future = client.call_async(request)
        self.until(future.done, "an answer")
        return future.result()

    def change(self, transition: str) -> bool:
        """Ask for a transition: whether it succeeded."""
        from lifecycle_msgs.msg import Transition
        from lifecycle_msgs.srv import ChangeState

        number = getattr(Transition, f"TRANSITION_{transition.upper()}")
        return bool(self.call(self._change, ChangeState.Request(transition=Transition(id=number))).success)

    @property
    def state(self) -> str:
        from lifecycle_msgs.srv import GetState

        return str(self.call(self._get, GetState.Request()).current_state.label)

    @property
    def speed(self) -> float | None:
        return float(self.commands[-1].linear.x) if self.commands else None

    def walks(self) -> None:
        self.commands.clear()
        self.until(lambda: self.speed == 0.5, "the robot to walk")

    def stands(self) -> None:
        """The last command is zero, perhaps sent twice, and none follows."""
        self.until(lambda: self.speed == 0.0, "the robot to stand")
        count = len(self.commands)
        self.peer.spin_for(0.3)
        assert not any(command.linear.x for command in self.commands[count:])
        count = len(self.commands)
        self.peer.spin_for(0.3)
        assert len(self.commands) == count

    def halt(self) -> None:
        from std_msgs.msg import Empty

        self.peer.publish(Empty(), "/halt")

    def halts(self) -> None:
        """Check that it halts, and so has heard the message: what is sent from here reaches it."""
        self.until(lambda: self.speed == 0.0, "the robot to halt", self.halt)
        self.stands()

    def level(self, value: float) -> None:
        from std_msgs.msg import Float32

        self.peer.publish(Float32(data=value), "/level")


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("workspace")
    write_files(generate(supervisor_of(model_of(MODEL)), "ros2"), folder)
    return folder


@pytest.fixture(params=DISTRIBUTIONS)
def start(request: pytest.FixtureRequest, workspace: Path, tmp_path: Path) -> Iterator[Callable[..., Stage]]:
    program, *words = distribution_command(request.param)
    with own_domain() as domain:
        variables = environment(domain, tmp_path)
        with Peer(domain, variables) as peer:
            nodes: list[RosProcess] = []
            power = Power(peer)

            def start_node(*parameters: str, has_power: bool = True) -> Stage:
                if has_power:
                    power.answers.set_result(None)
                parameters = ("period:=0.02", "server_wait:=0.0", *parameters)
                arguments = itertools.chain.from_iterable(("-p", parameter) for parameter in parameters)
                command = [*words, "-m", f"{PACKAGE}.node", "--ros-args", *arguments]
                folder = tmp_path / str(len(nodes))
                nodes.append(RosProcess(command, variables, folder, [workspace], program=program))
                return Stage(peer, nodes[-1], power)

            yield start_node
            for node in nodes:
                node.__exit__(None, None, None)


def test_by_itself_it_is_active(start: Callable[..., Stage]) -> None:
    stage = start()
    stage.walks()
    assert stage.state == ACTIVE


def test_a_manager_starts_and_stops_it_again_and_again(start: Callable[..., Stage]) -> None:
    stage = start("autostart:=false")
    assert stage.state == UNCONFIGURED
    assert not stage.change("activate")
    for _ in range(2):
        assert stage.change("configure")
        assert stage.state == INACTIVE
        stage.peer.wait_for_peers(["/cmd_vel", "/halt"])
        stage.peer.spin_for(0.2)
        assert not stage.commands
        for _ in range(2):
            assert stage.change("activate")
            stage.walks()
            assert stage.change("deactivate")
            stage.stands()
        assert stage.change("cleanup")
        stage.until(lambda: not _others(stage, "/cmd_vel"), "its publishers to go")
        stage.commands.clear()
    assert stage.change("unconfigured_shutdown")
    assert stage.node.wait() == 0


def _others(stage: Stage, topic: str) -> list[Any]:
    return list(stage.peer.node.get_publishers_info_by_topic(topic))


def test_activated_anew_it_begins_in_the_initial_state(start: Callable[..., Stage]) -> None:
    stage = start()
    stage.walks()
    stage.halts()
    assert stage.change("deactivate") and stage.change("activate")
    stage.walks()


def test_activated_anew_it_waits_for_the_answer_to_its_last_call(start: Callable[..., Stage]) -> None:
    from diagnostic_msgs.msg import DiagnosticArray

    stage = start("service_timeout:=1000.0", has_power=False)
    reports = stage.peer.receive(DiagnosticArray, "/diagnostics")
    stage.until(lambda: stage.power.calls == 1, "the call")
    assert stage.change("deactivate") and stage.change("activate")
    waits = "waiting for the end of calls from before the restart: power"
    stage.until(lambda: any(waits in report.status[0].message for report in reports), "a warning")
    assert stage.power.calls == 1
    stage.power.answers.set_result(None)
    stage.walks()
    assert stage.power.calls == 2


def test_what_came_while_it_was_inactive_is_known(start: Callable[..., Stage]) -> None:
    from std_msgs.msg import Empty

    stage = start("autostart:=false")
    assert stage.change("configure")
    listeners = stage.peer.publisher(Empty, "/halt")
    stage.until(lambda: listeners.get_subscription_count() > 0, "the node to listen")
    for _ in range(5):
        stage.halt()
        stage.peer.spin_for(0.1)
    assert stage.change("activate")
    stage.peer.spin_for(0.5)
    assert not [command for command in stage.commands if command.linear.x]


def test_shut_down_while_it_walks_it_stands(start: Callable[..., Stage]) -> None:
    stage = start()
    stage.walks()
    assert stage.change("active_shutdown")
    assert stage.node.wait() == 0
    stage.peer.spin_until(lambda: stage.speed == 0.0, LIMIT_S, "the last command")


def test_what_came_while_it_was_deactivated_is_known(start: Callable[..., Stage]) -> None:
    stage = start()
    stage.walks()
    stage.halts()
    assert stage.change("deactivate") and stage.change("activate")
    stage.walks()
    assert stage.change("deactivate")
    for _ in range(3):
        stage.halt()
        stage.peer.spin_for(0.1)
    stage.commands.clear()
    assert stage.change("activate")
    stage.peer.spin_for(0.5)
    assert not [command for command in stage.commands if command.linear.x]


def test_a_goal_that_is_accepted_after_the_cleanup_is_cancelled(start: Callable[..., Stage]) -> None:
    from rclpy.action import ActionServer, CancelResponse, GoalResponse
    from rclpy.callback_groups import ReentrantCallbackGroup
    from rclpy.task import Future
    from test_msgs.action import Fibonacci

    stage = start()
    accepted, cancelled, goals, ended = Future(), Future(), [], []

    async def take(goal: Any) -> Any:
        goals.append(goal)
        await accepted
        return GoalResponse.ACCEPT

    def cancel(goal: Any) -> Any:
        cancelled.set_result(None)
        return CancelResponse.ACCEPT

    async def work(goal: Any) -> Any:
        await cancelled
        goal.canceled()
        ended.append(goal)
        return Fibonacci.Result()

    # Callbacks wait for the test, and others go on meanwhile.
    group = ReentrantCallbackGroup()
    server = ActionServer(
        stage.peer.node, Fibonacci, "/lift", work, goal_callback=take, cancel_callback=cancel, callback_group=group
    )
    stage.walks()
    stage.until(lambda: bool(goals), "the goal", stage.halt)
    assert stage.change("deactivate") and stage.change("cleanup")
    assert not cancelled.done()
    accepted.set_result(None)
    stage.until(cancelled.done, "the cancel")
    # Messages that still wait for their turn would reach the next test.
    stage.until(lambda: bool(ended), "the goal's end")
    stage.peer.spin_for(0.1)
    server.destroy()


def test_parameters_are_set_before_it_is_configured(start: Callable[..., Stage]) -> None:
    from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
    from rcl_interfaces.srv import SetParameters

    stage = start("autostart:=false", "policy:=best", "period:=-1.0")
    client = stage.peer.node.create_client(SetParameters, f"/{PACKAGE}/set_parameters")
    stage.until(client.service_is_ready, "the node's parameters")

    def set_value(name: str, value: ParameterValue) -> bool:
        request = SetParameters.Request(parameters=[Parameter(name=name, value=value)])
        return bool(stage.peer.ask(client, request, LIMIT_S, stage.node).results[0].successful)

    def set_policy(policy: str) -> bool:
        return set_value("policy", ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=policy))

    assert not stage.change("configure")
    assert set_policy("fair")
    # A value out of its range can be set right, too.
    assert not stage.change("configure")
    assert set_value("period", ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=0.02))
    assert stage.change("configure") and stage.change("activate")
    stage.walks()
    assert not set_policy("random")


def test_a_fault_leaves_a_managed_node_at_rest_until_it_is_activated_anew(start: Callable[..., Stage]) -> None:
    stage = start("autostart:=false", "on_unknown:=fault")
    assert stage.change("configure") and stage.change("activate")
    stage.walks()
    stage.until(lambda: stage.speed == 0.0, "the fault", lambda: stage.level(float("nan")))
    stage.stands()
    assert stage.node.is_running and "stopped: " in stage.node.stderr
    assert stage.change("deactivate") and stage.change("activate")
    stage.walks()


def test_a_fault_ends_a_node_that_started_itself(start: Callable[..., Stage]) -> None:
    stage = start("on_unknown:=fault")
    stage.walks()
    stage.peer.spin_until(
        lambda: not stage.node.is_running, LIMIT_S, "its end", repeat=lambda: stage.level(float("nan"))
    )
    assert stage.node.wait() == 1
    assert stage.speed == 0.0


def test_what_cannot_be_configured_stays_unconfigured(start: Callable[..., Stage]) -> None:
    stage = start("autostart:=false", "policy:=best")
    assert not stage.change("configure")
    assert stage.state == UNCONFIGURED
    assert "parameter 'policy'" in stage.node.stderr
    assert not _others(stage, "/cmd_vel")


def test_a_wrong_autostart_is_one_error(workspace: Path, tmp_path: Path) -> None:
    with own_domain() as domain:
        command = ["-m", f"{PACKAGE}.node", "--ros-args", "-p", "autostart:=perhaps"]
        with RosProcess(command, environment(domain, tmp_path), tmp_path / "node", [workspace]) as node:
            assert node.wait() == 2
        assert "parameter 'autostart' is 'perhaps'; it must be true or false" in node.stderr
