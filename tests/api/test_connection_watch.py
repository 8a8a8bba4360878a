"""Tests of the watch over connections: its decisions on numbers, and a real server that is flooded."""

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager
from threading import Semaphore
from typing import Any

import grpc
import pytest

from robosc_api.connection_ledger import CallsSince, CloseReason, ConnectionLimits, Ledger, Peer, Traffic
from robosc_api.connection_watch import Arrivals, CallsByConnection, ConnectionWatch, LookPace, address_of, can_watch
from robosc_api.layers import Layer, behaviour_of, with_behaviour
from robosc_api.request_timeouts import RequestTimeouts
from support.floods import MOST_BYTES, endless_headers, resets
from support.late_connections import is_late
from support.small_server import SERVICE, call, small_server
from support.waiting import PATIENCE_S, until

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


def look(
    ledger: Ledger,
    received: dict[Peer, int],
    asked: Sequence[Peer],
    open_calls: dict[Peer, int],
    now_s: float,
    ended: dict[Peer, int] | None = None,
    acknowledged: dict[Peer, int] | None = None,
) -> Mapping[Peer, str]:
    """The connections that a ledger closes, without answers if nothing else is said."""
    traffic = {peer: Traffic(count, (acknowledged or {}).get(peer, 0)) for peer, count in received.items()}
    return ledger.look(traffic, CallsSince(frozenset(asked), ended or {}, open_calls), now_s)


def test_a_connection_may_receive_one_request_and_the_slack() -> None:
    ledger = Ledger(LIMITS)
    assert look(ledger, {A: 1100}, (), {}, 0.0) == {}
    assert list(look(ledger, {A: 1101}, (), {}, 0.0)) == [A]


def test_a_request_explains_what_came_before() -> None:
    ledger = Ledger(LIMITS)
    assert look(ledger, {A: 900}, (), {}, 0.0) == {}
    assert look(ledger, {A: 90_000}, [A], {}, 1.0) == {}
    assert look(ledger, {A: 91_100}, (), {}, 1.0) == {}
    assert list(look(ledger, {A: 91_101}, (), {}, 1.0)) == [A]


def test_each_open_call_may_have_a_request_on_its_way() -> None:
    ledger = Ledger(LIMITS)
    assert look(ledger, {A: 2100}, (), {A: 1}, 0.0) == {}
    assert list(look(ledger, {A: 2101}, (), {A: 1}, 0.0)) == [A]


def test_pings_of_a_long_watch_are_forgotten() -> None:
    ledger = Ledger(LIMITS)
    for second in range(1000):
        assert look(ledger, {A: second * 10}, (), {A: 1}, float(second)) == {}


def test_after_a_flood_other_new_connections_of_its_host_get_the_slack_alone() -> None:
    ledger = Ledger(LIMITS)
    assert list(look(ledger, {B: 5000}, (), {}, 0.0)) == [B]
    assert ledger.is_alert
    assert list(look(ledger, {A: 1000, C: 101}, (), {}, 1.0)) == [C]
    # One with a request is judged as before, and so is the host after a while.
    assert look(ledger, {A: 1000, C: 50}, [C], {}, 2.0) == {}
    assert look(ledger, {A: 1000, C: 1050}, (), {}, 2.0) == {}
    # The second flood has renewed the suspicion.
    assert look(ledger, {}, (), {}, 61.5) == {}
    assert not ledger.is_alert
    assert look(ledger, {B: 1000}, (), {}, 62.0) == {}


def test_connections_together_are_bounded_and_the_worst_goes_first() -> None:
    ledger = Ledger(LIMITS)
    received = {("10.0.0.3", port): 1000 for port in range(3)} | {A: 1050}
    assert next(iter(look(ledger, received, (), {}, 0.0))) == A
    assert len(look(ledger, {("10.0.0.4", port): 100 for port in range(6)}, (), {}, 0.0)) == 0


def test_a_connection_without_a_request_is_closed_in_time_unless_a_call_is_open() -> None:
    ledger = Ledger(LIMITS)
    assert look(ledger, {A: 50, B: 50, C: 50}, [B], {C: 1}, 0.0) == {}
    assert look(ledger, {A: 50, B: 50, C: 50}, (), {C: 1}, 29.9) == {}
    assert look(ledger, {A: 50, B: 50, C: 50}, (), {C: 1}, 30.0) == {A: "no request arrives on it"}


