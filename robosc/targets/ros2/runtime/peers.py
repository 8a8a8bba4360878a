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
    :param peers: What the middleware shows of the other ends.
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
    """
    Return why one quality of service does not do for the other; empty if it does.

    Only policies that nodes set: of others a peer's are reported in another way than one's own.
    """
    for policy, offered, wanted in (
        ('reliability', 'BEST_EFFORT', 'RELIABLE'),
        ('durability', 'VOLATILE', 'TRANSIENT_LOCAL'),
    ):
        if (getattr(sender, policy).name, getattr(receiver, policy).name) == (offered, wanted):
            return f'{policy} {offered.lower()} is sent, {wanted.lower()} is taken'
    return ''


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
