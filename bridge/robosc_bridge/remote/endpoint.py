"""The server of the remote endpoint, in a thread of its own."""

import asyncio
import contextlib
import logging
import os
from dataclasses import dataclass, field
from pathlib import Path

# The log of gRPC would repeat in other words what the bridge reports; gRPC reads this variable when it is imported.
os.environ.setdefault("GRPC_VERBOSITY", "NONE")

import grpc.aio
from grpc_health.v1 import health, health_pb2_grpc
from grpc_reflection.v1alpha import reflection, reflection_pb2_grpc

from robosc_api.connection_ledger import ConnectionLimits
from robosc_api.connection_watch import Arrivals, CallsByConnection, ConnectionWatch
from robosc_api.layers import LayeredServices
from robosc_api.malformed import PLAIN_REQUESTS, MalformedRequests
from robosc_api.request_timeouts import REFLECTION_METHODS, RequestTimeouts
from robosc_api.security import Guard, SecurityError, ServerSecurity, TokenFile, add_port
from robosc_api.security.addresses import split_address
from robosc_bridge.configuration.structure import Configuration
from robosc_bridge.daemon.operations import Operations
from robosc_bridge.daemon.served_endpoint import ServedEndpoint
from robosc_bridge.errors import BridgeError
from robosc_bridge.remote import convert
from robosc_bridge.remote.connection_slots import ConnectionSlots
from robosc_bridge.remote.health import Health
from robosc_bridge.remote.service import RULES, BridgeService
from robosc_bridge.remote.shutdown import ShutdownLayer

_log = logging.getLogger(__name__)

MAXIMUM_REQUEST_BYTES = 256 * 1024
MAXIMUM_METADATA_BYTES = 8 * 1024
MAXIMUM_CONNECTIONS = 256
"""At the same time. More than watchers, programs and commands; but whoever reaches the port may take them all."""

IDLE_S = 3.0
"""A connection on which nothing is called for so long is ended, so that a place is free again."""

MAXIMUM_CALLS = 200
"""On one connection; more than watchers, programs and commands, so that one is left for a stop."""

REQUEST_LIMIT_S = 5.0
"""Time for the request of a call that has one."""

REFLECTION_IDLE_S = 30.0
"""Time between two requests of a stream about what is served here."""

PING_S, PING_LIMIT_S = 5.0, 3.0
"""After so long without a word a caller is asked whether it is there, and taken for gone if it does not answer."""

UNASKED_BYTES = 16 * 2**20
"""Bytes that all connections together may have received since their last requests: a robot has little memory."""

_WATCH_SHARE = 0.002
"""Share of a core for the watch over connections: the control loop runs beside it."""

_HANDSHAKE_LIMIT_S = 3.0
_GRACE_S = 0.5
_LOOK_S = 1.0


class RemoteError(BridgeError):
    """The remote endpoint cannot listen at its address, or with its certificates."""


@dataclass(frozen=True, slots=True)
class RemoteSettings:
    """Settings of the endpoint.

    Attributes:
        address: `HOST:PORT`; port 0 picks a free one.
        security: Certificates and tokens.
        operator_timeout_s: Time without the operator after which the robot stops, in seconds; None: none is needed.
    """

    address: str
    security: ServerSecurity = field(default_factory=ServerSecurity)
    operator_timeout_s: float | None = None


def settings_of(configuration: Configuration) -> RemoteSettings | None:
    """Return the settings of a configuration; None: it has no remote endpoint."""
    remote = configuration.remote
    if remote.grpc_address is None:
        return None
    security = ServerSecurity(
        certificate=_path(remote.tls_certificate),
        key=_path(remote.tls_key),
        client_ca=_path(remote.client_ca),
        tokens=_path(remote.tokens),
        insecure_beyond_loopback=remote.insecure_beyond_loopback,
    )
    return RemoteSettings(remote.grpc_address, security, configuration.safety.operator_link_timeout_s)


def _path(text: str | None) -> Path | None:
    return None if text is None else Path(text)