def test_too_many_connections_cost_the_host_with_the_most_those_that_are_not_used() -> None:
    ledger = Ledger(LIMITS)
    many = [("10.0.0.9", port) for port in range(7)]
    received = dict.fromkeys([A, *many], 10)
    # Six may stay: the first of the many has an open call, the second had a request.
    look(ledger, {A: 10, many[0]: 10, many[1]: 10}, [many[1]], {many[0]: 1}, 0.0)
    closed = look(ledger, received, (), {many[0]: 1}, 1.0)
    assert len(closed) == 2
    assert set(closed) <= set(many[2:])


def test_a_host_is_barred_for_a_while_after_some_floods_and_no_other_host_is() -> None:
    ledger = Ledger(LIMITS)
    for port in (1, 2):
        assert look(ledger, {("10.0.0.2", port): 5000, A: 50}, (), {}, 0.0)
        assert ledger.barred == frozenset()
    assert look(ledger, {("10.0.0.2", 3): 5000, A: 50}, (), {}, 0.0)
    assert ledger.barred == {"10.0.0.2"}
    look(ledger, {A: 50}, (), {}, 4.9)
    assert ledger.barred == {"10.0.0.2"}
    look(ledger, {A: 50}, (), {}, 5.0)
    assert ledger.barred == frozenset()


def test_floods_that_are_long_ago_bar_no_host() -> None:
    ledger = Ledger(LIMITS)
    for number in range(10):
        assert look(ledger, {("10.0.0.2", number): 5000}, (), {}, number * 5.0)
        assert ledger.barred == frozenset()


def test_a_flood_that_is_closed_and_has_not_gone_yet_is_one() -> None:
    ledger = Ledger(LIMITS)
    for number in range(10):
        assert look(ledger, {B: 5000 + number}, (), {}, 0.0)
        assert ledger.barred == frozenset()


def test_connections_that_are_closed_for_other_reasons_bar_no_host() -> None:
    ledger = Ledger(LIMITS)
    many = {("10.0.0.9", port): 10 for port in range(6)}
    look(ledger, many, (), {}, 0.0)
    assert len(look(ledger, many, (), {}, 30.0)) == 6
    assert ledger.barred == frozenset()


def test_new_connections_by_the_hundred_that_ask_nothing_bar_their_host() -> None:
    def barred(count: int, *, asking: bool = False) -> frozenset[str]:
        ledger = Ledger(ConnectionLimits(newcomers=100, newcomers_a_s=10.0))
        new = dict.fromkeys([("10.0.0.9", port) for port in range(count)], 50)
        look(ledger, new, list(new) if asking else (), {}, 0.0)
        return ledger.barred

    assert barred(100) == frozenset()
    assert barred(101) == {"10.0.0.9"}
    assert barred(1000, asking=True) == frozenset()


def test_idle_connections_are_new_once() -> None:
    ledger = Ledger(ConnectionLimits(newcomers=100, newcomers_a_s=0.0))
    for number in range(10):
        look(ledger, {("10.0.0.9", port): 50 for port in range(60)}, (), {}, number * 0.1)
        assert ledger.barred == frozenset()


def test_clients_that_connect_for_each_call_bar_no_host() -> None:
    ledger = Ledger(ConnectionLimits(newcomers=100, newcomers_a_s=10.0))
    for number in range(1000):
        # One each tenth of a second, whose request comes a look later.
        peer = ("10.0.0.9", number)
        look(ledger, {peer: 50}, (), {peer: 1}, number * 0.1)
        look(ledger, {peer: 900}, [peer], {peer: 1}, number * 0.1 + 0.05)
        assert ledger.barred == frozenset()


def test_a_busy_client_is_neither_closed_nor_barred() -> None:
    ledger = Ledger(ConnectionLimits())
    for number in range(1, 1000):
        # Each tenth of a second: 500 calls, a hundred of which end without a request, and some are answered.
        received, acknowledged = {A: number * 100_000}, {A: number * 400 * ANSWER}
        assert look(ledger, received, [A], {A: 50}, number * 0.1, {A: 500}, acknowledged) == {}
    assert ledger.barred == frozenset()


KIB, MIB = 2**10, 2**20
REFUSED = 64 * KIB
"""Bytes that arrive of a request that is refused for its size, as measured."""

