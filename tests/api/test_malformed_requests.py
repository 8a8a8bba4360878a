"""Bytes that are no message, for methods of each kind, and what a guard and others stand behind."""

from collections.abc import AsyncIterator
from typing import Any

import grpc
from grpc_health.v1 import health_pb2

from robosc_api.layers import LayeredServices
from robosc_api.malformed import MalformedRequests
from support.small_server import SERVICE, call, small_server
from support.waiting import PATIENCE_S

Message = health_pb2.HealthCheckRequest
WRONG = b"\xff\xff"


async def echo(request: Any, context: Any) -> bytes:
    return bytes(request.service.encode())


async def generator(request: Any, context: Any) -> AsyncIterator[bytes]:
    yield request.service.encode()


async def writer(request: Any, context: Any) -> None:
    await context.write(request.service.encode())


async def raw(request: bytes, context: Any) -> bytes:
    return request


def with_messages(services: LayeredServices) -> None:
    handlers: dict[str, Any] = {
        "Unary": grpc.unary_unary_rpc_method_handler(echo, Message.FromString),
        "Generator": grpc.unary_stream_rpc_method_handler(generator, Message.FromString),
        "Writer": grpc.unary_stream_rpc_method_handler(writer, Message.FromString),
    }
    services.add_generic_rpc_handlers((grpc.method_handlers_generic_handler("test.Messages", handlers),))


async def test_they_are_refused_with_a_reason_and_messages_are_not() -> None:
    checked = MalformedRequests("test.Messages", SERVICE)
    async with small_server(layers=[checked], unary=raw, setup=with_messages) as (channel, _):
        # Methods that take bytes look at them themselves.
        assert (await call(channel, WRONG)).answer == WRONG
        right = Message(service="name").SerializeToString()
        made: Any = channel.unary_unary("/test.Messages/Unary")
        assert await made(right, timeout=PATIENCE_S) == b"name"
        refusals = [made(WRONG, timeout=PATIENCE_S)]
        for name in ("Generator", "Writer"):
            stream: Any = channel.unary_stream(f"/test.Messages/{name}")
            assert [answer async for answer in stream(right, timeout=PATIENCE_S)] == [b"name"]
            refusals.append(stream(WRONG, timeout=PATIENCE_S))
        for refused in refusals:
            assert await refused.code() is grpc.StatusCode.INVALID_ARGUMENT
            assert await refused.details() == "the request is not a valid message of this service"
            assert b"MALFORMED_REQUEST" in dict(await refused.trailing_metadata())["grpc-status-details-bin"]
