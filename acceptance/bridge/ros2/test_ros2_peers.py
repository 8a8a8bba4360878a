"""The bridge's node beside nodes that do not fit, over real DDS: its diagnostics say so within seconds."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from support.ros2 import Peer, RosProcess, environment, own_domain

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")

pytestmark = [pytest.mark.ros2, pytest.mark.real_time]

LIMIT_S = 20.0
WARN, OK = b"\x01", b"\x00"
# A bridge need not answer: the node publishes its diagnostics all the same.
ROS2 = ("-m", "robosc_bridge.command", "ros2", "--address", "127.0.0.1:9", "--no-tf")


@pytest.fixture
def peer(tmp_path: Path) -> Iterator[Peer]:
    with own_domain() as domain, Peer(domain, environment(domain, tmp_path)) as made:
        yield made


def _watched(peer: Peer) -> Callable[[], tuple[bytes, str]]:
    """Return a function that returns level and message of the entry about other nodes."""
    from diagnostic_msgs.msg import DiagnosticArray

    heard: list[Any] = []
    peer.node.create_subscription(DiagnosticArray, "/diagnostics", heard.append, 10)

    def last() -> tuple[bytes, str]:
        status = heard[-1].status if heard else ()
        found = [(bytes(item.level), str(item.message)) for item in status if item.name == "robosc_bridge: ros"]
        return found[0] if found else (b"", "")

    return last


def test_nodes_that_do_not_fit_are_a_warning_with_the_reason_until_they_are_gone(peer: Peer, tmp_path: Path) -> None:
    from geometry_msgs.msg import PoseStamped
    from rosgraph_msgs.msg import Clock
    from sensor_msgs.msg import Imu, LaserScan

    last = _watched(peer)
    with RosProcess([*ROS2], {}, tmp_path / "ros2") as process:
        node = peer.node

        def becomes(level: bytes, text: str) -> None:
            peer.spin_until(lambda: last()[0] == level and text in last()[1], LIMIT_S, f"{text}; {last()}", process)

        becomes(OK, "Nothing is wrong")
        made: list[tuple[Callable[[Any], Any], Any, str]] = [
            (
                node.destroy_subscription,
                node.create_subscription(PoseStamped, "odom", print, 10),
                "has messages of type",
            ),
            (node.destroy_publisher, node.create_publisher(Imu, "imu", 10), "publishes, too"),
            (node.destroy_subscription, node.create_subscription(LaserScan, "scan", print, 10), "asks for reliable"),
            (node.destroy_publisher, node.create_publisher(Clock, "/clock", 10), "a simulated time"),
        ]
        for _, _, text in made:
            becomes(WARN, text)
        for destroy, endpoint, _ in made:
            destroy(endpoint)
        becomes(OK, "Nothing is wrong")


def test_a_time_that_nobody_publishes_is_a_warning(peer: Peer, tmp_path: Path) -> None:
    last = _watched(peer)
    with RosProcess([*ROS2, "--ros-args", "-p", "use_sim_time:=true"], {}, tmp_path / "ros2") as process:
        peer.spin_until(lambda: last() == (WARN, last()[1]) and "use_sim_time" in last()[1], LIMIT_S, "it", process)
