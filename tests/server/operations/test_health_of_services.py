"""Health that follows what services need, over a real server; and how a server ends."""

import asyncio
import struct
from typing import Any

import grpc
import pytest
from grpc_health.v1 import health_pb2, health_pb2_grpc

from robosc_server.operations import drain as draining
from robosc_server.operations.drain import drain
from robosc_server.operations.health import Health
from robosc_server.operations.interceptor import CallInterceptor
from robosc_server.operations.metrics import Metrics
from robosc_server.result_sender import ResultSender
from robosc_server.tasks.task import Reason, RefusedError
from support.held_time import HeldLoop, on_held_time
from support.small_server import SERVICE, call, logged, small_server
from support.waiting import PATIENCE_S, limited, until

SERVING, NOT_SERVING = health_pb2.HealthCheckResponse.SERVING, health_pb2.HealthCheckResponse.NOT_SERVING
SERVICES = {"robosc.Works": ("workers",), "robosc.Keeps": ("store", "workers")}


def with_health(health: Health) -> Any:
    return lambda services: health_pb2_grpc.add_HealthServicer_to_server(health, services)


async def status(channel: Any, service: str = "") -> Any:
    request = health_pb2.HealthCheckRequest(service=service)
    return (await health_pb2_grpc.HealthStub(channel).Check(request, timeout=PATIENCE_S)).status


async def test_each_service_follows_what_it_needs() -> None:
    health = Health(SERVICES)
    async with small_server(setup=with_health(health)) as (channel, _):

        async def all_of_them() -> list[Any]:
            return [await status(channel, name) for name in ("robosc.Works", "robosc.Keeps", "")]

        assert await all_of_them() == [NOT_SERVING] * 3
        health.set_condition("workers", True)
        assert await all_of_them() == [SERVING, NOT_SERVING, NOT_SERVING]
        health.set_condition("store", True)
        assert await all_of_them() == [SERVING] * 3
        health.drain()
        assert await all_of_them() == [NOT_SERVING] * 3
        with pytest.raises(grpc.aio.AioRpcError) as caught:
            await status(channel, "nobody")
        assert caught.value.code() is grpc.StatusCode.NOT_FOUND


async def test_a_watcher_receives_each_change_once() -> None:
    health = Health(SERVICES)
    async with small_server(setup=with_health(health)) as (channel, _):
        watch = health_pb2_grpc.HealthStub(channel).Watch(health_pb2.HealthCheckRequest(service="robosc.Keeps"))
        assert (await watch.read()).status == NOT_SERVING
        health.set_condition("workers", True)
        health.set_condition("store", True)
        assert (await watch.read()).status == SERVING
        health.set_condition("store", False)
        assert (await watch.read()).status == NOT_SERVING
        other = health_pb2_grpc.HealthStub(channel).Watch(health_pb2.HealthCheckRequest(service="nobody"))
        assert (await other.read()).status == health_pb2.HealthCheckResponse.SERVICE_UNKNOWN
        for stream in (watch, other):
            stream.cancel()


def frame(kind: int, flags: int, stream: int, content: bytes) -> bytes:
    """A frame of HTTP/2 (RFC 9113, 4.1)."""
    return struct.pack(">I", len(content))[1:] + struct.pack(">BBI", kind, flags, stream) + content


def watch_without_taking(service: str) -> bytes:
    """The bytes of a caller that watches a service and lets nothing be sent to it: its window is 0."""
    headers = {
        ":method": "POST",
        ":scheme": "http",
        ":path": "/grpc.health.v1.Health/Watch",
        ":authority": "x",
        "content-type": "application/grpc",
        "te": "trailers",
    }
    # Literal fields without indexing (RFC 7541, 6.2.2).
    block = b"".join(
        b"\x00" + b"".join(struct.pack(">B", len(text)) + text.encode() for text in field) for field in headers.items()
    )
    request = health_pb2.HealthCheckRequest(service=service).SerializeToString()
    return b"".join(
        (
            b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
            frame(4, 0, 0, struct.pack(">HI", 4, 0)),
            frame(4, 1, 0, b""),
            frame(1, 4, 1, block),
            frame(0, 1, 1, struct.pack(">BI", 0, len(request)) + request),
        )
    )


