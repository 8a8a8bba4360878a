"""gRPC health service: the health of a service follows from the conditions that it needs.

The servicer of grpcio-health-checking (1.85) is not used: it writes to watchers while it holds the lock of a status, so
that a watcher that reads nothing, and needs no token, would keep every change from all others, even a shutdown.
"""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from typing import Any

import grpc
import structlog
from grpc_health.v1 import health_pb2, health_pb2_grpc

from robosc_api.failures import failure_metadata

type Probe = Callable[[], Awaitable[bool]]

_PROBE_LIMIT_S = 5.0

_Response = health_pb2.HealthCheckResponse


class Health(health_pb2_grpc.HealthServicer):  # type: ignore[misc]  # untyped
    """Health service, for use on one event loop.

    Args:
        services: Conditions that each service needs, by full name of the service; no condition holds before it is set.
            The name `""` stands for the whole server, which is well if every service is.
    """

    def __init__(self, services: Mapping[str, tuple[str, ...]]) -> None:
        self._services = dict(services)
        self._conditions = dict.fromkeys((name for needed in services.values() for name in needed), False)
        self._is_draining = False
        self._changed = asyncio.Event()

    def conditions(self) -> dict[str, bool]:
        """Return the conditions that services need and whether they hold; and whether the server takes calls."""
        return {**self._conditions, "accepting": not self._is_draining}

    def is_serving(self, service: str) -> bool | None:
        """Return True if a service is well; None: there is no such service."""
        if service == "":
            return not self._is_draining and all(self._conditions.values())
        needed = self._services.get(service)
        if needed is None:
            return None
        return not self._is_draining and all(self._conditions[name] for name in needed)

    def set_condition(self, name: str, holds: bool) -> None:
        """Set whether a condition holds; changes are logged.

        Args:
            name: Condition that a service needs.
            holds: True if the condition holds.

        Raises:
            KeyError: No service needs the condition.
        """
        if self._conditions[name] != holds:
            log = structlog.get_logger()
            if holds:
                log.info("condition met", condition=name)
            else:
                log.warning("condition not met", condition=name)
            self._conditions[name] = holds
            self._notify()

    def drain(self) -> None:
        """Report NOT_SERVING for all services from now on, so that load balancers choose another server."""
        self._is_draining = True
        self._notify()

    @asynccontextmanager
    async def probing(self, probes: Mapping[str, Probe], every_s: float = 2.0) -> AsyncIterator[None]:
        """Probe conditions periodically; each is probed once before the context begins.

        Args:
            probes: Probe of each condition; an exception or a timeout counts as not met.
            every_s: Seconds between the end of a probe and the next one.
        """
        await asyncio.gather(*(self._probe(name, probe) for name, probe in probes.items()))
        async with asyncio.TaskGroup() as group:
            tasks = [
                group.create_task(self._probe_periodically(name, probe, every_s)) for name, probe in probes.items()
            ]
            try:
                yield
            finally:
                for task in tasks:
                    task.cancel()

    async def _probe_periodically(self, name: str, probe: Probe, every_s: float) -> None:
        while True:
            await asyncio.sleep(every_s)
            await self._probe(name, probe)

    async def _probe(self, name: str, probe: Probe) -> None:
        try:
            async with asyncio.timeout(_PROBE_LIMIT_S):
                holds = await probe()
        except Exception as error:
            structlog.get_logger().debug("condition check failed", condition=name, exc_info=error)
            holds = False
        self.set_condition(name, holds)

    def _notify(self) -> None:
        self._changed.set()
        self._changed = asyncio.Event()

    async def Check(self, request: Any, context: Any) -> Any:  # noqa: N802  # named by the .proto file
        """Return the health of a service."""
        is_serving = self.is_serving(request.service)
        if is_serving is None:
            code, message = grpc.StatusCode.NOT_FOUND, "this server has no such service"
            await context.abort(code, message, failure_metadata(code, message, "NO_SUCH_SERVICE"))
        return _Response(status=_status(is_serving))

    async def Watch(self, request: Any, context: Any) -> None:  # noqa: N802
        """Send the health of a service, and each change of it."""
        last = None
        while True:
            changed = self._changed
            now = _status(self.is_serving(request.service))
            if now != last:
                last = now
                await context.write(_Response(status=now))
            await changed.wait()


def _status(is_serving: bool | None) -> Any:
    if is_serving is None:
        return _Response.SERVICE_UNKNOWN
    return _Response.SERVING if is_serving else _Response.NOT_SERVING
