"""Work that is done around every call, over a real server."""

import asyncio
from typing import Any

import grpc
import pytest

from robosc_api.layers import LayeredServices
from robosc_server.operations.interceptor import CallInterceptor
from robosc_server.operations.metrics import Metrics
from robosc_server.operations.settings import LogLevel
from support.small_server import SERVICE, answer, logged


@pytest.mark.real_time
def test_the_interceptor_costs_little(record_property: Any) -> None:
    """Counted in a processor's time, without a network; far more than what is measured on a quiet machine."""
    import time

    class Context:
        def code(self) -> None:
            return None

        def time_remaining(self) -> None:
            return None

        def peer(self) -> str:
            return "ipv4:127.0.0.1:4711"

    class Details:
        method = f"/{SERVICE}/Unary"
        invocation_metadata = (("user-agent", "test"),)

    handler: Any = grpc.unary_unary_rpc_method_handler(answer)

    async def run() -> float:
        services, context = LayeredServices(CallInterceptor(Metrics("1"))), Context()
        services.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(SERVICE, {"Unary": handler}),))
        begun_s = time.process_time()
        for _ in range(2000):
            await services.service(Details).unary_unary(b"", context)
        return (time.process_time() - begun_s) / 2000

    with logged(LogLevel.INFO):
        best_s = min(asyncio.run(run()) for _ in range(3))
    record_property("microseconds that the interceptor takes of a call", round(best_s * 1e6, 1))
    assert best_s < 300e-6