async def test_a_watcher_that_takes_nothing_keeps_nobody_from_the_truth() -> None:
    health, ports, watching = Health(SERVICES), list[int](), asyncio.Event()
    watch = health.Watch

    async def noted(request: Any, context: Any) -> None:
        watching.set()
        await watch(request, context)

    health.Watch = noted  # type: ignore[method-assign]

    def listen(server: grpc.aio.Server) -> None:
        with_health(health)(server)
        ports.append(server.add_insecure_port("127.0.0.1:0"))

    async with small_server(listen=listen) as (channel, server):
        _, writer = await asyncio.open_connection("127.0.0.1", ports[0])
        writer.write(watch_without_taking("robosc.Works"))
        await watching.wait()
        watcher = health_pb2_grpc.HealthStub(channel).Watch(health_pb2.HealthCheckRequest(service="robosc.Works"))
        assert (await watcher.read()).status == NOT_SERVING
        health.set_condition("workers", True)
        assert (await watcher.read()).status == SERVING
        assert await status(channel, "robosc.Works") == SERVING
        await drain(server, health, CallInterceptor(Metrics("1")), 0.0)
        assert not health.is_serving("robosc.Works")
        watcher.cancel()
        writer.close()


async def test_many_who_watch_keep_nobody_from_watching() -> None:
    health = Health(SERVICES)
    async with small_server(setup=with_health(health)) as (channel, _):
        stub = health_pb2_grpc.HealthStub(channel)
        watches = [stub.Watch(health_pb2.HealthCheckRequest(service="robosc.Works")) for _ in range(300)]
        assert [(await watch.read()).status for watch in watches] == [NOT_SERVING] * len(watches)
        health.set_condition("workers", True)
        assert [(await watch.read()).status for watch in watches] == [SERVING] * len(watches)
        assert await status(channel, "robosc.Works") == SERVING
        for watch in watches:
            watch.cancel()


async def test_conditions_are_asked_for_again_and_again_and_who_raises_says_no() -> None:
    is_there: dict[str, bool | Exception] = {"store": True, "workers": True}
    with logged() as log:
        health = Health(SERVICES)

        def probe(name: str) -> Any:
            async def ask() -> bool:
                answer = is_there[name]
                if isinstance(answer, Exception):
                    raise answer
                return answer

            return ask

        async with health.probing({name: probe(name) for name in is_there}, every_s=0.001):
            assert health.is_serving("")
            is_there["store"] = ConnectionError("away")
            await until(lambda: not health.is_serving("robosc.Keeps"))
            assert health.is_serving("robosc.Works")
            assert health.conditions() == {"store": False, "workers": True, "accepting": True}
            is_there["store"] = True
            await until(lambda: health.is_serving("robosc.Keeps") is True)
    assert [line["condition"] for line in log.lines("condition not met")] == ["store"]


async def is_draining(channel: Any) -> bool:
    return bool(await status(channel) != SERVING)


async def test_draining_says_no_first_then_refuses_and_lets_calls_end() -> None:
    health, release, seen = Health({}), asyncio.Event(), asyncio.Event()

    async def slow(request: bytes, context: Any) -> bytes:
        seen.set()
        await release.wait()
        return b"done"

    calls = CallInterceptor(Metrics("1"))
    async with small_server(layers=[calls], unary=slow, setup=with_health(health)) as (channel, server):
        under_way = asyncio.create_task(call(channel))
        await seen.wait()
        ending = asyncio.create_task(drain(server, health, calls, PATIENCE_S))
        await until(lambda: is_draining(channel))
        refused = await call(channel)
        assert (refused.code, refused.reason) == (grpc.StatusCode.UNAVAILABLE, "SHUTTING_DOWN")
        assert not ending.done()
        release.set()
        assert (await under_way).answer == b"done"
        await ending


