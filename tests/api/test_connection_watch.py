"""Tests of the watch over connections: its decisions on numbers, and a real server that is flooded."""

import asyncio
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import grpc
import pytest

from robosc_api.connection_watch import Arrivals, ConnectionLimits, ConnectionWatch, Ledger, can_watch, peer_of
from robosc_api.layers import Layers
from robosc_api.request_timeouts import RequestTimeouts
from support.small_server import call, small_server
from support.waiting import PATIENCE_S

LIMITS = ConnectionLimits(
    connections=8,
    request_bytes=1000,
    unasked_bytes=3000,
    slack_bytes=100,
    slack_bytes_a_s=10.0,
    first_request_s=30.0,
    suspicion_s=60.0,
)
A, B, C = ("10.0.0.1", 1), ("10.0.0.2", 1), ("10.0.0.2", 2)

needs_counts = pytest.mark.skipif(not can_watch(), reason="the kernel of this system does not count bytes")


@pytest.mark.parametrize(("open_calls", "most"), [({}, 1100), ({A: 1}, 2100)], ids=["no call", "an open call"])
def test_a_connection_may_receive_one_request_more_than_its_calls_and_the_slack(
    open_calls: dict[tuple[str, int], int], most: int
) -> None:
    ledger = Ledger(LIMITS)
    assert ledger.look({A: most}, (), open_calls, 0.0) == {}
    assert list(ledger.look({A: most + 1}, (), open_calls, 0.0)) == [A]


def test_a_request_explains_what_came_before() -> None:
    ledger = Ledger(LIMITS)
    assert ledger.look({A: 900}, (), {}, 0.0) == {}
    assert ledger.look({A: 90_000}, [A], {}, 1.0) == {}
    assert ledger.look({A: 91_100}, (), {}, 1.0) == {}
    assert list(ledger.look({A: 91_101}, (), {}, 1.0)) == [A]


def test_pings_of_a_long_watch_are_forgotten() -> None:
    ledger = Ledger(LIMITS)
    for second in range(1000):
        assert ledger.look({A: second * 10}, (), {A: 1}, float(second)) == {}


def test_after_a_flood_other_new_connections_of_its_host_get_the_slack_alone() -> None:
    ledger = Ledger(LIMITS)
    assert list(ledger.look({B: 5000}, (), {}, 0.0)) == [B]
    assert ledger.is_alert
    assert list(ledger.look({A: 1000, C: 101}, (), {}, 1.0)) == [C]
    # One with a request is judged as before, and so is the host after a while.
    assert ledger.look({A: 1000, C: 50}, [C], {}, 2.0) == {}
    assert ledger.look({A: 1000, C: 1050}, (), {}, 2.0) == {}
    # The second flood has renewed the suspicion.
    assert ledger.look({}, (), {}, 61.5) == {}
    assert not ledger.is_alert
    assert ledger.look({B: 1000}, (), {}, 62.0) == {}


def test_connections_together_are_bounded_and_the_worst_goes_first() -> None:
    ledger = Ledger(LIMITS)
    received = {("10.0.0.3", port): 1000 for port in range(3)} | {A: 1050}
    assert next(iter(ledger.look(received, (), {}, 0.0))) == A
    assert len(ledger.look({("10.0.0.4", port): 100 for port in range(6)}, (), {}, 0.0)) == 0


def test_a_connection_without_a_request_is_closed_in_time_unless_a_call_is_open() -> None:
    ledger = Ledger(LIMITS)
    assert ledger.look({A: 50, B: 50, C: 50}, [B], {C: 1}, 0.0) == {}
    assert ledger.look({A: 50, B: 50, C: 50}, (), {C: 1}, 29.9) == {}
    assert ledger.look({A: 50, B: 50, C: 50}, (), {C: 1}, 30.0) == {A: "no request arrives on it"}


