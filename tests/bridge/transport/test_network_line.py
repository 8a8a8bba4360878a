"""Lines over real sockets of this computer."""

import socket
from collections.abc import Iterator

import pytest

from robosc_bridge.errors import LineBusyError, LineError, LineLostError, LineMissingError
from robosc_bridge.transport.network_line import NetworkLine, is_network_address
from robosc_bridge.transport.serial_line import SerialLine
from robosc_bridge.transport.system_host import open_line
from support.descriptors import open_descriptors
from support.pty_end import PtyEnd


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


def test_addresses() -> None:
    assert is_network_address("udpin:0.0.0.0:14550")
    assert not is_network_address("/dev/ttyACM0")


@pytest.mark.parametrize("address", ["udpout:host", "tcp::5760", "udpin:127.0.0.1:x", "udpout:127.0.0.1:70000"])
def test_what_is_no_address_is_reported(address: str) -> None:
    with pytest.raises(LineError, match=r"udpin\|udpout\|tcp:HOST:PORT"):
        NetworkLine(address)


def test_a_sender_hears_what_comes_back(peer: socket.socket) -> None:
    line = NetworkLine(f"udpout:127.0.0.1:{_port(peer)}")
    line.write(b"hello")
    data, sender = peer.recvfrom(100)
    assert data == b"hello"
    assert sender[1] == line.port
    peer.sendto(b"a", sender)
    peer.sendto(b"", sender)
    peer.sendto(b"b", sender)
    assert line.is_datagram
    assert [line.read(3.0) for _ in range(3)] == [b"a", b"", b"b"]
    line.close()


def test_nobody_at_the_other_end_of_udp_is_no_loss() -> None:
    # One of the ports that the system does not hand out.
    line = NetworkLine("udpout:127.0.0.1:1")
    for _ in range(5):
        line.write(b"hello")
        assert line.read(0.01) == b""
    line.close()


def test_a_listener_answers_whom_it_has_chosen(peer: socket.socket) -> None:
    line = NetworkLine("udpin:127.0.0.1:0")
    line.write(b"to nobody")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.settimeout(0.05)
        peer.sendto(b"vehicle", ("127.0.0.1", line.port))
        assert line.read(3.0) == b"vehicle"
        line.answer_sender()
        stranger.sendto(b"stranger", ("127.0.0.1", line.port))
        assert line.read(3.0) == b"stranger"
        line.write(b"answer")
        assert peer.recv(100) == b"answer"
        with pytest.raises(TimeoutError):
            stranger.recv(100)
    line.close()


def test_a_port_that_is_taken_is_reported(peer: socket.socket) -> None:
    with pytest.raises(LineBusyError, match="another program listens there"):
        NetworkLine(f"udpin:127.0.0.1:{_port(peer)}")


def test_a_connection_carries_bytes_both_ways_and_reports_its_end(server: socket.socket) -> None:
    line = NetworkLine(f"tcp:127.0.0.1:{_port(server)}")
    other, _ = server.accept()
    line.write(b"x" * 100)
    assert other.recv(100, socket.MSG_WAITALL) == b"x" * 100
    other.sendall(b"back")
    assert line.read(3.0) == b"back"
    assert line.read(0.0) == b""
    other.close()
    with pytest.raises(LineLostError, match="has closed the connection"):
        line.read(3.0)
    line.close()


def test_nobody_serves_there() -> None:
    with socket.socket() as silent:
        # It is taken, without a listener.
        silent.bind(("127.0.0.1", 0))
        with pytest.raises(LineMissingError, match="no program listens there"):
            NetworkLine(f"tcp:127.0.0.1:{_port(silent)}")


def test_a_closed_line_is_reported_and_leaves_nothing(peer: socket.socket) -> None:
    before = open_descriptors()
    line = NetworkLine(f"udpout:127.0.0.1:{_port(peer)}")
    line.close()
    line.close()
    line.wake()
    assert open_descriptors() <= before
    with pytest.raises(LineLostError, match="closed"):
        line.read(0.0)
    with pytest.raises(LineLostError, match="closed"):
        line.write(b"x")


def test_who_listens_can_recognize_strangers_and_answer_them(peer: socket.socket) -> None:
    line = NetworkLine("udpin:127.0.0.1:0")
    line.reply(b"to nobody")
    peer.sendto(b"first", ("127.0.0.1", line.port))
    assert line.read(3.0) == b"first"
    assert not line.is_stranger
    line.answer_sender()
    assert not line.is_stranger
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.settimeout(3.0)
        other.sendto(b"second", ("127.0.0.1", line.port))
        assert line.read(3.0) == b"second"
        assert line.is_stranger
        line.reply(b"to the other")
        assert other.recv(100) == b"to the other"
    line.write(b"to the peer")
    assert peer.recv(100) == b"to the peer"
    line.close()


def test_a_line_is_opened_by_its_address(peer: socket.socket) -> None:
    line = open_line(f"udpout:127.0.0.1:{_port(peer)}", 9600)
    assert isinstance(line, NetworkLine)
    line.close()
    end = PtyEnd()
    serial = open_line(end.path, 9600)
    assert isinstance(serial, SerialLine)
    assert serial.baud == 9600
    serial.close()
    end.unplug()