class RemoteEndpoint(ServedEndpoint):
    """A server in a thread of its own; `serve` makes one that listens.

    Args:
        operations: The daemon.
        settings: Settings for listening.
    """

    def __init__(self, operations: Operations, settings: RemoteSettings) -> None:
        super().__init__("remote endpoint", "remote", RemoteError, (SecurityError, ValueError, OSError))
        self._operations = operations
        self._settings = settings

    def start(self) -> None:
        """Listen.

        Raises:
            RemoteError: The endpoint cannot listen.
        """
        super().start()
        _log.info("the remote endpoint listens on %s", self.address)

    async def _serve(self) -> None:
        settings = self._settings
        security = settings.security
        guard = Guard(
            RULES,
            None if security.tokens is None else TokenFile(security.tokens),
            has_client_certificates=security.client_ca is not None,
        )
        shutdown = ShutdownLayer()
        prompt = RequestTimeouts(REQUEST_LIMIT_S, dict.fromkeys(REFLECTION_METHODS, REFLECTION_IDLE_S))
        arrivals = Arrivals()
        # Outside of the request timeouts: a call without a request is open, too.
        services = LayeredServices(
            shutdown, guard, CallsByConnection(arrivals), prompt, arrivals, MalformedRequests(convert.SERVICE_NAME)
        )
        server = grpc.aio.server(None, (services,), options=_options())
        service = BridgeService(self._operations, settings.operator_timeout_s)
        convert.add_service(service, services)  # type: ignore[no-untyped-call]  # generated
        health_pb2_grpc.add_HealthServicer_to_server(Health(self._operations.feed), services)
        names = (convert.SERVICE_NAME, health.SERVICE_NAME, reflection.SERVICE_NAME)
        reflected = reflection.aio.ReflectionServicer(names)
        reflection_pb2_grpc.add_ServerReflectionServicer_to_server(reflected, services)
        self.address = add_port(server, settings.address, security)
        await server.start()
        self._is_listening()
        port = split_address(self.address)[1]
        slots = ConnectionSlots(port, MAXIMUM_CONNECTIONS)
        try:
            with _watch(port, arrivals):
                while not self._end.is_set():
                    slots.poll()
                    with contextlib.suppress(TimeoutError):
                        async with asyncio.timeout(_LOOK_S):
                            await self._end.wait()
        finally:
            service.close()
            shutdown.close()
            await server.stop(_GRACE_S)


def _watch(port: int, arrivals: Arrivals) -> ConnectionWatch:
    """Return the watch over the connections, which delays no other thread of the bridge."""
    limits = ConnectionLimits(
        connections=MAXIMUM_CONNECTIONS,
        request_bytes=MAXIMUM_REQUEST_BYTES,
        unasked_bytes=UNASKED_BYTES,
    )
    # The control loop must not wait while the allocator returns memory.
    return ConnectionWatch(port, limits, arrivals, share=_WATCH_SHARE, returns_memory=False)


def _options() -> list[tuple[str, int]]:
    return [
        # Two bridges could otherwise share a port, and each would get some of the stops.
        ("grpc.so_reuseport", 0),
        ("grpc.max_receive_message_length", MAXIMUM_REQUEST_BYTES),
        PLAIN_REQUESTS,
        ("grpc.max_metadata_size", MAXIMUM_METADATA_BYTES),
        ("grpc.absolute_max_metadata_size", MAXIMUM_METADATA_BYTES),
        ("grpc.max_allowed_incoming_connections", MAXIMUM_CONNECTIONS),
        ("grpc.max_connection_idle_ms", int(IDLE_S * 1000)),
        ("grpc.max_concurrent_streams", MAXIMUM_CALLS),
        ("grpc.server_handshake_timeout_ms", int(_HANDSHAKE_LIMIT_S * 1000)),
        # A caller whose cable is pulled says no goodbye.
        ("grpc.keepalive_time_ms", int(PING_S * 1000)),
        ("grpc.keepalive_timeout_ms", int(PING_LIMIT_S * 1000)),
        # The default is a minute. The machine of a caller that hangs takes all bytes: only this finds its silence.
        ("grpc.http2.ping_timeout_ms", int(PING_LIMIT_S * 1000)),
        ("grpc.keepalive_permit_without_calls", 1),
        ("grpc.http2.max_pings_without_data", 0),
        # Callers may ask as often.
        ("grpc.http2.min_ping_interval_without_data_ms", 1000),
        # A probed window grows to megabytes, all of which could arrive of a message that is refused for its size.
        ("grpc.http2.bdp_probe", 0),
    ]


def serve(operations: Operations, settings: RemoteSettings) -> RemoteEndpoint:
    """Return an endpoint that listens.

    Args:
        operations: The daemon.
        settings: Settings for listening.

    Raises:
        RemoteError: The endpoint cannot listen.
    """
    endpoint = RemoteEndpoint(operations, settings)
    endpoint.start()
    return endpoint
