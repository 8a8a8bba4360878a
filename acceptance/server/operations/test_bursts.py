"""Bursts of calls that are refused, on a server whose watch over connections takes none of them for a flood."""

import asyncio
from collections.abc import Awaitable
from typing import Any

import grpc
import grpc.aio
import pytest

from robosc_api.connection_watch import can_watch
from support.service import logged_server_process
from support.waiting import PATIENCE_S

pytestmark = pytest.mark.skipif(not can_watch(), reason="the kernel of this system does not count bytes")

CHECK = "/robosc_api.v1.SynthesisService/Check"
CALLS, CALL_BYTES = 800, 200_000
LARGE_CALLS, LARGE_BYTES = 40, 6 * 2**20


async def code_of(call: Awaitable[Any]) -> grpc.StatusCode:
    try:
        await call
    except grpc.aio.AioRpcError as error:
        return error.code()
    return grpc.StatusCode.OK


def test_calls_beyond_the_limits_are_refused_each_and_cost_nobody_the_connection() -> None:
    async def called(address: str) -> set[grpc.StatusCode]:
        async with grpc.aio.insecure_channel(address) as channel:
            check: Any = channel.unary_unary(CHECK)
            at_once = [code_of(check(bytes(CALL_BYTES), timeout=PATIENCE_S)) for _ in range(CALLS)]
            codes = set(await asyncio.gather(*at_once))
            for _ in range(LARGE_CALLS):
                codes.add(await code_of(check(bytes(LARGE_BYTES), timeout=PATIENCE_S)))
            return codes

    with logged_server_process("--open-calls-per-caller", "1") as (_, address, log):
        assert asyncio.run(called(address)) == {grpc.StatusCode.RESOURCE_EXHAUSTED}
    assert not [line for line in log if "closed connections" in line]
