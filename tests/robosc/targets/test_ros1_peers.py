"""Nodes of another type on a topic, as a master and the nodes themselves know them."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from robosc.targets.ros1.runtime.peers import LOOKS, Peers

TWIST, STAMPED, SCAN = "geometry_msgs/Twist", "geometry_msgs/TwistStamped", "sensor_msgs/LaserScan"


class Graph:
    """A master and nodes: what each sends and takes, by its name."""

    def __init__(self) -> None:
        self.sends: dict[str, dict[str, str]] = {}
        self.takes: dict[str, dict[str, str]] = {}
        self.uris: dict[str, str] = {}
        self.silent: set[str] = set()
        self.asked: list[str] = []

    def join(self, name: str, sends: dict[str, str], takes: dict[str, str], process: int = 1) -> None:
        self.sends[name], self.takes[name], self.uris[name] = sends, takes, f"http://{name}:{process}"

    def getSystemState(self, caller: str) -> list[Any]:
        def by_topic(found: dict[str, dict[str, str]]) -> list[list[Any]]:
            topics = {topic for types in found.values() for topic in types}
            return [[topic, [name for name in found if topic in found[name]]] for topic in topics]

        return [1, "", [by_topic(self.sends), by_topic(self.takes), []]]

    def lookupNode(self, caller: str, name: str) -> list[Any]:
        return [1, "", self.uris[name]] if name in self.uris else [-1, "unknown", ""]

    @contextmanager
    def proxy(self, uri: str) -> Iterator[Any]:
        (name,) = [name for name, item in self.uris.items() if item == uri]
        self.asked.append(name)
        if name in self.silent:
            raise OSError("refused")
        yield Answers(self.sends[name], self.takes[name])


class Answers:
    """A node that tells its types."""

    def __init__(self, sends: dict[str, str], takes: dict[str, str]) -> None:
        self._sends, self._takes = sends, takes

    def getPublications(self, caller: str) -> list[Any]:
        return [1, "", [list(item) for item in self._sends.items()]]

    def getSubscriptions(self, caller: str) -> list[Any]:
        return [1, "", [list(item) for item in self._takes.items()]]


def watched(graph: Graph) -> Peers:
    graph.join("/own", {"/cmd_vel": TWIST}, {"/scan": SCAN})
    return Peers("/own", [("/cmd_vel", TWIST, True), ("/scan", SCAN, False)], graph.proxy)


def test_nodes_of_another_type_are_named_and_asked_once() -> None:
    graph = Graph()
    peers = watched(graph)
    graph.join("/base", {}, {"/cmd_vel": STAMPED, "/scan": SCAN})
    graph.join("/recorder", {}, {"/cmd_vel": "*", "/scan": "*"})
    graph.join("/lidar", {"/scan": "sensor_msgs/PointCloud"}, {})
    graph.join("/other", {"/cmd_vel": STAMPED}, {"/else": TWIST})
    expected = (
        f"/cmd_vel: /base takes {STAMPED}, this node sends {TWIST}",
        f"/scan: /lidar sends sensor_msgs/PointCloud, this node takes {SCAN}",
    )
    for _ in range(2 * LOOKS):
        assert peers.misfits(graph) == expected
    assert sorted(graph.asked) == ["/base", "/lidar", "/recorder"]
    # Another process of that name has other types.
    graph.join("/base", {}, {"/cmd_vel": TWIST}, process=2)
    del graph.sends["/lidar"], graph.takes["/lidar"]
    assert peers.misfits(graph) == ()
    # A node that begins to take another topic is asked again.
    graph.join("/recorder", {"/scan": TWIST}, {"/cmd_vel": "*"})
    assert peers.misfits(graph) == (f"/scan: /recorder sends {TWIST}, this node takes {SCAN}",)


def test_a_node_that_does_not_answer_is_asked_again_but_seldom() -> None:
    graph = Graph()
    peers = watched(graph)
    graph.join("/base", {}, {"/cmd_vel": STAMPED})
    graph.silent.add("/base")
    for _ in range(2 * LOOKS):
        assert peers.misfits(graph) == ()
    assert len(graph.asked) == 3
    graph.silent.clear()
    found = [peers.misfits(graph) for _ in range(LOOKS)]
    assert len(found[-1]) == 1
    # It is known to the master, and nobody knows where it is.
    del graph.uris["/base"]
    assert peers.misfits(graph) == ()


def test_a_master_that_refuses_tells_nothing() -> None:
    graph = Graph()
    peers = watched(graph)
    graph.getSystemState = lambda caller: [0, "no", []]  # type: ignore[method-assign]
    assert peers.misfits(graph) == ()