async def passes(loop: HeldLoop, ending: asyncio.Task[None]) -> None:
    """Have time pass until a server has ended."""

    async def is_over() -> bool:
        await loop.passed(2.0)
        return ending.done()

    await until(is_over)
    await ending


async def test_a_large_answer_that_was_sent_is_waited_for(loop: HeldLoop) -> None:
    size = 3_000_000
    sender, calls, health = ResultSender(size, size), CallInterceptor(Metrics("1")), Health({})

    async def large(request: bytes, context: Any) -> bytes:
        answer = bytes(size)
        sender.reserve(context, (answer,))
        return answer

    ports: list[int] = []

    def listen(server: grpc.aio.Server) -> None:
        ports.append(server.add_insecure_port("127.0.0.1:0"))

    async with small_server(layers=[calls], unary=large, listen=listen) as (_, server):
        # More than is taken over the line before the client reads: the handler is long done by then.
        options = [("grpc.http2.lookahead_bytes", 65535), ("grpc.http2.bdp_probe", 0)]
        async with grpc.aio.insecure_channel(f"127.0.0.1:{ports[0]}", options) as slow:
            method: Any = slow.unary_stream(f"/{SERVICE}/Unary")
            reader = method(b"")
            await until(lambda: sender.unread_bytes > 0 and not calls.under_way())
            ending = asyncio.create_task(
                drain(server, health, calls, PATIENCE_S, unread_bytes=lambda: sender.unread_bytes)
            )
            # Longer than small answers are given.
            await loop.passed(5.0)
            assert not ending.done()
            assert [len(message) async for message in reader] == [size]
            await passes(loop, ending)


def test_calls_whose_time_is_up_are_refused_with_a_reason() -> None:
    async def run(loop: HeldLoop) -> None:
        is_over = asyncio.Event()

        async def working(request: bytes, context: Any) -> bytes:
            await is_over.wait()
            raise RefusedError(Reason.SHUTTING_DOWN, "the server is shutting down")

        calls = CallInterceptor(Metrics("1"))
        async with small_server(layers=[calls], unary=working) as (channel, server):
            under_way = asyncio.create_task(call(channel))
            await until(lambda: calls.under_way() > 0)
            ending = asyncio.create_task(drain(server, Health({}), calls, 30.0, end_work=is_over.set))
            await loop.passed(29.0)
            assert not is_over.is_set()
            await passes(loop, ending)
            refused = await under_way
            assert (refused.code, refused.reason) == (grpc.StatusCode.UNAVAILABLE, "SHUTTING_DOWN")

    on_held_time(run)


def test_connections_that_grpc_does_not_let_go_of_keep_nobody_from_ending(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(draining, "STOP_S", 0.0)

    class Stuck:
        """A server whose last connection never ends."""

        async def stop(self, grace: float | None) -> None:
            await asyncio.Event().wait()

    with logged() as log:
        limited(drain(Stuck(), Health({}), CallInterceptor(Metrics("1")), 0.0))
    assert len(log.lines("gRPC has not closed its connections in time; they end with the process")) == 1


def test_what_does_not_end_is_cancelled_and_what_is_idle_is_not_waited_for() -> None:
    async def run(loop: HeldLoop, seconds: float, idle: frozenset[str]) -> None:
        cancelled = asyncio.Event()

        async def stuck(request: bytes, context: Any) -> bytes:
            try:
                await asyncio.Event().wait()
            finally:
                cancelled.set()
            return b""

        calls, health = CallInterceptor(Metrics("1")), Health({})
        async with small_server(layers=[calls], unary=stuck) as (channel, server):
            under_way = asyncio.create_task(call(channel))
            await until(lambda: calls.under_way() > 0)
            ending = asyncio.create_task(drain(server, health, calls, seconds, idle))
            await passes(loop, ending)
            await cancelled.wait()
            assert (await under_way).code is not grpc.StatusCode.OK

    on_held_time(lambda loop: run(loop, 30.0, frozenset()))
    on_held_time(lambda loop: run(loop, 1e9, frozenset({f"/{SERVICE}/Unary"})))
