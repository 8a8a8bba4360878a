"""Handling of sensors by a generated ROS 2 node, on real topics: scans in degrees, diagnostics, one subscription."""

import json
import math
from array import array
from collections.abc import Callable, Iterator
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

LIMIT_S = 15.0

MODEL = """
robot Watcher {
    interface laser use LaserScan from sensor_msgs
    interface stamped use TwistStamped from geometry_msgs
    datatype object Scan { ranges: array(double) }
    datatype object Limits { ranges: array(double) angle_min: double range_max: double }
    component Right {
        outgoing message right_scan with identifier: "/scan", type: Scan, max_age: 0.5 links laser
        behaviour {
            variable distance: double
            variable count: integer
            initial marked state watching {
                on response from right_scan do distance := value.ranges[270], count := length(value.ranges)
            }
        }
    }
    component Ahead {
        outgoing message ahead_scan with identifier: "/scan", type: Limits, max_age: 0.5 links laser
        behaviour {
            variable distance: double
            variable start: double
            initial marked state watching {
                on response from ahead_scan do distance := value.ranges[0], start := value.angle_min
            }
        }
    }
    component Base {
        incoming message go with identifier: "/cmd", type: none, stamped: "base" links stamped
    }
}
"""


@pytest.fixture
def domain() -> Iterator[int]:
    with own_domain() as number:
        yield number


@pytest.fixture
def peer(domain: int, tmp_path: Path) -> Iterator[Peer]:
    with Peer(domain, environment(domain, tmp_path)) as made:
        yield made


@pytest.fixture
def start(domain: int, tmp_path: Path) -> Iterator[Callable[..., RosProcess]]:
    supervisor = Supervisor(model_of(MODEL), Deployment.CONTROLLER, (), CERTIFICATE)
    write_files(generate(supervisor, "ros2"), tmp_path / "package")
    nodes: list[RosProcess] = []

    def start_node(*parameters: str) -> RosProcess:
        command = ["-m", "watcher_controller.node", "--ros-args"]
        for parameter in ("period:=0.02", "publish_state:=true", *parameters):
            command += ["-p", parameter]
        nodes.append(RosProcess(command, environment(domain, tmp_path), tmp_path / "run", [tmp_path / "package"]))
        return nodes[-1]

    yield start_node
    for node in nodes:
        node.__exit__(None, None, None)


def scan(count: int, first_deg: float, step_deg: float, near: float = 0.5) -> Any:
    """A scan of a LiDAR that sees something near at 270 degrees, something less near ahead, and else a wall."""
    from sensor_msgs.msg import LaserScan

    def distance(index: int) -> float:
        degree = (first_deg + index * step_deg) % 360.0
        return near if abs(degree - 270.0) < 0.3 else 0.75 if min(degree, 360.0 - degree) < 0.3 else 2.0

    return LaserScan(
        angle_min=math.radians(first_deg),
        angle_increment=math.radians(step_deg),
        range_min=0.125,
        range_max=8.0,
        ranges=array("f", map(distance, range(count))),
    )


class Watched:
    """Reports of the node about itself."""

    def __init__(self, peer: Peer) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from std_msgs.msg import String

        self._peer = peer
        self._states = peer.receive(String, "/state")
        self._reports = peer.receive(DiagnosticArray, "/diagnostics")

    def values(self, component: str) -> dict[str, str]:
        current = json.loads(self._states[-1].data)["current"] if self._states else {component: {"variables": {}}}
        return {str(name): str(value) for name, value in current[component]["variables"].items()}

    @property
    def level(self) -> int | None:
        return self._reports[-1].status[0].level[0] if self._reports else None

    @property
    def status(self) -> Any:
        return self._reports[-1].status[0]


def send(peer: Peer, message: Any) -> Callable[[], None]:
    from rclpy.qos import qos_profile_sensor_data

    return lambda: peer.publish(message, "/scan", qos_profile_sensor_data)