ANSWER = 85
"""Bytes of the refusal, as measured."""


def test_requests_that_are_refused_with_an_answer_are_no_flood() -> None:
    ledger = Ledger(ConnectionLimits(request_bytes=100 * KIB, slack_bytes=KIB))
    for count in range(1, 1000):
        received = {A: count * REFUSED}
        # The answer arrives a look after the request, as on a slow line.
        assert look(ledger, received, (), {}, 0.0, {A: 1}, {A: (count - 1) * ANSWER}) == {}
        assert look(ledger, received, (), {}, 0.0, {}, {A: count * ANSWER}) == {}


def test_calls_that_are_reset_and_not_answered_stay_a_flood() -> None:
    ledger = Ledger(LIMITS)
    assert look(ledger, {A: 500}, (), {}, 0.0, {A: 3}) == {}
    assert list(look(ledger, {A: 1101}, (), {}, 0.0, {A: 7})) == [A]


def test_calls_that_are_reset_by_the_thousand_are_a_flood_however_few_bytes_they_take() -> None:
    ledger = Ledger(ConnectionLimits(resets=1000))
    assert look(ledger, {A: 500, B: 500}, (), {A: 900}, 0.0, {A: 600, B: 600}) == {}
    # A request shows that the connection is used; answers, that the server has ended the calls.
    assert look(ledger, {A: 900, B: 900}, [B], {A: 900}, 1.0, {A: 400, B: 600}) == {}
    assert look(ledger, {A: 900, B: 900, C: 900}, (), {}, 1.0, {B: 1000, C: 5000}, {C: 5000 * ANSWER}) == {}
    closed = look(ledger, {A: 901, B: 901, C: 901}, (), {A: 900}, 1.0, {A: 1}, {C: 5000 * ANSWER})
    assert closed == {A: "its calls are reset before their requests"}


def test_some_answers_explain_as_much_as_their_calls_can_bring() -> None:
    ledger = Ledger(LIMITS)
    # Ten have ended, two of them with an answer.
    assert look(ledger, {A: 2 * 96 * KIB + 1100}, (), {}, 0.0, {A: 10}, {A: 2 * 50}) == {}
    assert list(look(ledger, {A: 2 * 96 * KIB + 1101}, (), {}, 0.0, {}, {A: 2 * 50})) == [A]


def test_what_is_sent_explains_nothing_without_calls() -> None:
    ledger = Ledger(LIMITS)
    # Pings, for example, are answered as well.
    assert list(look(ledger, {A: 1101}, (), {}, 0.0, {}, {A: 1101})) == [A]


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
    assert address_of(text) == expected


LARGEST_BYTES = 128 * KIB


async def answer(request: bytes, context: Any) -> bytes:
    return request


class Outermost(Layer):
    """Layer whose handlers are coroutines, which gRPC recognizes."""

    def wrap(self, inner: Any, method: str) -> Any:
        behaviour = behaviour_of(inner)

        async def awaited(request: Any, context: Any) -> Any:
            return await behaviour(request, context)

        return with_behaviour(inner, awaited)


@asynccontextmanager
async def watched_server(arrivals: Arrivals, *outer: Layer) -> AsyncIterator[tuple[grpc.aio.Channel, int]]:
    """A server with the layer, a channel to it, and its port; other layers are outside of the wait for requests."""
    ports: list[int] = []

    def listen(server: grpc.aio.Server) -> None:
        ports.append(server.add_insecure_port("127.0.0.1:0"))

    layers = (*outer, RequestTimeouts(PATIENCE_S), arrivals)
    options = [("grpc.max_receive_message_length", LARGEST_BYTES), ("grpc.http2.bdp_probe", 0)]
    async with (
        small_server(layers=layers, unary=answer, listen=listen, options=options),
        grpc.aio.insecure_channel(f"127.0.0.1:{ports[0]}") as channel,
    ):
        yield channel, ports[0]


@needs_counts
def test_an_endless_header_block_is_cut_off_and_other_callers_are_answered() -> None:
    async def flooded() -> None:
        arrivals = Arrivals()
        async with watched_server(arrivals) as (channel, port):
            assert (await call(channel, b"before")).answer == b"before"
            watch = ConnectionWatch(port, ConnectionLimits(request_bytes=2**20), arrivals)
            sent = await asyncio.to_thread(endless_headers, port, watch.look)
            assert sent < MOST_BYTES
            # Until gRPC has noticed, it may be counted again.
            assert watch.closed.total() >= 1
            assert (await call(channel, b"after")).answer == b"after"

    asyncio.run(flooded())


