"""Tests of what does not fit among the nodes on the bridge's topics."""

import pytest

from robosc_bridge.ros2.peers import OwnTopic, Peer, clock_misfits, misfits

OWN = {
    "/odom": OwnTopic("nav_msgs/msg/Odometry"),
    "/scan": OwnTopic("sensor_msgs/msg/LaserScan", is_reliable=False),
    "/diagnostics": OwnTopic("diagnostic_msgs/msg/DiagnosticArray", is_shared=True),
}


def _peer(topic: str, *, publishes: bool = False, kind: str = "", is_reliable: bool = True) -> Peer:
    return Peer("/other", topic, kind or OWN[topic].type, publishes, is_reliable)


@pytest.mark.parametrize(
    "peer",
    [
        _peer("/odom"),
        _peer("/odom", is_reliable=False),
        _peer("/scan", is_reliable=False),
        _peer("/diagnostics", publishes=True),
    ],
)
def test_what_fits_is_not_reported(peer: Peer) -> None:
    assert misfits(OWN, [peer]) == ()


@pytest.mark.parametrize("publishes", [True, False])
def test_another_type_on_a_topic_is_reported_with_both(publishes: bool) -> None:
    peer = _peer("/odom", kind="geometry_msgs/msg/PoseStamped", publishes=publishes)
    (text,) = misfits(OWN, [peer, peer])
    assert text == (
        "On /odom, /other has messages of type geometry_msgs/msg/PoseStamped, and this node nav_msgs/msg/Odometry: "
        "none arrive."
    )


def test_a_second_source_is_reported() -> None:
    assert misfits(OWN, [_peer("/odom", publishes=True)]) == ("On /odom, /other publishes, too.",)


def test_a_subscriber_that_asks_for_more_than_there_is_is_reported() -> None:
    (text,) = misfits(OWN, [_peer("/scan")])
    assert text.startswith("On /scan, /other asks for reliable delivery")


def test_clocks() -> None:
    assert clock_misfits(uses_sim_time=False, has_clock=False) == ()
    assert "has no effect" in clock_misfits(uses_sim_time=True, has_clock=False)[0]
    for uses_sim_time in (True, False):
        assert "simulated time" in clock_misfits(uses_sim_time=uses_sim_time, has_clock=True)[0]