def test_270_degrees_is_on_the_right_of_every_lidar(start: Callable[..., RosProcess], peer: Peer) -> None:
    watched = Watched(peer)
    node = start("resample_scans:=true")
    lidars = ((360, 0.0, 1.0, 0.5), (720, -180.0, 0.5, 0.25), (1440, 180.0, -0.25, 0.375))
    for count, first_deg, step_deg, near in lidars:
        expected = ({"distance": str(near), "count": "360"}, {"distance": "0.75", "start": "0.0"})

        def is_understood(expected: tuple[dict[str, str], dict[str, str]] = expected) -> bool:
            return (watched.values("Right"), watched.values("Ahead")) == expected

        see = send(peer, scan(count, first_deg, step_deg, near))
        peer.spin_until(is_understood, LIMIT_S, f"the LiDAR of {count} beams to be understood", node, see)


def test_scans_are_left_alone_unless_asked_for(start: Callable[..., RosProcess], peer: Peer) -> None:
    watched = Watched(peer)
    node = start()
    peer.spin_until(
        lambda: watched.values("Right") == {"distance": "2.0", "count": "720"},
        LIMIT_S,
        "the scan as it came",
        node,
        send(peer, scan(720, -180.0, 0.5)),
    )


def test_one_subscription_serves_every_message_of_a_topic(start: Callable[..., RosProcess], peer: Peer) -> None:
    start()
    peer.wait_for_peers(["/scan"])
    assert len(peer.node.get_subscriptions_info_by_topic("/scan")) == 1


def test_diagnostics_follow_a_stale_sensor(start: Callable[..., RosProcess], peer: Peer) -> None:
    watched = Watched(peer)
    node = start()
    see = send(peer, scan(360, 0.0, 1.0))
    peer.spin_until(lambda: watched.level == 0, LIMIT_S, "an OK", node, see)
    assert watched.status.name == "/watcher_controller: controller"
    assert watched.status.hardware_id == "Watcher"
    values = {item.key: item.value for item in watched.status.values}
    assert values["status"] == "running"
    assert float(values["last decision (us)"]) > 0
    peer.spin_until(lambda: watched.level == 2, LIMIT_S, "an ERROR", node)
    assert watched.status.message.startswith("stopped: right_scan on /scan is stale")
    peer.spin_until(lambda: watched.level == 0, LIMIT_S, "an OK again", node, see)


class World:
    """A simulation: its time, which passes when it is set."""

    def __init__(self, peer: Peer, now_s: float) -> None:
        self.now_s = now_s
        self._peer = peer
        self._see = send(peer, scan(360, 0.0, 1.0))

    def pass_time(self) -> None:
        from rosgraph_msgs.msg import Clock

        self.now_s += 0.05
        time = Clock()
        time.clock.sec, time.clock.nanosec = int(self.now_s), int(self.now_s % 1.0 * 1e9)
        self._peer.publish(time, "/clock")

    def live(self) -> None:
        self.pass_time()
        self._see()


def test_a_paused_simulation_lets_nothing_expire_and_one_that_begins_anew_starts_anew(
    start: Callable[..., RosProcess], peer: Peer
) -> None:
    from geometry_msgs.msg import TwistStamped

    commands = peer.receive(TwistStamped, "/cmd")
    watched = Watched(peer)
    node = start("use_sim_time:=true")
    world = World(peer, 12345.0)

    def goes_since(sec: int) -> bool:
        return len(commands) > 10 and all(sec <= item.header.stamp.sec < sec + 1000 for item in commands[-5:])

    peer.spin_until(
        lambda: goes_since(12345) and watched.level == 0, LIMIT_S, "commands in simulated time", node, world.live
    )
    peer.spin_for(0.3)
    count = len(commands)
    # Longer than a scan is fresh, and than a report takes; nothing is decided either.
    peer.spin_for(1.5)
    assert watched.level == 0
    assert len(commands) == count
    peer.spin_until(lambda: watched.level == 2, LIMIT_S, "a stale scan", node, world.pass_time)
    world.now_s = 100.0
    commands.clear()
    peer.spin_until(
        lambda: goes_since(100) and watched.level == 0, LIMIT_S, "commands after the jump", node, world.live
    )
    assert "beginning anew" in node.stderr


def test_simulated_time_is_true_or_false(start: Callable[..., RosProcess]) -> None:
    node = start("use_sim_time:=1")
    assert node.wait() == 2
    assert node.stderr.splitlines()[-1].startswith("watcher_controller: ")
    assert "use_sim_time" in node.stderr