@needs_counts
def test_requests_that_are_too_large_are_refused_each_and_their_connection_stays() -> None:
    async def refused() -> None:
        arrivals = Arrivals()
        async with watched_server(arrivals, Outermost(), CallsByConnection(arrivals)) as (channel, port):
            limits = ConnectionLimits(request_bytes=LARGEST_BYTES, slack_bytes=KIB)
            watch = ConnectionWatch(port, limits, arrivals)
            for _ in range(8):
                ended = await call(channel, bytes(4 * LARGEST_BYTES))
                assert ended.code is grpc.StatusCode.RESOURCE_EXHAUSTED
                await asyncio.to_thread(watch.look)
            assert not watch.closed.total()

    asyncio.run(refused())


async def test_a_call_is_open_for_its_connection_until_it_has_ended() -> None:
    arrivals = Arrivals()
    is_open, may_end = asyncio.Event(), asyncio.Event()

    async def waiting(request: bytes, context: Any) -> bytes:
        is_open.set()
        await may_end.wait()
        return request

    async with small_server(layers=(Outermost(), CallsByConnection(arrivals)), unary=waiting) as (channel, _):
        made = asyncio.create_task(call(channel))
        await is_open.wait()
        (count,) = arrivals.take().open.values()
        assert count == 1
        may_end.set()
        await made
        ended: Counter[str] = Counter()

        def is_over() -> bool:
            now = arrivals.take()
            ended.update(now.ended)
            return not now.open

        await until(is_over)
        assert ended.total() == 1


@needs_counts
def test_calls_that_are_reset_at_once_are_cut_off() -> None:
    async def flooded() -> None:
        arrivals = Arrivals()
        async with watched_server(arrivals, Outermost(), CallsByConnection(arrivals)) as (_, port):
            watch = ConnectionWatch(port, ConnectionLimits(resets=500), arrivals)
            with watch:
                assert await asyncio.to_thread(resets, port, f"/{SERVICE}/Unary", lambda: None) < MOST_BYTES
            assert watch.closed.total() >= 1

    asyncio.run(flooded())


@needs_counts
def test_a_host_that_floods_again_and_again_connects_late_and_present_connections_go_on(
    caplog: pytest.LogCaptureFixture,
) -> None:
    now_s = [0.0]

    async def flooded() -> None:
        arrivals = Arrivals()
        async with watched_server(arrivals) as (channel, port):
            assert (await call(channel, b"before")).answer == b"before"
            limits = ConnectionLimits(request_bytes=2**20)
            watch = ConnectionWatch(port, limits, arrivals, bars=lambda host: True, clock=lambda: now_s[0])
            for _ in range(3):
                assert not is_late(port, "127.0.0.1")
                assert (watch.barred, watch.times_barred) == (0, 0)
                await asyncio.to_thread(endless_headers, port, watch.look)
            assert is_late(port, "127.0.0.1")
            assert (watch.barred, watch.times_barred) == (1, 1)
            assert not is_late(port, "127.0.0.2")
            assert (await call(channel, b"after")).answer == b"after"
            now_s[0] = 6.0
            await asyncio.to_thread(watch.look)
            assert not is_late(port, "127.0.0.1")
            assert (watch.barred, watch.times_barred) == (0, 1)

    asyncio.run(flooded())
    assert [record.getMessage() for record in caplog.records if "late" in record.getMessage()] == [
        "after floods, new connections are late from 127.0.0.1"
    ]


@needs_counts
def test_each_request_of_a_stream_counts_and_not_its_beginning() -> None:
    async def counted() -> None:
        arrivals, words = Arrivals(), asyncio.Queue[str]()

        async def stream(requests: AsyncIterator[bytes], context: Any) -> AsyncIterator[bytes]:
            async for request in requests:
                yield request

        handler: Any = grpc.stream_stream_rpc_method_handler(stream)
        noted = arrivals.wrap(handler, "/test.Service/Stream").stream_stream

        class Context:
            """Context of a call of one connection."""

            def peer(self) -> str:
                return "ipv4:10.0.0.1:1"

        async def requests() -> AsyncIterator[bytes]:
            while request := await words.get():
                yield request.encode()

        responses = noted(requests(), Context())
        assert arrivals.take().asked == frozenset()
        for word in ("one", "two"):
            words.put_nowait(word)
            assert await anext(responses) == word.encode()
            assert arrivals.take().asked == {"ipv4:10.0.0.1:1"}
            assert arrivals.take().asked == frozenset()

    asyncio.run(counted())


