"""`robosc-bridge ros2` over real DDS: a peer sees the robot of a bridge as RViz and Nav2 would."""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy", exc_type=ImportError)

from robosc_bridge.devices.interface import Pose, Velocity
from support.remote import READING, FakeDaemon, scan, served
from support.ros2 import Peer, RosProcess, environment, own_domain

pytestmark = pytest.mark.real_time
LIMIT_S = 30.0
IMU = {f"orientation_{axis}": float(axis == "w") for axis in "wxyz"} | {"angular_velocity_z": -0.2}


@pytest.fixture
def daemon() -> Iterator[FakeDaemon]:
    with FakeDaemon() as found:
        yield found


def test_a_peer_sees_the_robot(daemon: FakeDaemon, tmp_path: Path) -> None:
    from diagnostic_msgs.msg import DiagnosticArray
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import BatteryState, Imu, JointState, LaserScan

    reading = replace(READING, pose=Pose(1.0, 2.0, math.pi / 2), velocity=Velocity(0.1, -0.2), imu=IMU)
    with served(daemon) as endpoint, own_domain() as domain:
        variables = environment(domain, tmp_path / "ros")
        command = ["-m", "robosc_bridge.command", "ros2", "--address", endpoint.address]
        with Peer(domain, variables) as peer, RosProcess(command, variables, tmp_path) as process:
            heard: dict[str, list[Any]] = {
                topic: peer.receive(kind, topic)
                for topic, kind in (
                    ("odom", Odometry), ("joint_states", JointState), ("imu", Imu), ("battery_state", BatteryState),
                    ("/diagnostics", DiagnosticArray),
                )
            }  # fmt: skip
            from rclpy.qos import qos_profile_sensor_data

            heard["scan"] = []
            peer.node.create_subscription(LaserScan, "scan", heard["scan"].append, qos_profile_sensor_data)
            peer.spin_until(
                lambda: all(heard.values()), LIMIT_S, "all topics", process,
                lambda: daemon.show(reading=reading, scan=scan(0.7)),
            )  # fmt: skip
            endpoint.stop()

            def is_told() -> bool:
                return any(item.status[0].level == b"\x02" for item in heard["/diagnostics"])

            peer.spin_until(is_told, LIMIT_S, "the loss", process)
            subscriptions = peer.node.get_subscriber_names_and_types_by_node("robosc_bridge", "/")
    odom, joints, imu, battery, diagnosed = (heard[topic][-1] for topic in list(heard)[:5])
    assert (odom.header.frame_id, odom.child_frame_id) == ("odom", "base_footprint")
    assert (odom.pose.pose.position.x, odom.pose.pose.position.y) == (1.0, 2.0)
    assert odom.pose.pose.orientation.z == pytest.approx(math.sqrt(0.5))
    assert (odom.twist.twist.linear.x, odom.twist.twist.angular.z) == (0.1, -0.2)
    assert odom.pose.covariance[0] < 0.01 < odom.pose.covariance[14]
    assert joints.name == ["wheel_left_joint", "wheel_right_joint"]
    assert joints.velocity[0] == pytest.approx(READING.wheels_m_s[0] / 0.033)
    assert (imu.angular_velocity.z, imu.orientation.w) == (-0.2, 1.0)
    assert imu.linear_acceleration_covariance[0] == -1.0
    assert battery.voltage == pytest.approx(READING.battery_v)
    assert heard["scan"][-1].ranges[0] == pytest.approx(0.7)
    assert math.isnan(heard["scan"][-1].ranges[1])
    assert len(heard["scan"][-1].ranges) == 360
    running = next(item for item in heard["/diagnostics"] if item.status[0].level != b"\x02")
    assert {status.name.removeprefix("robosc_bridge: ") for status in running.status} == {
        "bridge", "drive", "scanner", "motors",
    }  # fmt: skip
    assert diagnosed.status[0].level == b"\x02"
    # The supervisor keeps command of the wheels.
    assert not any("cmd_vel" in name for name, _ in subscriptions)
