"""How the server ends without taking anything out of a caller's hands that it could still give."""

import asyncio
import time
from typing import Any

import structlog

from robosc_server.operations.health import Health
from robosc_server.operations.interceptor import CallInterceptor

_LOOK_S = 0.05


async def drain(
    server: Any,
    health: Health,
    calls: CallInterceptor,
    seconds: float,
    idle_methods: frozenset[str] = frozenset(),
) -> None:
    """End a server: health says no, then calls are refused, those under way are given time, and the rest is cancelled.

    Until then its port stays open, so that callers hear that it ends, and load balancers that it is not well.

    Args:
        server: A `grpc.aio.Server`.
        health: Its health.
        calls: Stands before its services.
        seconds: How long calls under way are given.
        idle_methods: Methods that are not waited for, since their callers can ask another server at any time.
    """
    log = structlog.get_logger()
    begun_s = time.monotonic()
    health.drain()
    calls.refuse_new()
    log.info("draining", calls=calls.under_way(idle_methods))
    while calls.under_way(idle_methods) and time.monotonic() - begun_s < seconds:
        await asyncio.sleep(_LOOK_S)
    left = calls.under_way(idle_methods)
    await server.stop(0)
    log.info("drained", seconds=round(time.monotonic() - begun_s, 3), cancelled=left)
