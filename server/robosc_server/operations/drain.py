"""Shutdown of the server that takes nothing from a caller that the server could still give."""

import asyncio
from collections.abc import Callable
from typing import Any

import structlog

from robosc_server.clock import monotonic
from robosc_server.operations.health import Health
from robosc_server.operations.interceptor import CallInterceptor

_POLL_S = 0.05

_FLUSH_S = 0.2
"""Time that small answers have to get on the wire after they were handed to gRPC, in seconds."""


STOP_S = 5.0
"""Time that gRPC may take to let go of its connections once all calls are cancelled, in seconds."""


async def stop(server: Any, grace_s: float | None = None) -> None:
    """End a server's calls and connections; those that gRPC does not let go of by then end with the process.

    Args:
        server: A `grpc.aio.Server`.
        grace_s: Time that calls under way are given, in seconds; None: none at all.
    """
    stopping = asyncio.ensure_future(server.stop(grace_s))
    await asyncio.wait([stopping], timeout=(grace_s or 0.0) + STOP_S)
    if stopping.done():
        stopping.result()
    else:
        structlog.get_logger().warning("gRPC has not closed its connections in time; they end with the process")


async def drain(
    server: Any,
    health: Health,
    calls: CallInterceptor,
    seconds: float,
    idle_methods: frozenset[str] = frozenset(),
    unread_bytes: Callable[[], int] = lambda: 0,
) -> None:
    """End a server: health says no, then calls are refused, those under way get time, and the rest is cancelled.

    Until then its port stays open, so that callers hear that it ends, and load balancers that it is not well.

    Args:
        server: A `grpc.aio.Server`.
        health: Its health.
        calls: Interceptor in front of its services.
        seconds: Time that calls under way are given, in seconds.
        idle_methods: Methods that are not waited for, since their callers can ask another server at any time.
        unread_bytes: Function that returns the bytes of large answers that were sent and are not read yet; they are
            waited for like calls.
    """
    log = structlog.get_logger()
    begun_s = monotonic()
    health.drain()
    calls.refuse_new()
    log.info("draining", calls=calls.under_way(idle_methods))
    while (calls.under_way(idle_methods) or unread_bytes()) and monotonic() - begun_s < seconds:
        await asyncio.sleep(_POLL_S)
    left = calls.under_way(idle_methods)
    await stop(server, _FLUSH_S)
    log.info("drained", seconds=round(monotonic() - begun_s, 3), cancelled=left)
