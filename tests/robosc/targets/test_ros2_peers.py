"""Connections that cannot exist, as ROS 2 shows the other ends."""

from types import SimpleNamespace
from typing import Any

from robosc.targets.ros2.runtime.peers import service_misfits, topic_misfits

TWIST, STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"


def end(name: str, type_name: str, quality: str = "fits", namespace: str = "/") -> Any:
    return SimpleNamespace(node_name=name, node_namespace=namespace, topic_type=type_name, qos_profile=quality)


def why_not(quality: str) -> str:
    return "" if quality == "fits" else quality


def test_a_receiver_of_another_type_gets_nothing() -> None:
    ends = [end("base", STAMPED), end("base", STAMPED), end("log", TWIST), end("other", STAMPED, namespace="/ns")]
    assert topic_misfits("/cmd_vel", TWIST, ends, True, why_not) == [
        f"/cmd_vel: /base takes {STAMPED}, this node sends {TWIST}",
        f"/cmd_vel: /ns/other takes {STAMPED}, this node sends {TWIST}",
    ]


def test_a_sender_of_another_type_or_quality_is_not_heard() -> None:
    ends = [end("lidar", TWIST, "its reliability"), end("_NODE_NAME_UNKNOWN_", STAMPED), end("young", "")]
    assert topic_misfits("/scan", TWIST, ends, False, why_not) == [
        "/scan: /lidar sends and this node takes in vain: its reliability",
        f"/scan: a node sends {STAMPED}, this node takes {TWIST}",
    ]


def test_a_service_of_another_type_does_not_answer() -> None:
    wanted = [("power", "/ns/power", "std_srvs/srv/SetBool"), ("go", "/go/_action/send_goal", "a/action/Go_SendGoal")]
    offered = {
        "/ns/power": ["std_srvs/srv/SetBool", "std_srvs/srv/Trigger"],
        "/go/_action/send_goal": ["a/action/Go_SendGoal"],
        "/else": ["std_srvs/srv/Empty"],
    }
    assert service_misfits(wanted, offered) == [
        "power: another node uses it as std_srvs/srv/Trigger, this node as std_srvs/srv/SetBool"
    ]
    assert service_misfits(wanted, {}) == []
