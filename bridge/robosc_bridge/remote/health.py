"""The standard health check of gRPC: true while the loop runs without a fault.

The servicer of `grpc_health` is not used: it returns the last value that was set, and keeps a stream and a name for
each caller that asks to be notified of changes, without a token and without a limit.
"""

import time
from typing import Any

import grpc
import grpc.aio
from grpc_health.v1 import health_pb2, health_pb2_grpc

from robosc_bridge.daemon.feed import Feed
from robosc_bridge.daemon.states import State
from robosc_bridge.remote import convert

STALE_S = 2.0
"""A snapshot that is older comes from a loop that hangs."""

Context = grpc.aio.ServicerContext[Any, Any]


class Health(health_pb2_grpc.HealthServicer):  # type: ignore[misc]  # generated, without types
    """Health service whose answers follow from the latest snapshot of the loop.

    Args:
        feed: Feed that the daemon shows.
    """

    def __init__(self, feed: Feed) -> None:
        self._feed = feed

    @property
    def is_serving(self) -> bool:
        """True if the loop runs, and no fault has stopped the robot."""
        snapshot = self._feed.snapshot
        if snapshot is None or time.time() - snapshot.time_s > STALE_S:
            return False
        return snapshot.state not in (State.FAULT, State.OVER) and not snapshot.problem

    async def Check(  # noqa: N802  # named by the .proto file
        self, request: health_pb2.HealthCheckRequest, context: Context
    ) -> health_pb2.HealthCheckResponse:
        """Answer whether the bridge is well."""
        if request.service not in ("", convert.SERVICE_NAME):
            await context.abort(grpc.StatusCode.NOT_FOUND, "there is no such service")
        answer = health_pb2.HealthCheckResponse
        return answer(status=answer.SERVING if self.is_serving else answer.NOT_SERVING)

    async def Watch(  # noqa: N802
        self, request: health_pb2.HealthCheckRequest, context: Context
    ) -> None:
        """Refuse to stream the health: the call needs no token, and would hold a stream forever."""
        await context.abort(grpc.StatusCode.UNIMPLEMENTED, "ask again and again, or use Watch of the bridge's service")
