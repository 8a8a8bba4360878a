"""Connections that cannot exist, as ROS 2 shows the other ends."""

from enum import Enum
from types import SimpleNamespace
from typing import Any

import pytest

from robosc.targets.ros2.runtime.peers import UNLIMITED_NS, Ends, service_misfits, topic_misfits

TWIST, STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"


class Policy(Enum):
    RELIABLE = 1
    BEST_EFFORT = 2
    TRANSIENT_LOCAL = 3
    VOLATILE = 4
    AUTOMATIC = 5
    MANUAL_BY_TOPIC = 6


def quality(
    *,
    reliable: bool = True,
    latched: bool = False,
    deadline_ns: int = 0,
    lease_ns: int = 0,
    liveliness: Policy = Policy.AUTOMATIC,
) -> Any:
    return SimpleNamespace(
        deadline=SimpleNamespace(nanoseconds=deadline_ns),
        liveliness_lease_duration=SimpleNamespace(nanoseconds=lease_ns),
        liveliness=liveliness,
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
    much, little = (
        quality(reliable=is_much) if policy == "reliable" else quality(latched=is_much) for is_much in (True, False)
    )
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


SECOND = 10**9


@pytest.mark.parametrize(
    ("wanted", "text"),
    [
        (quality(deadline_ns=UNLIMITED_NS, lease_ns=UNLIMITED_NS), None),
        (quality(deadline_ns=SECOND // 2), "deadline unlimited is sent, of 0.5 s is taken"),
        (quality(lease_ns=2 * SECOND), "liveliness_lease_duration unlimited is sent, of 2 s is taken"),
        (quality(liveliness=Policy.MANUAL_BY_TOPIC), "liveliness automatic is sent, manual_by_topic is taken"),
    ],
)
def test_a_limit_that_nobody_keeps_lets_nothing_through(wanted: Any, text: str | None) -> None:
    found = topic_misfits("/x", TWIST, [end("peer", TWIST, wanted)], True, PLAIN)
    assert found == ([] if text is None else [f"/x: /peer takes and this node sends in vain: {text}"])
    assert topic_misfits("/x", TWIST, [end("peer", TWIST, wanted)], False, PLAIN) == []


def test_a_limit_is_kept_by_a_shorter_one() -> None:
    for own, fits in ((SECOND, True), (3 * SECOND, False)):
        sender, receiver = quality(deadline_ns=own), quality(deadline_ns=2 * SECOND)
        assert (topic_misfits("/x", TWIST, [end("peer", TWIST, receiver)], True, sender) == []) is fits


def test_every_end_of_a_node_is_looked_at() -> None:
    shown = {True: [end("base", STAMPED)], False: []}
    ends = Ends(
        SimpleNamespace(
            get_subscriptions_info_by_topic=lambda name: shown[True],
            get_publishers_info_by_topic=lambda name: shown[False],
        )
    )
    topic = SimpleNamespace(package="geometry_msgs", type_name="Twist")
    ends.add("/cmd_vel", topic, True, PLAIN)
    ends.add("/back", topic, False, PLAIN)
    assert ends.misfits() == [f"/cmd_vel: /base takes {STAMPED}, this node sends {TWIST}"]
    shown[False].append(end("other", STAMPED))
    assert len(ends.misfits()) == 2


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
