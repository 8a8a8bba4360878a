"""Lines over real sockets of this computer."""

import socket
import threading
import time
from collections.abc import Iterator

import pytest

from robosc_bridge.errors import LineLostError
from robosc_bridge.transport.network_line import NetworkLine


@pytest.fixture
def peer() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        found.settimeout(3.0)
        yield found


@pytest.fixture
def server() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as found:
        found.settimeout(3.0)
        yield found


def _port(of: socket.socket) -> int:
    return int(of.getsockname()[1])


@pytest.mark.real_time
def test_a_connection_that_takes_no_more_is_reported_in_time(server: socket.socket) -> None:
    line = NetworkLine(f"tcp:127.0.0.1:{_port(server)}")
    other, _ = server.accept()
    begin_s = time.monotonic()
    with pytest.raises(LineLostError, match="takes no more bytes"):
        line.write(b"x" * 50_000_000)
    assert time.monotonic() - begin_s < 2.0
    other.close()
    line.close()


@pytest.mark.real_time
def test_waiting_ends_in_time_or_when_woken(peer: socket.socket) -> None:
    line = NetworkLine(f"udpout:127.0.0.1:{_port(peer)}")
    begin_s = time.monotonic()
    assert line.read(0.05) == b""
    assert 0.04 < time.monotonic() - begin_s < 1.0
    timer = threading.Timer(0.05, line.wake)
    timer.start()
    assert line.read(5.0) == b""
    assert time.monotonic() - begin_s < 3.0
    timer.join()
    line.close()
