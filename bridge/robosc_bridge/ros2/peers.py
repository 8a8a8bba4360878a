"""Other nodes on the topics of the bridge's node: what keeps them from understanding each other.

A middleware connects no endpoints of different types or incompatible qualities, and says nothing about it to those who
wait: a topic is there, and nothing comes. Of the nodes that are seen, this module says what does not fit.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class OwnTopic:
    """Topic that the node publishes on.

    Attributes:
        type: Type of its messages, such as `nav_msgs/msg/Odometry`.
        is_reliable: True if delivery is reliable.
        is_shared: True if others may publish on it, too.
    """

    type: str
    is_reliable: bool = True
    is_shared: bool = False


@dataclass(frozen=True)
class Peer:
    """Endpoint of another node.

    Attributes:
        node: Name of the node, with its namespace.
        topic: Name of the topic.
        type: Type of its messages.
        is_publisher: True if it publishes; else it subscribes.
        is_reliable: True if it asks for, or offers, reliable delivery.
    """

    node: str
    topic: str
    type: str
    is_publisher: bool
    is_reliable: bool


def misfits(own: Mapping[str, OwnTopic], peers: Iterable[Peer]) -> tuple[str, ...]:
    """Return what does not fit, one sentence each, without repetitions.

    Args:
        own: Topics that the node publishes on, by their full names.
        peers: Endpoints of other nodes on these topics.
    """
    return tuple(dict.fromkeys(text for peer in peers for text in _misfits(own[peer.topic], peer)))


def _misfits(own: OwnTopic, peer: Peer) -> Iterator[str]:
    if peer.type != own.type:
        yield f"On {peer.topic}, {peer.node} has messages of type {peer.type}, and this node {own.type}: none arrive."
    elif peer.is_publisher:
        if not own.is_shared:
            yield f"On {peer.topic}, {peer.node} publishes, too."
    elif peer.is_reliable and not own.is_reliable:
        yield (
            f"On {peer.topic}, {peer.node} asks for reliable delivery, which sensor data does not have: it receives "
            "nothing."
        )


def clock_misfits(*, uses_sim_time: bool, has_clock: bool) -> tuple[str, ...]:
    """Return what is wrong with the clocks, one sentence each.

    Args:
        uses_sim_time: True if the parameter use_sim_time of the node is set.
        has_clock: True if somebody publishes a simulated time.
    """
    if has_clock:
        return (
            "On /clock, somebody publishes a simulated time: nodes that go by it discard this node's messages, whose "
            "stamps are of the real time.",
        )
    if uses_sim_time:
        return ("use_sim_time is set, and has no effect: there is no /clock, and a bridge runs in real time.",)
    return ()
