"""Calls under way: their peers, which gRPC is asked for once, their number, and what happens at their end."""

import asyncio
from typing import Any

import grpc
import grpc.aio
import pytest

from robosc_api.calls import begin_call, peer_of
from robosc_api.failures import reason_of
from robosc_api.layers import Layer, LayeredServices, behaviour_of, with_behaviour
from support.waiting import PATIENCE_S


class Context:
    """Context of a call, which counts how often its peer is asked for."""

    def __init__(self, peer: str) -> None:
        self._peer = peer
        self.asked = 0

    def peer(self) -> str:
        self.asked += 1
        return self._peer


class Details:
    method = "/s/M"


class Asking(Layer):
    """Layer that asks for the peer of a call."""

    def wrap(self, inner: Any, method: str) -> Any:
        behaviour = behaviour_of(inner)

        def asking(request: Any, context: Any) -> Any:
            assert peer_of(context) == peer_of(context)
            return behaviour(request, context)

        return with_behaviour(inner, asking)


async def _answer(request: Any, context: Any) -> str:
    return peer_of(context)


HANDLER: Any = grpc.unary_unary_rpc_method_handler(_answer)


async def test_each_call_has_its_own_peer_and_is_asked_once() -> None:
    services = LayeredServices(Asking(), Asking())
    services.add_generic_rpc_handlers((grpc.method_handlers_generic_handler("s", {"M": HANDLER}),))

    async def call(context: Context) -> Any:
        handler = services.service(Details)
        await asyncio.sleep(0)
        return await handler.unary_unary(None, context)

    contexts = [Context(f"ipv4:192.0.2.{number}:1") for number in range(5)]
    # The first calls have a task each, as gRPC's do; the others come one after the other in the same task.
    found = await asyncio.gather(*map(call, contexts))
    found += [await call(context) for context in contexts]
    assert found == 2 * [f"ipv4:192.0.2.{number}:1" for number in range(5)]
    assert [context.asked for context in contexts] == [2] * 5


async def test_calls_beyond_the_most_are_refused_until_one_has_ended() -> None:
    begun, release = asyncio.Semaphore(0), asyncio.Event()

    async def waiting(request: bytes, context: Any) -> bytes:
        begun.release()
        await release.wait()
        return request

    services = LayeredServices(most_calls=2)
    services.add_generic_rpc_handlers(
        (grpc.method_handlers_generic_handler("s", {"M": grpc.unary_unary_rpc_method_handler(waiting)}),)
    )
    server = grpc.aio.server(None, (services,))
    port = server.add_insecure_port("127.0.0.1:0")
    await server.start()
    try:
        async with grpc.aio.insecure_channel(f"127.0.0.1:{port}") as channel:
            method: Any = channel.unary_unary("/s/M")
            open_calls = [asyncio.ensure_future(method(b"one", timeout=PATIENCE_S)) for _ in range(2)]
            for _ in open_calls:
                await begun.acquire()
            with pytest.raises(grpc.aio.AioRpcError) as refused:
                await method(b"more", timeout=PATIENCE_S)
            assert refused.value.code() is grpc.StatusCode.RESOURCE_EXHAUSTED
            assert reason_of(refused.value.trailing_metadata()) == "SERVER_BUSY"
            release.set()
            assert await asyncio.gather(*open_calls) == [b"one", b"one"]
            for _ in range(3):
                assert await method(b"later", timeout=PATIENCE_S) == b"later"
    finally:
        await server.stop(None)


async def test_what_fails_at_the_end_of_a_call_keeps_nothing_taken(caplog: pytest.LogCaptureFixture) -> None:
    given_back: list[str] = []

    def fail() -> None:
        raise ValueError("on purpose")

    async def call() -> None:
        at_end = begin_call().at_end
        at_end += [lambda: given_back.append("before"), fail, lambda: given_back.append("after")]

    await asyncio.create_task(call())
    await asyncio.sleep(0)
    assert given_back == ["before", "after"]
    (record,) = caplog.records
    assert record.exc_info is not None
    assert isinstance(record.exc_info[1], ValueError)


async def test_nothing_is_kept_where_no_call_has_begun() -> None:
    assert [peer_of(Context(peer)) for peer in ("a", "b")] == ["a", "b"]
