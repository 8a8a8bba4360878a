"""A network of memory: the same words as for the real one, without loss and in order."""

import math

import pytest

from robosc_bridge.errors import LineBusyError, LineLostError, LineMissingError
from robosc_simulated import VirtualHost


def test_datagrams_come_whole_and_in_order_to_who_listens() -> None:
    with VirtualHost(0.0) as host:
        listens = host.open_network("udpin:127.0.0.1:14550")
        assert (listens.port, listens.is_datagram) == (14550, True)
        with pytest.raises(LineBusyError):
            host.open_network("udpin:127.0.0.1:14550")
        # A listener has no one to write to until it was called.
        listens.write(b"lost")
        one, other = (host.open_network("udpout:127.0.0.1:14550") for _ in range(2))
        one.write(b"first")
        one.write(b"second")
        other.write(b"stranger")
        assert listens.read(1.0) == b"first"
        assert not listens.is_stranger
        listens.answer_sender()
        assert listens.read(1.0) == b"second"
        assert listens.read(1.0) == b"stranger"
        assert listens.is_stranger
        listens.reply(b"not now")
        listens.write(b"answer")
        assert (one.read(1.0), other.read(1.0)) == (b"answer", b"not now")
        assert host.monotonic() == 0.0
        assert one.read(0.5) == b""
        assert host.monotonic() == 0.5
        listens.close()
        listens.close()
        one.write(b"lost")
        with pytest.raises(LineLostError):
            listens.read(1.0)
        with pytest.raises(LineLostError):
            listens.write(b"x")
        assert host.open_network("udpin:127.0.0.1:0").port != 14550


def test_a_connection_carries_bytes_both_ways_until_one_end_is_closed() -> None:
    with VirtualHost(0.0) as host:
        with pytest.raises(LineMissingError, match="no program listens there"):
            host.open_network("tcp:127.0.0.1:5760")
        server = host.serve(5760)
        with pytest.raises(LineBusyError):
            host.serve(5760)
        assert server.accept(0.5) is None
        calls = host.open_network("tcp:127.0.0.1:5760")
        takes = server.accept(0.5)
        assert takes is not None
        assert not takes.is_datagram and not takes.is_stranger
        calls.write(b"as")
        calls.write(b"k")
        assert takes.read(1.0) == b"ask"
        takes.write(b"answer")
        takes.close()
        # All bytes sent before are read before the end is reported.
        assert calls.read(1.0) == b"answer"
        for use in (lambda: calls.read(1.0), lambda: calls.write(b"x")):
            with pytest.raises(LineLostError):
                use()
        assert host.monotonic() == 0.5
        server.close()
        with pytest.raises(LineMissingError):
            host.open_network("tcp:127.0.0.1:5760")


@pytest.mark.parametrize("address", ["udpin:127.0.0.1:0", "tcp:127.0.0.1:5760"])
def test_who_waits_is_woken(address: str) -> None:
    with VirtualHost(0.0) as host:
        host.serve(5760)
        line = host.open_network(address)

        def wake() -> None:
            host.sleep(0.25)
            line.wake()

        host.thread(wake, "wakes").start()
        assert line.read(math.inf) == b""
        assert host.monotonic() == 0.25