@needs_counts
def test_open_calls_keep_their_connection() -> None:
    async def watched() -> None:
        arrivals = Arrivals()
        async with watched_server(arrivals) as (channel, port):
            await call(channel)
            (peer,) = arrivals.take().asked
            watch = ConnectionWatch(port, ConnectionLimits(connections=1), arrivals)
            arrivals.begun(peer)
            watch.look()
            assert not watch.closed.total()
            arrivals.ended(peer)
            assert arrivals.take() == CallsSince(ended={peer: 1})
            await asyncio.to_thread(watch.look)
            assert watch.closed[CloseReason.UNUSED] == 1
            # A call that is sent before its channel has seen the end fails; later ones get a new connection.
            await asyncio.wait_for(channel.wait_for_state_change(grpc.ChannelConnectivity.READY), PATIENCE_S)
            assert (await call(channel, b"again")).answer == b"again"

    asyncio.run(watched())


def test_looks_are_seldom_while_the_process_is_calm() -> None:
    pace = LookPace(0.02)
    assert pace.is_due(100.0, 50 * MIB, 3.0, is_alert=False)
    pace.looked(0.001, 3.001)
    assert not pace.is_due(101.9, 50 * MIB, 3.01, is_alert=False)
    assert pace.is_due(102.1, 50 * MIB, 3.01, is_alert=False)
    pace.looked(0.001, 3.011)
    # The next one comes soon when the process has worked, but not at once.
    assert not pace.is_due(102.15, 50 * MIB, 3.05, is_alert=False)
    assert pace.is_due(102.25, 50 * MIB, 3.05, is_alert=False)


def test_looks_are_made_at_once_when_memory_grows_or_a_host_is_suspect() -> None:
    pace = LookPace(0.02)
    assert pace.is_due(100.0, 50 * MIB, 3.0, is_alert=False)
    pace.looked(0.001, 3.001)
    assert not pace.is_due(100.06, 65 * MIB, 3.001, is_alert=False)
    assert pace.is_due(100.06, 66 * MIB, 3.001, is_alert=False)
    pace.looked(0.001, 3.002)
    assert not pace.is_due(100.12, 67 * MIB, 3.002, is_alert=False)
    assert pace.is_due(100.12, 67 * MIB, 3.002, is_alert=True)


def test_looks_take_a_share_of_a_core_however_much_there_is_to_look_at() -> None:
    pace = LookPace(0.02)
    for is_alert in (False, True):
        assert pace.is_due(100.0, 50 * MIB, 3.0, is_alert=is_alert)
        pace.looked(0.1, 3.1)
        assert not pace.is_due(104.9, 50 * MIB, 5.0, is_alert=is_alert)
        assert pace.is_due(105.1, 50 * MIB, 5.0, is_alert=is_alert)
        pace = LookPace(0.02)


@needs_counts
def test_failures_of_the_watch_are_logged_now_and_then(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    now_s = [0.0]
    looks = Semaphore(0)

    def failing(watch: ConnectionWatch) -> None:
        # The next look is due, and after the fourth one the next line.
        now_s.append(now_s[-1] + (10.0 if len(now_s) == 5 else 2.1))
        looks.release()
        raise RuntimeError("broken")

    monkeypatch.setattr(ConnectionWatch, "look", failing)
    # Time goes on by looks alone, so the processor time that they take must not put off the next one.
    ended: list[float] = []
    monkeypatch.setattr(LookPace, "looked", lambda pace, took_s, processor_s: ended.append(took_s))
    with ConnectionWatch(1, LIMITS, Arrivals(), clock=lambda: now_s[-1]):
        for _ in range(6):
            assert looks.acquire(timeout=PATIENCE_S)
    # The pace is told of each of them, though it failed.
    assert len(ended) == len(now_s) - 1
    lines = [record.getMessage() for record in caplog.records]
    assert lines == [f"watching the connections failed ({count} times since the last such line)" for count in (1, 4)]
