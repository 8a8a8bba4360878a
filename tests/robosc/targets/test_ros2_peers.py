"""Connections that cannot exist, as ROS 2 shows the other ends."""

from enum import Enum
from types import SimpleNamespace
from typing import Any

import pytest

from robosc.targets.ros2.runtime.peers import service_misfits, topic_misfits

TWIST, STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"


class Policy(Enum):
    RELIABLE = 1
    BEST_EFFORT = 2
    TRANSIENT_LOCAL = 3
    VOLATILE = 4


def quality(*, reliable: bool = True, latched: bool = False) -> Any:
    return SimpleNamespace(
        reliability=Policy.RELIABLE if reliable else Policy.BEST_EFFORT,
        durability=Policy.TRANSIENT_LOCAL if latched else Policy.VOLATILE,
    )


PLAIN = quality()


def end(name: str, type_name: str, quality: Any = PLAIN, namespace: str = "/") -> Any:
    return SimpleNamespace(node_name=name, node_namespace=namespace, topic_type=type_name, qos_profile=quality)


def test_a_receiver_of_another_type_gets_nothing() -> None:
    ends = [end("base", STAMPED), end("base", STAMPED), end("log", TWIST), end("other", STAMPED, namespace="/ns")]
    assert topic_misfits("/cmd_vel", TWIST, ends, True, PLAIN) == [
        f"/cmd_vel: /base takes {STAMPED}, this node sends {TWIST}",
        f"/cmd_vel: /ns/other takes {STAMPED}, this node sends {TWIST}",
    ]


def test_a_sender_of_another_type_is_not_heard() -> None:
    ends = [end("_NODE_NAME_UNKNOWN_", STAMPED), end("young", "")]
    assert topic_misfits("/scan", TWIST, ends, False, PLAIN) == [
        f"/scan: a node sends {STAMPED}, this node takes {TWIST}"
    ]


@pytest.mark.parametrize("policy", ["reliable", "latched"])
@pytest.mark.parametrize("sends", [True, False])
def test_less_than_what_is_wanted_does_not_do(policy: str, sends: bool) -> None:
    much, little = quality(**{policy: True}), quality(**{policy: False})
    for other, own, fits in (
        (much, much, True),
        (little, little, True),
        (little, much, sends),
        (much, little, not sends),
    ):
        found = topic_misfits("/x", TWIST, [end("peer", TWIST, other)], sends, own)
        assert (found == []) == fits
        words = {
            "reliable": "reliability best_effort is sent, reliable is taken",
            "latched": "durability volatile is sent, transient_local is taken",
        }
        assert fits or found[0].endswith(words[policy])


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
