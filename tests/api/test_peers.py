"""The peer of the current call, which is asked of gRPC once for each call."""

import asyncio
from typing import Any

import grpc

from robosc_api.layers import Layer, Layers, behaviour_of, with_behaviour
from robosc_api.peers import peer_of


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


async def _handler(details: Any) -> Any:
    return HANDLER


async def test_each_call_has_its_own_peer_and_is_asked_once() -> None:
    layers = Layers(Asking(), Asking())

    async def call(context: Context) -> Any:
        handler = await layers.intercept_service(_handler, Details)
        await asyncio.sleep(0)
        return await handler.unary_unary(None, context)

    contexts = [Context(f"ipv4:192.0.2.{number}:1") for number in range(5)]
    # The first calls have a task each, as gRPC's do; the others come one after the other in the same task.
    found = await asyncio.gather(*map(call, contexts))
    found += [await call(context) for context in contexts]
    assert found == 2 * [f"ipv4:192.0.2.{number}:1" for number in range(5)]
    assert [context.asked for context in contexts] == [2] * 5


async def test_nothing_is_kept_where_no_call_has_begun() -> None:
    assert [peer_of(Context(peer)) for peer in ("a", "b")] == ["a", "b"]