def test_too_many_connections_cost_the_host_with_the_most_those_that_are_not_used() -> None:
    ledger = Ledger(LIMITS)
    many = [("10.0.0.9", port) for port in range(7)]
    received = dict.fromkeys([A, *many], 10)
    # Six may stay: the first of the many has an open call, the second had a request.
    ledger.look({A: 10, many[0]: 10, many[1]: 10}, [many[1]], {many[0]: 1}, 0.0)
    closed = ledger.look(received, (), {many[0]: 1}, 1.0)
    assert len(closed) == 2
    assert set(closed) <= set(many[2:])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("ipv4:127.0.0.1:4711", ("127.0.0.1", 4711)),
        ("ipv6:%5B::1%5D:4711", ("::1", 4711)),
        ("ipv6:[::ffff:10.1.2.3]:80", ("10.1.2.3", 80)),
        ("unix:/run/robosc.socket", None),
        ("", None),
    ],
)
def test_the_other_end_in_the_words_of_grpc(text: str, expected: Any) -> None:
    assert peer_of(text) == expected


PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes([0, 0, 0, 4, 0, 0, 0, 0, 0])
CONTINUATION = bytes([0, 0x40, 0, 9, 0, 0, 0, 0, 1]) + b"v" * 0x4000
# Header `x` with a value of 2 GB, of a stream whose header block does not end.
HEADERS = bytes([0, 0, 9, 1, 0, 0, 0, 0, 1]) + b"\x00\x01x\x7f\x80\xff\xff\xff\x07"
MOST_BYTES = 256 * 2**20


async def answer(request: bytes, context: Any) -> bytes:
    return request


@asynccontextmanager
async def watched_server(arrivals: Arrivals) -> AsyncIterator[tuple[grpc.aio.Channel, int]]:
    """A server with the layer, a channel to it, and its port."""
    ports: list[int] = []

    def listen(server: grpc.aio.Server) -> None:
        ports.append(server.add_insecure_port("127.0.0.1:0"))

    layers = Layers(RequestTimeouts(PATIENCE_S), arrivals)
    async with (
        small_server(interceptors=[layers], unary=answer, setup=listen),
        grpc.aio.insecure_channel(f"127.0.0.1:{ports[0]}") as channel,
    ):
        yield channel, ports[0]


@needs_counts
async def test_an_endless_header_block_is_cut_off_and_other_callers_are_answered() -> None:
    arrivals = Arrivals()
    async with watched_server(arrivals) as (channel, port):
        assert (await call(channel, b"before")).answer == b"before"
        watch = ConnectionWatch(port, ConnectionLimits(request_bytes=2**20), arrivals)
        sent = await asyncio.to_thread(_flood, port, watch)
        assert sent < MOST_BYTES
        # Until gRPC has noticed, it may be counted again.
        assert sum(watch.closed.values()) >= 1
        assert (await call(channel, b"after")).answer == b"after"


def _flood(port: int, watch: ConnectionWatch) -> int:
    """Send an endless header block until it is cut off; return the bytes that were sent."""
    sent = 0
    with socket.create_connection(("127.0.0.1", port)) as line:
        line.sendall(PREFACE + HEADERS)
        try:
            while sent < MOST_BYTES:
                line.sendall(CONTINUATION * 16)
                sent += 16 * len(CONTINUATION)
                watch.look()
        except OSError:
            pass
    return sent


@needs_counts
async def test_open_calls_keep_their_connection() -> None:
    arrivals = Arrivals()
    async with watched_server(arrivals) as (channel, port):
        await call(channel)
        (peer,) = arrivals.take()[0]
        watch = ConnectionWatch(port, ConnectionLimits(connections=1), arrivals)
        arrivals.begun(peer)
        watch.look()
        assert not watch.closed
        arrivals.ended(peer)
        assert arrivals.take() == (frozenset(), {})
        await asyncio.to_thread(watch.look)
        assert watch.closed
        # A call that is sent before its channel has seen the end fails; later ones get a new connection.
        await asyncio.wait_for(channel.wait_for_state_change(grpc.ChannelConnectivity.READY), PATIENCE_S)
        assert (await call(channel, b"again")).answer == b"again"
