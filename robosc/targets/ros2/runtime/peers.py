"""
Connections that the model needs and that cannot exist, in words.

ROS 2 does not tell a node that a peer on its topic sends another type, or with another quality of
service: nothing is ever received.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from robosc.targets.ros2.runtime.inquiry import node_of

UNLIMITED_NS = 2**63 - 1
"""Duration of what has no limit, as the middleware shows it; that of a node's own profile is 0."""


class Ends:
    """
    The ends of topics that a node has.

    :param node: The node.
    """

    def __init__(self, node: Any) -> None:
        self._node = node
        self._ends: list[tuple[str, str, bool, Any]] = []

    def add(self, name: str, topic: Any, sends: bool, quality: Any) -> None:
        """
        Add an end.

        :param name: The topic's name on ROS.
        :param topic: The topic, with the package and the name of its type.
        :param sends: True if the node sends there.
        :param quality: The node's quality of service there, as it is once overrides are in it.
        """
        type_name = topic.package + '/msg/' + topic.type_name
        self._ends.append((name, type_name, sends, quality))

    def misfits(self) -> list[str]:
        """Return what keeps other nodes from being connected with this one, in words."""
        found = []
        for name, type_name, sends, quality in self._ends:
            look = (
                self._node.get_subscriptions_info_by_topic
                if sends
                else self._node.get_publishers_info_by_topic
            )
            found += topic_misfits(name, type_name, look(name), sends, quality)
        return found


def topic_misfits(
    name: str,
    type_name: str,
    peers: Iterable[Any],
    sends: bool,
    quality: Any,
) -> list[str]:
    """
    Return what keeps the other ends of a topic from being connected with this node.

    :param name: The topic's name on ROS.
    :param type_name: Type that this node uses, `geometry_msgs/msg/Twist`.
    :param peers: The other ends, as the middleware shows them.
    :param sends: True if this node sends there and the others receive.
    :param quality: This node's quality of service there.
    """
    own, others = ('sends', 'takes') if sends else ('takes', 'sends')
    found = set()
    for peer in peers:
        who = node_of(peer) or 'a node'
        if peer.topic_type and peer.topic_type != type_name:
            found.add(f'{name}: {who} {others} {peer.topic_type}, this node {own} {type_name}')
            continue
        sender, receiver = (quality, peer.qos_profile) if sends else (peer.qos_profile, quality)
        reason = _why_not(sender, receiver)
        if reason:
            found.add(f'{name}: {who} {others} and this node {own} in vain: {reason}')
    return sorted(found)


def _why_not(sender: Any, receiver: Any) -> str:
    """Return why one quality of service does not do for the other; empty if it does."""
    for policy, offered, wanted in (
        ('reliability', 'BEST_EFFORT', 'RELIABLE'),
        ('durability', 'VOLATILE', 'TRANSIENT_LOCAL'),
    ):
        if (getattr(sender, policy).name, getattr(receiver, policy).name) == (offered, wanted):
            return f'{policy} {offered.lower()} is sent, {wanted.lower()} is taken'
    # No node asserts by hand that a publisher of the model lives, or promises when it sends again.
    if receiver.liveliness.name == 'MANUAL_BY_TOPIC' != sender.liveliness.name:
        return 'liveliness automatic is sent, manual_by_topic is taken'
    for policy in ('deadline', 'liveliness_lease_duration'):
        offered_s, wanted_s = (
            _limit_s(getattr(quality, policy)) for quality in (sender, receiver)
        )
        if offered_s > wanted_s:
            return f'{policy} {_shown(offered_s)} is sent, {_shown(wanted_s)} is taken'
    return ''


def _limit_s(duration: Any) -> float:
    is_limited = 0 < duration.nanoseconds < UNLIMITED_NS
    return duration.nanoseconds / 1e9 if is_limited else float('inf')


def _shown(limit_s: float) -> str:
    return 'unlimited' if limit_s == float('inf') else f'of {limit_s:g} s'


def service_misfits(
    wanted: Iterable[tuple[str, str, str]], offered: Mapping[str, Sequence[str]]
) -> list[str]:
    """
    Return the services and actions that others use with another type.

    :param wanted: Of each its name on ROS, the service by which it is recognized, and its type.
    :param offered: The types that are in use, by service.
    """
    return [
        f'{name}: another node uses it as {other}, this node as {type_name}'
        for name, service, type_name in wanted
        for other in sorted(offered.get(service, ()))
        if other != type_name
    ]
