"""Tests of the kernel's filter of new connections, on real sockets of this machine."""

import socket
from collections.abc import Iterator, Sequence

import pytest

from robosc_api.connection_filter import drop_new_connections
from robosc_api.connection_watch import can_watch
from support.late_connections import is_late

pytestmark = pytest.mark.skipif(not can_watch(), reason="this system has no filters of packets")


@pytest.fixture(name="listener")
def listening() -> Iterator[socket.socket]:
    """A socket that listens for both versions of IP."""
    with socket.create_server(("::", 0), family=socket.AF_INET6, dualstack_ipv6=True) as listener:
        yield listener


@pytest.mark.parametrize(
    ("hosts", "expected"),
    [
        ([], (False, False, False)),
        (["127.0.0.1"], (True, False, False)),
        (["10.0.0.1", "::2", "127.0.0.2"], (False, True, False)),
        (["127.0.0.3", "::1"], (False, False, True)),
        (["2001:db8::1", "0:0:0:1::1", "no address"], (False, False, False)),
        (["127.0.0.1", "127.0.0.2", "::1"], (True, True, True)),
        ([*[f"2001:db8::{number:x}" for number in range(1, 400)], "127.0.0.1"], (True, False, False)),
    ],
)
def test_new_connections_of_some_hosts_are_dropped(
    listener: socket.socket, hosts: Sequence[str], expected: tuple[bool, ...]
) -> None:
    drop_new_connections(listener, hosts)
    port = listener.getsockname()[1]
    ends = (("127.0.0.1", "127.0.0.1"), ("127.0.0.2", "127.0.0.1"), ("::1", "::1"))
    assert tuple(is_late(port, *end) for end in ends) == expected


def test_a_present_connection_goes_on_and_a_filter_is_replaced_and_removed(listener: socket.socket) -> None:
    with socket.create_connection(("127.0.0.1", listener.getsockname()[1])) as line:
        accepted, _ = listener.accept()
        with accepted:
            drop_new_connections(listener, ["127.0.0.1"])
            line.sendall(b"word")
            assert accepted.recv(4) == b"word"
    port = listener.getsockname()[1]
    drop_new_connections(listener, ["127.0.0.2"])
    assert not is_late(port, "127.0.0.1")
    drop_new_connections(listener, [])
    drop_new_connections(listener, [])
    assert not is_late(port, "127.0.0.2")
