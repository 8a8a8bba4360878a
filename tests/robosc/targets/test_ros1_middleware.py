"""The generated connections of ROS 1 without ROS 1: names on the wire, and when a last message has arrived."""

import socket
import sys
from collections.abc import Callable, Iterator
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from robosc.targets import generate, write_files
from support.generated import example_supervisor

PACKAGE = "line_follower_controller"


@pytest.fixture(scope="module")
def connections(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """The generated module, with stand-ins for what it imports of ROS."""
    folder = tmp_path_factory.mktemp("package")
    write_files(generate(example_supervisor("line_follower/line_follower"), "ros1"), folder)
    with pytest.MonkeyPatch.context() as patch:
        for name, members in (("rospy", {}), ("actionlib", {"ActionClient": object, "CommState": None})):
            stub = ModuleType(name)
            vars(stub).update(members)
            patch.setitem(sys.modules, name, stub)
        patch.syspath_prepend(str(folder))
        __import__(f"{PACKAGE}.connections")
        yield sys.modules[f"{PACKAGE}.connections"]
        for name in [name for name in sys.modules if name.split(".")[0] == PACKAGE]:
            del sys.modules[name]


def publisher(*connections: Any) -> Any:
    return SimpleNamespace(impl=SimpleNamespace(connections=list(connections)))


@pytest.mark.parametrize(
    ("prefix", "identifier", "name"),
    [("", "/a", "/a"), ("", "a/b", "a/b"), ("/p", "a", "/p/a"), ("/p", "/a", "/p/a"), ("/p", "~/a/b", "~a/b")],
)
def test_names_on_the_wire(connections: Any, prefix: str, identifier: str, name: str) -> None:
    assert connections.wire_name(prefix, identifier) == name


class Time:
    """The time, which passes only while somebody sleeps.

    Args:
        then: Function that is called when the moment `at_s` has come.
        at_s: Seconds from the beginning.
    """

    def __init__(self, then: Callable[[], object] = lambda: None, at_s: float = 0.0) -> None:
        self.now_s = 0.0
        self._then, self._at_s = then, at_s

    def monotonic(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds
        if self.now_s >= self._at_s:
            self._then()


def test_what_waits_in_a_queue_is_awaited(connections: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    connection = SimpleNamespace(_queue=[b"zero"], socket=None)
    time = Time(connection._queue.clear, 0.2)
    monkeypatch.setattr(connections, "time", time)
    connections.wait_until_delivered([publisher(SimpleNamespace(_queue=[], socket=None)), publisher(connection)])
    assert not connection._queue
    assert 0.2 <= time.now_s < connections.DELIVERY_S


def test_what_the_other_computer_has_not_confirmed_is_awaited_but_not_for_long(
    connections: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    time = Time()
    monkeypatch.setattr(connections, "time", time)
    with socket.create_server(("127.0.0.1", 0)) as server, socket.create_connection(server.getsockname()) as sender:
        receiver, _ = server.accept()
        with receiver:
            sender.setblocking(False)
            with pytest.raises(BlockingIOError):
                while True:
                    sender.send(bytes(65536))
            connection = SimpleNamespace(_queue=[], socket=sender)
            assert connections._unsent(connection)
            connections.wait_until_delivered([publisher(connection)])
            assert connections.DELIVERY_S <= time.now_s < 2 * connections.DELIVERY_S

    assert not connections._unsent(SimpleNamespace(_queue=[], socket=sender))
    assert not connections._unsent(SimpleNamespace(_queue=[], socket=None))
