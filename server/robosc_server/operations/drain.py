"""Graceful shutdown: open calls finish before the server stops."""

import asyncio
from collections.abc import Callable
from typing import Any

import structlog

from robosc_server.clock import monotonic
from robosc_server.operations.health import Health
from robosc_server.operations.interceptor import CallInterceptor

_POLL_S = 0.05

_FLUSH_S = 0.2
"""Time for gRPC to send small responses before the server stops, in seconds."""

_REFUSED_S = 2.0
"""Time for the work of the remaining calls to end, so that they are refused with a reason, in seconds."""


STOP_S = 5.0
"""Time for gRPC to close its connections after all calls are cancelled, in seconds."""


async def stop(server: Any, grace_s: float | None = None) -> None:
    """End the calls and connections of a server; connections that gRPC does not close in time end with the process.

    Args:
        server: A `grpc.aio.Server`.
        grace_s: Time for open calls to finish, in seconds; None: cancel them at once.
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
    end_work: Callable[[], None] = lambda: None,
) -> None:
    """Shut down a server: report NOT_SERVING, refuse new calls, wait for open calls, and end the rest.

    The port stays open until then, so that callers and load balancers learn of the shutdown.

    Args:
        server: A `grpc.aio.Server`.
        health: Its health.
        calls: Interceptor in front of its services.
        seconds: Time for calls under way to end, in seconds.
        idle_methods: Methods whose calls are not waited for, since their callers can use another server at any time.
        unread_bytes: Function that returns the bytes of large answers that were sent and are not read yet; the shutdown
            waits for them as for calls.
        end_work: Function that ends the work of calls whose time is up, so that they are refused with a reason; calls
            that go on are cancelled.
    """
    log = structlog.get_logger()
    begun_s = monotonic()
    health.drain()
    calls.refuse_new()
    log.info("draining", calls=calls.under_way(idle_methods))
    while (calls.under_way(idle_methods) or unread_bytes()) and monotonic() - begun_s < seconds:
        await asyncio.sleep(_POLL_S)
    left = calls.under_way(idle_methods)
    if left:
        end_work()
        cut_off_s = monotonic()
        while calls.under_way(idle_methods) and monotonic() - cut_off_s < _REFUSED_S:
            await asyncio.sleep(_POLL_S)
    await stop(server, _FLUSH_S)
    log.info("drained", seconds=round(monotonic() - begun_s, 3), cancelled=left)
