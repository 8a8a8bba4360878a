"""Quality of service and stamped headers of a generated ROS 2 node, on real topics."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc.targets import generate, write_files
from support.models import model_of
from support.random_supervisors import CERTIFICATE
from support.ros2 import Peer, RosProcess, environment, own_domain

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")

pytestmark = pytest.mark.ros2

LIMIT_S = 10.0
FRAME = "base/link \"' \\ {{ 1 }} #"

MODEL = """
robot Carrier {
    interface stamped_twist use TwistStamped from geometry_msgs
    interface laser use LaserScan from sensor_msgs
    datatype object Vector { x: double }
    datatype object Twist { linear: Vector }
    datatype object Command { twist: Twist }
    component Sight {
        outgoing message clear with identifier: "/clear", type: boolean, qos: best_effort, depth: 3
        outgoing message scan with identifier: "/scan", type: none links laser
        behaviour {
            variable free: boolean
            initial marked state watching {
                on response from clear do free := value
                on response from scan
            }
        }
    }
    component Base {
        incoming message announce with identifier: "/mode", type: string, qos: latched, depth: 2
        incoming message go with
            identifier: "/cmd", type: Command, stamped: "base/link \\"' \\\\ {{ 1 }} #" links stamped_twist
        behaviour {
            initial state starting { on request to announce goto started }
            marked state started { on request to go }
        }
    }
    requirement go needs Sight.free
    provide announce with "carrying"
    provide go with { twist: { linear: { x: 0.5 } } }
}
"""


@pytest.fixture
def domain() -> Iterator[int]:
    with own_domain() as number:
        yield number


@pytest.fixture
def node(domain: int, tmp_path: Path) -> Iterator[RosProcess]:
    """The generated node, deciding every 20 ms."""
    supervisor = Supervisor(model_of(MODEL), Deployment.CONTROLLER, (), CERTIFICATE)
    write_files(generate(supervisor, "ros2"), tmp_path / "package")
    command = ["-m", "carrier_controller.node", "--ros-args", "-p", "period:=0.02"]
    with RosProcess(command, environment(domain, tmp_path), tmp_path / "run", [tmp_path / "package"]) as process:
        yield process


@pytest.fixture
def peer(domain: int, tmp_path: Path) -> Iterator[Peer]:
    with Peer(domain, environment(domain, tmp_path)) as made:
        yield made


def best_effort() -> Any:
    from rclpy.qos import QoSProfile, ReliabilityPolicy

    return QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)


def test_the_endpoints_have_the_quality_that_the_model_asks_for(node: RosProcess, peer: Peer) -> None:
    from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

    peer.wait_for_peers(["/cmd", "/mode", "/clear", "/scan"])
    expected = {
        "/cmd": (peer.node.get_publishers_info_by_topic, "RELIABLE", "VOLATILE"),
        "/mode": (peer.node.get_publishers_info_by_topic, "RELIABLE", "TRANSIENT_LOCAL"),
        "/clear": (peer.node.get_subscriptions_info_by_topic, "BEST_EFFORT", "VOLATILE"),
        "/scan": (peer.node.get_subscriptions_info_by_topic, "BEST_EFFORT", "VOLATILE"),
    }
    for topic, (ends_of, reliability, durability) in expected.items():
        (end,) = ends_of(topic)
        assert end.qos_profile.reliability == ReliabilityPolicy[reliability], topic
        assert end.qos_profile.durability == DurabilityPolicy[durability], topic


def test_a_late_subscriber_gets_what_is_latched(node: RosProcess, peer: Peer) -> None:
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from std_msgs.msg import Bool, String

    # `go` comes after the announcement, which the model makes only once.
    moves: list[Any] = []
    from geometry_msgs.msg import TwistStamped

    peer.node.create_subscription(TwistStamped, "/cmd", moves.append, 10)
    peer.spin_until(
        lambda: bool(moves), LIMIT_S, "a command", node, lambda: peer.publish(Bool(data=True), "/clear", best_effort())
    )
    late: list[Any] = []
    volatile: list[Any] = []
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    peer.node.create_subscription(String, "/mode", volatile.append, 10)
    peer.node.create_subscription(String, "/mode", late.append, latched)
    peer.spin_until(lambda: bool(late), LIMIT_S, "the latched message", node)
    assert [message.data for message in late] == ["carrying"]
    assert volatile == []


def test_commands_are_stamped_and_so_is_the_message_that_stops_the_robot(node: RosProcess, peer: Peer) -> None:
    from geometry_msgs.msg import TwistStamped
    from std_msgs.msg import Bool

    commands: list[Any] = []
    peer.node.create_subscription(TwistStamped, "/cmd", commands.append, 1000)

    def see(clear: bool) -> None:
        # Best effort to best effort: a reliable subscription would get none of these.
        peer.publish(Bool(data=clear), "/clear", best_effort())

    before = peer.node.get_clock().now().nanoseconds
    peer.spin_until(lambda: len(commands) >= 5, LIMIT_S, "commands", node, lambda: see(True))
    peer.spin_until(lambda: commands[-1].twist.linear.x == 0.0, LIMIT_S, "a release", node, lambda: see(False))
    after = peer.node.get_clock().now().nanoseconds

    speeds = [command.twist.linear.x for command in commands]
    assert speeds == [0.5] * (len(commands) - 1) + [0.0]
    assert {command.header.frame_id for command in commands} == {FRAME}
    stamps = [command.header.stamp.sec * 10**9 + command.header.stamp.nanosec for command in commands]
    assert before <= stamps[0]
    assert stamps == sorted(set(stamps))
    assert stamps[-1] <= after


def test_the_last_message_before_the_end_is_stamped_too(node: RosProcess, peer: Peer) -> None:
    import signal

    from geometry_msgs.msg import TwistStamped
    from std_msgs.msg import Bool

    commands: list[Any] = []
    peer.node.create_subscription(TwistStamped, "/cmd", commands.append, 1000)
    peer.spin_until(
        lambda: bool(commands),
        LIMIT_S,
        "a command",
        node,
        lambda: peer.publish(Bool(data=True), "/clear", best_effort()),
    )
    node.signal(signal.SIGTERM)
    peer.spin_until(lambda: commands[-1].twist.linear.x == 0.0 and not node.is_running, LIMIT_S, "a zero and the end")
    assert node.wait() == 0
    assert commands[-1].header.frame_id == FRAME
    assert commands[-1].header.stamp.sec > 0


def test_with_simulated_time_the_stamp_is_simulated_too(domain: int, tmp_path: Path, peer: Peer) -> None:
    from geometry_msgs.msg import TwistStamped
    from rosgraph_msgs.msg import Clock
    from std_msgs.msg import Bool

    supervisor = Supervisor(model_of(MODEL), Deployment.CONTROLLER, (), CERTIFICATE)
    write_files(generate(supervisor, "ros2"), tmp_path / "package")
    command = ["-m", "carrier_controller.node", "--ros-args", "-p", "period:=0.02", "-p", "use_sim_time:=true"]
    commands: list[Any] = []
    peer.node.create_subscription(TwistStamped, "/cmd", commands.append, 1000)
    time = Clock()
    time.clock.sec = 1234

    def live() -> None:
        time.clock.nanosec += 20_000_000
        if time.clock.nanosec >= 10**9:
            time.clock.sec, time.clock.nanosec = time.clock.sec + 1, 0
        peer.publish(time, "/clock")
        peer.publish(Bool(data=True), "/clear", best_effort())

    with RosProcess(command, environment(domain, tmp_path), tmp_path / "run", [tmp_path / "package"]) as process:
        peer.spin_until(
            lambda: any(item.header.stamp.sec >= 1234 for item in commands), LIMIT_S, "that time", process, live
        )
    assert {item.header.stamp.sec for item in commands} <= {0, *range(1234, 1300)}


def test_a_type_without_a_header_is_a_start_up_error(domain: int, tmp_path: Path) -> None:
    # A package that generation knows nothing of, standing in for one of the user's own.
    messages = tmp_path / "package" / "own_msgs"
    supervisor = Supervisor(
        model_of(
            "robot Misfit { interface i use Headless from own_msgs component C {"
            ' incoming message m with type: none, stamped: "map" links i } }'
        ),
        Deployment.CONTROLLER,
        (),
        CERTIFICATE,
    )
    write_files(generate(supervisor, "ros2"), tmp_path / "package")
    messages.mkdir()
    (messages / "__init__.py").write_text("")
    (messages / "msg.py").write_text("from geometry_msgs.msg import Twist as Headless\n")
    command = ["-m", "misfit_controller.node"]
    with RosProcess(command, environment(domain, tmp_path), tmp_path / "run", [tmp_path / "package"]) as process:
        assert process.wait() == 2
        *before, line = process.stderr.splitlines()
    assert all(earlier.startswith("[INFO]") for earlier in before)
    assert line.startswith("misfit_controller: message m: ")
    assert "header" in line
